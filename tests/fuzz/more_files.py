"""Valid meshes, logs, results and units that a command reads, and who reads them."""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
from scipy.io import savemat

from carrierflex.blind_check.sealing import answers
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.report.diagnosis_files import write_diagnosis
from carrierflex.fe.curve_files import PIN_FIT, read_derivatives, write_curves
from carrierflex.geometry.cad_mesh import step_faces
from carrierflex.geometry.cad_surface_files import CadFrame
from carrierflex.geometry.given_meshes.solid_files import read_solid_mesh
from carrierflex.identification.logs.log_files import read_log
from carrierflex.workflows import describe_file
from carrierflex.workflows.diagnosis.gap_change import read_side
from carrierflex.workflows.diagnosis.report_files import read_report_data, write_report_data
from carrierflex.workflows.simulation.identified_life import identified_sharing, identified_tilt
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.report.verdict_pages import data_of
from tests.fe.solids.test_solids import blocks
from tests.geometry.test_cad_recognition import boxes
from tests.identification.logs.test_other_tools import FORCE, TIME, TRAVEL, openfast_bytes
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve
from tests.workflows.simulation.test_identified_life import document

Reader = Callable[[Path], Any]
_SIGNALS = [("values", "O"), ("label", "O")]
_MESHES = {"tetra10": ".bdf", "wedge": ".unv", "hexahedron20": ".msh", "tetra": ".med"}


def _read_solids(path: Path) -> None:
    read_solid_mesh(path, lambda _: np.arange(1, 10_000))


def _read_step(path: Path) -> None:
    step_faces(path, CadFrame.of_the_file())


def _read_answers(path: Path) -> None:
    answers.read_answers(path, ["element-0001"])


def _read_whole_diagnosis(path: Path) -> None:
    read_side(path.parent)


#: Every file by its name, and who reads it.
MORE_READERS: dict[str, Reader] = {
    **{f"blocks{suffix}": _read_solids for suffix in _MESHES.values()},
    "boxes.step": _read_step,
    "simulink.mat": read_log,
    "table.parquet": read_log,
    "packed.outb": read_log,
    "answers.json": _read_answers,
    "derivatives.csv": read_derivatives,
    "loads.json": identified_sharing,
    "tilt.json": identified_tilt,
    "whole/diagnosis.json": _read_whole_diagnosis,
    "whole/report.json": read_report_data,
    "unit.fmu": describe_file.main,
    "mesh.vtu": describe_file.main,
    "page.html": describe_file.main,
    "pin_fit.json": describe_file.main,
}


def more_contents(folder: Path) -> dict[str, dict[str, bytes]]:
    """Content of every file, and of those beside it, by the name of the file that is damaged."""
    for kind, suffix in _MESHES.items():
        blocks(kind, folder / f"blocks{suffix}")
    boxes(folder / "boxes.step", (0, 0, 0))
    _write_logs(folder)
    _write_results(folder)
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    contents = {name: {name: files[name]} for name in MORE_READERS if "/" not in name}
    reports = {name: files[name] for name in ("diagnosis.json", "report.json")}
    return contents | {f"whole/{name}": reports for name in reports}


def _write_logs(folder: Path) -> None:
    signals = np.zeros(2, dtype=_SIGNALS)
    signals[0], signals[1] = (FORCE[:, None], "F"), (TRAVEL[:, None], "s")
    savemat(folder / "simulink.mat", {"out": {"time": TIME[:, None], "signals": signals}})
    table = pa.table({"time": TIME, "force": FORCE, "note": ["a"] * TIME.size})
    pa_parquet.write_table(table, folder / "table.parquet")
    packed = openfast_bytes(4, ["Force"], ["(N)"], [TRAVEL], 0.01)
    (folder / "packed.outb").write_bytes(packed)


def _shortened(value_of_document: Any) -> Any:
    """JSON without the samples of its curves from the ninth on: most damage would hit those."""
    if isinstance(value_of_document, dict):
        return {name: _shortened(value) for name, value in value_of_document.items()}
    return (
        [_shortened(value) for value in value_of_document[:8]]
        if isinstance(value_of_document, list)
        else value_of_document
    )


def _write_results(folder: Path) -> None:
    campaign = displacement_campaign(lambda q, v: 5e8 * q**3, n=1500)
    diagnosis = diagnose(element_problem(campaign), campaign="twin", kind="element")
    write_diagnosis(folder / "diagnosis.json", diagnosis)
    write_report_data(folder / "report.json", data_of(diagnosis, campaign))
    digests = {"records": {"measured": "0" * 64, "simulated": None}}
    for name, more in (("diagnosis.json", digests), ("report.json", {})):
        stated = json.loads((folder / name).read_text())
        (folder / name).write_text(json.dumps(_shortened(stated) | more))
    curves = {
        name: (stiff_curve() if name.endswith("_s") else flexible_curve())
        for name in ("delta_s", "delta_f", "g_s", "g_f", PIN_FIT, "delta_f/plate_gap")
    }
    write_curves(folder / "derivatives.csv", curves)
    entry = {"verdict": "named", "effects": ["backlash"], "seconds": 1.0}
    answer = {"format": answers.FORMAT, "version": answers.VERSION, "tool": "a tool"}
    factor = {"value": 1.05, "low": 0.97, "high": 1.13}
    run = {"run": "LC1", "torque": {"value": 3.6e5}, "load_sharing_factor": factor}
    texts = {
        "answers.json": json.dumps(answer | {"cases": {"element-0001": entry}}),
        "loads.json": json.dumps({"format": "carrierflex-loads", "version": 1, "runs": [run]}),
        "tilt.json": json.dumps(document()),
        "page.html": "<!doctype html><html><title>Gap of a twin</title><p>carrierflex</p></html>",
        "pin_fit.json": json.dumps({"worst": 0.5, "inputs": {}, "versions": {"carrierflex": "1"}}),
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    description = '<fmiModelDescription fmiVersion="3.0" modelName="a" description="carrierflex">'
    variables = '<ModelVariables><Float64 name="x"/></ModelVariables></fmiModelDescription>'
    with zipfile.ZipFile(folder / "unit.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", description + variables)
        archive.writestr("binaries/x86_64-linux/a.so", b"")
    corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 4]])
    solids = [("tetra", np.array([[0, 1, 2, 3]]))]
    meshio.write(folder / "mesh.vtu", meshio.Mesh(corners, solids))
