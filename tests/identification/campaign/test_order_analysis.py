from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.order_analysis import (
    PATTERNS,
    OrderFit,
    aliased_order,
    highest_order,
    too_sparse,
)
from carrierflex.identification.carrier.sensor_patterns import PATTERN_NAMES, pattern_split
from carrierflex.simulation.carrier.kinematics import (
    carrier_tilt_pattern,
    housing_tilt_pattern,
    saddle_pattern,
)
from tests.diagnosis.carrier.carrier_twin import CHANNELS

MAX_ORDER = highest_order(3)
AXIAL = CHANNELS[:4]


def turning(n_revolutions=3, per_revolution=120, ripple=0.02):
    even = np.arange(n_revolutions * per_revolution) / per_revolution
    angle = 2.0 * np.pi * (even + ripple * np.sin(2.0 * np.pi * even / 1.7) / 6.0)
    return [angle[np.floor(angle / (2.0 * np.pi)).astype(int) == k] for k in range(n_revolutions)]


def patterns_of(signal_at, channels=AXIAL):
    """Pattern amplitudes of a signal ``(theta, v) -> s``.

    By revolution, pattern (as PATTERNS) and order.
    """
    rows = []
    for theta in turning():
        signals = np.array([signal_at(theta, c.angle) for c in channels])
        rows.append(OrderFit(theta, MAX_ORDER).amplitudes(signals)[0].T)
    split = pattern_split(channels, np.array(rows))
    assert split.names == tuple(PATTERN_NAMES[m] for m in PATTERNS)
    return split.amplitudes[..., MAX_ORDER:]


def test_amplitudes_are_those_of_the_cosine_series_whatever_the_speed_ripple():
    amplitudes = {0: 0.3, 1: 1.0 - 2.0j, 7: 0.5j, 12: -0.2}
    expected = np.zeros(MAX_ORDER + 1, dtype=complex)
    expected[list(amplitudes)] = list(amplitudes.values())
    for theta in turning():
        signal = sum((value * np.exp(1j * n * theta)).real for n, value in amplitudes.items())
        result, scatter = OrderFit(theta, MAX_ORDER).amplitudes(np.array([signal, 2.0 * signal]))
        assert_allclose(result.T, [expected, 2.0 * expected], rtol=0, atol=1e-12)
        assert scatter[0] < 1e-20
        assert scatter[1] == theta.size - 25


def test_scatter_about_the_orders_is_the_noise():
    rng = np.random.default_rng(0)
    theta = np.arange(4000) * 2.0 * np.pi / 4000
    square, degrees = OrderFit(theta, MAX_ORDER).amplitudes(
        (np.cos(3.0 * theta) + 0.1 * rng.standard_normal(4000))[None]
    )[1]
    assert_allclose(
        square / degrees, 0.01, rtol=0.07
    )  # three standard deviations of 3975 degrees of freedom


@pytest.mark.parametrize("order", range(1, MAX_ORDER + 1))
def test_waviness_of_the_carrier_lands_in_the_single_pattern_order_mod_4(order):
    size = np.abs(
        patterns_of(lambda theta, v: 3e-6 * np.cos(order * (v - theta) + 0.7)).mean(axis=0)
    )
    pattern = PATTERNS.index({0: 0, 1: 1, 2: 2, 3: -1}[order % 4])
    assert_allclose(size[pattern, order], 3e-6, rtol=1e-9)
    size[pattern, order] = 0.0
    assert size.max() < 1e-15


def test_waves_that_stand_the_other_way_round_land_in_another_pattern():
    """A reading at v + theta, the wrong direction of rotation, sends order 1 to m = -1."""
    size = np.abs(patterns_of(lambda theta, v: 1e-6 * np.cos(v + theta)).mean(axis=0))
    assert size[PATTERNS.index(-1), 1] > 0.99e-6
    assert size[PATTERNS.index(1), 1] < 1e-15


def test_carrier_tilt_is_order_1_of_pattern_plus_1():
    size = np.abs(
        patterns_of(lambda theta, v: 5.8e-4 * carrier_tilt_pattern(theta, v, 0.412, 1.0)).mean(
            axis=0
        )
    )
    assert_allclose(size[PATTERNS.index(1), 1], 5.8e-4 * 0.412, rtol=1e-9)
    size[PATTERNS.index(1), 1] = 0.0
    assert size.max() < 1e-15


def test_housing_tilt_and_saddle_are_static_patterns():
    size = np.abs(
        patterns_of(
            lambda theta, v: housing_tilt_pattern(theta, v, 1.0, 0.3) + np.zeros_like(theta)
        ).mean(axis=0)
    )
    assert_allclose(size[[PATTERNS.index(1), PATTERNS.index(-1)], 0], 0.5, rtol=1e-9)
    size = np.abs(
        patterns_of(lambda theta, v: saddle_pattern(theta, v) + np.zeros_like(theta)).mean(axis=0)
    )
    assert_allclose(size[PATTERNS.index(2), 0], 1.0, rtol=1e-9)


def test_a_sensor_with_a_gain_error_leaks_a_constant_share_into_pattern_2():
    """5 % gain on one sensor: A_2 / A_1 = 0.05/4 / (1 + 0.05/4) = 1.23 %, whatever the order."""
    gains = {
        channel.angle: gain for channel, gain in zip(AXIAL, [1.05, 1.0, 1.0, 1.0], strict=True)
    }
    size = np.abs(
        patterns_of(lambda theta, v: gains[v] * (np.cos(v - theta) + np.cos(5 * (v - theta)))).mean(
            axis=0
        )
    )
    ratio = size[PATTERNS.index(2)] / np.maximum(size[PATTERNS.index(1)], 1e-9)
    assert_allclose(ratio[[1, 5]], 0.0123, atol=5e-5)


def test_mean_square_over_time_and_sensors_is_the_sum_over_the_cells():
    def signal(theta, v):
        return 0.2 + np.cos(3 * theta + v) + 0.5 * np.sin(theta) * np.cos(2 * v) + 0.1 * np.cos(v)

    weight = np.where(np.arange(MAX_ORDER + 1) == 0, 1.0, 0.5)
    total = (weight * np.abs(patterns_of(signal).mean(axis=0)) ** 2).sum()
    theta = 2.0 * np.pi * np.arange(360) / 360
    assert_allclose(
        total, np.mean([np.mean(signal(theta, c.angle) ** 2) for c in AXIAL]), rtol=1e-9
    )


def test_sequence_of_the_sensors_does_not_matter():
    def signal(theta, v):
        return np.cos(theta - v) + 0.3 * np.cos(2 * theta) * np.cos(v) + np.sin(3 * v)

    shuffled = tuple(AXIAL[k] for k in (2, 0, 3, 1))
    assert_allclose(patterns_of(signal, shuffled), patterns_of(signal), atol=1e-14)


@pytest.mark.parametrize(
    "degrees", [[47.0, 137.0, 227.0], [47.0, 137.0, 227.0, 318.0], [0.0, 0.0, 180.0, 270.0]]
)
def test_sensors_that_are_not_four_at_quarter_turns_stand_alone(degrees):
    channels = tuple(
        replace(AXIAL[0], name=f"s{k}", angle=float(np.deg2rad(degree)))
        for k, degree in enumerate(degrees)
    )
    split = pattern_split(channels, np.zeros((2, len(degrees), MAX_ORDER + 1), dtype=complex))
    assert split.names == tuple(channel.name for channel in channels)


def test_a_revolution_with_a_gap_of_half_a_period_of_the_highest_order_is_too_sparse():
    theta = turning(1)[0]
    present = np.ones(theta.size, dtype=bool)
    present[::4] = False
    assert not too_sparse(theta[present], MAX_ORDER)
    present[10:40] = False
    assert too_sparse(theta[present], MAX_ORDER)
    assert too_sparse(theta[:20], MAX_ORDER)


def at_steady_speeds(speeds_hz, order, step=0.05, n=960):
    """Records of one wave at steady speeds, read at even times, with a little noise."""
    rng = np.random.default_rng(4)
    time = step * np.arange(n)
    for speed in speeds_hz:
        angle = 2.0 * np.pi * speed * time
        yield np.cos(order * angle)[:, None] + 0.3 * rng.standard_normal((n, 2)), angle


@pytest.mark.parametrize("order", [99, 63])
def test_an_order_that_is_read_too_seldom_is_found_at_two_speeds(order):
    assert aliased_order(at_steady_speeds([0.366, 0.24], order)) == order


@pytest.mark.parametrize(
    ("speeds_hz", "order"), [([0.366, 0.24], 4.3), ([0.366, 0.24], 12), ([0.366, 0.366], 99)]
)
def test_what_may_be_a_slow_motion_is_no_order_read_too_seldom(speeds_hz, order):
    assert aliased_order(at_steady_speeds(speeds_hz, order)) == 0
