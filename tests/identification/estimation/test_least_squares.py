"""The jackknife solves no system of all unknowns again: right to rounding, in little memory."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.estimation.least_squares import joint_fit
from carrierflex.identification.estimation.normal_equations import NormalEquations

SHARED = (True, True, False, False, False)


def equations(n_runs, n_revolutions=6, *, dependent=False):
    """Sums of random designs, three unknowns of each run its own."""
    rng = np.random.default_rng(n_runs)
    runs = []
    for k in range(n_runs):
        X = rng.standard_normal((n_revolutions, 1, 30, len(SHARED)))
        if dependent:
            X[..., 4] = X[..., 3]
        y = X @ np.arange(1.0, 6.0) + 0.1 * rng.standard_normal(X.shape[:-1])
        runs.append(
            NormalEquations(
                f"run {k}",
                ("a",),
                np.swapaxes(X, 2, 3) @ X,
                (y[..., None] * X).sum(axis=2),
                (y**2).sum(axis=2),
                np.full((n_revolutions, 1), 30),
            )
        )
    return runs


def without(run, revolution):
    """Sums of a run but for those of one revolution."""
    others = np.arange(run.n_revolutions) != revolution
    return replace(
        run,
        matrix=run.matrix[others],
        right_side=run.right_side[others],
        square_sum=run.square_sum[others],
        n_samples=run.n_samples[others],
    )


@pytest.mark.parametrize("dependent", [False, True])
def test_the_covariance_is_that_of_fits_without_one_revolution_each(dependent):
    runs = equations(3, dependent=dependent)
    fit = joint_fit(runs, SHARED)
    expected = np.zeros_like(fit.covariance)
    for k, run in enumerate(runs):
        fits = [
            joint_fit([*runs[:k], without(run, r), *runs[k + 1 :]], SHARED).unknowns
            for r in range(run.n_revolutions)
        ]
        scatter = np.array(fits) - np.mean(fits, axis=0)
        expected += (run.n_revolutions - 1) / run.n_revolutions * scatter.T @ scatter
    determined = ~fit.undetermined
    some = np.ix_(determined, determined)
    # Errors that are alike from turn to turn, if only by chance, widen a coefficient alone.
    growth = np.sqrt(np.diag(fit.covariance)[determined] / np.diag(expected)[determined])
    assert (growth > 1.0 - 1e-9).all()
    # What the records cannot see takes a share of its own in every fit.
    assert_allclose(
        fit.covariance[some], np.outer(growth, growth) * expected[some], rtol=1e-9, atol=1e-12
    )


def test_memory_of_many_runs_is_that_of_a_few_matrices_of_all_unknowns():
    runs = equations(120)
    tracemalloc.start()
    fit = joint_fit(runs, SHARED)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # Before, each revolution of a run took three of them.
    assert peak < 10 * 8 * fit.unknowns.size**2
