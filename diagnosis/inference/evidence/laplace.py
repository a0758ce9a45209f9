"""Laplace's approximation of the evidence of a fit.

With residuals ``r`` of a model at its fitted parameters, ``J`` their slopes and ``d`` a step of the
parameters, the sum of squares near the fit is

    S(d) = S - 2 b.d + d.T H d,      S = r.T r / f,   b = J.T r / f,   H = J.T J / f,

with ``f`` samples of the record for one that is independent, and ``N = n / f`` of these. With noise
of standard deviation s and the prior p(d), the evidence is

    Z(s) = (2 pi s²)^(-N/2) int exp(-S(d) / 2 s²) p(d) dd.

The prior of an effect's parameter is the normal one of the fit (mean and standard deviation of
:class:`carrierflex.diagnosis.comparison.problem.Parameter`) within the bounds of the effect's card,
uniform between them where the fit has none; SI units. Parameters of the baseline without a prior
are the same in all candidates, so that a density of one cancels. The integral over the bounds is
that of a normal distribution (:mod:`box_probability`), exact for a linear model.

Where the noise is not declared, or the best candidate leaves more than it, s is unknown with
Jeffreys' prior 1/s, ``Z = int Z(s) ds/s``: for flat priors the density of a Student
distribution, ``Gamma((N - p)/2) S_min^(-(N - p)/2) |H|^(-1/2) / 2 pi^((N - p)/2)``.

References
----------
.. [1] D. J. C. MacKay, "Information Theory, Inference, and Learning Algorithms" (2003), ch. 27, 28.
.. [2] R. E. Kass, A. E. Raftery, "Bayes factors", J. Am. Stat. Assoc. 90 (1995) 773-795.
.. [3] H. Jeffreys, "Theory of Probability" (1961), ch. 3.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from carrierflex.diagnosis.inference.evidence.box_probability import log_box_probability
from carrierflex.identification.estimation.scaled_least_squares import (
    DEPENDENT,
    column_lengths,
    normal_inverse,
)

FloatArray = NDArray[np.float64]

#: Precision that stands for "uniform between bounds" where the data say nothing, in squares of the
#: bounds' distance: it changes the density by 1e-6 over them.
_UNIFORM = 1e-6
#: Smallest eigenvalue of a matrix of unit diagonal that is more than rounding.
_ROUNDING = 1e-12
#: Standard deviations of log s on either side, and points, of the integral over the noise: the
#: trapezoidal rule of a normal density is exact to the last digit there.
_REACH, _POINTS = 8.0, 49


@dataclass(frozen=True, eq=False)
class QuadraticCost:
    """Sum of squares of independent samples near a fit, of the parameters that have a prior.

    Parameters
    ----------
    n_samples : float
        Independent samples N.
    n_flat : int
        Parameters without a prior that were integrated out.
    square : float
        S at the minimum over those.
    matrix : ndarray, shape (p, p)
        H of the others, Schur complement.
    slope : ndarray, shape (p,)
        b of the others.
    log_flat : float
        ``log |H|`` of the parameters that were integrated out.
    """

    n_samples: float
    n_flat: int
    square: float
    matrix: FloatArray
    slope: FloatArray
    log_flat: float


@dataclass(frozen=True, eq=False)
class BoundedPrior:
    """Normal priors between bounds about the fit, uniform where the precision is zero.

    Parameters
    ----------
    mean : ndarray, shape (p,)
        Means, less the fitted values.
    precision : ndarray, shape (p,)
        Inverse variances; zero: uniform.
    lower, upper : ndarray, shape (p,)
        Bounds, less the fitted values; finite where the precision is zero.
    """

    mean: FloatArray
    precision: FloatArray
    lower: FloatArray
    upper: FloatArray

    @property
    def log_norm(self) -> float:
        """Logarithm of the factor before ``exp(-(d - mean)² precision / 2)``, of all parameters."""
        normal = self.precision > 0.0
        width = self.upper[~normal] - self.lower[~normal]
        root = np.sqrt(self.precision[normal])
        below = (self.lower[normal] - self.mean[normal]) * root
        above = (self.upper[normal] - self.mean[normal]) * root
        inside = np.log1p(-ndtr(below) - ndtr(-above))
        return float(
            0.5 * np.sum(np.log(self.precision[normal] / (2.0 * np.pi)))
            - inside.sum()
            - np.log(width).sum()
        )


def quadratic_cost(
    square: float,
    matrix: FloatArray,
    slope: FloatArray,
    *,
    has_prior: NDArray[np.bool_],
    n_samples: float,
) -> QuadraticCost:
    """Integrate the parameters without a prior out of a sum of squares.

    ``S - b_1.T H_11^-1 b_1``, ``H_22 - H_21 H_11^-1 H_12``, ``b_2 - H_21 H_11^-1 b_1``.

    Parameters
    ----------
    square : float
        S.
    matrix : ndarray, shape (q, q)
        H.
    slope : ndarray, shape (q,)
        b.
    has_prior : ndarray of bool, shape (q,)
        Parameters that stay.
    n_samples : float
        Independent samples.
    """
    flat = ~has_prior & (np.diag(matrix) > 0.0)
    inner = matrix[np.ix_(flat, flat)]
    across = matrix[np.ix_(has_prior, flat)]
    inverse = normal_inverse(inner) if flat.any() else np.zeros((0, 0))
    lengths = column_lengths(inner)
    scaled = np.linalg.eigvalsh(inner / np.outer(lengths, lengths))
    seen = scaled > DEPENDENT * max(float(scaled.max(initial=0.0)), 0.0)
    return QuadraticCost(
        n_samples=n_samples,
        n_flat=int(seen.sum()),
        square=square - float(slope[flat] @ inverse @ slope[flat]),
        matrix=matrix[np.ix_(has_prior, has_prior)] - across @ inverse @ across.T,
        slope=slope[has_prior] - across @ inverse @ slope[flat],
        log_flat=float(np.log(scaled[seen]).sum() + 2.0 * np.log(lengths).sum()),
    )


def log_evidence(cost: QuadraticCost, prior: BoundedPrior, variance: float) -> float:
    """Log evidence with noise of known variance.

    Parameters
    ----------
    cost : QuadraticCost
        Sum of squares near the fit.
    prior : BoundedPrior
        Prior of its parameters.
    variance : float
        s², in the unit of the sum of squares.

    Returns
    -------
    float
        ``log Z``; exact for a linear model.
    """
    width = np.where(prior.precision > 0.0, np.inf, prior.upper - prior.lower)
    weak = _UNIFORM / width**2
    A = cost.matrix / variance + np.diag(prior.precision + weak)
    g = cost.slope / variance + prior.precision * prior.mean
    lengths = column_lengths(A)
    values, vectors = np.linalg.eigh(A / np.outer(lengths, lengths))
    # A parameter that the baseline can stand for has a curvature of rounding, of either sign.
    values = np.maximum(values, _ROUNDING)
    covariance = (vectors / values) @ vectors.T / np.outer(lengths, lengths)
    centre = covariance @ g
    log_determinant = float(np.log(values).sum() + 2.0 * np.log(lengths).sum())
    exponent = (
        -0.5 * cost.square / variance
        - 0.5 * float(prior.precision @ prior.mean**2)
        + 0.5 * float(g @ centre)
    )
    free = cost.n_samples - cost.n_flat
    n_kept = prior.mean.size
    return (
        exponent
        - 0.5 * free * float(np.log(2.0 * np.pi * variance))
        - 0.5 * cost.log_flat
        + prior.log_norm
        + 0.5 * n_kept * float(np.log(2.0 * np.pi))
        - 0.5 * log_determinant
        + log_box_probability(centre, covariance, prior.lower, prior.upper)
    )


def log_evidence_any_noise(cost: QuadraticCost, prior: BoundedPrior, variance: float) -> float:
    """Log evidence with noise of unknown size, ``int Z(s) ds/s``.

    Parameters
    ----------
    cost, prior
        As of :func:`log_evidence`.
    variance : float
        s² about which the integral is taken: what the model leaves.

    Returns
    -------
    float
        ``log Z``.
    """
    free = max(cost.n_samples - cost.n_flat - prior.mean.size, 1.0)
    # log s has the standard deviation 1 / sqrt(2 N) about the best.
    step = 2.0 * _REACH / np.sqrt(2.0 * free) / (_POINTS - 1)
    log_s = 0.5 * np.log(variance) + step * (np.arange(_POINTS) - (_POINTS - 1) / 2)
    values = np.array([log_evidence(cost, prior, float(np.exp(2.0 * own))) for own in log_s])
    largest = float(values.max())
    return largest + float(np.log(step * np.exp(values - largest).sum()))
