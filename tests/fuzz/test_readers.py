"""Every reader, fed with damaged files: one line that names the file, or a result; nothing else.

``make fuzz`` tries 2 000 files, ``make acceptance`` 100 000 (FUZZ_INPUTS). The files of a run with
the same number and seed (FUZZ_SEED) are the same.
"""

import importlib.util
import io
import os
import resource
import signal
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, seed, settings
from nptdms import ChannelObject, TdmsWriter
from scipy.io import savemat

from carrierflex.blind_check.sealing.check import Seals, read_seals, write_seals
from carrierflex.blind_check.sealing.verdicts import read_verdict
from carrierflex.diagnosis.carrier.watch.rim_revolutions import RevolutionSplitter
from carrierflex.diagnosis.carrier.watch.state_files import read_state, write_state
from carrierflex.diagnosis.report.diagnosis_files import read_diagnosis
from carrierflex.fe.curve_files import read_curves, write_curves
from carrierflex.fe.matrices import node_files, op4_input_files
from carrierflex.files import child_process, hdf5_trial
from carrierflex.files.json_files import save_json
from carrierflex.files.shown_values import printable
from carrierflex.geometry import cad_mesh, mesh_files
from carrierflex.geometry.cad_surface_files import read_cad_statements, write_cad_statements
from carrierflex.geometry.given_meshes import foreign_files
from carrierflex.geometry.mesh_files import read_mesh, write_mesh
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.parameters import CarrierParameters, PinParameters
from carrierflex.identification.campaign.campaign_files import read_campaign, write_campaign
from carrierflex.identification.campaign.run_files import ExpectedColumns
from carrierflex.identification.logs import log_files
from carrierflex.identification.logs.log_files import read_log
from carrierflex.identification.logs.map_guesses import map_guess
from carrierflex.identification.logs.map_tables import read_map
from carrierflex.identification.logs.map_text import map_text
from carrierflex.reduction.body_files import (
    read_body,
    read_certificate,
    read_shapes,
    read_stresses,
    write_body,
)
from carrierflex.reduction.certificate import Certificate, Check
from carrierflex.reduction.imports import superelement_files
from carrierflex.reduction.shapes.body_shapes import BodyShapes
from carrierflex.reduction.shapes.body_stresses import BodyStresses
from carrierflex.simulation.carrier.case_files import read_case, shipped_case
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.mounting.case_files import read_mounting_case
from carrierflex.simulation.rexs.planetary_stage import chosen_stage, planetary_stage
from carrierflex.simulation.rexs.rexs_files import read_rexs, write_with_load_cases
from carrierflex.simulation.rexs.stage_values import stage_values
from carrierflex.simulation.stage.stage_cases import read_stage_case
from carrierflex.workflows.cached_results import CacheStore
from carrierflex.workflows.fe.default_curves import default_curves, with_mesh_error
from carrierflex.workflows.fleet.watch_turbine import _checked, _rows
from carrierflex.workflows.view3d.rim_motion_files import (
    RimMotion,
    RimSignal,
    read_rim_motion,
    write_rim_motion,
)
from carrierflex.workflows.view3d.rim_scene import rim_scene
from tests.diagnosis.carrier.watch.test_turbine_watch import (
    BASELINE,
    OPTIONS,
    SINCE,
    TILT,
    N,
    adding,
    watched,
)
from tests.diagnosis.carrier.watch.turbines import record
from tests.fe.solids.test_solids import blocks
from tests.forked_readers import read_in_forks
from tests.fuzz.body_files import BODY_READERS, body_contents
from tests.fuzz.body_files import read as read_foreign_body
from tests.fuzz.counts import COUNTS
from tests.fuzz.matrix_files import MATRIX_READERS, matrix_contents
from tests.fuzz.more_files import MORE_READERS, more_contents
from tests.fuzz.mutations import damaged, damaged_hdf5, damaged_values
from tests.identification.campaign.test_campaign_files import element_campaign, mounting_campaign
from tests.identification.logs.test_other_tools import (
    write_mdf,
    write_openfast,
    write_universal,
    write_workbook,
)
from tests.identification.synthetic_campaigns import carrier_campaign, run_case
from tests.simulation.rexs.public_sample import shipped_gearbox
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve
from tests.simulation.test_law_files import LAWS

pytestmark = pytest.mark.fuzz

#: What ends as one line (carrierflex.workflows.command_line).
REPORTED = (ValueError, OSError, KeyError, ArithmeticError, RuntimeError, MemoryError)
#: Seconds of processor time after which a reader counts as hanging.
PATIENCE = 20.0
#: Memory beyond what stood before [kB] that no small file may take, and that of a child.
MOST_MEMORY = 400_000
MOST_OF_A_CHILD = 2_000_000
#: As errors name the stream.
_STREAM = "standard input"
#: Laws whose files are damaged: one of every form of a part.
DAMAGED_LAWS = ("rubbing", "slipping", "surface", "bushings", "bushing stops", "tilt")


class HangError(BaseException):
    """A reader does not come to an end."""


@dataclass(frozen=True)
class Target:
    """A reader, the valid files it is given, and the one of them that is damaged."""

    files: dict[str, bytes]
    damaged: str
    read: Callable[[Path], Any]


def _tree(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def _campaigns(folder: Path) -> dict[str, Target]:
    campaigns = {
        "carrier": carrier_campaign([run_case("LC1", duration=2.0)]),
        "mounting": mounting_campaign(),
        "element": element_campaign(),
    }
    targets = {}
    for kind, campaign in campaigns.items():
        write_campaign(campaign, folder / kind, simulated=True)
        files = _tree(folder / kind)
        run = campaign.runs[0].file
        for what, name in (("document", "campaign.toml"), ("run", run)):
            targets[f"campaign {kind} {what}"] = Target(files, name, read_campaign)
    return targets


def _logs(folder: Path) -> dict[str, Target]:
    """A logger's files, and the map of their columns."""
    rows = [f"{k},0;{k * k % 7},5;{k % 3}" for k in range(40)]
    text = "Messung;Probe\n\nZeit;Kraft;Weg\ns;kN;mm\n" + "\n".join(rows)
    values = np.arange(50.0)
    (folder / "log.csv").write_bytes(text.encode("utf-16"))
    savemat(folder / "log.mat", {"t": values, "rig": {"F": values**2}}, do_compression=True)
    with h5py.File(folder / "log.h5", "w") as file:
        file["t"], file["x"] = values, values**2
    with TdmsWriter(folder / "log.tdms") as writer:
        writer.write_segment([ChannelObject("g", "x", values, {"wf_increment": 0.1})])
    others = [write(folder).name for write in (write_universal, write_workbook, write_openfast)]
    others += [write_mdf(folder).name] if importlib.util.find_spec("asammdf") else []
    guess = map_guess("element", [folder / "log.csv"], "force")
    (folder / "map.toml").write_text(map_text(guess, "# a map"), encoding="utf-8")
    targets = {
        f"log {name}": Target({name: (folder / name).read_bytes()}, name, _log_reader(name))
        for name in ("log.csv", "log.mat", "log.h5", "log.tdms", *others)
    }
    return targets | {
        "map": Target(
            {"map.toml": (folder / "map.toml").read_bytes()},
            "map.toml",
            lambda path: read_map(path / "map.toml"),
        )
    }


def _log_reader(name: str) -> Callable[[Path], Any]:
    return lambda path: read_log(path / name)


def _documents(folder: Path) -> dict[str, Target]:
    """Files that are read by themselves."""
    curves = {
        name: (stiff_curve() if name.endswith("_s") else flexible_curve())
        for name in ("delta_s", "delta_f", "g_s", "g_f")
    }
    write_curves(folder / "curves.csv", curves)
    write_cad_statements(folder / "surfaces.toml", CarrierParameters(), PinParameters())
    write_seals(folder / "seals.json", Seals({"seed": 1}, {"element-0001": "ab" * 32}))
    save_json(folder / "times.json", {"seconds": 1.0, "error": "ValueError: no"})
    diagnosis = {"format": "carrierflex-diagnosis", "version": 1, "verdict": "named"}
    save_json(folder / "diagnosis.json", diagnosis | {"effects": ["backlash"], "how_far": {}})
    signal = RimSignal("LC1", "s", "axial", 0.5, np.arange(9.0), np.ones(9), np.ones(9))
    write_rim_motion(
        folder / "rim_motion.json", RimMotion("twin", "m", 3, 0.4, ("carrier_tilt",), (signal,))
    )
    error = {"curve": "delta_f", "order": 3, "amplitude": 2e-7, "error": 1e-8}
    save_json(folder / "mesh_error.json", {"size": 0.03, "errors": [error]})
    for name in DAMAGED_LAWS:
        write_law(folder / f"law {name}.toml", LAWS[name])
    entry = {"format": "carrierflex-cache-entry", "version": 1, "key": "k"}
    save_json(folder / "entry.json", entry | {"files": {"a.csv": "0" * 64}, "inputs": {}})
    parameters = b"[carrier]\nplate_gap = 0.25\nouter_radius = 0.5\n[gear]\nring_teeth = 99\n"
    (folder / "parameters.toml").write_bytes(parameters)
    readers: dict[str, Callable[[Path], Any]] = {
        "curves.csv": lambda path: read_curves(path / "curves.csv"),
        "parameters.toml": lambda path: read_parameters(path / "parameters.toml"),
        "surfaces.toml": lambda path: read_cad_statements(path / "surfaces.toml"),
        **{f"law {name}.toml": _reading(read_law, f"law {name}.toml") for name in DAMAGED_LAWS},
        "seals.json": lambda path: read_seals(path / "seals.json"),
        "times.json": read_verdict,
        "diagnosis.json": lambda path: read_diagnosis(path / "diagnosis.json"),
        "rim_motion.json": lambda path: rim_scene(read_rim_motion(path / "rim_motion.json")),
        "mesh_error.json": lambda path: with_mesh_error(default_curves(), path / "mesh_error.json"),
        "entry.json": lambda path: CacheStore(path.parent).lookup(path.name, ["a.csv"]),
    }
    companions = {"times.json": ["diagnosis.json"]}
    return {
        name: Target(
            {each: (folder / each).read_bytes() for each in (name, *companions.get(name, []))},
            name,
            read,
        )
        for name, read in readers.items()
    }


def _cases() -> dict[str, Target]:
    readers = {
        "carrier_lc1_to_lc4": lambda path: read_case(path / "a.toml", flexible_curve()),
        "mounting_2011": lambda path: read_mounting_case(path / "a.toml"),
        "stage_lc1": lambda path: read_stage_case(path / "a.toml"),
    }
    return {
        f"case {name}": Target({"a.toml": shipped_case(name).read_bytes()}, "a.toml", read)
        for name, read in readers.items()
    }


def _gearboxes(folder: Path) -> dict[str, Target]:
    model, files = shipped_gearbox(), ("gearbox.rexs", "gearbox.rexsj", "gearbox.rexsz")
    for write, file in zip(("write_xml", "write_json", "write_archive"), files, strict=True):
        getattr(model, write)(folder / file)
    return {
        file: Target({file: (folder / file).read_bytes()}, file, _reading(_read_gearbox, file))
        for file in files
    }


def _read_gearbox(path: Path) -> None:
    model = read_rexs(path)
    stage = planetary_stage(model, chosen_stage(model, None))
    stage_values(stage, lambda table, key: "m")
    results = [("LC1", {stage.sun.id: {"rotational_speed": 1.0}})]
    write_with_load_cases(path.with_name("copy_of_" + path.name), path, results)


def _watches(folder: Path) -> dict[str, Target]:
    """What a watch goes on from: its state, the header of that alone, and rows as they come."""
    rng = np.random.default_rng(1)
    columns = record(BASELINE, N, rng, adding("housing_tilt", TILT, 0.0), since=SINCE)
    write_state(folder / "state.npz", watched(columns), "key")
    with np.load(folder / "state.npz") as file:
        arrays = dict(file)
    expected = ExpectedColumns(dict.fromkeys(columns, "input") | {"time": "time"})
    rows = np.column_stack([values[:300] for values in columns.values()])
    np.savetxt(folder / _STREAM, rows, delimiter=",", header=",".join(columns), comments="")

    def read_header(path: Path) -> None:
        header = np.array((path / "header.json").read_bytes().decode("utf-8", "replace"))
        np.savez(path / "header.json.npz", **(arrays | {"header": header}))
        read_state(path / "header.json.npz", BASELINE, OPTIONS, "key")

    def read_rows(path: Path) -> None:
        splitter = RevolutionSplitter()
        rows = _rows(io.BytesIO((path / _STREAM).read_bytes()), expected)
        for _, columns in _checked(rows, -np.inf, ""):
            list(splitter.turns(columns))

    state, rows_of_stream = (folder / "state.npz").read_bytes(), (folder / _STREAM).read_bytes()
    return {
        "watch state": Target(
            {"state.npz": state},
            "state.npz",
            lambda path: read_state(path / "state.npz", BASELINE, OPTIONS, "key"),
        ),
        "watch header": Target(
            {"header.json": str(arrays["header"]).encode()}, "header.json", read_header
        ),
        "watch rows": Target({_STREAM: rows_of_stream}, _STREAM, read_rows),
    }


def _reading(read: Callable[[Path], Any], file: str) -> Callable[[Path], Any]:
    return lambda folder: read(folder / file)


def _matrices(folder: Path) -> dict[str, Target]:
    contents = matrix_contents(folder)
    return {
        file: Target({file: contents[file]}, file, _reading(read, file))
        for file, read in MATRIX_READERS.items()
    }


def _bodies(folder: Path) -> dict[str, Target]:
    contents = body_contents(folder)
    return {
        f"body {name}": Target(contents[name], name, _reading(read_foreign_body, file))
        for name, file in BODY_READERS.items()
    }


def _more(folder: Path) -> dict[str, Target]:
    contents = more_contents(folder)
    return {
        name: Target(contents[name], Path(name).name, _reading(read, Path(name).name))
        for name, read in MORE_READERS.items()
    }


TEXTS = [
    *("campaign carrier document", "campaign carrier run", "campaign mounting document"),
    *("campaign mounting run", "campaign element document", "campaign element run"),
    *("curves.csv", "parameters.toml", "surfaces.toml", "seals.json"),
    *(f"law {name}.toml" for name in DAMAGED_LAWS),
    *("times.json", "diagnosis.json", "rim_motion.json", "mesh_error.json", "entry.json"),
    *("case carrier_lc1_to_lc4", "case mounting_2011", "case stage_lc1"),
    *("mesh .msh", "mesh of hexahedra .inp"),
    *("map", "log log.csv", "log log.mat", "log log.h5", "log log.tdms", "log run.uff"),
    *(
        "log run.xlsx",
        "log run.outb",
        *["log run.mf4"][: bool(importlib.util.find_spec("asammdf"))],
    ),
    *MATRIX_READERS,
    *("gearbox.rexs", "gearbox.rexsj", "gearbox.rexsz"),
    *("watch state", "watch header", "watch rows"),
    *(f"body {name}" for name in BODY_READERS),
    *MORE_READERS,
    "body .h5 bytes",
]
#: JSON whose values are damaged too, so that it is taken for what it is.
VALUES = ("gearbox.rexsj", "watch header", "whole/diagnosis.json", "whole/report.json")
#: Every reader has its share; the body is damaged in two ways.
SHARE = ceil(int(os.environ.get("FUZZ_INPUTS", "2000")) / (len(TEXTS) + len(VALUES) + 1))
SEED = int(os.environ.get("FUZZ_SEED", "1"))
SETTINGS = settings(
    max_examples=SHARE,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)


@pytest.fixture(scope="module")
def body(tmp_path_factory, pin_reduction):
    path = tmp_path_factory.mktemp("body") / "a.h5"
    certificate = Certificate(1000.0, (Check("mass", "1e-9", 1e-12, True),))
    triangles, n = np.array([[0, 1, 2], [0, 2, 3]]), pin_reduction.model.n_coordinates
    shapes = BodyShapes(np.eye(4, 3), triangles, ("a",), np.array([0, -1]), np.ones((4, 3, n)))
    corners, surface_of = (np.eye(4, 3), triangles, ("a",)), np.array([0, 0, 0, -1])
    stresses = BodyStresses(*corners, surface_of, np.zeros(4, dtype=bool), np.ones((4, 6, n)))
    write_body(pin_reduction.model, path, certificate, shapes, stresses)
    return path.read_bytes()


def _read_both(path: Path) -> None:
    read_body(path / "a.h5")
    read_certificate(path / "a.h5")
    read_stresses(path / "a.h5")
    shapes = read_shapes(path / "a.h5")
    if shapes is not None:
        shapes.displacement(np.ones(shapes.T.shape[2]))


def _written(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


@pytest.fixture(scope="module")
def targets(tmp_path_factory, one_pin_mesh, body):
    folder = tmp_path_factory.mktemp("valid")
    write_mesh(one_pin_mesh, folder / "a.msh")
    mesh = {"a.msh": (folder / "a.msh").read_bytes()}
    deck = blocks("hexahedron", folder / "a.inp").read_bytes()
    hexahedra = {"a.inp": deck.replace(b"left", b"carrier").replace(b"right", b"pins")}
    read_mesh(_written(folder / "whole.inp", hexahedra["a.inp"]))
    return {
        **_campaigns(tmp_path_factory.mktemp("campaigns")),
        **_documents(tmp_path_factory.mktemp("documents")),
        **_logs(tmp_path_factory.mktemp("logs")),
        **_cases(),
        **_gearboxes(tmp_path_factory.mktemp("gearboxes")),
        **_watches(tmp_path_factory.mktemp("watches")),
        "mesh .msh": Target(mesh, "a.msh", lambda path: read_mesh(path / "a.msh")),
        "mesh of hexahedra .inp": Target(
            hexahedra, "a.inp", lambda path: read_mesh(path / "a.inp")
        ),
        **_matrices(tmp_path_factory.mktemp("matrices")),
        **_bodies(tmp_path_factory.mktemp("bodies")),
        **_more(tmp_path_factory.mktemp("more")),
        "body .h5 bytes": Target({"a.h5": body}, "a.h5", _read_both),
    }


@pytest.fixture(autouse=True)
def careful(monkeypatch):
    """Children are forks, which start at once; all of this process may take four gigabytes more."""
    read_in_forks(
        monkeypatch,
        *(mesh_files, foreign_files, node_files, op4_input_files, log_files, hdf5_trial),
        *(superelement_files, cad_mesh, child_process),
    )
    monkeypatch.setattr(log_files, "_SECONDS", 2)
    monkeypatch.setattr(hdf5_trial, "_SECONDS", 2)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_virtual_bytes() + 4_000_000_000, limits[1]))
    previous = signal.signal(signal.SIGVTALRM, _hang)
    yield
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    signal.signal(signal.SIGVTALRM, previous)
    resource.setrlimit(resource.RLIMIT_AS, limits)


def _virtual_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def _hang(number, frame):
    raise HangError


def tried(name: str, read: Callable[[Path], Any], folder: Path, file: str) -> None:
    """Read once; count how it ends and fail where it ends otherwise than told in one line."""
    counts = COUNTS.setdefault(name, Counter())
    counts["tried"] += 1
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    signal.setitimer(signal.ITIMER_VIRTUAL, PATIENCE)
    bad = ""
    try:
        read(folder)
        counts["accepted"] += 1
    except REPORTED as error:
        message = printable(str(error.args[0] if isinstance(error, KeyError) else error))
        counts["refused"] += 1
        if file not in message or len(message) > 2100:
            bad = "unnamed"
            detail = message
    except HangError:
        bad, detail = "hang", "no end"
    except Exception as error:
        bad, detail = "traceback", repr(error)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    if resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before > MOST_MEMORY:
        bad, detail = "above 400 MB", "memory"
    if resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss > MOST_OF_A_CHILD:
        bad, detail = "above 400 MB", "a child above 2 GB"
    if bad:
        counts[bad] += 1
        pytest.fail(f"{bad}: {detail}")


def written(target: Target, content: bytes, folder: Path) -> Path:
    target_folder = folder / "k"
    target_folder.mkdir(exist_ok=True)
    for name, valid in target.files.items():
        (target_folder / name).write_bytes(content if name == target.damaged else valid)
    return target_folder


@pytest.mark.parametrize("name", TEXTS)
def test_damaged_files_are_told_in_one_line(tmp_path, targets, name):
    target = targets[name]
    # The valid file first: a reader that refuses it would pass all the rest.
    if name not in ("entry.json",):
        target.read(written(target, target.files[target.damaged], tmp_path))

    @seed(SEED)
    @SETTINGS
    @given(content=damaged(target.files[target.damaged]))
    def check(content):
        tried(name, target.read, written(target, content, tmp_path), target.damaged)

    check()


@pytest.mark.parametrize("name", VALUES)
def test_other_values_are_told_in_one_line(tmp_path, targets, name):
    target = targets[name]

    @seed(SEED)
    @SETTINGS
    @given(content=damaged_values(target.files[target.damaged]))
    def check(content):
        where = written(target, content, tmp_path)
        tried(f"{name} values", target.read, where, target.damaged)

    check()


def test_damaged_parts_of_a_body_are_told_in_one_line(tmp_path, body):
    datasets: list[str] = []
    with h5py.File(io.BytesIO(body)) as file:
        file.visititems(
            lambda name, entry: datasets.append(name) if isinstance(entry, h5py.Dataset) else None
        )

    @seed(SEED)
    @SETTINGS
    @given(change=damaged_hdf5(sorted(datasets)))
    def check(change):
        buffer = io.BytesIO(body)
        with h5py.File(buffer, "r+") as file:
            change(file)
        (tmp_path / "a.h5").write_bytes(buffer.getvalue())
        tried("body .h5 parts", _read_both, tmp_path, "a.h5")

    check()
