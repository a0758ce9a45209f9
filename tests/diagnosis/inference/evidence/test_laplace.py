"""Evidence against linear models, whose integral is known, and against nested sampling."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import dblquad, quad
from scipy.special import gammaln
from scipy.stats import multivariate_normal, norm

from carrierflex.diagnosis.inference.evidence.box_probability import log_box_probability
from carrierflex.diagnosis.inference.evidence.laplace import (
    BoundedPrior,
    QuadraticCost,
    log_evidence,
    log_evidence_any_noise,
    quadratic_cost,
)


def cost_of(residual, slopes, has_prior=None):
    """Sum of squares of residuals with their slopes, all samples independent."""
    has_prior = np.ones(slopes.shape[1], dtype=bool) if has_prior is None else has_prior
    return quadratic_cost(
        float(residual @ residual),
        slopes.T @ slopes,
        slopes.T @ residual,
        has_prior=np.asarray(has_prior),
        n_samples=residual.size,
    )


def wide(p):
    return np.full(p, -np.inf), np.full(p, np.inf)


def line_records(n=40, seed=1):
    rng = np.random.default_rng(seed)
    x = np.linspace(-1.0, 1.0, n)
    design = np.stack([x, x**2], axis=1)
    return design, design @ np.array([1.3, -0.4]) + 0.3 * rng.standard_normal(n)


def test_evidence_of_a_linear_model_is_the_density_of_its_signals():
    design, signals = line_records()
    mean, std, noise = np.array([0.5, 0.0]), np.array([2.0, 1.0]), 0.3
    covariance = design @ np.diag(std**2) @ design.T + noise**2 * np.eye(signals.size)
    expected = multivariate_normal(design @ mean, covariance).logpdf(signals)
    # About any point: the expansion of a linear model does not depend on it.
    for theta in (np.zeros(2), np.array([1.0, -1.0])):
        prior = BoundedPrior(mean - theta, 1.0 / std**2, *wide(2))
        found = log_evidence(cost_of(signals - design @ theta, design), prior, noise**2)
        assert_allclose(found, expected, rtol=1e-10)


def test_bounds_that_cut_the_likelihood_are_integrated_between():
    design, signals = line_records()
    theta = np.array([1.0, 0.0])
    lower, upper = np.array([-1.0, -0.35]), np.array([1.25, 1.0])
    noise = 0.3

    def density(b, a):
        rest = signals - design @ np.array([a, b])
        return np.exp(norm(0.0, noise).logpdf(rest).sum()) / np.prod(upper - lower)

    expected = np.log(dblquad(density, lower[0], upper[0], lower[1], upper[1], epsrel=1e-9)[0])
    prior = BoundedPrior(np.zeros(2), np.zeros(2), lower - theta, upper - theta)
    found = log_evidence(cost_of(signals - design @ theta, design), prior, noise**2)
    assert_allclose(found, expected, atol=2e-3)


def test_a_parameter_that_the_records_do_not_show_changes_no_evidence():
    design, signals = line_records()
    more = np.column_stack([design[:, 0], np.zeros(signals.size)])
    one = BoundedPrior(np.zeros(1), np.zeros(1), np.array([-3.0]), np.array([3.0]))
    two = BoundedPrior(np.zeros(2), np.zeros(2), np.array([-3.0, -1e6]), np.array([3.0, 2e6]))
    values = [
        log_evidence(cost_of(signals, columns), prior, 0.09)
        for columns, prior in ((design[:, :1], one), (more, two))
    ]
    assert_allclose(values[0], values[1], atol=1e-5)


def test_parameters_that_stand_for_one_another_are_integrated_as_one():
    design, signals = line_records()
    twice = np.column_stack([design[:, 0], design[:, 0] * (1.0 + 1e-15)])
    both = BoundedPrior(np.zeros(2), np.array([1.0, 1.0]), *wide(2))
    # The sum of two normal priors is one of twice the variance.
    one = BoundedPrior(np.zeros(1), np.array([0.5]), *wide(1))
    found = log_evidence(cost_of(signals, twice), both, 1e-8)
    expected = log_evidence(cost_of(signals, design[:, :1]), one, 1e-8)
    assert_allclose(found, expected, rtol=1e-6)


def test_unknown_noise_gives_the_student_form():
    design, signals = line_records()
    flat = cost_of(signals, design, [False, False])
    none = BoundedPrior(*(np.zeros(0),) * 4)
    degrees = signals.size - 2
    rest = signals - design @ np.linalg.lstsq(design, signals, rcond=None)[0]
    expected = (
        gammaln(degrees / 2)
        - np.log(2.0)
        - degrees / 2 * np.log(np.pi * (rest @ rest))
        - 0.5 * np.linalg.slogdet(design.T @ design)[1]
    )
    found = log_evidence_any_noise(flat, none, float(rest @ rest) / degrees)
    assert_allclose(found, expected, rtol=1e-9)


def test_unknown_noise_is_integrated_over_with_bounds_too():
    design, signals = line_records()
    prior = BoundedPrior(np.zeros(2), np.zeros(2), np.full(2, -2.0), np.full(2, 2.0))
    cost = cost_of(signals, design)
    best = log_evidence(cost, prior, 0.09)
    expected = best + np.log(
        quad(lambda t: np.exp(log_evidence(cost, prior, np.exp(2 * t)) - best), -2.5, 0.5)[0]
    )
    assert_allclose(log_evidence_any_noise(cost, prior, 0.09), expected, atol=1e-6)


def test_evidence_does_not_depend_on_units():
    design, signals = line_records()
    values = []
    for unit in (1.0, 1e9):
        prior = BoundedPrior(
            np.zeros(2),
            np.array([0.25, 0.0]) * unit**2,
            np.array([0.0, -2.0]) / unit,
            np.array([np.inf, 2.0]) / unit,
        )
        values.append(log_evidence(cost_of(signals, design * unit), prior, 0.09))
    assert_allclose(values[0], values[1], rtol=1e-12)


def test_probability_of_a_box_keeps_its_digits_far_in_the_tail():
    # Two independent tails: 12 and 15 standard deviations.
    found = log_box_probability(
        np.zeros(2), np.eye(2), np.array([12.0, -np.inf]), np.array([np.inf, -15.0])
    )
    assert_allclose(found, norm.logsf(12.0) + norm.logcdf(-15.0), rtol=1e-12)
    correlated = np.array([[1.0, 0.95], [0.95, 1.0]])
    exact = np.log(
        multivariate_normal(np.zeros(2), correlated).cdf(
            np.array([1.0, 0.2]), lower_limit=np.array([-0.5, -1.0])
        )
    )
    found = log_box_probability(
        np.zeros(2), correlated, np.array([-0.5, -1.0]), np.array([1.0, 0.2])
    )
    assert_allclose(found, exact, atol=1e-3)


def sampled(log_likelihood, prior_of_unit, dimensions):
    """Log evidence and its error by nested sampling."""
    import dynesty

    sampler = dynesty.NestedSampler(
        log_likelihood, prior_of_unit, dimensions, nlive=150, rstate=np.random.default_rng(4)
    )
    sampler.run_nested(print_progress=False, dlogz=0.1)
    return float(sampler.results.logz[-1]), float(sampler.results.logzerr[-1])


@pytest.mark.long
@pytest.mark.parametrize("at_bound", [False, True])
def test_nested_sampling_of_a_linear_model_agrees(at_bound):
    design, signals = line_records()
    lower, upper = np.full(2, -2.0), np.array([2.0, -0.6 if at_bound else 2.0])
    logz, error = sampled(
        lambda theta: norm(0.0, 0.3).logpdf(signals - design @ theta).sum(),
        lambda u: lower + u * (upper - lower),
        2,
    )
    start = np.clip(np.linalg.lstsq(design, signals, rcond=None)[0], lower, upper)
    prior = BoundedPrior(np.zeros(2), np.zeros(2), lower - start, upper - start)
    found = log_evidence(cost_of(signals - design @ start, design), prior, 0.09)
    assert abs(found - logz) < 3.0 * error


@pytest.mark.long
def test_nested_sampling_of_a_decay_agrees_with_the_approximation():
    rng = np.random.default_rng(2)
    x = np.linspace(0.0, 4.0, 60)
    noise = 0.05

    def model(theta):
        return theta[0] * np.exp(-theta[1] * x)

    signals = model((1.2, 0.8)) + noise * rng.standard_normal(x.size)
    lower, upper = np.array([0.0, 0.1]), np.array([5.0, 4.0])
    logz, error = sampled(
        lambda theta: norm(0.0, noise).logpdf(signals - model(theta)).sum(),
        lambda u: lower + u * (upper - lower),
        2,
    )
    theta = np.array([1.2, 0.8])
    for _ in range(20):
        slopes = np.stack([np.exp(-theta[1] * x), -theta[0] * x * np.exp(-theta[1] * x)], axis=1)
        theta = theta + np.linalg.lstsq(slopes, signals - model(theta), rcond=None)[0]
    prior = BoundedPrior(np.zeros(2), np.zeros(2), lower - theta, upper - theta)
    found = log_evidence(cost_of(signals - model(theta), slopes), prior, noise**2)
    assert abs(found - logz) < 3.0 * error


def test_a_flat_parameter_costs_as_much_in_every_candidate():
    """The factor of two candidates' evidence is that of the whole integral over the offset."""
    design, signals = line_records()
    offset = np.ones((signals.size, 1))
    prior = BoundedPrior(np.zeros(1), np.array([1.0]), np.array([-np.inf]), np.array([np.inf]))
    none = BoundedPrior(*(np.zeros(0),) * 4)
    beside = np.column_stack([offset, design[:, :1]])
    with_line = log_evidence(cost_of(signals, beside, [False, True]), prior, 0.09)
    alone = log_evidence(cost_of(signals, offset, [False]), none, 0.09)
    # A very wide normal prior of the offset instead: its density cancels in the factor.
    precisions = np.array([1e-8, 1.0])
    both = BoundedPrior(np.zeros(2), precisions, *wide(2))
    one = BoundedPrior(np.zeros(1), precisions[:1], *wide(1))
    expected = log_evidence(cost_of(signals, beside), both, 0.09) - log_evidence(
        cost_of(signals, offset), one, 0.09
    )
    assert_allclose(with_line - alone, expected, atol=1e-6)
    assert isinstance(cost_of(signals, offset), QuadraticCost)
