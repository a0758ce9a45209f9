"""Derivatives of the torque curves that a carrier's drawing allows, by finite elements.

The carrier is held node by node at its shaft face, as for the curves of ``carrierflex curves``.
What its pins see of it is the compliance C at the bores' pilots, what the rim shows of their loads
are the readings R, and both have exact derivatives (:mod:`carrierflex.fe.curve_derivatives`).
Joined with its pins, in six coordinates a bore, the carrier has the stiffness ``C⁻¹`` and the
sensor rows ``R C⁻¹``.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.carrier_curves import UNIT_TORQUE, sensor_curve
from carrierflex.fe.curve_derivatives import (
    ClampedHalfSector,
    HalfSectorStatics,
    clamped_carrier,
    clamped_curves,
    half_sector_curves,
)
from carrierflex.fe.curve_files import PIN_FIT
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.load_cases import gear_forces
from carrierflex.fe.materials import BODY_MATERIALS, Material
from carrierflex.fe.structural_model import PIN_PILOTS, carrier_pilot_points, structural_model
from carrierflex.geometry.carrier_mesh import pin_mesh
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.shape_velocity import with_step
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.carrier_sensitivities import (
    CarrierProblem,
    Change,
    curve_sensitivities,
    given_problem,
    parametric_problem,
)
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.pin_joints import carrier_with_pins, drive_torque_load
from carrierflex.reduction.reduced_model import (
    PILOT_COORDINATES,
    MassProperties,
    ReducedModel,
)
from carrierflex.reduction.reduced_static import static_coordinates

#: Causes that shape no solid, or do not bear on statics.
_NO_SHAPE = ("carrier.upwind_bearing_width", "carrier.sensor_radius", "carrier.rho")
#: Step of the central differences of the joined body, as a share of the value: new meshes of the
#: pin scatter by less than a hundredth of the derivative.
_STEP = 2e-3
#: The same of an offset [m].
_OFFSET_STEP = 1e-4
#: Table of the causes that are named surfaces.
_SURFACE = "surface"
#: Distance up to which two middles of a bore are the same [m].
_SAME_BORE = 1e-3
FloatArray = NDArray[np.float64]


def drawn_curves(
    half: TetMesh,
    stage: StageParameters,
    size: float,
    *,
    note: Callable[[str], None] = lambda name: None,
) -> dict[str, DeflectionCurve]:
    """Curves that a parametric carrier may have: for any pin fit, and causes off their drawing.

    Between pins without bending stiffness and rigidly fitted ones the torque curves lie on a
    straight line to 0.1 % (docs/reduction.md), ``delta_f + w d`` with w from 0 to 1, so that d and
    the derivatives of both by every cause are the whole family.

    Parameters
    ----------
    half : TetMesh
        Half sector of the carrier without pins.
    stage : StageParameters
        Its dimensions, and those of its pins.
    size : float
        Element edge length of the pin's mesh [m].
    note : callable
        Told the name of each cause before its turn.

    Returns
    -------
    dict of str to DeflectionCurve
        ``pin_fit`` is d; ``delta_f/<cause>`` and ``pin_fit/<cause>`` are the derivatives [m per kN
        m and unit of the cause] by every dimension of the table [carrier] that shapes the solid,
        by ``E`` and ``nu`` of the carrier and ``pin_E`` of its pins.

    Raises
    ------
    ValueError, SingularMatrixError
        Where the mesh does not belong to the dimensions.
    """
    return _drawn(parametric_problem(half, stage), stage, size, note)


def given_drawn_curves(
    mesh: TetMesh,
    stage: StageParameters,
    size: float,
    *,
    materials: Mapping[str, Material] = BODY_MATERIALS,
    note: Callable[[str], None] = lambda name: None,
) -> dict[str, DeflectionCurve]:
    """The same of a carrier from a CAD model or mesh: its causes are named surfaces and materials.

    A surface moves along its outward normal [m]; the pins stay as they are.

    Parameters
    ----------
    mesh : TetMesh
        Whole carrier without pins.
    stage : StageParameters
        Dimensions that its pins are made of.
    size : float
        Element edge length of the pin's mesh [m].
    materials : mapping of str to Material
        Material of every body.
    note : callable
        Told the name of each cause before its turn.

    Raises
    ------
    KeyError, ValueError, SingularMatrixError
        Where the mesh is no carrier, or its bores are not where the dimensions have them.
    """
    problem = given_problem(mesh, stage.gear, materials)
    points, drawn = problem.half.pilots, carrier_pilot_points(stage.carrier)
    for name in (name for name in points if name.startswith("pin_")):
        if name not in drawn or np.abs(points[name] - drawn[name]).max() > _SAME_BORE:
            raise ValueError(
                f"the middle of bore {name} of the mesh is at {np.round(points[name], 4)} m, and "
                f"that of the dimensions at {np.round(drawn.get(name, np.nan), 4)} m; expected the "
                "same, as the pins are made of the dimensions: state [carrier] of this carrier in "
                "--parameters"
            )
    return _drawn(problem, stage, size, note, materials)


def _drawn(
    problem: CarrierProblem,
    stage: StageParameters,
    size: float,
    note: Callable[[str], None],
    materials: Mapping[str, Material] = BODY_MATERIALS,
) -> dict[str, DeflectionCurve]:
    """Pin fit and derivatives of a carrier whose curves are derived by its causes."""
    curve = curve_sensitivities(problem)["delta_f"]
    nominal, statics = _bores(problem.clamped)
    pin = _pin(stage, size, materials)

    def named(name: str, readings: FloatArray) -> dict[str, DeflectionCurve]:
        return {name: sensor_curve(name, readings, UNIT_TORQUE, problem.radius)}

    curves = named(PIN_FIT, _by_fit(nominal, pin, stage))
    for k, change in enumerate(problem.changes):
        name = change.cause.name
        if name in _NO_SHAPE:
            continue
        note(name)
        table, _, cause = name.rpartition(".")
        # An offset has no value.
        step = _STEP * change.cause.value or _OFFSET_STEP
        moved = _derivative(statics, nominal, change)
        ends = []
        for h in (step, -step):
            moves_pin = change.cause.unit == "m" and table != _SURFACE
            at = with_step(stage, name, h) if moves_pin else stage
            of_pin = _pin(at, size, materials) if moves_pin else pin
            ends.append(_by_fit(nominal.moved(moved, h), of_pin, at))
        curves |= named(f"delta_f/{cause}", np.concatenate([curve.axial[k], curve.radial[k]]))
        curves |= named(f"{PIN_FIT}/{cause}", (ends[0] - ends[1]) / (2.0 * step))
    E = materials["pins"].E
    ends = [_by_fit(nominal, replace(pin, K=(1.0 + h) * pin.K), stage) for h in (_STEP, -_STEP)]
    curves |= named("delta_f/pin_E", np.zeros_like(ends[0]))
    curves |= named(f"{PIN_FIT}/pin_E", (ends[0] - ends[1]) / (2.0 * _STEP * E))
    return curves


def nominal_curves(
    flexible: TetMesh,
    stiff: TetMesh,
    stage: StageParameters,
    size: float,
    *,
    materials: Mapping[str, Material] = BODY_MATERIALS,
) -> dict[str, DeflectionCurve]:
    """Curves of a parametric carrier: ``delta_s, delta_f, g_s, g_f``, and `PIN_FIT`.

    Parameters
    ----------
    flexible, stiff : TetMesh
        Half sectors without pins and with bonded pins.
    stage, size
        As of :func:`drawn_curves`.
    materials : mapping of str to Material
        Material of carrier and pins.

    Raises
    ------
    ValueError, SingularMatrixError
        Where a mesh does not belong to the dimensions.
    """
    clamped = clamped_carrier(flexible, stage, materials=materials)
    nominal, _ = _bores(clamped)
    by_fit = _by_fit(nominal, _pin(stage, size, materials), stage)
    return {
        **clamped_curves(clamped, stage),
        **half_sector_curves(stiff, stage, materials=materials),
        PIN_FIT: sensor_curve(PIN_FIT, by_fit, UNIT_TORQUE, stage.carrier.sensor_radius),
    }


class _Bores:
    """A carrier as its pins see it: compliance C (6 b, 6 b) and readings R (s, 6 b) of b bores."""

    def __init__(self, names: tuple[str, ...], C: FloatArray, R: FloatArray) -> None:
        self.names, self.C, self.R = names, C, R

    def moved(self, by: "_Bores", step: float) -> "_Bores":
        """The same, `step` along a derivative."""
        return _Bores(self.names, self.C + step * by.C, self.R + step * by.R)

    def model(self, stage: StageParameters) -> ReducedModel:
        """The carrier in the coordinates of its bores."""
        K = np.linalg.inv(self.C)
        points = carrier_pilot_points(stage.carrier)
        n = len(K)
        return ReducedModel(
            name="held_carrier",
            K=0.5 * (K + K.T),
            M=np.zeros((n, n)),
            D=np.zeros((n, n)),
            labels=tuple(f"{name} {one}" for name in self.names for one in PILOT_COORDINATES),
            pilots={name: points[name] for name in self.names},
            pilot_coordinates={
                name: np.arange(6 * k, 6 * k + 6) for k, name in enumerate(self.names)
            },
            sensor_names=tuple(f"rim {k}" for k in range(len(self.R))),
            sensor_rows=self.R @ K,
            mass_properties=MassProperties(0.0, np.zeros(3), np.zeros((3, 3))),
        )


def _bores(clamped: ClampedHalfSector) -> tuple[_Bores, HalfSectorStatics]:
    """A held carrier as its pins see it, and its answer to unit loads at the bores."""
    pilots = list(clamped.half.pilots)
    bores = [name for name in pilots if name.startswith("pin_")]
    loads = np.zeros((6 * len(pilots), 6 * len(bores)))
    for k, name in enumerate(bores):
        first = 6 * pilots.index(name)
        loads[first : first + 6, 6 * k : 6 * k + 6] = np.eye(6)
    statics = clamped.statics(loads)
    return _Bores(tuple(bores), statics.compliance, statics.readings), statics


def _derivative(statics: HalfSectorStatics, bores: _Bores, change: Change) -> _Bores:
    """Derivative of C and R by one cause."""
    of = change.derivative()
    forces = statics.forces(of, np.zeros_like(statics.loads))
    return _Bores(bores.names, statics.compliance_derivative(of), statics.derivatives([forces])[0])


def _pin(
    stage: StageParameters, size: float, materials: Mapping[str, Material] = BODY_MATERIALS
) -> ReducedModel:
    """Pin 1, reduced to its pilots."""
    mesh = pin_mesh(stage.carrier, stage.pin, size)
    structure = structural_model("pin", mesh, stage.carrier, PIN_PILOTS, materials=materials)
    return craig_bampton(structure, 0).model


def _by_fit(bores: _Bores, pin: ReducedModel, stage: StageParameters) -> FloatArray:
    """Readings of what a rigid fit adds to the curve of pins without bending stiffness."""
    n = stage.carrier.n_planets
    forces = gear_forces(UNIT_TORQUE, stage.gear, n)
    loads = drive_torque_load(forces.F_PLC, forces.M_t, n)
    readings = []
    for stiffness in (math.inf, 0.0):
        joined = carrier_with_pins(bores.model(stage), pin, stiffness)
        readings.append(joined.sensor_rows @ static_coordinates(joined, [], loads))
    return np.asarray(readings[0] - readings[1])
