"""Gear forces of the paper, and the direction of every load.

By vector algebra of the tooth forces.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.load_cases import (
    bonded_pin_load,
    gear_forces,
    radial,
    simply_supported_pin_load,
    standard_tilting_moment,
    tangential,
    together,
)
from carrierflex.fe.structural_model import carrier_pilot_points

X = np.array([1.0, 0.0, 0.0])
PINS = (1, 2, 3)


def resultant(loads, points, about):
    force, moment = np.zeros(3), np.zeros(3)
    for name, load in loads.items():
        force += load[:3]
        moment += load[3:] + np.cross(points[name] - about, load[:3])
    return np.concatenate([force, moment])


def test_forces_of_1_kn_m_are_those_of_the_paper(gear):
    forces = gear_forces(1000.0, gear, 3)
    assert_allclose(forces.F_PLC, 1000.0 / (3.0 * 0.308), rtol=1e-12)
    assert_allclose(forces.F_t, 541.13, rtol=1e-5)  # five printed digits, the four below too
    assert_allclose(forces.F_n, 575.85, rtol=1e-5)
    assert_allclose(forces.F_a, 75.813, rtol=1e-5)
    # The paper prints 30.3 (30.36 cut, not rounded) and uses eq. (5); the usual axial force gives 6
    # % less.
    assert_allclose(forces.M_t, 30.36, rtol=0.0, atol=5e-3)
    assert_allclose(standard_tilting_moment(1000.0, gear, 3), 28.5, rtol=0.0, atol=5e-2)


def test_forces_are_proportional_to_torque_and_change_sign_with_it(gear):
    one, other = gear_forces(1000.0, gear, 3), gear_forces(-3000.0, gear, 3)
    for name in ("F_PLC", "F_t", "F_n", "F_a", "M_t"):
        assert_allclose(getattr(other, name), -3.0 * getattr(one, name), rtol=1e-14)


def test_unit_vectors_follow_the_projects_angles():
    v = np.deg2rad(30.0)
    assert_allclose(radial(v), [0.0, -0.5, math.sqrt(0.75)], rtol=1e-14)
    assert_allclose(tangential(v), np.cross(X, radial(v)), rtol=0.0, atol=1e-16)
    assert_allclose((radial(v + 1e-6) - radial(v)) / 1e-6, tangential(v), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("torque", [1000.0, -250.0])
def test_pin_loads_balance_the_drive_torque(torque, carrier, gear):
    forces, points = gear_forces(torque, gear, 3), carrier_pilot_points(carrier)
    loads = together(*(bonded_pin_load(pin, forces.F_PLC, forces.M_t, 3) for pin in PINS))
    total = resultant(loads, points, np.zeros(3))
    # A positive torque drives the carrier, the planets hold it back: -T about x, and nothing else.
    assert_allclose(total, [0.0, 0.0, 0.0, -torque, 0.0, 0.0], rtol=0.0, atol=1e-12 * abs(torque))


@pytest.mark.parametrize("pin", PINS)
@pytest.mark.parametrize("about", [np.zeros(3), np.array([0.7, -0.2, 0.4])])
def test_a_simply_supported_pin_hands_over_the_load_of_a_bonded_one(pin, about, carrier):
    points = carrier_pilot_points(carrier)
    bonded = bonded_pin_load(pin, 900.0, 30.0, 3)
    supported = simply_supported_pin_load(pin, 900.0, 30.0, carrier)
    assert_allclose(
        resultant(supported, points, about), resultant(bonded, points, about), rtol=0.0, atol=1e-10
    )
    # A simply supported end cannot take a moment.
    assert all((load[3:] == 0.0).all() for load in supported.values())


def test_a_simply_supported_pin_loads_the_nearer_bore_more(carrier):
    x1 = 0.0325
    x2 = 0.3275
    x_m = 0.185
    assert_allclose(carrier.pin_stations[1], x_m, rtol=1e-14)
    supported = simply_supported_pin_load(1, 1000.0, 0.0, carrier)
    share = {name: -load[:3] @ tangential(0.0) / 1000.0 for name, load in supported.items()}
    expected = {"pin_1_upwind": (x2 - x_m) / (x2 - x1), "pin_1_downwind": (x_m - x1) / (x2 - x1)}
    assert share == pytest.approx(expected, rel=1e-12)


def tooth_direction(hand, position):
    """Tangent of a helix of the hand (+1 right) through a point of the planet's pitch circle.

    By finite differences.
    """
    r = np.linalg.norm(position)

    def point(x):
        # A right-handed helix turns about +x while it advances along +x.
        turn = hand * x * math.tan(math.radians(7.5)) / r
        return x * X + math.cos(turn) * position + math.sin(turn) * np.cross(X, position)

    step = 1e-6 * r
    return (point(step) - point(-step)) / (2.0 * step)


@pytest.mark.parametrize("pin", PINS)
def test_helix_moment_is_the_moment_of_the_two_tooth_forces_on_a_left_handed_planet(pin, gear):
    angle = 2.0 * math.pi * (pin - 1) / 3.0
    e, t = radial(angle), tangential(angle)
    forces, r = gear_forces(1000.0, gear, 3), gear.planet_pitch_diameter / 2.0
    force, moment = np.zeros(3), np.zeros(3)
    for position in (-r * e, r * e):  # the sun's contact, the ring's
        # Both meshes hold the planet back; a tooth force has no component along its tooth.
        tooth = tooth_direction(-1, position)
        tooth_force = -forces.F_t * t
        tooth_force = tooth_force - (tooth_force @ tooth) / (X @ tooth) * X
        force += tooth_force
        moment += np.cross(position, tooth_force)
    load = bonded_pin_load(pin, forces.F_PLC, forces.M_t, 3)[f"pin_{pin}_midspan"]
    assert_allclose(force, load[:3], rtol=0.0, atol=1e-6 * forces.F_PLC)
    # F_t tan(beta) here; the paper's eq. (5) divides by cos(alpha), which its M_t keeps.
    expected = load[3:] * math.cos(gear.pressure_angle)
    assert_allclose(moment, expected, rtol=0.0, atol=1e-6 * forces.M_t)


def test_loads_on_one_pilot_add_up_and_leave_their_parts_unchanged():
    one, two = bonded_pin_load(1, 100.0, 0.0, 3), bonded_pin_load(1, 50.0, 3.0, 3)
    total = together(one, two, bonded_pin_load(2, 1.0, 0.0, 3))
    assert set(total) == {"pin_1_midspan", "pin_2_midspan"}
    assert_allclose(
        total["pin_1_midspan"], bonded_pin_load(1, 150.0, 3.0, 3)["pin_1_midspan"], rtol=1e-14
    )
    assert_allclose(
        one["pin_1_midspan"], bonded_pin_load(1, 100.0, 0.0, 3)["pin_1_midspan"], rtol=0.0, atol=0.0
    )
