"""Reduce both carriers and a pin, compare with the full models, vary the pin fit when reduced.

The carriers are reduced by the blocks of their symmetry and checked by the full models' matrices.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.carrier_curves import UNIT_TORQUE, sensor_curve
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.load_cases import gear_forces
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.reduction.certificate import compliance_errors, compliance_errors_by_fields
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.fixed_interface_modes import FixedInterfaceModes
from carrierflex.reduction.mode_count import DEFAULT_FREQUENCY
from carrierflex.reduction.modes.mode_rules import rule_for_use
from carrierflex.reduction.pin_fit import FIXED_PILOT, PinFitFamily
from carrierflex.reduction.pin_joints import TABLE_4_STIFFNESS
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import static_coordinates
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton
from carrierflex.workflows.fe.bodies import built_pin
from carrierflex.workflows.fe.carrier_variants import CarrierVariant
from carrierflex.workflows.geometry.carrier_files import CarrierFiles
from carrierflex.workflows.reduction.half_sector_bodies import half_sector_body

#: Interface stiffnesses of the study [N m/rad]: simply supported, the paper's, the one of Table 4's
#: rim size, nearly rigid.
STUDY_STIFFNESSES = (0.0, PAPER_STIFFNESS, 1e7, TABLE_4_STIFFNESS, 1e8, 1e12)

#: Shares of the time that are over after the pin, the stiff carrier and the flexible one.
_PIN_SHARE = 0.06
_FLEXIBLE_FROM = 0.57
_CURVES_FROM = 0.98


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """A reduced body, its modes, and its static compliance's relative error to the full model's."""

    model: ReducedModel
    modes: FixedInterfaceModes
    compliance_error: float


@dataclass(frozen=True, eq=False)
class ReducedCarrier:
    """The three reduced bodies and what was measured of them."""

    flexible: Annotated[ReducedBody, "Carrier without pins"]
    stiff: Annotated[ReducedBody, "Carrier with bonded pins"]
    pin: Annotated[ReducedBody, "Pin 1"]
    joined: Annotated[
        dict[float, DeflectionCurve],
        "Torque curve of carrier and pins joined in the reduced space, by interface stiffness "
        "[N m/rad]",
    ]
    fit: Annotated[PinFitFamily, "The same at any stiffness"]
    sliding: Annotated[
        DeflectionCurve, "The curve at stiffness 0 with pins free to slide in their downwind bores"
    ]
    reference: Annotated[
        DeflectionCurve,
        "Torque curve of the full model without pins, its shaft face held through its pilot as "
        "in the assemblies",
    ]


def main(
    stage: StageParameters,
    flexible: CarrierVariant,
    stiff: CarrierVariant,
    size: float,
    provenance: Mapping[str, str],
    *,
    files: CarrierFiles,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> ReducedCarrier:
    """Reduce both carriers and a pin, compare with the full models, and join carrier and pins.

    Parameters
    ----------
    stage
        Dimensions of carrier, pins and gears.
    flexible, stiff
        Carriers, solved.
    size
        Element edge length of the pin's mesh [m].
    provenance
        Kept in the bodies.
    files
        STEP file of the carrier; its bodies are reduced whole.
    note
        Told each body with the share of the work that is done.

    Returns
    -------
    ReducedCarrier
        A good reduction has compliance errors below 1e-9, and its sliding curve equals the
        reference.
    """
    pin_structure = built_pin(stage, size, files, stiff.mesh)
    reduction = craig_bampton(pin_structure, rule_for_use(DEFAULT_FREQUENCY), provenance=provenance)
    error = max(compliance_errors(pin_structure, reduction).values())
    pin = ReducedBody(reduction.model, reduction.modes, error)

    def reduced(structure: StructuralModel) -> tuple[ReducedBody, NDArray[np.float64]]:
        if files.given:
            return _reduced_whole(structure, provenance)
        return _reduced_carrier(stage, structure, size, provenance)

    note("stiff carrier", _PIN_SHARE)
    stiff_body, _ = reduced(stiff.structure)
    note("flexible carrier", _FLEXIBLE_FROM)
    flexible_body, Psi = reduced(flexible.structure)
    note("curves over the pin fit", _CURVES_FROM)
    load, radius = flexible.cases["both"], flexible.interface.sensor_radius
    reference = _held_through_pilot(load, radius, flexible.structure, flexible_body.model, Psi)
    forces = gear_forces(UNIT_TORQUE, flexible.gear, flexible.n_planets)
    family = PinFitFamily(flexible_body.model, pin.model, forces, radius)
    joined = {stiffness: family.curve(stiffness) for stiffness in STUDY_STIFFNESSES}
    sliding = replace(family, sliding=True).curve(0.0)
    return ReducedCarrier(flexible_body, stiff_body, pin, joined, family, sliding, reference)


def _reduced_carrier(
    stage: StageParameters, structure: StructuralModel, size: float, provenance: Mapping[str, str]
) -> tuple[ReducedBody, NDArray[np.float64]]:
    """A carrier reduced from its half sector, and its constraint modes on the whole body."""
    half, sensors = half_sector_body(structure.name, stage, size)
    reduction = symmetric_craig_bampton(
        half, rule_for_use(DEFAULT_FREQUENCY), sensors=sensors, provenance=provenance
    )
    model, T = reduction.model, reduction.basis.whole_body(structure.points)
    m = 6 * len(model.pilots)
    error = max(compliance_errors_by_fields(structure, model, T[:, :m]).values())
    modes = FixedInterfaceModes(T[:, m:], reduction.basis.omega)
    return ReducedBody(model, modes, error), T[:, :m]


def _reduced_whole(
    structure: StructuralModel, provenance: Mapping[str, str]
) -> tuple[ReducedBody, NDArray[np.float64]]:
    """A carrier without symmetry reduced as it is, and its constraint modes."""
    reduction = craig_bampton(structure, rule_for_use(DEFAULT_FREQUENCY), provenance=provenance)
    error = max(compliance_errors(structure, reduction).values())
    return ReducedBody(reduction.model, reduction.modes, error), reduction.Psi


def _held_through_pilot(
    load: Mapping[str, NDArray[np.float64]],
    radius: float,
    structure: StructuralModel,
    model: ReducedModel,
    Psi: NDArray[np.float64],
) -> DeflectionCurve:
    """Torque curve of the full model without pins."""
    # Its shaft face held through the pilot instead of node by node: the constraint modes give the
    # full static answer.
    q = static_coordinates(model, [FIXED_PILOT], load)
    assert structure.sensors is not None
    reading = structure.sensors.rows @ (Psi @ q[: Psi.shape[1]])
    return sensor_curve("full model", reading, UNIT_TORQUE, radius)
