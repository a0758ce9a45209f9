"""Every pattern against vector algebra that shares nothing with it.

Rotation matrices and cross products.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.kinematics import (
    axial_deflection_pattern,
    carrier_tilt_pattern,
    housing_tilt_pattern,
    offset_pattern,
    radial_deflection_pattern,
    saddle_pattern,
)
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

RADIUS = 0.412
SENSORS = np.deg2rad([47.0, 137.0, 227.0, 317.0, 40.0])
CARRIER_ANGLES = np.deg2rad([0.0, 10.0, 75.0, 200.0, 359.0, 1000.0])


def rotation_about(axis, angle):
    """Right-handed rotation matrix (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def unit_vector(angle):
    """z turned about x by the angle."""
    return rotation_about([1.0, 0.0, 0.0], angle) @ np.array([0.0, 0.0, 1.0])


def material_angle_under(sensor_angle, carrier_angle):
    """Carrier-frame angle of the point that the turning carrier brings under the sensor: search."""
    candidates = np.deg2rad(np.arange(0.0, 360.0, 0.5))
    turned = rotation_about([1.0, 0.0, 0.0], carrier_angle)
    distance = [
        np.linalg.norm(turned @ unit_vector(a) - unit_vector(sensor_angle)) for a in candidates
    ]
    assert min(distance) < 1e-6
    return candidates[int(np.argmin(distance))]


def test_unit_vector_is_that_of_the_geometry_convention():
    v = 0.7
    assert_allclose(unit_vector(v), [0.0, -np.sin(v), np.cos(v)], atol=1e-15)


@pytest.mark.parametrize("sensor_angle", SENSORS)
@pytest.mark.parametrize("tilt_axis", [0.0, 0.4, np.pi / 2, 4.0])
def test_housing_tilt_is_a_negative_rotation_about_its_axis(sensor_angle, tilt_axis):
    small = 1e-6
    point = RADIUS * unit_vector(sensor_angle)
    moved = rotation_about(unit_vector(tilt_axis), -small) @ point
    expected = (moved - point)[0] / small
    result = housing_tilt_pattern(CARRIER_ANGLES, sensor_angle, RADIUS, tilt_axis)
    assert_allclose(result, expected, rtol=0, atol=1e-6 * RADIUS)
    assert_allclose(expected, -np.cross(unit_vector(tilt_axis), point)[0], atol=1e-6)


@pytest.mark.parametrize("sensor_angle", SENSORS)
@pytest.mark.parametrize("tilt_axis", [0.0, 1.0, 5.0])
def test_carrier_tilt_axis_turns_with_the_carrier(sensor_angle, tilt_axis):
    point = RADIUS * unit_vector(sensor_angle)
    for angle in CARRIER_ANGLES:
        axis = rotation_about([1.0, 0.0, 0.0], angle) @ unit_vector(tilt_axis)
        expected = -np.cross(axis, point)[0]
        result = carrier_tilt_pattern(np.array([angle]), sensor_angle, RADIUS, tilt_axis)
        assert_allclose(result, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("curve", [flexible_curve(), stiff_curve()])
@pytest.mark.parametrize("sensor_angle", SENSORS)
def test_deflection_is_that_of_the_material_point_under_the_sensor(curve, sensor_angle):
    for angle in CARRIER_ANGLES:
        material = material_angle_under(sensor_angle, angle)
        torque = np.array([250e3])
        expected = 250.0 * curve.axial_at(material)  # unit load 1 kN m
        result = axial_deflection_pattern(np.array([angle]), sensor_angle, torque, curve)
        assert_allclose(result, expected, rtol=0, atol=1e-10)
        expected = 250.0 * curve.radial_at(material)
        result = radial_deflection_pattern(np.array([angle]), sensor_angle, torque, curve)
        assert_allclose(result, expected, rtol=0, atol=1e-10)


def test_positive_rotation_carries_the_deflection_from_47_to_137_degrees():
    angle, torque = np.linspace(0.0, 6.0, 50), np.full(50, 360e3)
    at_47 = axial_deflection_pattern(angle, np.deg2rad(47.0), torque, flexible_curve())
    at_137 = axial_deflection_pattern(
        angle + np.pi / 2, np.deg2rad(137.0), torque, flexible_curve()
    )
    assert_allclose(at_137, at_47, rtol=0, atol=1e-16)
    opposite = axial_deflection_pattern(
        angle - np.pi / 2, np.deg2rad(137.0), torque, flexible_curve()
    )
    assert np.abs(opposite - at_47).max() > 1e-5


def test_the_papers_argument_turns_an_odd_curve_over():
    curve = flexible_curve()
    v = 0.82
    angle = np.linspace(0.0, 7.0, 40)
    paper = curve.axial_at(angle - v)  # equation (8) with theta_rho = 0
    ours = axial_deflection_pattern(angle, v, np.full(40, 1000.0), curve)
    assert_allclose(ours, -paper, rtol=0, atol=1e-18)


def test_pin_angle_moves_the_curve_with_the_pin():
    curve, shift = flexible_curve(), 0.3
    at_pin = axial_deflection_pattern(
        np.array([0.0]), shift, np.array([1e3]), curve, pin_angle=shift
    )
    assert_allclose(at_pin, curve.axial_at(0.0), rtol=0, atol=1e-18)


def test_saddle_alternates_over_the_four_axial_sensors_and_is_orthogonal_to_offset_and_tilt():
    theta = np.zeros(1)
    saddle = np.array([saddle_pattern(theta, v)[0] for v in SENSORS[:4]])
    assert_allclose(saddle, [1.0, -1.0, 1.0, -1.0], rtol=0, atol=1e-14)
    for axis in (0.0, np.pi / 2):
        tilt = np.array([housing_tilt_pattern(theta, v, RADIUS, axis)[0] for v in SENSORS[:4]])
        assert abs(saddle @ tilt) < 1e-14
    assert abs(saddle.sum()) < 1e-14


def test_offset_is_the_same_everywhere():
    assert_allclose(offset_pattern(CARRIER_ANGLES), 1.0)
