"""Sensitivities of a carrier: curves, reduced matrices and frequencies over its causes.

A cause is what may differ between a carrier and its drawing: a dimension, a surface that lies
elsewhere, a constant of a material, the stiffness of a pin's fit or of a bearing's seat.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.assembly import MatrixDerivatives
from carrierflex.fe.carrier_curves import (
    UNIT_PIN_FORCE,
    UNIT_TORQUE,
)
from carrierflex.fe.curve_derivatives import (
    ClampedHalfSector,
    clamped_carrier,
    clamped_half_sector,
    curves_of_readings,
    is_stiff,
    unit_loads,
)
from carrierflex.fe.deflection_curves import DeflectionCurve, order_amplitudes
from carrierflex.fe.half_sector_derivatives import (
    HalfSectorDerivative,
    material_derivative,
    shape_derivative,
)
from carrierflex.fe.half_sector_sensors import (
    HalfSectorSensors,
    whole_body_sensors,
)
from carrierflex.fe.load_cases import bonded_pin_load, gear_forces
from carrierflex.fe.materials import BODY_MATERIALS, Material, material_of
from carrierflex.fe.shape_extension import extended_velocity
from carrierflex.fe.structural_model import (
    carrier_pilot_points,
    flexible_carrier_pilots,
    stiff_carrier_pilots,
)
from carrierflex.fe.surface_motion import surface_groups, surface_motion
from carrierflex.fe.symmetry_blocks import HalfSector, half_sector
from carrierflex.geometry.carrier_interface import carrier_interface
from carrierflex.geometry.dihedral_group import no_symmetry
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import planets_of
from carrierflex.geometry.shape_velocity import (
    IMAGINARY_STEP,
    dimension_value,
    dimensions_of,
    parametric_motion,
    with_imaginary_step,
)
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.pin_fit import FIXED_PILOT
from carrierflex.reduction.pin_joints import carrier_with_pins, drive_torque_load
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.reduced_static import constrained_solution, load_vector
from carrierflex.reduction.sensitivities import (
    FrequencyDerivatives,
    frequency_derivatives,
    reduced_derivative,
)
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

#: Constants of a material and their units.
_CONSTANTS = {"E": "Pa", "nu": "1", "rho": "kg/m^3"}
#: Change of a named surface that tables show [m].
_OFFSET = 1e-3
#: Change of any other cause that tables show, as a share of its value.
_SHARE = 0.01
#: Radial springs to the ground leave the carrier free along its axis and about it.
_FREE_ON_SEATS = 2


@dataclass(frozen=True)
class Cause:
    """What may differ from its nominal value."""

    name: str
    """``carrier.plate_gap``, ``pin.bearing_width``: table and key of the parameter file;
    ``carrier.E``, ``pins.rho``: constant of a body's material; ``surface.rim_face``: offset along
    the outward normal; ``pin_fit``, ``seat.upwind``, ``seat.downwind``: stiffness."""
    value: float
    """Nominal value [`unit`]; 0 for an offset."""
    unit: str
    change: float
    """Change that tables and pictures show [`unit`]: 1 % of the value, 1 mm of an offset."""


@dataclass(frozen=True, eq=False)
class CurveSensitivity:
    """A deflection curve and its derivatives by p causes, each a curve of n angles.

    Parameters
    ----------
    nominal : DeflectionCurve
        The curve.
    axial, radial : ndarray, shape (p, n)
        Derivatives of its displacements [m per unit of the cause].
    """

    nominal: DeflectionCurve
    axial: NDArray[np.float64]
    radial: NDArray[np.float64]

    def order_derivative(self, order: int) -> NDArray[np.complex128]:
        """Derivative of the axial curve's complex amplitude of `order`, shape (p,)."""
        return order_amplitudes(self.axial)[:, order]

    def amplitude_derivative(self, order: int) -> NDArray[np.float64]:
        """Derivative of the magnitude of `order`, shape (p,)."""
        c = self.nominal.axial_order(order)
        if c == 0.0:
            return np.abs(self.order_derivative(order))
        return np.asarray((self.order_derivative(order) * np.conj(c)).real / abs(c))


@dataclass(frozen=True, eq=False)
class BodySensitivities:
    """A body's sensitivities to its causes.

    Parameters
    ----------
    name : str
        ``flexible_carrier``, ``stiff_carrier``, ``carrier_with_pins``.
    causes : tuple of Cause
        All p of them.
    curves : mapping of str to CurveSensitivity
        By name: ``delta_f`` and ``g_f``, ``delta_s`` and ``g_s``, or ``delta_joined`` and
        ``g_joined``.
    model : ReducedModel
        Nominal reduced body, n coordinates.
    dK, dM : ndarray, shape (p, n, n)
        Derivatives of its matrices on the nominal basis.
    dG : ndarray, shape (p, m, n)
        Derivatives of the pilots' motion in its coordinates.
    frequencies : FrequencyDerivatives
        Natural frequencies of the free body; ``carrier_with_pins`` on its seats.
    """

    name: str
    causes: tuple[Cause, ...]
    curves: Mapping[str, CurveSensitivity]
    model: ReducedModel
    dK: NDArray[np.float64]
    dM: NDArray[np.float64]
    dG: NDArray[np.float64]
    frequencies: FrequencyDerivatives


@dataclass(frozen=True, eq=False)
class Change:
    """What a cause changes of a variant."""

    cause: Cause
    derivative: Callable[[], HalfSectorDerivative]
    """Makes the derivative of the half sector's matrices and couplings."""
    d_loads: NDArray[np.float64]
    """Derivative of the loads at the pilots, shape (6 p, 2)."""


@dataclass(frozen=True, eq=False)
class CarrierProblem:
    """Finite elements of one variant, its loads, and what of them each cause changes.

    Parameters
    ----------
    clamped : ClampedHalfSector
        Half sector and sensors, held at the shaft face; or the whole body of a given mesh.
    radius : float
        Radius of the sensor circle [m].
    loads : ndarray, shape (6 p, 2)
        At the pilots, of 1 kN m and of 1 N on pin 1 [N, N m].
    changes : tuple of Change
        What each cause changes.
    """

    clamped: ClampedHalfSector
    radius: float
    loads: NDArray[np.float64]
    changes: tuple[Change, ...]

    @property
    def half(self) -> HalfSector:
        """The half sector, or the whole body of a given mesh."""
        return self.clamped.half

    @property
    def sensors(self) -> HalfSectorSensors:
        """Its sensors."""
        return self.clamped.sensors

    @property
    def curve_suffix(self) -> str:
        """``s`` of a carrier with bonded pins, ``f`` of one without."""
        return "s" if is_stiff(self.half.pilots) else "f"

    @property
    def n_planets(self) -> int:
        """Number of its pins."""
        return planets_of(self.half.pilots)


def parametric_problem(
    half: TetMesh, stage: StageParameters, *, materials: Mapping[str, Material] = BODY_MATERIALS
) -> CarrierProblem:
    """Problem of a variant of the parametric carrier; its causes are dimensions and materials.

    Parameters
    ----------
    half : TetMesh
        Half sector of :mod:`carrierflex.geometry.carrier_mesh`, with pins or without.
    stage : StageParameters
        Its dimensions.
    materials : mapping of str to Material
        Material of every body of the mesh.

    Raises
    ------
    ValueError, SingularMatrixError
        Where the mesh does not belong to the dimensions, or is not one piece.
    """
    clamped = clamped_carrier(half, stage, materials=materials)
    names = tuple(clamped.half.pilots)
    matrices = MatrixDerivatives(half, materials)
    dimensions = dimensions_of(pins="pins" in half.bodies)
    stepped = [with_imaginary_step(stage, dimension) for dimension in dimensions]

    def shape(V: NDArray[np.float64], one: StageParameters) -> Callable[[], HalfSectorDerivative]:
        moved = carrier_pilot_points(one.carrier)
        velocities = {name: np.imag(moved[name]) / IMAGINARY_STEP for name in names}
        return lambda: shape_derivative(clamped.half, matrices, V, velocities)

    velocity = extended_velocity(half, parametric_motion(half, stage, dimensions))
    changes = [
        Change(
            _relative(name, dimension_value(stage, name), "m"),
            shape(V, one),
            unit_loads(names, one.carrier, one.gear).imag / IMAGINARY_STEP,
        )
        for name, V, one in zip(dimensions, velocity, stepped, strict=True)
    ]
    return _with_materials(
        clamped,
        stage.carrier.sensor_radius,
        unit_loads(names, stage.carrier, stage.gear),
        matrices,
        changes,
    )


def given_problem(
    mesh: TetMesh, gear: GearData, materials: Mapping[str, Material]
) -> CarrierProblem:
    """Problem of a variant from a CAD model or mesh; its causes are named surfaces and materials.

    A surface moves along its outward normal; pilots stay where they are.

    Parameters
    ----------
    mesh : TetMesh
        Whole carrier, with pins or without.
    gear : GearData
        Gears that set the forces on the pins; the centre distance is that of the bores.
    materials : mapping of str to Material
        Material of every body of the mesh.

    Raises
    ------
    KeyError, ValueError, SingularMatrixError
        As :func:`carrierflex.geometry.carrier_interface.carrier_interface` and
        :func:`parametric_problem`.
    """
    pins, interface = "pins" in mesh.bodies, carrier_interface(mesh)
    n, radius = interface.n_planets, interface.sensor_radius
    names = stiff_carrier_pilots(n) if pins else flexible_carrier_pilots(n)
    pilots = {name: interface.points[name] for name in names}
    body = half_sector(
        "stiff_carrier" if pins else "flexible_carrier",
        mesh,
        pilots,
        no_symmetry(),
        materials=materials,
    )
    sensors = whole_body_sensors(mesh, radius)
    matrices = MatrixDerivatives(mesh, materials)
    groups = surface_groups(mesh.surfaces)
    velocity = extended_velocity(mesh, surface_motion(mesh, groups, radius))
    at_rest = dict.fromkeys(names, np.zeros(3))

    def shape(V: NDArray[np.float64]) -> Callable[[], HalfSectorDerivative]:
        return lambda: shape_derivative(body, matrices, V, at_rest)

    gear = replace(gear, centre_distance=interface.centre_distance)
    loads = unit_loads(names, interface, gear)
    changes = [
        Change(Cause(f"surface.{name}", 0.0, "m", _OFFSET), shape(V), np.zeros_like(loads))
        for name, V in zip(groups, velocity, strict=True)
    ]
    return _with_materials(
        clamped_half_sector(body, sensors, mesh.surface("shaft_face")),
        radius,
        loads,
        matrices,
        changes,
    )


def sensitivities(
    problem: CarrierProblem,
    n_modes: int,
    *,
    n_frequencies: int = 10,
    note: Callable[[str], None] = lambda name: None,
) -> BodySensitivities:
    """Sensitivities of a variant to all its causes.

    Parameters
    ----------
    problem : CarrierProblem
        Finite elements and causes.
    n_modes : int
        Fixed-interface modes of the nominal basis.
    n_frequencies : int
        Lowest elastic frequencies of the free body; the last group is complete.
    note : callable
        Told the name of each cause before its turn.

    Raises
    ------
    SingularMatrixError, AccuracyError
        From the reduction.
    """
    reduction = symmetric_craig_bampton(problem.half, n_modes, sensors=problem.sensors)
    statics = problem.clamped.statics(problem.loads)
    forces, reduced = [], []
    for change in problem.changes:
        note(change.cause.name)
        of = change.derivative()
        forces.append(statics.forces(of, change.d_loads))
        reduced.append(reduced_derivative(reduction, of))
    return BodySensitivities(
        problem.half.structure.name,
        tuple(change.cause for change in problem.changes),
        _curves(
            problem.curve_suffix, problem.radius, statics.readings, statics.derivatives(forces)
        ),
        reduction.model,
        np.array([one.K for one in reduced]),
        np.array([one.M for one in reduced]),
        np.array([one.G for one in reduced]),
        frequency_derivatives(
            reduction.model.K,
            reduction.model.M,
            [(one.K, one.M) for one in reduced],
            n_frequencies,
        ),
    )


def curve_sensitivities(problem: CarrierProblem) -> dict[str, CurveSensitivity]:
    """The curves of :func:`sensitivities` alone: no reduction."""
    statics = problem.clamped.statics(problem.loads)
    forces = [statics.forces(change.derivative(), change.d_loads) for change in problem.changes]
    derivatives = statics.derivatives(forces)
    return _curves(problem.curve_suffix, problem.radius, statics.readings, derivatives)


def spring_sensitivities(
    carrier: ReducedModel,
    pin: ReducedModel,
    gear: GearData,
    *,
    radius: float,
    pin_fit: float,
    seats: Mapping[str, float],
    n_frequencies: int = 10,
) -> BodySensitivities:
    """Sensitivities of the carrier with its pins to their fit and to the bearings on its seats.

    The pins are joined as by :func:`carrierflex.reduction.pin_joints.carrier_with_pins`, a radial
    spring holds each seat. Stiffness is linear in every spring, so that its derivative is that of
    one spring of one unit. The curves have the shaft face held through its pilot.

    Parameters
    ----------
    carrier, pin : ReducedModel
        Carrier without pins; pin 1.
    gear : GearData
        Gears that set the forces on the pins.
    radius : float
        Radius of the sensor circle [m].
    pin_fit : float
        Bending and torsional stiffness of every interface [N m/rad], positive and finite.
    seats : mapping of str to float
        Radial stiffness [N/m] by seat, ``upwind`` and ``downwind``.
    n_frequencies : int
        Lowest elastic frequencies on the seats.

    Raises
    ------
    ValueError
        Where a stiffness is not positive and finite.
    """
    causes = tuple(
        _relative(name, value, unit)
        for name, value, unit in (
            ("pin_fit", pin_fit, "N m/rad"),
            *((f"seat.{side}", value, "N/m") for side, value in seats.items()),
        )
    )
    for cause in causes:
        if not (np.isfinite(cause.value) and cause.value > 0.0):
            raise ValueError(
                f"{cause.name} is {cause.value} {cause.unit}; expected a positive stiffness"
            )
    model = carrier_with_pins(carrier, pin, pin_fit)
    # Twice the stiffness less once the stiffness is that of the springs alone.
    dK = [(carrier_with_pins(carrier, pin, 2.0 * pin_fit).K - model.K) / pin_fit]
    K = model.K.copy()
    for side, stiffness in seats.items():
        unit_spring = np.zeros_like(K)
        rows = model.coordinates_of(f"{side}_seat")[1:3]
        unit_spring[rows, rows] = 1.0
        K += stiffness * unit_spring
        dK.append(unit_spring)
    model = replace(model, K=K)
    n_planets = sum(name.endswith("_midspan_of_pin") for name in model.pilots)
    forces = gear_forces(UNIT_TORQUE, gear, n_planets)
    one_pin = bonded_pin_load(1, UNIT_PIN_FORCE, 0.0, n_planets)
    cases = (
        drive_torque_load(forces.F_PLC, forces.M_t, n_planets),
        {f"{name}_of_pin": load for name, load in one_pin.items()},
    )
    f = np.stack([load_vector(model, loads) for loads in cases], axis=1)
    held_rows = model.rows_of(FIXED_PILOT)
    q = constrained_solution(model, held_rows, f, f"holding {FIXED_PILOT}")
    dq = [
        constrained_solution(model, held_rows, -(one @ q), f"holding {FIXED_PILOT}") for one in dK
    ]
    zero = np.zeros_like(K)
    n_pilots = len(model.pilot_rows)
    return BodySensitivities(
        model.name,
        causes,
        _curves(
            "joined",
            radius,
            model.sensor_rows @ q,
            np.array([model.sensor_rows @ one for one in dq]),
        ),
        model,
        np.array(dK),
        np.zeros((len(dK), *K.shape)),
        np.zeros((len(dK), n_pilots, K.shape[0])),
        frequency_derivatives(
            K, model.M, [(one, zero) for one in dK], n_frequencies, n_rigid=_FREE_ON_SEATS
        ),
    )


def _relative(name: str, value: float, unit: str) -> Cause:
    return Cause(name, value, unit, _SHARE * value)


def _with_materials(
    clamped: ClampedHalfSector,
    radius: float,
    loads: NDArray[np.float64],
    matrices: MatrixDerivatives,
    shapes: Sequence[Change],
) -> CarrierProblem:
    """Problem with the causes of its shape and, behind them, the constants of its materials."""

    def constant(body: str, name: str) -> Callable[[], HalfSectorDerivative]:
        return lambda: material_derivative(clamped.half, matrices, body, name)

    materials = [
        Change(
            _relative(f"{body}.{name}", getattr(material_of(matrices.materials, body), name), unit),
            constant(body, name),
            np.zeros_like(loads),
        )
        for body in matrices.mesh.bodies
        for name, unit in _CONSTANTS.items()
    ]
    return CarrierProblem(clamped, radius, loads, (*shapes, *materials))


def _curves(
    suffix: str,
    radius: float,
    readings: NDArray[np.float64],
    derivatives: NDArray[np.float64],
) -> dict[str, CurveSensitivity]:
    """Curves ``delta`` and ``g`` of readings (n_sensors, 2), derivatives (p, n_sensors, 2)."""
    curves = {}
    nominal = curves_of_readings(suffix, readings, radius)
    for column, (name, curve) in enumerate(nominal.items()):
        n, of_curve = curve.axial.size, derivatives[:, :, column]
        curves[name] = CurveSensitivity(curve, of_curve[:, :n], of_curve[:, n:])
    return curves
