"""The four deflection curves of a carrier and the load cases behind them.

One factorisation serves a variant.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.load_cases import (
    PilotLoad,
    bonded_pin_load,
    gear_forces,
    simply_supported_pin_load,
    together,
)
from carrierflex.fe.static import HeldSolver, clamped_displacement, held_displacement
from carrierflex.fe.structural_model import N_SENSOR_ANGLES, Sensors, StructuralModel
from carrierflex.geometry.carrier_interface import CarrierInterface
from carrierflex.geometry.parameters import CarrierParameters, GearData

#: Drive torque of the unit load cases [N m], the paper's 1 kN m.
UNIT_TORQUE = 1000.0
#: Force of the single-pin cases [N].
UNIT_PIN_FORCE = 1.0

#: Pilot loads of every unit load case by name.
UnitCases = dict[str, dict[str, PilotLoad]]


@dataclass(frozen=True, eq=False)
class CarrierDeflection:
    """Static solution of one carrier variant under the unit load cases.

    Parameters
    ----------
    curves : dict of str to DeflectionCurve
        By load case: ``tangential``, ``tilting``, ``both`` (1 kN m); ``pin_1``, ``pin_2``
        ... (1 N).
    u : ndarray, shape (n, 3)
        Nodal displacement under ``both`` [m].
    reaction : ndarray, shape (6,)
        Force [N] and moment [N m] of the clamp on the carrier under ``both``.
    imbalance : float
        Largest relative imbalance of load and reaction over all cases.
    """

    curves: dict[str, DeflectionCurve]
    u: NDArray[np.float64]
    reaction: NDArray[np.float64]
    imbalance: float


def flexible_cases(carrier: CarrierParameters | CarrierInterface, gear: GearData) -> UnitCases:
    """Pilot loads of every unit load case for the carrier without pins."""
    return _cases(
        lambda pin, force, moment: simply_supported_pin_load(pin, force, moment, carrier),
        gear,
        carrier.n_planets,
    )


def stiff_cases(gear: GearData, n_planets: int) -> UnitCases:
    """Pilot loads of every unit load case for the carrier with bonded pins."""
    return _cases(
        lambda pin, force, moment: bonded_pin_load(pin, force, moment, n_planets), gear, n_planets
    )


def _cases(
    pin_load: Callable[[int, float, float], dict[str, PilotLoad]], gear: GearData, n_planets: int
) -> UnitCases:
    forces = gear_forces(UNIT_TORQUE, gear, n_planets)
    pins = range(1, n_planets + 1)

    def all_pins(force: float, moment: float) -> dict[str, PilotLoad]:
        """The same force [N] and moment [N m] on every pin."""
        return together(*(pin_load(pin, force, moment) for pin in pins))

    torque_cases = {
        "tangential": all_pins(forces.F_PLC, 0.0),
        "tilting": all_pins(0.0, forces.M_t),
        "both": all_pins(forces.F_PLC, forces.M_t),
    }
    return torque_cases | {f"pin_{pin}": pin_load(pin, UNIT_PIN_FORCE, 0.0) for pin in pins}


def carrier_deflection(
    structure: StructuralModel,
    shaft_face: NDArray[np.int64],
    cases: Mapping[str, Mapping[str, PilotLoad]],
    *,
    solver: HeldSolver = held_displacement,
) -> CarrierDeflection:
    """Solve the unit load cases of one carrier variant, the upwind shaft face fixed.

    After section 2.2 of the 2012 paper.

    Parameters
    ----------
    structure : StructuralModel
        Carrier with the sensor circle's recovery rows.
    shaft_face : ndarray of int
        Nodes that are held in all directions.
    cases : mapping of str to mapping
        Pilot loads by load case, from :func:`flexible_cases` or :func:`stiff_cases`.
    solver : callable
        What solves K u = f with the shaft face held.

    Raises
    ------
    SingularMatrixError, AccuracyError
        From :func:`carrierflex.fe.static.clamped_displacement`.
    ValueError
        Where the structure has no sensors.
    """
    loads = np.stack([structure.load_vector(case) for case in cases.values()], axis=1)
    solution = clamped_displacement(structure, shaft_face, loads, solver=solver)
    both = list(cases).index("both")
    return CarrierDeflection(
        curves={
            case: _recovered(structure.sensors, solution.u[:, i], case)
            for i, case in enumerate(cases)
        },
        u=solution.u[:, both].reshape(-1, 3),
        reaction=solution.reaction[:, both],
        imbalance=solution.imbalance,
    )


def sensor_curve(
    name: str, displacement: NDArray[np.float64], unit_load: float, radius: float
) -> DeflectionCurve:
    """Deflection curve from the sensor circle's readings, axial ones first, shape (2 n,) [m]."""
    return DeflectionCurve(
        name, radius, unit_load, displacement[:N_SENSOR_ANGLES], displacement[N_SENSOR_ANGLES:]
    )


def _recovered(sensors: Sensors | None, u: NDArray[np.float64], case: str) -> DeflectionCurve:
    if sensors is None:
        raise ValueError(
            "the body has no sensor circle; expected a carrier with the surface rim_face"
        )
    unit_load = UNIT_PIN_FORCE if case.startswith("pin") else UNIT_TORQUE
    return sensor_curve(case, sensors.rows @ u, unit_load, sensors.radius)


def named_curves(
    stiff: CarrierDeflection, flexible: CarrierDeflection
) -> dict[str, DeflectionCurve]:
    """The four curves of the chain by name.

    ``delta_s, delta_f`` belong to 1 kN m, ``g_s, g_f`` to 1 N on pin 1.
    """
    return {
        name: replace(deflection.curves[case], name=name)
        for name, deflection, case in (
            ("delta_s", stiff, "both"),
            ("delta_f", flexible, "both"),
            ("g_s", stiff, "pin_1"),
            ("g_f", flexible, "pin_1"),
        )
    }
