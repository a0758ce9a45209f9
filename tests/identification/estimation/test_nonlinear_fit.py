"""Bounded fits: known optima, exact derivatives, bounds, nested costs, honest errors."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.estimation.fit_uncertainty import (
    fit_uncertainty,
    profile_likelihood,
)
from carrierflex.identification.estimation.nonlinear_fit import (
    _difference_quotients,
    _one_sided_quotients,
    bounded_fit,
)
from carrierflex.identification.estimation.several_starts import (
    best_of_starts,
    check_nested,
    merged_values,
)
from carrierflex.simulation.fit_parameter import FitParameter
from carrierflex.workflows.executors import SerialExecutor

TIME = np.linspace(0.0, 4.0, 400)
FREE = (FitParameter("a", "m", -10.0, 10.0, 1.0), FitParameter("b", "1/s", 0.0, 50.0, 10.0))


@dataclass(frozen=True, eq=False)
class Decay:
    """``a exp(-b t)`` against a record."""

    measured: np.ndarray

    def __call__(self, values):
        return self.measured - values[0] * np.exp(-values[1] * TIME)


def record(a=2.0, b=1.5, noise=0.0, seed=0, memory=0.0):
    steps = np.random.default_rng(seed).standard_normal(TIME.size)
    for k in range(1, TIME.size):
        steps[k] = memory * steps[k - 1] + np.sqrt(1.0 - memory**2) * steps[k]
    return Decay(a * np.exp(-b * TIME) + noise * steps)


def test_the_truth_comes_back_without_noise_and_every_call_is_counted():
    residuals = record()
    calls = []

    def counting(values):
        calls.append(1)
        return residuals(values)

    fit = bounded_fit(counting, FREE, np.array([1.0, 4.0]))
    assert_allclose(fit.values, [2.0, 1.5], rtol=1e-8)
    assert fit.by_name() == dict(zip(("a", "b"), fit.values.tolist(), strict=True))
    assert fit.model_runs == len(calls)


@pytest.mark.parametrize(
    ("quotients", "order"),
    [
        (lambda f, v, s, lo, up: _difference_quotients(f, v, s, lo, up), 2),
        (lambda f, v, s, lo, up: _one_sided_quotients(f, v, s, up), 1),
    ],
    ids=["central", "one-sided"],
)
def test_derivatives_pass_the_taylor_test(monkeypatch, quotients, order):
    """The error of the quotients against the exact derivative falls with their order."""
    values, scale = np.array([2.0, 1.5]), np.array([1.0, 10.0])
    exact = -np.column_stack([np.exp(-1.5 * TIME), -2.0 * TIME * np.exp(-1.5 * TIME)]) * scale
    errors = []
    for step in (1e-2, 1e-3):
        monkeypatch.setattr("carrierflex.identification.estimation.nonlinear_fit._STEP", step)
        J = quotients(record(), values, scale, np.full(2, -99.0), np.full(2, 99.0))
        errors.append(np.abs(J - exact)[:, 1].max())
    slope = np.log10(errors[0] / errors[1])
    assert order - 0.2 < slope < order + 0.2


@pytest.mark.long
def test_a_minimum_outside_the_bounds_ends_on_the_bound_and_is_said():
    free = (FREE[0], FitParameter("b", "1/s", 2.0, 50.0, 10.0))
    fit = bounded_fit(record(), free, np.array([1.0, 4.0]))
    assert fit.at_bound == ("b",)
    assert fit.values[1] == 2.0
    uncertainty = fit_uncertainty(fit, np.arange(TIME.size) // 20)
    assert uncertainty.undetermined == ("b ended on a bound of its search",)
    # Where the bound is the truth, half of the fits end on it: the interval must not have no width.
    inside = []
    for seed in range(200):
        fit = bounded_fit(record(b=2.0, noise=0.05, seed=seed), free, np.array([1.0, 4.0]))
        uncertainty = fit_uncertainty(fit, np.arange(TIME.size) // 20)
        half = uncertainty.confidence_factor * uncertainty.std
        inside.append(np.append(np.abs(fit.values - 2.0) <= half, fit.at_bound != ()))
        assert half[1] > 0.01
    coverage = np.mean(inside, axis=0)
    assert (coverage[:2] >= 0.9).all()
    assert 0.4 < coverage[2] < 0.6


def test_a_weak_parameter_of_an_unseen_direction_has_no_interval_either():
    """Signals x1, x1 + 0.01 x3 and a small x3: what the first two cannot tell moves the third."""
    x1, x3 = np.sin(TIME), 1e-3 * np.cos(3.0 * TIME)
    free = tuple(FitParameter(name, "m") for name in ("K1", "C0", "Kp"))

    def residuals(values):
        return x1 - values @ np.array([x1, x1 + 10.0 * x3, x3])

    fit = bounded_fit(residuals, free, np.full(3, 0.3))
    uncertainty = fit_uncertainty(fit, np.arange(TIME.size) // 20)
    assert uncertainty.undetermined == (
        "K1 and C0 and Kp cannot be separated: these signals determine fewer combinations of them",
    )
    assert np.isinf(uncertainty.std).all()


def test_the_better_of_two_valleys_is_found_whatever_the_order_of_starts():
    def wave(values):
        return np.sin(3.0 * TIME) - np.sin(values[0] * TIME)

    free = (FitParameter("omega", "rad/s", 0.1, 9.0, 1.0),)
    starts = [np.array([7.0]), np.array([2.8]), np.array([5.0])]
    fit = best_of_starts(wave, free, starts, SerialExecutor(), most=2)
    assert_allclose(fit.values, 3.0, rtol=1e-4)


def test_starts_that_fail_are_passed_over_and_all_failing_is_an_error():
    def failing(values):
        if values[1] > 30.0:
            raise ArithmeticError("diverged")
        return record()(values)

    starts = [np.array([1.0, 40.0]), np.array([1.0, 3.0])]
    assert_allclose(
        best_of_starts(failing, FREE, starts, SerialExecutor(), most=2).values,
        [2.0, 1.5],
        rtol=1e-3,
    )
    with pytest.raises(ValueError, match="no start of 1 gave a fit: diverged"):
        best_of_starts(failing, FREE, starts[:1], SerialExecutor(), most=2)


def test_a_richer_model_that_fits_worse_is_refused():
    check_nested(1.0, 1.0 - 1e-9, ("rich", "simple"))
    with pytest.raises(
        ArithmeticError, match=r"model rich contains simple and costs 1\.1, more than 1;"
    ):
        check_nested(1.1, 1.0, ("rich", "simple"))
    assert_allclose(merged_values(FREE, {"a": 3.0}, {"a": 0.0, "b": 0.0}), [3.0, 0.0])
    with pytest.raises(ValueError, match="no start for parameter b"):
        merged_values(FREE, {"a": 3.0}, {})


@pytest.mark.long
@pytest.mark.parametrize("memory", [0.0, 0.8], ids=["white", "coloured"])
def test_intervals_cover_the_truth_for_white_and_coloured_noise(memory):
    inside, classical = [], []
    for seed in range(200):
        fit = bounded_fit(record(noise=0.05, seed=seed, memory=memory), FREE, np.array([2.0, 1.5]))
        uncertainty = fit_uncertainty(fit, np.arange(TIME.size) // 16)
        half = uncertainty.confidence_factor * uncertainty.std
        inside.append(np.abs(fit.values - [2.0, 1.5]) < half)
        plain = (
            np.sqrt(np.diag(np.linalg.inv(fit.jacobian.T @ fit.jacobian)) * fit.cost / TIME.size)
            * fit.scale
        )
        classical.append(np.abs(fit.values - [2.0, 1.5]) < 1.96 * plain)
    coverage = np.mean(inside, axis=0)
    assert (coverage > 0.88).all(), coverage
    assert (coverage <= 0.99).all(), coverage
    if memory:  # an error bar that takes residuals as independent fails here
        assert (np.mean(classical, axis=0) < 0.7).all()


def test_profile_has_its_foot_at_the_solution_and_rises_on_both_sides():
    residuals = record(noise=0.05)
    fit = bounded_fit(residuals, FREE, np.array([1.0, 4.0]))
    values = fit.values[1] + np.array([-0.2, -0.1, 0.0, 0.1, 0.2])
    cost, points = profile_likelihood(residuals, fit, "b", values)
    assert_allclose(cost[2], fit.cost, rtol=1e-9)
    assert (np.diff(cost[:3]) < 0.0).all()
    assert (np.diff(cost[2:]) > 0.0).all()
    # With a refitted the profile is lower than a cut along b.
    assert (
        cost[[0, 4]]
        < [np.square(residuals(np.array([fit.values[0], b]))).sum() for b in values[[0, 4]]]
    ).all()
    assert_allclose(points[:, 1], values)
    with pytest.raises(ValueError, match="no parameter 'c'; expected one of a, b"):
        profile_likelihood(residuals, fit, "c", [1.0])


def test_what_the_data_cannot_see_is_said():
    def blind(values):
        return 2.0 * np.exp(-TIME) - (values[0] + values[1]) * np.exp(-TIME)

    free = (
        FREE[0],
        FitParameter("b", "m", -10.0, 10.0, 1.0),
        FitParameter("c", "m", -1.0, 1.0, 1.0),
    )
    fit = bounded_fit(blind, free, np.array([0.5, 0.5, 0.0]))
    uncertainty = fit_uncertainty(fit, np.arange(TIME.size) // 20)
    assert uncertainty.undetermined == (
        "c has no influence on these signals",
        "a and b cannot be separated: these signals determine fewer combinations of them",
    )
    assert np.isinf(uncertainty.std).all()


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="no finite signal at the start"):
        bounded_fit(lambda v: np.array([np.nan]), FREE, np.zeros(2))
    with pytest.raises(ValueError, match=r"bounds 1\.0 to 1\.0; expected lower < upper"):
        FitParameter("a", "m", 1.0, 1.0, 1.0)
    with pytest.raises(ValueError, match="2 blocks of residuals; expected at least 3"):
        fit_uncertainty(bounded_fit(record(), FREE, np.ones(2)), np.arange(TIME.size) // 200)
