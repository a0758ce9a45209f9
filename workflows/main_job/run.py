"""The main job: from the carrier's parameters to a first report on the sim-to-real gap.

Meshes, deflection curves, reduced bodies, planetary stage and mounting in time with those bodies,
the load cases LC1 to LC4 of the 2012 paper simulated at the rim sensors, the motion identified from
those signals, and the gap of a model without misalignment and flexibility diagnosed.
"""

from __future__ import annotations

import resource
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from carrierflex.fe.curve_files import write_curves
from carrierflex.files.json_files import save_json
from carrierflex.files.versions import provenance, versions
from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameters import DEFAULT_SIZE, CarrierParameters
from carrierflex.identification.campaign.campaign_files import prepare_campaign_folder
from carrierflex.simulation.carrier.case_files import shipped_case
from carrierflex.workflows.identification import identify_parameters
from carrierflex.workflows.main_job import check_mesh_convergence
from carrierflex.workflows.outputs import prepared_folder
from carrierflex.workflows.progress import Stages

if TYPE_CHECKING:
    from carrierflex.workflows.fe.carrier_variants import CarrierVariant
    from carrierflex.workflows.main_job import reduce_carrier
    from carrierflex.workflows.main_job.job import Gap, Job
    from carrierflex.workflows.simulation import simulate_carrier

_MESH_SUFFIXES = (".msh", ".vtu", ".inp")


def main(
    *,
    out: Path,
    size: float = DEFAULT_SIZE,
    parameters: Path | None = None,
    mesh_sizes: tuple[float, ...] = check_mesh_convergence.STUDY_SIZES,
    quiet: bool = False,
) -> Job:
    """Do the whole chain for one planet carrier and leave every result in one folder.

    Parameters
    ----------
    out
        Folder to write: meshes, deflection_curves.csv, bodies, stage, mounting, campaign,
        identification, gap, pictures, summary.json.
    size
        Element edge length [m].
    parameters
        TOML file with the tables [carrier], [pin], [gear], dimensions in metres; what it leaves out
        keeps its default. four_planets: a set that comes with the package.
    mesh_sizes
        Element edge lengths [m] of the mesh study, descending.
    quiet
        Show no progress.

    Returns
    -------
    Job
        In a good job every check of the summary is met.
    """
    stage = read_parameters(parameters)
    for folder in ("", "meshes", "bodies", "pictures", "stage", "mounting"):
        prepared_folder(out / folder)
    for folder in ("campaign", "stage/campaign", "mounting/campaign"):
        prepare_campaign_folder(out / folder)

    from carrierflex.fe.carrier_curves import named_curves
    from carrierflex.workflows.fe.carrier_variants import flexible_variant, stiff_variant
    from carrierflex.workflows.main_job import run_reduced_bodies
    from carrierflex.workflows.main_job.job import Job, job_summary
    from carrierflex.workflows.main_job.pictures import draw_carriers

    # No weights: the mesh study took 0.4 and 1.6 times as long as the diagnosis.
    stages = Stages(10, quiet)
    variants = {}
    with stages.stage("carrier without pins: mesh, matrices, load cases"):
        variants["flexible"] = flexible_variant(stage, size)
    with stages.stage("carrier with bonded pins: mesh, matrices, load cases"):
        variants["stiff"] = stiff_variant(stage, size)
        curves = named_curves(variants["stiff"].deflection, variants["flexible"].deflection)
        write_curves(out / "deflection_curves.csv", curves)
    with stages.stage("mesh files"):
        _write_meshes(out / "meshes", variants)
    with stages.stage("mesh study on the half sector"):
        mesh_study = check_mesh_convergence.main(stage, mesh_sizes, note=stages.note)
    with stages.stage("reduction of both carriers and a pin"):
        reduced = _reduced_bodies(out / "bodies", stage, variants, size, stages.note)
    with stages.stage("pictures of the carriers"):
        case = _load_cases(out, stage.carrier)
        draw_carriers(out / "pictures", variants, curves, reduced, case)
    with stages.stage("planetary stage and mounting in time"):
        in_time = run_reduced_bodies.main(
            reduced.flexible.model, reduced.pin.model, stage.gear, curves=curves, out=out
        )
    simulated, identified, gap = _signals(out, case, stages)
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
        summary={},
    )
    summary = job_summary(job, size) | {
        "seconds": stages.seconds,
        "peak_memory_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "versions": versions(),
    }
    save_json(out / "summary.json", summary)
    return replace(job, summary=summary)


def _reduced_bodies(
    folder: Path,
    stage: StageParameters,
    variants: Mapping[str, CarrierVariant],
    size: float,
    note: Callable[[str, float], None],
) -> reduce_carrier.ReducedCarrier:
    """Both carriers and a pin, reduced and written."""
    from carrierflex.reduction.body_files import write_body
    from carrierflex.workflows.main_job import reduce_carrier

    reduced = reduce_carrier.main(
        stage,
        variants["flexible"].structure,
        variants["stiff"].structure,
        size,
        provenance(parameters=stage, size=size),
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


def _load_cases(out: Path, carrier: CarrierParameters) -> Path:
    """The shipped load cases, or a copy of them for a carrier of another number of planets.

    Its sensors stand where that carrier's curves are read.
    """
    shipped = shipped_case()
    default = CarrierParameters()
    if carrier.n_planets == default.n_planets:
        return shipped
    text = shipped.read_text(encoding="utf-8")
    for key in ("n_planets", "sensor_radius"):
        default_line, line = (f"{key} = {getattr(of, key)}" for of in (default, carrier))
        text = text.replace(f"\n{default_line}", f"\n{line}")
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
