import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import BASELINE
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import NestedFitError, fit_effects
from tests.diagnosis.element.element_campaigns import DAMPING, MASS, STIFFNESS, force_campaign


@pytest.fixture(scope="module")
def cubic_problem():
    return element_problem(force_campaign(lambda q, v: 8e8 * q**3))


def test_fit_finds_the_truth_within_its_error(cubic_problem):
    fit = fit_effects(cubic_problem, ("cubic_stiffness",))
    truth = {"m": MASS, "K1": STIFFNESS, "C1": DAMPING, "f0": 0.0, "K3": 8e8}
    std = np.sqrt(np.diag(fit.covariance))
    for parameter, value, error in zip(fit.parameters, fit.theta, std, strict=True):
        # Five errors, and a share of 2e-4 for the drive between the samples.
        assert abs(value - truth[parameter.name]) < 5.0 * error + 2e-4 * abs(
            truth[parameter.name]
        ), parameter.name
    noise = np.sqrt(fit.sums.square.sum() / cubic_problem.cell_counts.sum())
    assert_allclose(noise, 2e-6, rtol=0.03)


def test_derivatives_predict_the_change_of_the_residual(cubic_problem):
    fit = fit_effects(cubic_problem, ("cubic_stiffness",))
    everything = np.ones(len(cubic_problem.segments), dtype=bool)
    for k in range(fit.theta.size):
        errors = []
        for size in (1e-3, 5e-4):
            step = np.zeros(fit.theta.size)
            step[k] = size * max(abs(fit.theta[k]), 0.1 * fit.parameters[k].scale)
            moved = cubic_problem.squares(fit.effects, fit.theta + step, everything).sum()
            slope = -2.0 * fit.sums.full_right_side().sum(axis=0) @ step
            curve = step @ fit.sums.matrix.sum(axis=0) @ step
            errors.append(abs(moved - fit.sums.square.sum() - slope - curve) / curve)
        # Third order in the step: halving it halves the relative error.
        assert errors[1] < 0.6 * errors[0] + 1e-3
        assert errors[0] < 0.1


def test_a_larger_set_never_fits_worse(cubic_problem):
    base = fit_effects(cubic_problem, ())
    single = fit_effects(cubic_problem, ("cubic_stiffness",), contained=[base])
    for further in ("quintic_stiffness", "coulomb_friction", "maxwell_branch", "stribeck_friction"):
        pair = tuple(sorted(("cubic_stiffness", further)))
        assert fit_effects(cubic_problem, pair, contained=[base, single]).cost <= single.cost * (
            1.0 + 1e-9
        )


def test_a_failed_search_is_an_error(cubic_problem):
    single = fit_effects(cubic_problem, ("cubic_stiffness",))
    with pytest.raises(
        NestedFitError,
        match=r"quadratic_damping contains .*cubic_stiffness and costs .* did not converge",
    ) as caught:
        fit_effects(cubic_problem, ("quadratic_damping",), contained=[single])
    assert caught.value.smaller is single
    assert caught.value.fit.cost > single.cost


def test_an_effect_of_the_wrong_sign_stands_on_its_bound():
    # A force that drives the motion: negative damping beyond the linear part.
    problem = element_problem(force_campaign(lambda q, v: -20.0 * v * abs(v)))
    fit = fit_effects(problem, ("quadratic_damping",))
    index = next(
        k for k, parameter in enumerate(fit.parameters) if parameter.effect == "quadratic_damping"
    )
    assert fit.theta[index] == 0.0
    assert fit.at_bound[index]


@pytest.mark.parametrize(("errors", "is_absent"), [(0.0, True), (5.0, False)])
def test_a_size_that_noise_does_not_distinguish_from_zero_stands_on_its_bound(errors, is_absent):
    # One standard error of the size, from the fit of records without the effect.
    C2 = errors * 0.028
    fit = fit_effects(
        element_problem(force_campaign(lambda q, v: C2 * v * abs(v))), ("quadratic_damping",)
    )
    index = next(
        k for k, parameter in enumerate(fit.parameters) if parameter.effect == "quadratic_damping"
    )
    assert fit.at_bound[index] == is_absent


def test_given_mass_is_not_fitted():
    campaign = force_campaign(lambda q, v: 0.0, amplitudes=(1.0,))
    campaign.rig["mass"] = MASS
    names = [
        parameter.name
        for parameter in element_problem(campaign).parameters(())
        if parameter.effect == BASELINE
    ]
    assert names == ["K1", "C1", "f0"]
