"""How far fitted parameters can be trusted.

Covariance with alike residuals, what is unseen, profile likelihood.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from carrierflex.identification.estimation.nonlinear_fit import NonlinearFit, Residuals, bounded_fit
from carrierflex.identification.estimation.resampling import growth_by_memory

Array = NDArray[np.float64]

#: Singular values of the scaled derivatives below this share of the largest: not determined.
_UNSEEN = 1e-5
#: A component of an unseen direction below this share is left out of the words.
_NEGLIGIBLE = 0.02


@dataclass(frozen=True, eq=False)
class FitUncertainty:
    """Covariance of a fit.

    Parameters
    ----------
    covariance : ndarray, shape (p, p)
        In the square of the parameters' units; infinite variance for what the data cannot see. A
        parameter that sits on a bound has the variance that it would have without the bound.
    confidence_factor : float
        Half width of a 95 % interval in standard deviations.
    n_blocks : int
        Time blocks that count as independent observations.
    undetermined : tuple of str
        What the data cannot see, in words.
    """

    covariance: Array
    confidence_factor: float
    n_blocks: int
    undetermined: tuple[str, ...]

    @property
    def std(self) -> Array:
        """Standard deviations, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> Array:
        """Correlation matrix, shape (p, p); NaN beside parameters without a finite variance."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return self.covariance / np.outer(self.std, self.std)


def fit_uncertainty(fit: NonlinearFit, blocks: NDArray[np.int64]) -> FitUncertainty:
    """Covariance that does not take neighbouring residuals as independent.

    Delete-one-block jackknife in one step: without the time block b the solution moves by ``d_b =
    (A - A_b)^-1 g_b`` with ``A = J.T J``, ``A_b = J_b.T J_b`` and the gradient ``g_b = J_b.T r_b``;
    ``C = (B - 1) / B sum_b d_b d_b.T``. A block that alone decides a parameter counts for what it
    is. Blocks that are alike add up: C grows by ``1 + 2 r`` with r the correlation of the moves
    from one block to the next, over all directions.

    Parameters
    ----------
    fit : NonlinearFit
        Solution.
    blocks : ndarray of int, shape (n,)
        Block of every residual; a block is longer than residuals are alike.

    Returns
    -------
    FitUncertainty
        Covariance, and Student's t with one degree of freedom less than there are blocks.

    Raises
    ------
    ValueError
        Where there are fewer than three blocks.

    References
    ----------
    .. [1] A. C. Cameron, D. L. Miller, "A practitioner's guide to cluster-robust inference",
       Journal of Human Resources 50 (2015), section VI (CV3).
    """
    numbers, block = np.unique(blocks, return_inverse=True)
    if numbers.size < 3:
        raise ValueError(
            f"{numbers.size} blocks of residuals; expected at least 3 for an error estimate"
        )
    length = np.linalg.norm(fit.jacobian, axis=0)
    used = length > 0.0
    J = fit.jacobian[:, used] / length[used]
    left_vectors, sizes, directions = np.linalg.svd(J, full_matrices=False)
    determined = sizes > _UNSEEN * sizes.max(initial=0.0)
    # Coordinates in which A is the identity; at a bound the residuals would fall along them.
    X = left_vectors[:, determined]
    moves = _without_each_block(X, fit.residuals - X @ (X.T @ fit.residuals), block)
    moves *= growth_by_memory([moves[:, :, None]])
    moves = moves @ (directions[determined].T / sizes[determined]).T
    covariance = np.zeros((len(fit.free), len(fit.free)))
    unit = fit.scale[used] / length[used]
    covariance[np.ix_(used, used)] = (
        (1.0 - 1.0 / len(moves)) * np.outer(unit, unit) * (moves.T @ moves)
    )
    unseen = directions[~determined]
    groups = _inseparable(unseen, unseen / length[used])
    blind = ~used
    blind[np.flatnonzero(used)] |= groups.any(axis=0)
    covariance[blind, :] = covariance[:, blind] = 0.0
    covariance[blind, blind] = np.inf
    return FitUncertainty(
        covariance,
        float(student_t.ppf(0.975, numbers.size - 1)),
        numbers.size,
        _in_words(fit, used, groups),
    )


def _without_each_block(X: Array, residuals: Array, block: NDArray[np.int64]) -> Array:
    """Move of the solution where one block is left out, shape (n_blocks, p).

    For a design with ``X.T X = 1``.
    """
    n_blocks = int(block.max()) + 1
    gradients = np.zeros((n_blocks, X.shape[1]))
    np.add.at(gradients, block, X * residuals[:, None])
    order = np.argsort(block, kind="stable")
    ends = np.searchsorted(block[order], np.arange(n_blocks + 1))
    moves = np.empty_like(gradients)
    for b in range(n_blocks):
        X_b = X[order[ends[b] : ends[b + 1]]]
        # A block without which the rest decides nothing in some direction: the largest move is then
        # the block's own.
        moves[b] = np.linalg.lstsq(np.eye(X.shape[1]) - X_b.T @ X_b, gradients[b], rcond=1e-9)[0]
    return moves


def profile_likelihood(
    residuals: Residuals, fit: NonlinearFit, name: str, values: Sequence[float]
) -> tuple[Array, Array]:
    """Cost over one parameter with all others fitted again.

    Parameters
    ----------
    residuals : callable
        Residual function of the fit.
    fit : NonlinearFit
        Solution; neighbours warm-start one another outwards from it.
    name : str
        Parameter to fix.
    values : sequence of float
        Values to fix it at, SI units.

    Returns
    -------
    cost : ndarray, shape (n,)
        Sum of squares at each value.
    others : ndarray, shape (n, p)
        All parameters at each value.

    Raises
    ------
    ValueError
        Where the fit has no such parameter.
    """
    if name not in fit.names:
        raise ValueError(f"no parameter '{name}'; expected one of {', '.join(fit.names)}")
    fixed = fit.names.index(name)
    others = np.arange(len(fit.free)) != fixed
    free = [parameter for parameter, keep in zip(fit.free, others, strict=True) if keep]
    cost, points = np.empty(len(values)), np.empty((len(values), len(fit.free)))
    for side in (1.0, -1.0):
        warm = fit.values[others]
        for k in np.argsort(np.abs(np.asarray(values) - fit.values[fixed])):
            if (values[k] - fit.values[fixed]) * side < 0.0:
                continue
            refit = bounded_fit(_with_fixed(residuals, fixed, float(values[k])), free, warm)
            warm = refit.values
            cost[k], points[k] = refit.cost, np.insert(refit.values, fixed, values[k])
    return cost, points


def _with_fixed(residuals: Residuals, index: int, value: float) -> Residuals:
    """Residuals with one parameter fixed."""
    return lambda others: residuals(np.insert(others, index, value))


def _inseparable(unseen: Array, in_scales: Array) -> NDArray[np.bool_]:
    """Parameters that take part in each unseen direction, shape (n_unseen, n_used)."""
    motion = np.abs(in_scales)
    return (np.abs(unseen) > _NEGLIGIBLE) | (
        motion > _NEGLIGIBLE * motion.max(axis=1, keepdims=True, initial=0.0)
    )


def _in_words(
    fit: NonlinearFit, used: NDArray[np.bool_], groups: NDArray[np.bool_]
) -> tuple[str, ...]:
    names = np.array(fit.names)
    sentences = [f"{name} has no influence on these signals" for name in names[~used]]
    for group in groups:
        members = names[used][group]
        if members.size == 1:
            sentences.append(f"{members[0]} has hardly any influence on these signals")
        else:
            sentences.append(
                f"{' and '.join(members)} cannot be separated: these signals determine fewer "
                "combinations of them"
            )
    sentences += [f"{name} ended on a bound of its search" for name in fit.at_bound]
    return tuple(sentences)
