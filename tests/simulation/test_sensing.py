import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.sensing import SensorError, delayed, delayed_angle


def error_of_a_delayed_sine(samples_per_period):
    """Largest error over delays of parts of a sample, off the ends, for amplitude 1."""
    time = np.arange(40 * samples_per_period) / samples_per_period
    inside = slice(5 * samples_per_period, -5 * samples_per_period)
    errors = []
    for share in (0.25, 0.5, 0.8):
        delay = share / samples_per_period
        read = delayed(time, np.sin(2.0 * np.pi * time + 0.3), delay)
        truth = np.sin(2.0 * np.pi * (time - delay) + 0.3)
        errors.append(np.abs(read - truth)[inside].max())
    return max(errors)


@pytest.mark.parametrize(("samples", "error"), [(5, 1.5e-2), (10, 2.7e-4), (20, 4.6e-6)])
def test_a_delayed_sine_is_recovered_to_the_stated_error(samples, error):
    assert_allclose(error_of_a_delayed_sine(samples), error, rtol=0.05)


def test_delay_is_of_order_six():
    samples = np.array([10, 20, 40])
    errors = [error_of_a_delayed_sine(n) for n in samples]
    order = -np.polyfit(np.log(samples), np.log(errors), 1)[0]
    assert 5.7 < order < 6.2


def test_a_polynomial_of_degree_five_is_delayed_exactly_on_uneven_times():
    time = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 40))
    scaled = time / time[-1]
    polynomial = np.poly1d([1.0, -2.0, 0.5, 3.0, -1.0, 0.2])
    delay = 0.37
    inside = (time - delay > time[0]) & (time - delay < time[-1])
    read = delayed(time, polynomial(scaled), delay)
    assert_allclose(read[inside], polynomial((time - delay) / time[-1])[inside], atol=1e-12)


@pytest.mark.parametrize("delay", [0.13, -0.13])
def test_a_signal_is_held_and_an_angle_turns_on_beyond_the_record(delay):
    time = np.linspace(0.0, 2.0, 41)
    signal = delayed(time, 2.0 * time, delay)
    assert_allclose(signal, 2.0 * np.clip(time - delay, 0.0, 2.0), atol=1e-12)
    assert_allclose(delayed_angle(time, 2.0 * time, delay), 2.0 * (time - delay), atol=1e-12)


def test_signals_side_by_side_are_delayed_as_one_by_one():
    time = np.arange(30) * 0.1
    signals = np.random.default_rng(2).standard_normal((30, 3))
    both = delayed(time, signals, 0.04)
    for column in range(3):
        assert_allclose(both[:, column], delayed(time, signals[:, column], 0.04), rtol=1e-14)


@pytest.mark.parametrize("delay", [0.013, -0.027, 0.5, -40.0])
def test_a_long_record_is_delayed_as_its_stretches_are(delay):
    # A record on an even grid takes one set of weights, one with a longer step a set each.
    time = 7.0 + 0.02 * np.arange(6000)
    signals = np.random.default_rng(3).standard_normal((6000, 2))
    signals[2000, 1] = np.nan
    at_once = delayed(time, signals, delay)
    for first in range(0, 4000, 1500):
        stretch = slice(first, first + 3000)
        uneven = time[stretch].copy()
        uneven[0 if first else -1] += -0.001 if first else 0.001
        read = delayed(uneven, signals[stretch], delay)
        inside = slice(0 if delay > 0.0 and first == 0 else 2100, None if first == 3000 else 900)
        assert_allclose(read[inside], at_once[stretch][inside], rtol=1e-9, atol=1e-10)


def test_a_missing_sample_spoils_its_neighbours_only():
    time = np.arange(40.0)
    values = np.sin(0.3 * time)
    missing = values.copy()
    missing[20] = np.nan
    differs = np.flatnonzero(~np.isclose(delayed(time, missing, 0.4), delayed(time, values, 0.4)))
    assert_allclose(differs, np.arange(18, 24))


def test_gain_acts_before_the_zero():
    reading = SensorError(gain=0.2, zero=1e-4).reading(np.array([1e-3, -1e-3]))
    assert_allclose(reading, [1.3e-3, -1.1e-3], rtol=1e-12)
