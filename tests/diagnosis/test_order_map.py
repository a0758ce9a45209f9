import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.order_map import MAX_ORDER, PATTERNS, order_coefficients, sensor_patterns
from simulation.carrier_kinematics import carrier_tilt_pattern, housing_tilt_pattern, saddle_pattern

SENSORS = np.deg2rad([47.0, 137.0, 227.0, 317.0])


def turning(n_revolutions=3, per_revolution=120, ripple=0.02):
    even = np.arange(n_revolutions * per_revolution) / per_revolution
    angle = 2.0 * np.pi * (even + ripple * np.sin(2.0 * np.pi * even / 1.7) / 6.0)
    number = np.floor(angle / (2.0 * np.pi)).astype(int)
    return angle, [np.flatnonzero(number == k) for k in range(n_revolutions)]


def patterns_of(signal_at):
    """Pattern amplitudes of a signal ``(theta, v) -> s`` on the four sensors."""
    angle, revolutions = turning()
    by_sensor = [order_coefficients(angle, signal_at(angle, v), revolutions) for v in SENSORS]
    return sensor_patterns(np.stack(by_sensor, axis=-1), SENSORS)


def test_amplitudes_are_those_of_the_cosine_series_whatever_the_speed_ripple():
    angle, revolutions = turning()
    amplitudes = {0: 0.3, 1: 1.0 - 2.0j, 7: 0.5j, 12: -0.2}
    signal = sum((value * np.exp(1j * n * angle)).real for n, value in amplitudes.items())
    found = order_coefficients(angle, signal, revolutions)
    expected = np.zeros(MAX_ORDER + 1, dtype=complex)
    expected[list(amplitudes)] = list(amplitudes.values())
    assert_allclose(found, np.tile(expected, (3, 1)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("order", range(1, MAX_ORDER + 1))
def test_waviness_of_the_carrier_lands_in_the_single_pattern_order_mod_4(order):
    cells = patterns_of(lambda theta, v: 3e-6 * np.cos(order * (v - theta) + 0.7))
    expected_m = {0: 0, 1: 1, 2: 2, 3: -1}[order % 4]
    size = np.abs(cells.mean(axis=0))
    assert_allclose(size[order, PATTERNS.index(expected_m)], 3e-6, rtol=1e-9)
    size[order, PATTERNS.index(expected_m)] = 0.0
    assert size.max() < 1e-15


def test_waves_that_stand_the_other_way_round_land_in_another_pattern():
    """A reading at v + theta, the wrong direction of rotation, sends order 1 to m = -1."""
    size = np.abs(patterns_of(lambda theta, v: 1e-6 * np.cos(v + theta)).mean(axis=0))
    assert size[1, PATTERNS.index(-1)] > 0.99e-6
    assert size[1, PATTERNS.index(1)] < 1e-15


def test_carrier_tilt_is_order_1_of_pattern_plus_1():
    size = np.abs(patterns_of(lambda theta, v: 5.8e-4 * carrier_tilt_pattern(theta, v, 0.412, 1.0)).mean(axis=0))
    assert_allclose(size[1, PATTERNS.index(1)], 5.8e-4 * 0.412, rtol=1e-9)
    assert np.delete(size.ravel(), 4 + PATTERNS.index(1)).max() < 1e-15


def test_housing_tilt_and_saddle_are_static_patterns():
    size = np.abs(patterns_of(lambda theta, v: housing_tilt_pattern(theta, v, 1.0, 0.3)).mean(axis=0))
    assert_allclose(size[0, [PATTERNS.index(1), PATTERNS.index(-1)]], 0.5, rtol=1e-9)
    size = np.abs(patterns_of(saddle_pattern).mean(axis=0))
    assert_allclose(size[0, PATTERNS.index(2)], 1.0, rtol=1e-9)


def test_a_sensor_with_a_gain_error_leaks_a_constant_share_into_pattern_2():
    """5 % gain on one sensor: A_2 / A_1 = 0.05/4 / (1 + 0.05/4) = 1.23 %."""
    gains = dict(zip(SENSORS, [1.05, 1.0, 1.0, 1.0], strict=True))
    size = np.abs(patterns_of(lambda theta, v: gains[v] * np.cos(v - theta)).mean(axis=0))
    assert_allclose(size[1, PATTERNS.index(2)] / size[1, PATTERNS.index(1)], 0.0123, atol=5e-5)


def test_mean_square_over_time_and_sensors_is_the_sum_over_the_cells():
    def signal(theta, v):
        return 0.2 + np.cos(3 * theta + v) + 0.5 * np.sin(theta) * np.cos(2 * v) + 0.1 * np.cos(v)

    weight = np.where(np.arange(MAX_ORDER + 1) == 0, 1.0, 0.5)[:, None]
    total = (weight * np.abs(patterns_of(signal).mean(axis=0)) ** 2).sum()
    theta = 2.0 * np.pi * np.arange(360) / 360
    assert_allclose(total, np.mean([np.mean(signal(theta, v) ** 2) for v in SENSORS]), rtol=1e-9)


def test_sequence_of_the_sensors_does_not_matter():
    rng = np.random.default_rng(0)
    values = rng.standard_normal((5, 4)) + 1j * rng.standard_normal((5, 4))
    shuffle = [2, 0, 3, 1]
    assert_allclose(sensor_patterns(values[:, shuffle], SENSORS[shuffle]), sensor_patterns(values, SENSORS), atol=1e-15)


def test_missing_samples_are_absent_and_a_sparse_revolution_is_left_out():
    angle, revolutions = turning()
    signal = np.cos(angle)
    signal[revolutions[0][::4]] = np.nan
    signal[revolutions[1][10:40]] = np.nan
    found = order_coefficients(angle, signal, revolutions)
    assert_allclose(found[[0, 2], 1], 1.0, atol=1e-12)
    assert np.isnan(found[1]).all()
    assert np.isnan(signal[revolutions[0][0]])


@pytest.mark.parametrize("degrees", [[47.0, 137.0, 227.0], [47.0, 137.0, 227.0, 318.0], [0.0, 0.0, 180.0, 270.0]])
def test_sensors_that_are_not_four_at_quarter_turns_are_refused(degrees):
    angles = np.deg2rad(degrees)
    with pytest.raises(ValueError, match=r"axial sensors stand at .* deg; expected four sensors 90 deg apart"):
        sensor_patterns(np.zeros((2, len(degrees)), dtype=complex), angles)
