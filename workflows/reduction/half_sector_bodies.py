"""The carriers that workflows know by name, from their half sector.

Reduced by the blocks of their symmetry.
"""

from collections.abc import Mapping

from carrierflex.fe.curve_derivatives import half_sector_structure
from carrierflex.fe.half_sector_sensors import HalfSectorSensors
from carrierflex.fe.symmetry_blocks import HalfSector
from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.reduction.certificate import (
    Certificate,
    fixed_interface_cut_off,
    inner_checks,
)
from carrierflex.reduction.modes.mode_rules import ModeRule
from carrierflex.reduction.symmetric_craig_bampton import (
    SymmetricReduction,
    symmetric_craig_bampton,
)

#: Options of `carrierflex reduce` that ask for what the half sector cannot give, and the value that
#: does not.
_NEEDS_WHOLE_BODY = {
    "frf_tolerance": None,
    "residual_vectors": False,
    "coupling": "rbe3",
    "interface": "fixed",
    "assembly": "compiled",
    "shapes": False,
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


def refuse_whole_body_options(options: Mapping[str, object], *, files_given: bool) -> None:
    """Raise ValueError where an option needs the whole body.

    A reduction by symmetry never makes it.
    """
    for name, harmless in _NEEDS_WHOLE_BODY.items():
        if options[name] != harmless:
            flag = "--" + name.replace("_", "-")
            given = flag if options[name] is True else f"{flag} {options[name]}"
            raise ValueError(
                f"--by-symmetry works on the half sector, {given} needs the whole body; leave one "
                "of them out"
            )
    if files_given or options["body"] != "carrier":
        raise ValueError(
            "--by-symmetry is for the parametric carrier; expected --body carrier without STEP or "
            "mesh file"
        )


def reduced_by_symmetry(
    name: str, stage: StageParameters, size: float, rule: ModeRule, *, cut_off_hz: float | None
) -> tuple[SymmetricReduction, Certificate]:
    """Reduced carrier from its half sector, and the checks of its matrices in themselves.

    The certificate's other lines compare with the whole body, which is never made here:
    docs/performance.md says how far the two paths agree.
    """
    half, sensors = half_sector_body(name, stage, size)
    reduction = symmetric_craig_bampton(half, rule, sensors=sensors)
    if cut_off_hz is None:
        cut_off_hz = fixed_interface_cut_off(reduction.basis.omega)
    return reduction, Certificate(cut_off_hz, inner_checks(reduction.model, cut_off_hz))
