"""Bounded Gauss-Newton search on problems with known minima."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from carrierflex.identification.estimation.gauss_newton import (
    Bounds,
    CostSearch,
    CostSums,
    StopRule,
    bounded_step,
)

FREE = np.ones(2, dtype=bool)
WIDE = Bounds(np.full(2, -10.0), np.full(2, 10.0))


@dataclass
class Model:
    """Residuals of a model with their derivatives, answering in sums; counts its calls."""

    residuals: object
    derivatives: object
    n_sums: int = 0

    def cost(self, theta):
        return float(np.square(self.residuals(theta)).sum())

    def sums(self, theta):
        self.n_sums += 1
        residual = self.residuals(theta)
        J = self.derivatives(theta)
        return CostSums(float(residual @ residual), J.T @ J, -J.T @ residual, theta.copy())

    def least(self, start, stop):
        start = np.asarray(start, dtype=np.float64)
        search = CostSearch(self.sums, self.cost, WIDE, FREE, stop)
        return search.least((start, self.sums(start)))

    def minimised(self, start, *, bounds=WIDE, free=FREE, stop=StopRule()):  # noqa: B008
        start = np.asarray(start, dtype=np.float64)
        first = self.sums(start)
        search = CostSearch(self.sums, self.cost, bounds, free, stop)
        return search.minimised((start, first))


def rosenbrock():
    """Valley of Rosenbrock (1960): residuals 10 (y - x²) and 1 - x, minimum at (1, 1)."""
    return Model(
        lambda v: np.array([10.0 * (v[1] - v[0] ** 2), 1.0 - v[0]]),
        lambda v: np.array([[-20.0 * v[0], 10.0], [-1.0, 0.0]]),
    )


def linear(design, target):
    return Model(lambda v: design @ v - target, lambda v: design)


def test_the_minimum_of_a_curved_valley_is_found():
    theta, reached = rosenbrock().minimised([-1.2, 1.0], stop=StopRule(promise=1e-20))
    assert_allclose(theta, [1.0, 1.0], atol=1e-9)
    assert reached.cost < 1e-18
    assert_array_equal(reached.detail, theta)


def test_one_step_solves_a_linear_problem_whatever_the_units_of_its_columns():
    design = np.array([[1.0, 2e9], [3.0, -1e9], [0.5, 4e9]])
    truth = np.array([2.0, 3e-9])
    model = linear(design, design @ truth)
    theta, _ = model.minimised([0.0, 0.0], stop=StopRule(most_steps=1))
    assert_allclose(theta, truth, rtol=1e-5)  # the first damping is 1e-6


def test_a_parameter_that_leaves_its_bounds_stays_there_and_the_others_follow():
    # Minimum of (x - 3)² + (x + y - 3)² under x <= 1 is y = 2, not the y = 0 of the free minimum.
    model = linear(np.array([[1.0, 0.0], [1.0, 1.0]]), np.array([3.0, 3.0]))
    bounds = Bounds(np.array([-10.0, -10.0]), np.array([1.0, 10.0]))
    step = bounded_step(
        model.sums(np.zeros(2)), np.zeros(2), bounds=bounds, free=FREE, damping=1e-12
    )
    assert_allclose(step, [1.0, 2.0])
    theta, _ = model.minimised([0.0, 0.0], bounds=bounds)
    assert_allclose(theta, [1.0, 2.0], rtol=1e-5)
    assert_array_equal(bounds.hits(theta, np.full(2, 1e-6)), [True, False])


def test_a_fixed_parameter_does_not_move():
    model = linear(np.eye(2), np.array([3.0, 4.0]))
    theta, _ = model.minimised([1.0, 1.0], free=np.array([False, True]))
    assert_allclose(theta, [1.0, 4.0], rtol=1e-5)


def test_parameters_of_equal_influence_share_what_the_data_ask():
    model = linear(np.ones((5, 2)), np.full(5, 4.0))
    theta, reached = model.minimised([0.0, 0.0])
    assert_allclose(theta, [2.0, 2.0], rtol=1e-5)
    assert reached.cost < 1e-9


def test_a_parameter_without_influence_stays():
    model = linear(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([1.0, 2.0]))
    theta, _ = model.minimised([0.0, 7.0])
    assert_allclose(theta, [1.0, 7.0], rtol=1e-5)


def test_the_search_steps_back_from_where_the_model_fails():
    model = rosenbrock()
    cost = model.cost
    model.cost = lambda v: np.nan if abs(v[1] - v[0] ** 2) > 3.0 else cost(v)
    theta, _ = model.minimised([-1.2, 1.0], stop=StopRule(promise=1e-20))
    assert_allclose(theta, [1.0, 1.0], atol=1e-8)


def test_the_cost_never_rises():
    costs = [
        rosenbrock().minimised([-1.2, 1.0], stop=StopRule(most_steps=n))[1].cost for n in range(12)
    ]
    assert (np.diff(costs) <= 0.0).all()


@pytest.mark.parametrize(
    ("gain", "noise_square", "is_slow"),
    [(2e-5, 1.0, True), (4e-5, 1.0, False), (4e-5, 0.5, True), (2e-3, 0.5, False)],
)
def test_far_above_the_noise_a_step_has_to_gain_more(gain, noise_square, is_slow):
    stop = replace(StopRule(), noise_square=noise_square)
    assert stop.is_slow(1.0, 1.0 - gain) is is_slow


def test_slow_steps_end_the_search():
    # Residuals 1 and v³: every step takes a third of v, so that the gain falls without an end.
    model = Model(
        lambda v: np.array([1.0, v[0] ** 3]), lambda v: np.array([[0.0], [3 * v[0] ** 2]])
    )
    bounds = Bounds(np.array([-9.0]), np.array([9.0]))
    free = np.ones(1, dtype=bool)
    patient = StopRule(promise=0.0, slow_gain_far=0.0)
    model.minimised([0.5], bounds=bounds, free=free, stop=replace(patient, slow_gain_far=1e-3))
    n_impatient = model.n_sums
    model.minimised([0.5], bounds=bounds, free=free, stop=patient)
    assert n_impatient < 10
    assert model.n_sums - n_impatient > 2 * n_impatient


def test_a_step_that_meets_several_bounds_holds_only_those_that_it_has_to():
    """Two columns that are nearly one: free, both run out of their bounds to opposite sides."""
    J = np.array([[1.0, 0.99], [0.0, 0.05]])
    target = J @ np.array([0.5, 0.0]) + np.array([0.0, 0.6])
    sums = CostSums(float(target @ target), J.T @ J, J.T @ target, None)
    bounds = Bounds(np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    step = bounded_step(sums, np.zeros(2), bounds=bounds, free=FREE, damping=0.0)
    grid = np.linspace(-1.0, 1.0, 2001)
    x, y = np.meshgrid(grid, grid)
    cost = sum((row[0] * x + row[1] * y - t) ** 2 for row, t in zip(J, target, strict=True))
    index = np.unravel_index(np.argmin(cost), cost.shape)
    assert_allclose(step, [x[index], y[index]], atol=2e-3)


def test_the_least_cost_is_that_of_the_minimum_also_in_a_curved_valley():
    theta, cost = rosenbrock().least([-1.2, 1.0], StopRule(promise=1e-20))
    assert_allclose(theta, [1.0, 1.0], atol=1e-3)
    assert cost < 1e-6


def test_a_search_without_sums_beside_its_minimum_makes_none():
    design = np.random.default_rng(4).standard_normal((30, 2))
    target = design @ [0.5, -2.0] + np.random.default_rng(5).standard_normal(30)
    model = linear(design, target)
    theta, cost = model.least([0.4, -1.9], StopRule())
    expected, square, *_ = np.linalg.lstsq(design, target, rcond=None)
    assert_allclose(theta, expected, rtol=1e-5)
    assert_allclose(cost, square[0], rtol=1e-9)
    assert model.n_sums == 1


def test_an_undamped_step_that_keeps_no_promise_does_not_end_a_search_without_sums():
    # exp(v) = 1 with a residual that stays: Newton's steps from v = 2 are not damped.
    model = Model(
        lambda v: np.array([np.exp(v[0]) - 1.0, v[1], 1.0]),
        lambda v: np.array([[np.exp(v[0]), 0.0], [0.0, 1.0], [0.0, 0.0]]),
    )
    theta, cost = model.least([2.0, 0.0], StopRule())
    assert_allclose(theta, [0.0, 0.0], atol=1e-2)
    assert_allclose(cost, 1.0, rtol=1e-3)
