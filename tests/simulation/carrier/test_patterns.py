from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.effects.library import CLEARANCE_ROCKING
from carrierflex.simulation.carrier.patterns import (
    closing_torque,
    drift_patterns,
    face_waves_pattern,
    load_shift_pattern,
    load_tilt_pattern,
    load_turned_shares,
    pin_radius_of,
    saturated_load,
    uneven_pins_pattern,
)
from carrierflex.simulation.carrier.rim import CarrierRig, RimSensor, inputs_of_columns
from carrierflex.workflows.fe.default_curves import default_curves

CURVES = default_curves()
RIG = CarrierRig(360e3, 3, 0.308, CURVES)
ANGLE = np.linspace(0.0, 2.0 * np.pi, 50)


def test_equal_pin_loads_give_the_curve_under_torque():
    radius = pin_radius_of(CURVES["delta_f"], CURVES["g_f"], 3)
    torque = np.full(50, 2e5)
    curve = uneven_pins_pattern(ANGLE, 0.8, torque, np.ones(3), g=CURVES["g_f"], pin_radius=radius)
    expected = CURVES["delta_f"].axial_at(0.8 - ANGLE) * 200.0
    # The mesh does not repeat from pin to pin, so that the curve of pin 1, turned, misses the
    # others' by a per cent.
    assert_allclose(curve, expected, atol=0.015 * np.abs(expected).max())
    assert_allclose(radius, 0.308, rtol=0.01)


def test_a_pin_curve_without_the_shape_of_the_torque_curve_is_refused():
    flat = replace(CURVES["g_f"], axial=np.zeros(360))
    with pytest.raises(ValueError, match="expected the shape of delta_f"):
        pin_radius_of(CURVES["delta_f"], flat, 3)


def test_shares_that_turn_through_the_load_sum_to_zero_and_are_largest_at_the_pin_along_the_load():
    radial, tangential = load_turned_shares(ANGLE, np.zeros(50), np.full(50, 2.0), 3)
    assert_allclose(radial.sum(axis=0), 0.0, atol=1e-12)
    assert_allclose(tangential.sum(axis=0), 0.0, atol=1e-12)
    # At carrier angle 0 pin 1 stands at +z, where the load points.
    assert_allclose(radial[0, 0], 2.0, rtol=1e-12)
    assert_allclose(tangential[0, 0], 0.0, atol=1e-12)


def test_clearance_closes_at_its_threshold_for_both_signs_of_torque():
    assert_allclose(closing_torque(np.array([-3.0, -1.0, 0.5, 4.0]), 2.0), [-1.0, 0.0, 0.0, 2.0])


def test_load_in_a_clearance_keeps_its_direction_and_saturates():
    y, z = saturated_load(np.array([3e9, 3.0]), np.array([4e9, 4.0]), 5.0, 0.0)
    assert_allclose(y, [0.6, 0.6 / np.sqrt(2.0)], rtol=1e-9)
    assert_allclose(z, [0.8, 0.8 / np.sqrt(2.0)], rtol=1e-9)


def test_weight_holds_a_bearing_until_the_load_outweighs_it_and_counts_from_rest():
    sharp = 1e-6
    y, z = saturated_load(np.zeros(4), np.array([0.0, -0.9, -1.1, 5.0]), sharp, 1.0)
    assert_allclose(y, 0.0)
    # Nothing moves until the load turns over: then the whole clearance, from one side to the other.
    assert_allclose(z, [0.0, 0.0, -2.0, 0.0], atol=1e-9)
    # Across the weight the bearing follows the sum of both.
    y, z = saturated_load(np.ones(1), np.zeros(1), sharp, 1.0)
    assert_allclose((y, z), [[np.sqrt(0.5)], [np.sqrt(0.5) - 1.0]], rtol=1e-9)


def test_two_bearings_held_apart_answer_alike_to_both_signs_of_the_load():
    sensor = RimSensor(0.0, 0.4, True)
    loads = np.array([1e6, -1e6, 1.0, -3e3])
    record = {"carrier_angle": np.zeros(4), "ntl_y": np.zeros(4), "ntl_z": loads}
    tilt, shift = CLEARANCE_ROCKING.signals(sensor, inputs_of_columns(record), RIG, 1e3, 9e3)
    at_rest = 1.0 / np.hypot(1.0, 0.2)
    # Little moves nothing; between the two weights only the lightly loaded bearing turns round.
    assert_allclose(tilt, -0.4 * at_rest * np.array([1.0, 1.0, 0.0, 1.0]), atol=4e-3)
    assert not shift.any()


def test_a_load_along_y_moves_the_sensor_at_minus_quarter_turn():
    # e(v) = (0, -sin v, cos v): +y stands at v = -90 deg.
    one = np.ones(1)
    assert_allclose(load_tilt_pattern(-np.pi / 2.0, 0.4, one, 0.0 * one), 0.4)
    assert_allclose(load_shift_pattern(-np.pi / 2.0, one, 0.0 * one), 1.0)
    assert_allclose(load_shift_pattern(0.0, one, 0.0 * one), 0.0, atol=1e-15)


def test_waves_of_the_face_turn_with_the_carrier():
    first = face_waves_pattern(np.array([0.3]), 1.0, 4)
    second = face_waves_pattern(np.array([0.8]), 1.5, 4)
    assert_allclose(first, second, rtol=1e-12)


def test_drift_has_no_mean():
    time = np.linspace(10.0, 40.0, 20001)
    for pattern in drift_patterns(time, 10.0, 40.0):
        assert abs(np.trapezoid(pattern, time)) < 1e-6
