"""The carriers that workflows know by name, from their half sector.

Reduced by the blocks of their symmetry.
"""

from collections.abc import Mapping
from typing import Any

from carrierflex.fe.curve_derivatives import half_sector_structure
from carrierflex.fe.half_sector_sensors import HalfSectorSensors
from carrierflex.fe.symmetry_blocks import HalfSector
from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.reduction.certificate import Certificate
from carrierflex.reduction.dynamic_stiffness import FullResponse
from carrierflex.reduction.mode_count import chosen_modes, wanted_frequency
from carrierflex.reduction.modes.mode_rules import ModeRule
from carrierflex.reduction.symmetric_certificate import certify_by_blocks, response_by_blocks
from carrierflex.reduction.symmetric_craig_bampton import (
    SymmetricReduction,
    symmetric_craig_bampton,
)
from carrierflex.workflows.progress import Stages

#: Options of `carrierflex reduce` whose other values need the mesh of the whole body.
_HALF_SECTOR = {
    "residual_vectors": False,
    "coupling": "rbe3",
    "interface": "fixed",
    "assembly": "compiled",
}


def half_sector_body(
    name: str, stage: StageParameters, size: float
) -> tuple[HalfSector, HalfSectorSensors]:
    """Half sector of ``flexible_carrier`` or ``stiff_carrier``: finite elements and sensors.

    Raises
    ------
    ValueError
        Where the body is not a carrier: the others have no dihedral symmetry.
    """
    if name == "flexible_carrier":
        mesh = flexible_half_sector(stage.carrier, size)
    elif name == "stiff_carrier":
        mesh = stiff_half_sector(stage.carrier, stage.pin, size)
    else:
        raise ValueError(
            f"{name} has no dihedral symmetry; expected flexible_carrier or stiff_carrier"
        )
    return half_sector_structure(mesh, stage)


def serves_half_sector(options: Mapping[str, object], *, files_given: bool) -> bool:
    """Whether the half sector gives what the options of ``carrierflex reduce`` ask for."""
    if files_given or options["body"] != "carrier" or not options["symmetry"]:
        return False
    return all(options[name] == value for name, value in _HALF_SECTOR.items())


def certified_half_sector(
    name: str,
    stage: StageParameters,
    size: float,
    options: Mapping[str, Any],
    *,
    stages: Stages | None = None,
) -> tuple[SymmetricReduction, Certificate]:
    """Reduced carrier from its half sector, and its certificate by blocks.

    Parameters
    ----------
    name : str
        ``flexible_carrier`` or ``stiff_carrier``.
    stage : StageParameters
        Dimensions [m].
    size : float
        Element edge length [m].
    options : mapping
        Those that say how many modes are kept.
    stages : Stages, optional
        Progress, three stages.

    Raises
    ------
    SingularMatrixError, AccuracyError, ValueError
        From the reduction.
    """
    stages = stages or Stages(3, quiet=True)
    with stages.stage(f"finite elements of the half sector, {size:.4g} m"):
        half, sensors = half_sector_body(name, stage, size)

    def response_of(rule: ModeRule) -> FullResponse:
        return response_by_blocks(symmetric_craig_bampton(half, rule, sensors=sensors))

    n_dofs = len(half.group.motions) * half.structure.n_dofs
    with stages.stage(f"reduction of about {n_dofs} degrees of freedom by symmetry"):
        rule = chosen_modes(response_of, options)
        reduction = symmetric_craig_bampton(half, rule, sensors=sensors)
    with stages.stage("certificate"):
        cut_off_hz = wanted_frequency(options)
        return reduction, certify_by_blocks(reduction, cut_off_hz=cut_off_hz, note=stages.note)
