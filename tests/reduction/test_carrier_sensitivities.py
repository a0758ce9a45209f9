"""Sensitivities beside central differences of the same mesh moved, and known answers.

Steps of 1e-4 of a value: the differences' own error is its square times the third derivative, which
is largest where two faces meet at a small angle (hub and pin hole, 15 degrees).
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.carrier_curves import (
    UNIT_TORQUE,
    carrier_deflection,
    flexible_cases,
    stiff_cases,
)
from carrierflex.fe.curve_derivatives import clamped_carrier
from carrierflex.fe.load_cases import gear_forces
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.shape_extension import extended_velocity
from carrierflex.fe.structural_model import PIN_PILOTS, structural_model
from carrierflex.geometry.carrier_mesh import (
    flexible_half_sector,
    pin_mesh,
    stiff_half_sector,
)
from carrierflex.geometry.dihedral import completed
from carrierflex.geometry.named_surfaces import with_carrier_surfaces
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.shape_velocity import parametric_motion, with_step
from carrierflex.reduction.carrier_sensitivities import (
    given_problem,
    parametric_problem,
    sensitivities,
    spring_sensitivities,
)
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.pin_fit import torque_curve
from carrierflex.reduction.pin_joints import carrier_with_pins, drive_torque_load
from carrierflex.reduction.sensitivities import frequency_derivatives
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

STAGE = StageParameters()
SIZE = 0.1
STEP = 1e-4


def half_sector_of(variant):
    if variant == "flexible":
        return flexible_half_sector(STAGE.carrier, SIZE)
    return stiff_half_sector(STAGE.carrier, STAGE.pin, SIZE)


@pytest.fixture(scope="module", params=["flexible", "stiff"])
def variant(request):
    return request.param


@pytest.fixture(scope="module")
def half(variant):
    return half_sector_of(variant)


@pytest.fixture(scope="module")
def problem(half):
    return parametric_problem(half, STAGE)


@pytest.fixture(scope="module")
def body(problem):
    return sensitivities(problem, 8)


def relative(actual, expected):
    return np.abs(actual - expected).max() / np.abs(expected).max()


@pytest.mark.long
def test_every_dimension_meets_differences_of_the_same_mesh_moved(half, problem, body):
    """Curves, reduced stiffness, mass and couplings, to 1e-5 with a step of 1e-4."""
    basis = nominal_basis(problem)
    for number, cause in enumerate(body.causes):
        if cause.unit != "m":
            continue
        step = STEP * cause.value
        # It moves no face: what changes of the matrices is the mesh alone, and strongly curved.
        tolerance = 3e-5 if cause.name == "carrier.sensor_radius" else 1e-5
        V = extended_velocity(half, parametric_motion(half, STAGE, [cause.name]))[0]
        readings, matrices = [], []
        for sign in (1.0, -1.0):
            moved = replace(half, points=half.points + sign * step * V)
            again = parametric_problem(moved, with_step(STAGE, cause.name, sign * step))
            readings.append(again.clamped.statics(again.loads).readings)
            matrices.append(on_basis(again, *basis))
        difference = (readings[0] - readings[1]) / (2.0 * step)
        n = len(difference) // 2
        for column, curve in enumerate(body.curves.values()):
            assert relative(curve.axial[number], difference[:n, column]) < 1e-5, cause.name
            assert relative(curve.radial[number], difference[n:, column]) < 1e-5, cause.name
        for actual, plus, minus in zip(
            (body.dK[number], body.dM[number], body.dG[number]), *matrices, strict=True
        ):
            assert relative(actual, (plus - minus) / (2.0 * step)) < tolerance, cause.name


@pytest.mark.long
def test_the_stiffness_of_the_pilots_follows_from_both_derivatives():
    """``dK_bb - dG_bᵀ K_bb - K_bb dG_b`` is what another reduction of the moved mesh gives."""
    half, name = half_sector_of("flexible"), "carrier.pin_hole_diameter"
    problem = parametric_problem(half, STAGE)
    body = sensitivities(problem, 0, n_frequencies=0)
    number = [cause.name for cause in body.causes].index(name)
    m, step = body.dG.shape[1], STEP * body.causes[number].value
    V = extended_velocity(half, parametric_motion(half, STAGE, [name]))[0]
    plus, minus = (
        symmetric_craig_bampton(
            clamped_carrier(
                replace(half, points=half.points + sign * step * V),
                with_step(STAGE, name, sign * step),
            ).half,
            0,
        ).model.K
        for sign in (1.0, -1.0)
    )
    K, dG = body.model.K[:m, :m], body.dG[number, :, :m]
    derivative = body.dK[number, :m, :m] - dG.T @ K - K @ dG
    assert relative(derivative, (plus - minus) / (2.0 * step)) < 1e-5


def nominal_basis(problem):
    """Basis on the half sector and how coordinates follow the symmetry, of the nominal body."""
    basis = symmetric_craig_bampton(problem.half, 8, sensors=problem.sensors).basis
    return basis.T, basis.motions


def on_basis(problem, T, Q):
    """Stiffness, mass and pilots' motion of another body on the nominal basis."""
    half, m = problem.half, problem.half.Z.shape[0]

    def images(projection, matrix):
        return np.einsum("gab,bc,gdc->ad", projection, matrix, Q, optimize=True)

    K, M = (images(Q, T.T @ (matrix @ T)) for matrix in (half.structure.K, half.structure.M))
    return K, M, np.linalg.solve(half.Z, images(Q[:, :m, :m], half.B @ T))


def test_nominal_curves_are_those_of_the_whole_body(half, body, variant):
    pin = STAGE.pin if variant == "stiff" else None
    full = with_carrier_surfaces(completed(half, 3), STAGE.carrier, pin)
    names = tuple(body.model.pilots)
    structure = structural_model(variant, full, STAGE.carrier, names)
    cases = stiff_cases(STAGE.gear, 3) if pin else flexible_cases(STAGE.carrier, STAGE.gear)
    curves = carrier_deflection(structure, full.surface("shaft_face"), cases).curves
    for curve, expected in zip(
        body.curves.values(), (curves["both"], curves["pin_1"]), strict=True
    ):
        assert relative(curve.nominal.axial, expected.axial) < 1e-9
        assert relative(curve.nominal.radial, expected.radial) < 1e-9


def test_derivatives_of_the_torque_curve_keep_its_orders(body):
    """A dimension is the same at every planet: orders that are no multiple of three stay away."""
    delta = body.curves[next(iter(body.curves))]
    size = np.abs(np.fft.rfft(delta.axial, axis=1))
    others = [order for order in range(1, 12) if order % 3]
    assert size[:, others].max() < 1e-9 * size.max()


@pytest.mark.long
def test_modulus_and_density_scale_the_carrier_without_pins():
    """Curves go as 1/E, frequencies as the root of E and as one over the root of the density."""
    body = sensitivities(parametric_problem(half_sector_of("flexible"), STAGE), 8)
    names = [cause.name for cause in body.causes]
    E, rho = (names.index(f"carrier.{constant}") for constant in ("E", "rho"))
    steel = BODY_MATERIALS["carrier"]
    for curve in body.curves.values():
        assert_allclose(curve.axial[E], -curve.nominal.axial / steel.E, rtol=1e-9, atol=1e-30)
        assert np.abs(curve.axial[rho]).max() == 0.0
    f = body.frequencies
    assert_allclose(f.derivative[E], f.frequency / (2.0 * steel.E), rtol=1e-7)
    assert_allclose(f.derivative[rho], -f.frequency / (2.0 * steel.rho), rtol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("constant", ["E", "nu"])
def test_constants_of_the_pins_meet_differences(constant):
    """To 1e-6 with a step of 1e-4."""
    half = half_sector_of("stiff")
    body = sensitivities(parametric_problem(half, STAGE), 8)
    number = [cause.name for cause in body.causes].index(f"pins.{constant}")
    value = getattr(BODY_MATERIALS["pins"], constant)
    readings = []
    for sign in (1.0, -1.0):
        other = replace(BODY_MATERIALS["pins"], **{constant: value * (1.0 + sign * STEP)})
        again = parametric_problem(half, STAGE, materials=BODY_MATERIALS | {"pins": other})
        readings.append(again.clamped.statics(again.loads).readings)
    difference = (readings[0] - readings[1]) / (2.0 * STEP * value)
    for column, curve in enumerate(body.curves.values()):
        n = curve.axial.shape[1]
        assert relative(curve.axial[number], difference[:n, column]) < 1e-6
        assert relative(curve.radial[number], difference[n:, column]) < 1e-6


@pytest.fixture(scope="module")
def bodies():
    """Carrier without pins and a pin, reduced."""
    problem = parametric_problem(half_sector_of("flexible"), STAGE)
    carrier = sensitivities(problem, 8).model
    mesh = pin_mesh(STAGE.carrier, STAGE.pin, SIZE)
    pin = craig_bampton(structural_model("pin", mesh, STAGE.carrier, PIN_PILOTS), 0).model
    return carrier, pin


def springs(bodies, pin_fit=1e7, **seats):
    stiffness = {"upwind": 2e9, "downwind": 1e9} | seats
    return spring_sensitivities(
        *bodies, STAGE.gear, radius=STAGE.carrier.sensor_radius, pin_fit=pin_fit, seats=stiffness
    )


def test_springs_meet_differences(bodies):
    """Pin fit and seats, curves and frequencies, to 1e-6."""
    body = springs(bodies)
    # Free along and about the axis alone: the first frequency counted is an elastic one.
    assert body.frequencies.frequency[0] > 10.0
    for number, (name, value) in enumerate((("pin_fit", 1e7), ("upwind", 2e9), ("downwind", 1e9))):
        plus, minus = (
            springs(bodies, **{name: value * (1.0 + sign * STEP)}) for sign in (1.0, -1.0)
        )
        step = 2.0 * STEP * value
        for curve in body.curves:
            difference = plus.curves[curve].nominal.axial - minus.curves[curve].nominal.axial
            size = np.abs(body.curves[curve].nominal.axial).max() / value
            error = np.abs(body.curves[curve].axial[number] - difference / step).max()
            # A lateral spring does not feel the same load on all pins: there is no change at all.
            assert error < 1e-6 * max(np.abs(difference / step).max(), 1e-4 * size)
        f = plus.frequencies.frequency - minus.frequencies.frequency
        actual = body.frequencies.derivative[number]
        assert_allclose(actual, f / step, rtol=1e-5, atol=1e-6 * np.abs(actual).max())


def test_the_curve_with_springs_is_that_of_the_pin_fit_study(bodies):
    carrier, pin = bodies
    forces = gear_forces(UNIT_TORQUE, STAGE.gear, 3)
    joined = carrier_with_pins(carrier, pin, 1e7)
    loads = drive_torque_load(forces.F_PLC, forces.M_t, 3)
    expected = torque_curve("joined", joined, loads, STAGE.carrier.sensor_radius)
    # Seats feel the torque only by the asymmetry of rounding.
    nominal = springs(bodies).curves["delta_joined"].nominal
    assert relative(nominal.axial, expected.axial) < 1e-9


def test_an_unusable_stiffness_is_refused(bodies):
    with pytest.raises(ValueError, match=r"pin_fit is 0.0 N m/rad; expected a positive stiffness"):
        springs(bodies, pin_fit=0.0)


def test_a_repeated_frequency_splits_by_the_eigenvalues_of_the_projected_derivative():
    """Two equal oscillators coupled by a spring k: squares of frequencies 1 and 1 + 2 k."""
    Q = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    K, M = Q @ np.diag([1.0, 1.0, 9.0]) @ Q.T, np.eye(3)
    dK = Q @ np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]]) @ Q.T
    f = frequency_derivatives(K, M, [(dK, np.zeros((3, 3)))], 2, n_rigid=0)
    assert_allclose(f.frequency, 1.0 / (2.0 * np.pi), rtol=1e-12)
    assert_allclose(f.derivative[0], [0.0, 1.0 / (2.0 * np.pi)], atol=1e-12)


def test_a_group_is_complete():
    f = frequency_derivatives(np.diag([1.0, 4.0, 4.0, 9.0]), np.eye(4), [], 2, n_rigid=0)
    assert_allclose(f.frequency * 2.0 * np.pi, [1.0, 2.0, 2.0])


@pytest.mark.long
def test_a_given_mesh_offset_by_its_surfaces(variant):
    """The whole body as a mesh of somebody: same curves, surfaces that are dimensions alike.

    A seat moved outwards by 1 is a diameter greater by 2. The motion within the solid differs
    slightly: the normals of coarse facets are not quite radial.
    """
    half = half_sector_of(variant)
    pin = STAGE.pin if variant == "stiff" else None
    full = with_carrier_surfaces(completed(half, 3), STAGE.carrier, pin)
    given = sensitivities(given_problem(full, STAGE.gear, BODY_MATERIALS), 8)
    parametric = sensitivities(parametric_problem(half, STAGE), 8)
    number = {cause.name: i for i, cause in enumerate(given.causes)}
    dimension = {cause.name: i for i, cause in enumerate(parametric.causes)}
    assert_allclose(given.frequencies.frequency, parametric.frequencies.frequency, rtol=1e-7)
    for name, curve in given.curves.items():
        expected = parametric.curves[name]
        assert relative(curve.nominal.axial, expected.nominal.axial) < 1e-8
        for mine, theirs in (
            ("surface.downwind_seat", ("carrier.seat_outer_diameter", 2.0)),
            ("carrier.E", ("carrier.E", 1.0)),
        ):
            other = theirs[1] * expected.axial[dimension[theirs[0]]]
            assert relative(curve.axial[number[mine]], other) < 0.03, (name, mine)
