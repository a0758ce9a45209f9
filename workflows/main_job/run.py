"""The main job: from the carrier's parameters to a first report on the sim-to-real gap.

Meshes, deflection curves, reduced bodies, planetary stage and mounting in time with those bodies,
the load cases LC1 to LC4 of the 2012 paper simulated at the rim sensors, the motion identified from
those signals, and the gap of a model without misalignment and flexibility diagnosed.
"""

from __future__ import annotations

import resource
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.fe.curve_files import write_curves
from carrierflex.files.json_files import save_json
from carrierflex.files.versions import provenance, versions
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.identification.campaign.campaign_files import prepare_campaign_folder
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows.executors import other_processes
from carrierflex.workflows.identification import identify_parameters
from carrierflex.workflows.interruption import end_children
from carrierflex.workflows.main_job import check_mesh_convergence
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.workflows.fe.carrier_variants import CarrierVariant
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles
    from carrierflex.workflows.main_job import reduce_carrier
    from carrierflex.workflows.main_job.check_mesh_convergence import MeshStudy
    from carrierflex.workflows.main_job.job import Gap, Job
    from carrierflex.workflows.simulation import simulate_carrier

_MESH_SUFFIXES = (".msh", ".vtu", ".inp")


def main(
    *,
    out: Path,
    size: float | None = None,
    parameters: Path | None = None,
    step: Path | None = None,
    surfaces: Path | None = None,
    mesh_sizes: tuple[float, ...] = (),
    quiet: bool = False,
) -> Job:
    """Run the complete chain for one planet carrier; all results in one folder.

    Parameters
    ----------
    out
        Folder to write: meshes, deflection_curves.csv, bodies, stage, mounting, campaign,
        identification, gap, pictures, summary.json.
    size
        Element edge length [m]; default: 0.03; of a STEP file as of carrierflex curves.
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; a missing key has
        its default. four_planets: a bundled set.
    step
        STEP file with the carrier without pins, instead of the parametric carrier; any length unit.
    surfaces
        TOML file that states the STEP file's surfaces; carrierflex cad writes one to start from.
    mesh_sizes
        Element edge lengths [m] of the mesh study, descending; default: 0.025, 0.016, 0.0125, of a
        STEP file 1.25 and 1 times the size.
    quiet
        Show no progress.

    Returns
    -------
    Job
        In a good job every check of the summary is met.
    """
    stage = read_parameters(parameters)

    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

    files = CarrierFiles(step, surfaces)
    record, edge = files.record(), files.element_size(size)
    for folder in ("", "meshes", "bodies", "pictures", "stage", "mounting"):
        prepared_folder(out / folder)
    for folder in ("campaign", "stage/campaign", "mounting/campaign"):
        prepare_campaign_folder(out / folder)

    from carrierflex.fe.carrier_curves import named_curves
    from carrierflex.workflows.fe.carrier_variants import carrier_variant, default_gear_notes
    from carrierflex.workflows.main_job import run_reduced_bodies
    from carrierflex.workflows.main_job.job import Job, job_summary
    from carrierflex.workflows.main_job.pictures import draw_carriers

    # No weights: the diagnosis took 1.8 times as long as the reductions in one run, 1.2 in another.
    stages = Stages(10, quiet)
    variants = {}
    with stages.stage("carrier without pins: mesh, matrices, load cases"):
        variants["flexible"] = carrier_variant("flexible", stage, edge, files)
    with stages.stage("carrier with bonded pins: mesh, matrices, load cases"):
        variants["stiff"] = carrier_variant("stiff", stage, edge, files)
        curves = named_curves(variants["stiff"].deflection, variants["flexible"].deflection)
        write_curves(out / "deflection_curves.csv", curves)
    gear = variants["flexible"].gear
    if files.given:
        for text in default_gear_notes(gear):
            stages.tell(text)
    # What no other stage waits for is done in a process beside them.
    with other_processes(1) as process, _ended_with_errors():
        study = process.submit(_mesh_study, stage, files, mesh_sizes, edge)
        with stages.stage("mesh files"):
            _write_meshes(out / "meshes", variants)
        with stages.stage("reduction of both carriers and a pin"):
            reduced = _reduced_bodies(out / "bodies", stage, variants, edge, files, stages.note)
        interface = variants["flexible"].interface
        case = _load_cases(out, interface.n_planets, interface.sensor_radius)
        pictures = process.submit(draw_carriers, out / "pictures", variants, curves, reduced, case)
        with stages.stage("planetary stage and mounting in time"):
            in_time = run_reduced_bodies.main(
                reduced.flexible.model, reduced.pin.model, gear, curves=curves, out=out
            )
        simulated, identified, gap = _signals(out, case, stages)
        with stages.stage("mesh study, done beside the others"):
            mesh_study = study.result()
        with stages.stage("pictures of the carriers, drawn beside the others"):
            pictures.result()
    job = Job(
        out,
        stage,
        variants,
        curves,
        mesh_study,
        reduced,
        in_time,
        simulated,
        identified,
        gap,
        record,
        summary={},
    )
    summary = job_summary(job, edge) | {
        "seconds": stages.seconds,
        "peak_memory_gb": _peak_memory_gb(),
        "versions": versions(),
    }
    save_json(out / "summary.json", summary)
    return replace(job, summary=summary)


def _mesh_study(
    stage: StageParameters, files: CarrierFiles, sizes: tuple[float, ...], edge: float
) -> MeshStudy:
    if files.given:
        return check_mesh_convergence.study_of_files(stage, files, sizes or (1.25 * edge, edge))
    return check_mesh_convergence.main(stage, sizes or check_mesh_convergence.STUDY_SIZES)


@contextmanager
def _ended_with_errors() -> Iterator[None]:
    """End the processes beside this one where a stage fails: nobody asks for their results."""
    try:
        yield
    except Exception:
        end_children()
        raise


def _peak_memory_gb() -> float:
    """Peaks of this process and of the largest beside it, as if they met."""
    peaks = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(peak.ru_maxrss for peak in peaks) / 1e6


def _reduced_bodies(
    folder: Path,
    stage: StageParameters,
    variants: Mapping[str, CarrierVariant],
    size: float,
    files: CarrierFiles,
    note: Callable[[str, float], None],
) -> reduce_carrier.ReducedCarrier:
    """Both carriers and a pin, reduced and written."""
    from carrierflex.reduction.body_files import write_body
    from carrierflex.workflows.main_job import reduce_carrier

    record = files.record()
    reduced = reduce_carrier.main(
        stage,
        variants["flexible"],
        variants["stiff"],
        size,
        provenance(parameters=stage, size=size, **({"files": record} if record else {})),
        files=files,
        note=note,
    )
    for body in (reduced.flexible, reduced.stiff, reduced.pin):
        write_body(body.model, folder / f"{body.model.name}.h5")
    return reduced


def _write_meshes(folder: Path, variants: Mapping[str, CarrierVariant]) -> None:
    from carrierflex.geometry.mesh_files import write_mesh

    for name, variant in variants.items():
        for suffix in _MESH_SUFFIXES:
            write_mesh(variant.mesh, folder / f"{name}_carrier{suffix}")


def _load_cases(out: Path, n_planets: int, sensor_radius: float) -> Path:
    """The shipped load cases, or a copy of them for a carrier with other planets or sensors."""
    # Its sensors stand where that carrier's curves are read.
    shipped = shipped_case()
    default = CarrierParameters()
    keys = {"n_planets": n_planets, "sensor_radius": round(sensor_radius, 6)}
    if n_planets == default.n_planets and abs(sensor_radius - default.sensor_radius) < 1e-6:
        return shipped
    text = shipped.read_text(encoding="utf-8")
    for key, value in keys.items():
        text = text.replace(f"\n{key} = {getattr(default, key)}", f"\n{key} = {value}")
    copy = out / "load_cases.toml"
    with whole_file(copy) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return copy


def _signals(
    out: Path, case: Path, stages: Stages
) -> tuple[simulate_carrier.SimulatedLoadCases, identify_parameters.Identification, Gap]:
    """Simulate the load cases, identify the motion, diagnose the gap of the simplest model."""
    from carrierflex.workflows.main_job.job import diagnosed_gap
    from carrierflex.workflows.simulation import simulate_carrier

    campaign = out / "campaign"
    with stages.stage("load cases LC1 to LC4 simulated"):
        simulated = simulate_carrier.main(
            case, out=campaign, curves=out / "deflection_curves.csv", quiet=True
        )
    with stages.stage("M1 and M2 identified"):
        identified = identify_parameters.identify_carrier(
            campaign, "m2", out / "identification", per_run=True, quiet=True
        )
    with stages.stage("gap diagnosed"):
        gap = diagnosed_gap(campaign, out=out / "gap")
    return simulated, identified, gap
