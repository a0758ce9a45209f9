"""Prior of many machines, values drawn to it, machines that differ, and trends over time."""

import numpy as np
import pytest

from carrierflex.identification.estimation.shrinkage import shrunk_values, trend


def drawn_fleet(rng, n=30, spread=1.0, smallest=0.3, largest=3.0):
    """True values of n machines about 5, their standard deviations and measured values."""
    true = 5.0 + spread * rng.standard_normal(n)
    stds = rng.uniform(smallest, largest, n)
    return true, stds, true + stds * rng.standard_normal(n)


def test_the_prior_is_that_of_the_machines():
    rng = np.random.default_rng(1)
    fleets = [drawn_fleet(rng, n=20) for _ in range(60)]
    priors = [shrunk_values(values, stds) for _, stds, values in fleets]
    # Means of 60 fleets: standard errors 0.05 of the mean and 0.05 of the spread.
    assert abs(np.mean([prior.mean for prior in priors]) - 5.0) < 0.15
    assert abs(np.mean([prior.spread for prior in priors]) - 1.0) < 0.15


@pytest.mark.parametrize("spread", [0.0, 0.5, 2.0])
def test_shrunk_values_are_nearer_and_their_intervals_hold(spread):
    rng = np.random.default_rng(2)
    errors, raw, inside = [], [], []
    for _ in range(120):
        true, stds, values = drawn_fleet(rng, n=12, spread=spread)
        shrunk = shrunk_values(values, stds)
        errors.append(shrunk.values - true)
        raw.append(values - true)
        inside.append(np.abs(shrunk.values - true) < 1.96 * shrunk.stds)
    # Spread 2 against errors up to 3 leaves the least to gain, a fifth.
    assert np.std(errors) < 0.85 * np.std(raw)
    # 1440 intervals, alike within a fleet: 0.95 within 0.02, and conservative without a spread.
    assert 0.93 < np.mean(inside) < 1.0


def test_values_without_errors_stay_and_values_without_a_spread_meet():
    values = np.array([1.0, 2.0, 4.0, 8.0, 3.0])
    exact = shrunk_values(values, np.full(5, 1e-9))
    np.testing.assert_allclose(exact.values, values, rtol=1e-9)
    vague = shrunk_values(values, np.full(5, 1e3))
    assert vague.spread == 0.0
    # (n - 3)/(n - 1) of the way to the mean: a spread of zero is an estimate, too.
    np.testing.assert_allclose(vague.values, 0.5 * (values + values.mean()))


@pytest.mark.long
def test_few_equal_machines_are_called_different_and_one_that_is_far_is_found():
    rng = np.random.default_rng(3)
    p_values, far = [], []
    for _ in range(60):
        _, stds, values = drawn_fleet(rng)
        p_values.extend(shrunk_values(values, stds).p_values)
        stds[0] = 0.5
        values[0] = 5.0 + 6.0
        far.append(shrunk_values(values, stds).p_values[0])
    # 1800 p-values at the level of 5 %: standard error 0.005, more as those of a fleet are alike.
    assert abs(np.mean(np.array(p_values) < 0.05) - 0.05) < 0.02
    assert np.median(far) < 0.05 / 30.0


def test_too_few_machines_are_refused():
    with pytest.raises(ValueError, match="3 machines; expected at least 4"):
        shrunk_values(np.arange(3.0), np.ones(3))
    with pytest.raises(ValueError, match="not finite and positive"):
        shrunk_values(np.arange(5.0), np.array([1.0, 0.0, 1.0, 1.0, 1.0]))


@pytest.mark.long
@pytest.mark.parametrize("scatter", [0.0, 4.0])
def test_a_trend_has_its_slope_and_its_interval_holds(scatter):
    rng = np.random.default_rng(4)
    time = np.array([0.0, 1.0, 2.0, 4.0, 7.0, 8.0])
    inside, real = [], []
    for _ in range(300):
        stds = rng.uniform(0.5, 2.0, 6)
        noise = np.hypot(stds, scatter) * rng.standard_normal(6)
        low, high = trend(time, 3.0 + 2.0 * time + noise, stds).slope_ci95
        inside.append(low < 2.0 < high)
        real.append(trend(time, noise, stds).p_value < 0.05)
    # The wider of two intervals: 0.95 or more; standard error 0.013.
    assert 0.92 < np.mean(inside) <= 1.0
    assert np.mean(real) < 0.07
    assert np.isnan(trend(time, 3.0 + 2.0 * time, np.ones(6)).step_time)
    with pytest.raises(ValueError, match="2 dates; expected at least 3"):
        trend(np.array([0.0, 0.0, 1.0]), np.ones(3), np.ones(3))


@pytest.mark.long
@pytest.mark.parametrize("first", [2, 4, 5])
def test_a_step_of_five_errors_is_dated_and_no_step_is_seen_in_a_drift(first):
    rng = np.random.default_rng(6)
    time, stds = np.arange(6.0), np.full(6, 1.0)
    dated, drifts = [], []
    for _ in range(200):
        noise = rng.standard_normal(6)
        dated.append(trend(time, 5.0 * (time >= first) + noise, stds).step_time == first)
        drifts.append(np.isnan(trend(time, 2.0 * time + noise, stds).step_time))
    assert np.mean(dated) > 0.85
    assert np.mean(drifts) > 0.85


def test_a_drift_that_speeds_up_is_a_change_though_no_line():
    time = np.arange(6.0)
    stds = np.full(6, 0.1)
    noise = 0.1 * np.random.default_rng(3).standard_normal(6)
    grown = trend(time, 10.0 * (time / 5.0) ** 2 + noise, stds)
    assert grown.p_value < 1e-5
    assert np.isnan(grown.step_time)


@pytest.mark.parametrize("unit", [1e-9, 1e6])
def test_units_change_nothing(unit):
    rng = np.random.default_rng(8)
    time, values, stds = np.arange(6.0), 2.0 * rng.standard_normal(6), rng.uniform(0.3, 1.0, 6)
    here, there = trend(time, values, stds), trend(time, unit * values, unit * stds)
    np.testing.assert_allclose(there.slope_ci95, unit * np.array(here.slope_ci95), rtol=1e-8)
    np.testing.assert_allclose(there.p_value, here.p_value, rtol=1e-8)
    prior = shrunk_values(unit * values, unit * stds)
    np.testing.assert_allclose(prior.spread, unit * shrunk_values(values, stds).spread, rtol=1e-8)
    assert prior.spread > 0.0
