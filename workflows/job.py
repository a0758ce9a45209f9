"""Everything the main job computed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.workflows.diagnosis import diagnose_load_cases
from carrierflex.workflows.fe import check_mesh_convergence
from carrierflex.workflows.identification import identify_parameters
from carrierflex.workflows.reduction import reduce_carrier
from carrierflex.workflows.simulation import run_reduced_bodies, simulate_carrier
from carrierflex.workflows.support.carrier_variants import CarrierVariant


@dataclass(frozen=True, eq=False)
class Job:
    """Everything the main job computed, its folder, and its summary as in summary.json."""

    folder: Path
    stage: StageParameters
    variants: dict[str, CarrierVariant]
    curves: dict[str, DeflectionCurve]
    mesh_study: check_mesh_convergence.MeshStudy
    reduced: reduce_carrier.ReducedCarrier
    in_time: run_reduced_bodies.BodiesAtWork
    simulated: simulate_carrier.SimulatedLoadCases
    identified: identify_parameters.Identification
    gap: diagnose_load_cases.Gap
    summary: dict[str, Any]
