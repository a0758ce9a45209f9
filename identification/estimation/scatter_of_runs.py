"""Whether runs agree on the parameters they share, and honest errors where they do not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher_f
from scipy.stats import t as student_t

from carrierflex.identification.estimation.least_squares import (
    FEWEST_REVOLUTIONS,
    JointFit,
    joint_fit,
)
from carrierflex.identification.estimation.normal_equations import NormalEquations

#: Runs that agree look this different once in a thousand campaigns.
DISAGREEMENT = 1e-3
SCATTER_OF_RUNS = (
    "shared parameters: jackknife over runs, which disagree; others: jackknife over revolutions"
)


def with_scatter_of_runs(
    fit: JointFit, equations: Sequence[NormalEquations], shared: Sequence[bool]
) -> JointFit:
    """Widen the errors of shared parameters where the runs disagree on them.

    The scatter of revolutions inside a run knows nothing of a tilt that differs from run to run.
    Each run is fitted by itself, ``p_k`` with covariance ``C_k``, and ``Q = sum_k (p_k - p).T
    C_k^-1 (p_k - p)`` is compared with Hotelling's distribution. Where it is beyond chance the
    covariance of the shared unknowns is that of the delete-one-run jackknife, with one degree of
    freedom less than there are runs.

    Parameters
    ----------
    fit : JointFit
        Solution of :func:`~carrierflex.identification.estimation.least_squares.joint_fit`.
    equations : sequence of NormalEquations
        One for each run.
    shared : sequence of bool
        Whether each coefficient is shared by the runs.

    Returns
    -------
    JointFit
        `fit` itself where the runs agree, or where they cannot be compared: a single run, too few
        revolutions, or a run that does not determine every shared parameter.
    """
    n_shared, n_runs = sum(shared), len(equations)
    freedom = min(run.n_revolutions for run in equations) - n_shared
    if (
        n_runs < 2
        or n_shared == 0
        or freedom < 1
        or min(r.n_revolutions for r in equations) < FEWEST_REVOLUTIONS
    ):
        return fit
    alone = [joint_fit([run], shared) for run in equations]
    if fit.undetermined.any() or any(one.undetermined.any() for one in alone):
        return fit
    ratio = _disagreement(fit, alone, n_shared) * freedom / (freedom + n_shared - 1)
    degrees = n_shared * (n_runs - 1)
    if fisher_f.sf(ratio / degrees, degrees, freedom) >= DISAGREEMENT:
        return fit
    covariance = fit.covariance.copy()
    covariance[:n_shared, :] = covariance[:, :n_shared] = 0.0
    covariance[:n_shared, :n_shared] = _jackknife_over_runs(
        equations, np.asarray(shared, dtype=bool)
    )
    factor = fit.confidence_factor.copy()
    factor[:n_shared] = student_t.ppf(0.975, n_runs - 1)
    return replace(
        fit, covariance=covariance, covariance_source=SCATTER_OF_RUNS, confidence_factor=factor
    )


def _disagreement(fit: JointFit, alone: Sequence[JointFit], n_shared: int) -> float:
    """Sum over the runs of the squared distance to the joint solution, in units of each run's own covariance."""
    total = 0.0
    for one in alone:
        distance = one.unknowns[:n_shared] - fit.unknowns[:n_shared]
        total += float(distance @ np.linalg.solve(one.covariance[:n_shared, :n_shared], distance))
    return total


def _jackknife_over_runs(
    equations: Sequence[NormalEquations], shared: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Covariance of the shared unknowns from the joint solutions without one run each."""
    reduced = [_without_own_unknowns(run, shared) for run in equations]
    matrix = sum((one for one, _ in reduced), np.zeros((shared.sum(), shared.sum())))
    right_side = sum((one for _, one in reduced), np.zeros(shared.sum()))
    solutions = np.array(
        [np.linalg.solve(matrix - own, right_side - right) for own, right in reduced]
    )
    scatter = solutions - solutions.mean(axis=0)
    return (len(equations) - 1) / len(equations) * scatter.T @ scatter


def _without_own_unknowns(
    run: NormalEquations, shared: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Eliminate the run's own unknowns from its normal equations (Schur complement)."""
    matrix, right_side = run.matrix.sum(axis=(0, 1)), run.right_side.sum(axis=(0, 1))
    to_own = np.linalg.solve(matrix[np.ix_(~shared, ~shared)], matrix[np.ix_(~shared, shared)])
    return (
        matrix[np.ix_(shared, shared)] - matrix[np.ix_(shared, ~shared)] @ to_own,
        right_side[shared] - to_own.T @ right_side[~shared],
    )
