"""Joint least squares over runs: coefficients, their covariance, and what the data cannot see."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.stats import t as student_t

from carrierflex.identification.estimation.normal_equations import NormalEquations
from carrierflex.identification.estimation.resampling import growth_by_memory
from carrierflex.identification.estimation.scaled_least_squares import DEPENDENT, column_lengths

#: The jackknife needs a scatter of revolutions; with fewer the classical estimate takes its place.
FEWEST_REVOLUTIONS = 5
#: A component below this share of a unit vector is taken as rounding when unseen directions are
#: described.
_NEGLIGIBLE_SHARE = 0.02

JACKKNIFE = "jackknife over revolutions"
CLASSICAL = "classical, residuals taken as independent"


@dataclass(frozen=True, eq=False)
class JointFit:
    """Least-squares solution of several runs with shared coefficients; q unknowns in all.

    Parameters
    ----------
    unknowns : ndarray, shape (q,)
        Solution of least norm in scaled coefficients.
    positions : ndarray of int, shape (n_runs, p)
        Which unknown each run's coefficient is: shared ones have the same number in every run.
    covariance : ndarray, shape (q, q)
        Covariance of the unknowns within the determined directions.
    covariance_source : str
        How it was estimated.
    confidence_factor : ndarray, shape (q,)
        Half width of each unknown's 95 % interval in standard deviations (Student's t).
    condition_number : float
        Of the scaled design, over the determined directions.
    unseen : ndarray, shape (n_unseen, q)
        Directions in the unknowns, each divided by its `column_scale`, that the data cannot see.
    column_scale : ndarray, shape (q,)
        Inverse length of every unknown's column of the design.
    """

    unknowns: NDArray[np.float64]
    positions: NDArray[np.int64]
    covariance: NDArray[np.float64]
    covariance_source: str
    confidence_factor: NDArray[np.float64]
    condition_number: float
    unseen: NDArray[np.float64]
    column_scale: NDArray[np.float64]

    @property
    def undetermined(self) -> NDArray[np.bool_]:
        """Which unknowns take part in a direction that the data cannot see, shape (q,)."""
        return np.square(self.unseen).sum(axis=0) > _NEGLIGIBLE_SHARE**2

    def run_coefficients(self, run: int) -> NDArray[np.float64]:
        """Coefficients of one run, shape (p,)."""
        return self.unknowns[self.positions[run]]


def _joint_positions(shared: Sequence[bool], n_runs: int) -> NDArray[np.int64]:
    """Give every unknown of a joint fit a number.

    Shared coefficients one, the others one for each run.
    """
    is_shared = np.asarray(shared, dtype=bool)
    n_shared = int(is_shared.sum())
    n_per_run = int((~is_shared).sum())
    positions = np.empty((n_runs, is_shared.size), dtype=np.int64)
    positions[:, is_shared] = np.arange(n_shared)
    positions[:, ~is_shared] = n_shared + np.arange(n_runs * n_per_run).reshape(n_runs, n_per_run)
    return positions


def joint_fit(equations: Sequence[NormalEquations], shared: Sequence[bool]) -> JointFit:
    """Minimise the sum of squared residuals of all runs.

    ``N p = b`` with ``N = sum E_k.T X_k.T X_k E_k`` over the runs k, columns scaled to unit length,
    solved in the eigenvectors of N that the data determine.

    Parameters
    ----------
    equations : sequence of NormalEquations
        One for each run, of one model.
    shared : sequence of bool
        Whether each coefficient is shared by the runs.

    Returns
    -------
    JointFit
        Solution with its covariance.

    Notes
    -----
    Residuals of a quasi-static model repeat from sample to sample, so a covariance for independent
    samples would be far too small. The delete-one-revolution jackknife, run by run, takes each
    revolution as one observation: ``C = sum_k (g_k - 1) / g_k sum_r (p_(kr) - mean)(p_(kr) -
    mean).T`` with ``g_k`` revolutions in run k; the interval takes Student's t with ``min g_k - 1``
    degrees of freedom. Errors of neighbouring revolutions that are alike, as of a sensor that
    drifts, add up: the standard deviation of every coefficient grows by ``sqrt(1 + 2 r)`` with r
    the correlation of its errors from one revolution to the next, over all channels and runs [2]_.

    References
    ----------
    .. [1] B. Efron, C. Stein, "The jackknife estimate of variance", Annals of Statistics 9 (1981).
    .. [2] L. P. Hansen, "Large sample properties of generalized method of moments estimators",
       Econometrica 50 (1982): covariance of correlated errors, here to the next revolution.
    """
    positions = _joint_positions(shared, len(equations))
    n_unknowns = int(positions.max()) + 1
    matrix = np.zeros((n_unknowns, n_unknowns))
    right_side = np.zeros(n_unknowns)
    for run, where in zip(equations, positions, strict=True):
        matrix[np.ix_(where, where)] += run.matrix.sum(axis=(0, 1))
        right_side[where] += run.right_side.sum(axis=(0, 1))
    # A column of zeros keeps its place and becomes unseen.
    scale = 1.0 / column_lengths(matrix)
    eigenvalues, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    independent = eigenvalues > DEPENDENT * eigenvalues[-1]
    basis = scale[:, None] * vectors[:, independent]
    unknowns = basis @ ((basis.T @ right_side) / eigenvalues[independent])
    fewest = min(run.n_revolutions for run in equations)
    if fewest >= FEWEST_REVOLUTIONS:
        covariance = _jackknife(equations, positions, basis, eigenvalues[independent], unknowns)
        freedom, source = fewest - 1, JACKKNIFE
    else:
        covariance, freedom = _classical(
            equations, positions, basis, eigenvalues[independent], unknowns
        )
        source = CLASSICAL
    return JointFit(
        unknowns=unknowns,
        positions=positions,
        covariance=covariance,
        covariance_source=source,
        confidence_factor=np.full(n_unknowns, student_t.ppf(0.975, freedom)),
        condition_number=float(np.sqrt(eigenvalues[independent][-1] / eigenvalues[independent][0])),
        unseen=vectors[:, ~independent].T,
        column_scale=scale,
    )


def unseen_in_words(fit: JointFit, labels: Sequence[str]) -> tuple[str, ...]:
    """Describe what the data cannot see.

    Parameters
    ----------
    fit : JointFit
        Solution with q unknowns.
    labels : sequence of str, length q
        Names of the unknowns.

    Returns
    -------
    tuple of str
        One sentence for each unknown without influence and for each group that cannot be told
        apart.
    """
    projector = fit.unseen.T @ fit.unseen
    share = np.diag(projector)
    silent = share > 1.0 - _NEGLIGIBLE_SHARE
    sentences = [
        f"{labels[int(k)]} has no influence on these signals" for k in np.flatnonzero(silent)
    ]
    mixed = fit.undetermined & ~silent
    linked = (np.abs(projector) > _NEGLIGIBLE_SHARE) & np.outer(mixed, mixed)
    n_groups, group = connected_components(linked, directed=False)
    for number in range(n_groups):
        members = np.flatnonzero((group == number) & mixed)
        if members.size:
            sentences.append(_group_in_words(fit, members, labels))
    return tuple(sentences)


def _group_in_words(fit: JointFit, members: NDArray[np.int64], labels: Sequence[str]) -> str:
    """Say which combination of unknowns is determined, where it is a single one."""
    names = " and ".join(labels[int(k)] for k in members)
    unseen = (fit.unseen * fit.column_scale)[:, members]
    _, sizes, directions = np.linalg.svd(unseen / np.abs(unseen).max())
    n_unseen = int((sizes > _NEGLIGIBLE_SHARE).sum())
    if members.size - n_unseen != 1:
        n_determined = members.size - n_unseen
        return (
            f"{names} cannot be separated: "
            f"these signals determine only {n_determined} combinations of them"
        )
    combination = directions[-1] / directions[-1][np.argmax(np.abs(directions[-1]))]
    terms = " + ".join(
        f"{'' if np.isclose(share, 1.0) else f'{share:.3g} '}{labels[int(k)]}"
        for k, share in zip(members, combination, strict=True)
    ).replace("+ -", "- ")
    return f"{names} cannot be separated: only {terms} is determined"


def _jackknife(
    equations: Sequence[NormalEquations],
    positions: NDArray[np.int64],
    basis: NDArray[np.float64],
    eigenvalues: NDArray[np.float64],
    unknowns: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Covariance from the solutions without one revolution each, run by run.

    Without the sums ``D, d`` of a revolution, which meet the few unknowns E of its run only, the
    solution ``(N - E D E.T)^-1 (b - E d)`` moves by ``N^-1 E z`` with ``z = (I - D A)^-1 D (E.T p
    - A d) - d`` and ``A = E.T N^-1 E`` (Woodbury): no system of all unknowns is solved again.
    """
    covariance = np.zeros((basis.shape[1], basis.shape[1]))
    for run, where in zip(equations, positions, strict=True):
        along = basis[where] / eigenvalues
        A = along @ basis[where].T
        D = run.matrix.sum(axis=1)
        d = run.right_side.sum(axis=1)
        missed = (D @ (unknowns[where] - d @ A.T)[:, :, None])[:, :, 0]
        moves = np.linalg.solve(np.eye(where.size) - D @ A, missed[:, :, None])[:, :, 0] - d
        scatter = moves - moves.mean(axis=0)
        share = (run.n_revolutions - 1) / run.n_revolutions
        covariance += share * along.T @ (scatter.T @ scatter) @ along
    errors = (
        (run.right_side - run.matrix @ unknowns[where])
        @ (basis[where] / eigenvalues)
        @ basis[where].T
        for run, where in zip(equations, positions, strict=True)
    )
    growth = np.ones(unknowns.size)
    growth[positions] = growth_by_memory(errors)
    return np.outer(growth, growth) * (basis @ covariance @ basis.T)


def _classical(
    equations: Sequence[NormalEquations],
    positions: NDArray[np.int64],
    basis: NDArray[np.float64],
    eigenvalues: NDArray[np.float64],
    unknowns: NDArray[np.float64],
) -> tuple[NDArray[np.float64], int]:
    """Covariance ``s² N^-1`` for independent residuals, and its degrees of freedom."""
    squared = sum(
        float(run.squared_error(unknowns[where]).sum())
        for run, where in zip(equations, positions, strict=True)
    )
    freedom = max(sum(int(run.n_samples.sum()) for run in equations) - eigenvalues.size, 1)
    return squared / freedom * (basis / eigenvalues) @ basis.T, freedom
