"""Carrier and main shaft joined with a misalignment.

Kinematics of equation (1), statics of a shaft bent by it.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.load_cases import gear_forces, radial
from carrierflex.fe.main_shaft import main_shaft_structure
from carrierflex.fe.materials import STEEL
from carrierflex.geometry.main_shaft_mesh import main_shaft_mesh
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.pin_joints import carrier_with_pins, drive_torque_load
from carrierflex.reduction.reduced_static import constrained_solution, static_coordinates
from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes
from carrierflex.reduction.shaft_joint import (
    CARRIER_BEARINGS,
    COUPLING,
    MAIN_BEARING,
    Misalignment,
    carrier_on_shaft,
    rotating_group,
)
from carrierflex.simulation.carrier.kinematics import carrier_tilt_pattern

SHAFT = MainShaftParameters()
TILT = Misalignment(phi=0.6e-3, theta=math.radians(60.0))
R = 0.412
ANGLES = np.deg2rad(np.arange(360))
#: The sensor circle is made of quadratic edges: at the coarse mesh size it leaves the true circle
#: by this share of R.
CIRCLE = 2e-5
#: Joint to downwind bearing: 120 mm of hub, 350 mm of carrier, half the seat of 60 mm.
ARM = 0.5


@pytest.fixture(scope="module")
def shaft(carrier):
    return craig_bampton(
        main_shaft_structure(main_shaft_mesh(carrier, SHAFT, 0.08), carrier, SHAFT), 4
    ).model


@pytest.fixture(scope="module")
def group(flexible_reduction, pin_reduction, shaft):
    return rotating_group(flexible_reduction.model, pin_reduction.model, shaft, misalignment=TILT)


@pytest.fixture(scope="module")
def stiffened(flexible_reduction, shaft):
    """The group without pins, its carrier as good as rigid."""
    rigid = replace(flexible_reduction.model, K=1e4 * flexible_reduction.model.K)
    return carrier_on_shaft(rigid, shaft, TILT)


def static_answer(group, *supports):
    """Static answer to the misalignment, with (pilot, components) held.

    The shaft does not turn about x.
    """
    fixed = np.concatenate(
        [group.model.coordinates_of(pilot)[list(components)] for pilot, components in supports]
    )
    return constrained_solution(group.model, fixed, group.imposed.load, "supports")


PIVOT = ((MAIN_BEARING, (0, 1, 2)), (COUPLING, (3,)))
BEARING_A, BEARING_B = ((pilot, (1, 2)) for pilot in CARRIER_BEARINGS)


def test_with_the_shaft_alone_held_the_rim_moves_as_equation_1(group):
    q = static_answer(group, (MAIN_BEARING, range(6)))
    axial = group.sensor_readings(q)[:360]
    # The sensor at 47 deg reads the material point at 47 deg - theta.
    for theta in (0, 30, 200):
        expected = TILT.phi * carrier_tilt_pattern(
            np.array([math.radians(theta)]), math.radians(47.0), R, TILT.theta
        )
        assert_allclose(
            axial[(47 - theta) % 360], expected[0], rtol=0.0, atol=CIRCLE * R * TILT.phi
        )
    assert_allclose(np.abs(axial).max(), R * TILT.phi, rtol=1e-4)
    # The line of no displacement is the tilt axis itself.
    assert_allclose(axial[[60, 240]], 0.0, rtol=0.0, atol=CIRCLE * R * TILT.phi)


def test_the_carriers_nodes_turn_rigidly_with_the_tilt(group, flexible_structure):
    joint = np.array([-0.12, 0.0, 0.0])
    rotation = -TILT.phi * radial(TILT.theta)
    rigid = np.cross(rotation, flexible_structure.points - joint)
    readings = group.sensor_readings(static_answer(group, (MAIN_BEARING, range(6))))
    expected = flexible_structure.sensors.rows @ rigid.ravel()
    assert_allclose(readings, expected, rtol=0.0, atol=1e-9 * R * TILT.phi)


def test_the_tilt_turns_the_rim_about_the_joint(group):
    radial_motion = group.sensor_readings(static_answer(group, (MAIN_BEARING, range(6))))[360:]
    rotation = -TILT.phi * radial(TILT.theta)
    from_joint = np.array([[0.12, 0.0, 0.0] + R * radial(angle) for angle in ANGLES])
    expected = [
        np.cross(rotation, r) @ radial(angle) for r, angle in zip(from_joint, ANGLES, strict=True)
    ]
    assert_allclose(radial_motion, expected, rtol=0.0, atol=1e-9 * R * TILT.phi)
    assert np.abs(expected).max() > 0.1 * TILT.phi


def test_a_free_carrier_is_not_strained(group):
    q = static_answer(group, (MAIN_BEARING, range(6)))
    # Without the carrier's following, the tilt of its pilot alone would cost this much.
    alone = group.imposed.stiffness_work / 2.0
    assert alone > 1.0
    assert abs(group.imposed.strain_energy(group.model.K, q)) < 1e-9 * alone


def test_an_offset_moves_the_free_carrier_as_a_whole(flexible_reduction, shaft):
    moved = carrier_on_shaft(
        flexible_reduction.model, shaft, Misalignment(offset=(1e-4, 2e-4, -3e-4))
    )
    readings = moved.sensor_readings(static_answer(moved, (MAIN_BEARING, range(6))))
    assert_allclose(readings[:360], 1e-4, rtol=1e-8)
    expected = [np.array([1e-4, 2e-4, -3e-4]) @ radial(angle) for angle in ANGLES]
    assert_allclose(readings[360:], expected, rtol=0.0, atol=1e-11)


def test_one_carrier_bearing_turns_the_whole_line_and_strains_nothing(group):
    # Pivot at the main bearing and one bearing on the carrier: statically determinate. The joint's
    # kink phi divides into slopes: carrier phi L / (L + a), shaft -phi a / (L + a).
    q = static_answer(group, *PIVOT, BEARING_B)
    length = SHAFT.bearing_to_joint
    axial = group.sensor_readings(q)[:360]
    expected = R * TILT.phi * length / (length + ARM) * np.sin(TILT.theta - ANGLES)
    assert_allclose(axial, expected, rtol=0.0, atol=CIRCLE * R * TILT.phi)
    slope = q[group.model.coordinates_of("carrier_joint")[3:]]
    assert_allclose(
        slope, TILT.phi * ARM / (length + ARM) * radial(TILT.theta), rtol=0.0, atol=1e-8 * TILT.phi
    )


def test_two_bearings_on_a_rigid_carrier_bend_the_shaft_as_a_propped_beam(stiffened):
    q = static_answer(stiffened, *PIVOT, BEARING_A, BEARING_B)
    axial = stiffened.sensor_readings(q)[:360]
    assert np.abs(axial).max() < 1e-3 * R * TILT.phi
    # Carrier at rest: the shaft's end turns by phi, the bearing's end pivots. Stiffness 3 E I / L
    # with shear in series.
    second = math.pi / 64.0 * (0.341**4 - 0.060**4)
    area, G = math.pi / 4.0 * (0.341**2 - 0.060**2), STEEL.E / 2.6
    length = SHAFT.bearing_to_joint
    compliance = length / (3.0 * STEEL.E * second) + 1.0 / (0.886 * G * area * length)
    energy = stiffened.imposed.strain_energy(stiffened.model.K, q)
    assert_allclose(energy, TILT.phi**2 / (2.0 * compliance), rtol=0.01)


def test_a_flexible_carrier_between_two_bearings_shares_the_tilt(
    flexible_reduction, shaft, stiffened
):
    soft = carrier_on_shaft(flexible_reduction.model, shaft, TILT)
    q_soft, q_stiff = (
        static_answer(one, *PIVOT, BEARING_A, BEARING_B) for one in (soft, stiffened)
    )
    energies = [
        one.imposed.strain_energy(one.model.K, q)
        for one, q in ((soft, q_soft), (stiffened, q_stiff))
    ]
    assert 0.0 < energies[0] < energies[1]
    # The rim feels what the hub bends: far less than the tilt, more than nothing.
    assert 0.005 < np.abs(soft.sensor_readings(q_soft)[:360]).max() / (R * TILT.phi) < 0.3


def test_the_imposed_tilt_loads_the_group_with_nothing_from_outside(group):
    # Forces of the load on all rigid motions of the group: none, or the group would take off by
    # itself.
    modes = geometric_rigid_modes(group.model)
    work = modes.T @ group.imposed.load
    assert np.abs(work).max() < 1e-8 * np.abs(group.imposed.load).max()


def test_the_misalignment_is_linear_and_vanishes_with_the_tilt(flexible_reduction, shaft):
    double = carrier_on_shaft(flexible_reduction.model, shaft, replace(TILT, phi=2.0 * TILT.phi))
    single = carrier_on_shaft(flexible_reduction.model, shaft, TILT)
    none = carrier_on_shaft(flexible_reduction.model, shaft)
    assert_allclose(double.imposed.load, 2.0 * single.imposed.load, rtol=1e-12)
    assert not none.imposed.load.any()
    assert not none.imposed.sensor_offset.any()
    assert (none.model.K == single.model.K).all()


def test_torque_through_the_shaft_deflects_the_rim_as_with_the_carrier_held(
    flexible_reduction, pin_reduction, shaft, gear
):
    forces = gear_forces(1000.0, gear, 3)
    loads = drive_torque_load(forces.F_PLC, forces.M_t, 3)
    with_shaft = rotating_group(flexible_reduction.model, pin_reduction.model, shaft, pin_fit=1e7)
    through_shaft = with_shaft.model.sensor_rows @ static_coordinates(
        with_shaft.model, [COUPLING], loads
    )
    alone = carrier_with_pins(flexible_reduction.model, pin_reduction.model, 1e7)
    carrier_held = alone.sensor_rows @ static_coordinates(alone, ["shaft_face"], loads)
    # The shaft twists and does nothing else, symmetric meshes do not couple: no axial motion is
    # added.
    difference = np.abs(through_shaft - carrier_held)
    assert difference[:360].max() < 1e-8 * np.abs(carrier_held[:360]).max()
    # Nor a radial one, but for the twist of a circle that is none to CIRCLE.
    twist = 1000.0 * SHAFT.length / 50e6
    assert difference[360:].max() < CIRCLE * R * twist


def test_the_group_has_every_physical_pilot_and_all_the_mass(
    group, flexible_reduction, pin_reduction, shaft
):
    planets = [f"pin_{pin}_midspan_of_pin" for pin in (1, 2, 3)]
    assert {COUPLING, MAIN_BEARING, *CARRIER_BEARINGS, *planets} <= set(group.model.pilots)
    assert_allclose(group.model.pilots[MAIN_BEARING], [-2.22, 0.0, 0.0], rtol=0.0, atol=1e-12)
    assert_allclose(group.model.pilots[COUPLING], [-3.44, 0.0, 0.0], rtol=0.0, atol=1e-12)
    for planet, angle in zip(planets, np.deg2rad([0.0, 120.0, 240.0]), strict=True):
        assert_allclose(
            group.model.pilots[planet][1:], 0.308 * radial(angle)[1:], rtol=0.0, atol=1e-12
        )
    bodies = (
        flexible_reduction.model,
        pin_reduction.model,
        pin_reduction.model,
        pin_reduction.model,
        shaft,
    )
    assert_allclose(
        group.model.mass_properties.mass,
        sum(body.mass_properties.mass for body in bodies),
        rtol=1e-12,
    )
    # The joint ties six coordinates, and no other.
    n_alone = carrier_with_pins(flexible_reduction.model, pin_reduction.model).n_coordinates
    assert group.model.n_coordinates == n_alone + shaft.n_coordinates - 6
    assert len(group.model.sensor_names) == 720
    assert (group.imposed.pilot_offset["shaft_face"] == TILT.relative_motion).all()


def test_readings_of_many_states_are_offset_alike(group):
    q = np.random.default_rng(3).standard_normal((group.model.n_coordinates, 2))
    both = group.sensor_readings(q)
    # Readings are sums of terms of order 1, added up in another order for one state than for two.
    assert_allclose(both[:, 1], group.sensor_readings(q[:, 1]), rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"phi": 0.6}, r"phi is 0\.6 rad; expected a small angle, at most 0\.05 rad"),
        ({"theta": math.nan}, "holds a value that is not finite"),
        ({"offset": (0.0, math.inf, 0.0)}, "holds a value that is not finite"),
    ],
)
def test_impossible_misalignments_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        Misalignment(**values)


def test_bodies_that_do_not_meet_are_refused(flexible_reduction, shaft):
    step = np.array([0.01, 0.0, 0.0])
    away = replace(shaft, pilots={name: point + step for name, point in shaft.pilots.items()})
    with pytest.raises(
        ValueError,
        match=r"pilots carrier_joint and shaft_face are 0\.01 m apart; expected one point",
    ):
        carrier_on_shaft(flexible_reduction.model, away)
