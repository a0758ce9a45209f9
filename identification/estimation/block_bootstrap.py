"""Block bootstrap over revolutions.

The errors of parameters when residuals are alike from turn to turn.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from carrierflex.identification.estimation.least_squares import JointFit
from carrierflex.identification.estimation.normal_equations import NormalEquations

#: With fewer samples a covariance is itself uncertain by more than ten percent.
FEWEST_SAMPLES = 50


def with_bootstrap(
    fit: JointFit, equations: Sequence[NormalEquations], n_samples: int, rng: np.random.Generator
) -> JointFit:
    """Replace the covariance of a fit by that of refits to resampled revolutions.

    Every sample draws, run by run, blocks of consecutive revolutions with replacement until the run
    is full again (circular: a block may go over the end), of the length ``R^(1/3)`` that keeps a
    correlation of neighbouring turns.

    Parameters
    ----------
    fit : JointFit
        Solution of :func:`~carrierflex.identification.estimation.least_squares.joint_fit`.
    equations : sequence of NormalEquations
        Sums of every run, by revolution.
    n_samples : int
        Samples to draw.
    rng : numpy.random.Generator
        Source of the draws.

    Returns
    -------
    JointFit
        Copy with the covariance of the samples; intervals with Student's t of the fewest blocks
        less one.

    Raises
    ------
    ValueError
        Where a run has fewer than three revolutions: there is nothing to draw from.

    References
    ----------
    .. [1] D. N. Politis, J. P. Romano, "A circular block-resampling procedure for stationary data"
    (1992).
    """
    lengths = [max(1, round(run.n_revolutions ** (1.0 / 3.0))) for run in equations]
    for run in equations:
        if run.n_revolutions < 3:
            raise ValueError(
                f"run {run.run}: {run.n_revolutions} revolutions; expected at least 3 for a bootstrap over revolutions"
            )
    basis = _determined_basis(fit)
    solutions = np.array(
        [_resampled(fit, equations, lengths, basis, rng) for _ in range(n_samples)]
    )
    scatter = solutions - solutions.mean(axis=0)
    blocks = min(
        run.n_revolutions // length for run, length in zip(equations, lengths, strict=True)
    )
    # Draws with replacement scatter less than the data by (blocks - 1) / blocks.
    covariance = scatter.T @ scatter / (n_samples - 1) * blocks / (blocks - 1.0)
    return replace(
        fit,
        covariance=basis @ covariance @ basis.T,
        covariance_source=f"block bootstrap over revolutions, {n_samples} samples, "
        f"blocks of {'/'.join(str(length) for length in sorted(set(lengths)))}",
        confidence_factor=np.full(fit.unknowns.size, student_t.ppf(0.975, blocks - 1)),
    )


def _determined_basis(fit: JointFit) -> NDArray[np.float64]:
    """Basis of what the data determine, in the unknowns.

    Scaled columns orthogonal to the unseen directions.
    """
    unseen = fit.unseen
    projector = np.eye(fit.unknowns.size) - unseen.T @ unseen
    eigenvalues, vectors = np.linalg.eigh(projector)
    return fit.column_scale[:, None] * vectors[:, eigenvalues > 0.5]


def _resampled(
    fit: JointFit,
    equations: Sequence[NormalEquations],
    lengths: Sequence[int],
    basis: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Solution of one sample, in the coordinates of `basis`."""
    matrix = np.zeros((basis.shape[1], basis.shape[1]))
    right_side = np.zeros(basis.shape[1])
    for run, where, length in zip(equations, fit.positions, lengths, strict=True):
        own = basis[where]
        counts = _block_counts(run.n_revolutions, length, rng)
        matrix += own.T @ np.tensordot(counts, run.matrix.sum(axis=1), axes=1) @ own
        right_side += counts @ run.right_side.sum(axis=1) @ own
    return np.asarray(np.linalg.lstsq(matrix, right_side, rcond=None)[0], dtype=np.float64)


def _block_counts(n_revolutions: int, length: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """How often each revolution is drawn."""
    n_blocks = -(-n_revolutions // length)
    first = rng.integers(0, n_revolutions, n_blocks)
    drawn = (first[:, None] + np.arange(length)).ravel()[:n_revolutions] % n_revolutions
    return np.bincount(drawn, minlength=n_revolutions).astype(np.float64)
