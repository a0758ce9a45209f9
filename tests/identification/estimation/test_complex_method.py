"""The direct search finds known optima, keeps to its bounds and counts its calls."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.carrier.models import flexible_model, rigid_model
from carrierflex.identification.estimation.complex_method import complex_search
from carrierflex.identification.estimation.least_squares import joint_fit
from carrierflex.identification.estimation.normal_equations import normal_equations
from tests.identification.synthetic_campaigns import carrier_campaign
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve


def _rng():
    return np.random.default_rng(5)


def test_the_bottom_of_a_tilted_bowl_is_found():
    matrix = np.array([[4.0, 1.0], [1.0, 2.0]])
    bottom = np.array([0.3, -0.7])
    search = complex_search(
        lambda p: 1.0 + (p - bottom) @ matrix @ (p - bottom),
        np.full(2, -2.0),
        np.full(2, 3.0),
        rng=_rng(),
    )
    assert search.converged
    assert_allclose(search.values, bottom, atol=1e-4)


def test_boxs_own_problem_ends_at_its_constraint():
    """Without its bounds the optimum lies outside.

    The search ends on the bound, never beyond it.
    """
    evaluated = []

    def cost(point):
        evaluated.append(point.copy())
        return float((point[0] - 5.0) ** 2 + (point[1] - 0.5) ** 2)

    search = complex_search(cost, np.zeros(2), np.ones(2), rng=_rng())
    assert_allclose(search.values, [1.0, 0.5], atol=1e-3)
    assert (np.array(evaluated) >= 0.0).all()
    assert (np.array(evaluated) <= 1.0).all()
    assert search.evaluations == len(evaluated)


def test_rosenbrocks_valley_takes_many_calls():
    search = complex_search(
        lambda p: 100.0 * (p[1] - p[0] ** 2) ** 2 + (1.0 - p[0]) ** 2 + 1.0,
        np.full(2, -2.0), np.full(2, 2.0), rng=_rng(), tolerance=1e-8,
    )  # fmt: skip
    assert_allclose(search.values, 1.0, atol=0.05)
    assert search.evaluations > 100


def test_the_search_ends_when_the_calls_run_out_and_says_so():
    search = complex_search(
        lambda p: float(p @ p), np.full(6, -1.0), np.full(6, 2.0), rng=_rng(), max_evaluations=40
    )
    assert not search.converged
    assert 40 <= search.evaluations <= 40 + 21


def test_a_model_that_fails_somewhere_is_the_worst_there():
    search = complex_search(
        lambda p: np.nan if p[0] < 0.0 else float((p[0] - 0.5) ** 2 + 1.0),
        np.full(1, -1.0),
        np.ones(1),
        rng=_rng(),
    )
    assert_allclose(search.values, 0.5, atol=1e-2)


def test_bad_bounds_are_refused():
    with pytest.raises(ValueError, match=r"parameter 1: bounds 1\.0 and 1\.0"):
        complex_search(lambda p: 0.0, np.array([0.0, 1.0]), np.ones(2), rng=_rng())
    with pytest.raises(ValueError, match=r"start 3\.0 lies outside"):
        complex_search(lambda p: 0.0, np.zeros(1), np.ones(1), rng=_rng(), start=np.array([3.0]))


@pytest.mark.parametrize(
    "model", [rigid_model(), flexible_model(stiff_curve(), flexible_curve())], ids=["m1", "m2"]
)
def test_closed_form_is_never_worse_and_costs_less_than_a_hundredth(model):
    """The papers searched for what has an exact solution.

    Same optimum, hundreds of model evaluations.
    """
    campaign = carrier_campaign()
    for run in campaign.runs:
        equations = normal_equations(run, campaign.channels, model)
        exact = joint_fit([equations], [False] * len(model.coefficients))
        least = equations.squared_error(exact.run_coefficients(0)).sum()
        bounds = np.array(
            [
                1e-3 if name == "d_x" else 2e-3 if name.startswith("phi") else 2.0
                for name in model.coefficients
            ]
        )
        search = complex_search(
            lambda values, system=equations: float(system.squared_error(values).sum()),
            -bounds,
            bounds,
            rng=_rng(),
            tolerance=1e-5,
        )
        assert least <= search.cost
        assert search.cost < 1.05 * least
        assert search.evaluations > 100  # against one


def test_the_history_ends_at_the_result_and_its_best_never_rises():
    search = complex_search(
        lambda p: 1.0 + float(p @ p), np.full(3, -1.0), np.full(3, 2.0), rng=_rng()
    )
    calls, least, largest = search.history.T
    assert calls[0] == 6
    assert calls[-1] == search.evaluations
    assert (np.diff(calls) >= 1).all()
    assert (np.diff(least) <= 0.0).all()
    assert (least <= largest).all()
    assert least[-1] == search.cost
    assert least[-1] < 1.0 + 1e-6 < least[0]
