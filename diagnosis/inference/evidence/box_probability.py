"""Probability of a box under a normal distribution, as a logarithm that does not run out."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtri_exp
from scipy.stats import qmc

FloatArray = NDArray[np.float64]

#: Points of the rule, a power of two: with two or three bounds that act, errors of the logarithm
#: stay below 1e-3.
_POINTS = 1024
_SEED = 5


def log_box_probability(
    mean: FloatArray, covariance: FloatArray, lower: FloatArray, upper: FloatArray
) -> float:
    """Logarithm of the probability of ``lower <= x <= upper`` for ``x ~ N(mean, covariance)``.

    ``x = mean + L z``, ``L L.T = covariance``: the bounds of ``z_k`` follow from those before it,
    and the product of the conditional probabilities is averaged over a Sobol sequence of them.

    Parameters
    ----------
    mean : ndarray, shape (p,)
        Centre.
    covariance : ndarray, shape (p, p)
        Positive definite.
    lower, upper : ndarray, shape (p,)
        Bounds, may be infinite.

    Returns
    -------
    float
        Exact for p = 1; the same for the same arguments.

    References
    ----------
    .. [1] A. Genz, "Numerical computation of multivariate normal probabilities", J. Comput. Graph.
       Stat. 1 (1992) 141-149.
    """
    p = mean.size
    if p == 0:
        return 0.0
    factor = _lower_factor(covariance)
    uniform = qmc.Sobol(p, scramble=True, rng=_SEED).random(_POINTS if p > 1 else 1)
    z = np.zeros((len(uniform), p))
    total = np.zeros(len(uniform))
    for k in range(p):
        centre = mean[k] + z[:, :k] @ factor[k, :k]
        below = (lower[k] - centre) / factor[k, k]
        above = (upper[k] - centre) / factor[k, k]
        inside, z[:, k] = _truncated(below, above, uniform[:, k])
        total += inside
    largest = float(total.max())
    return largest + float(np.log(np.mean(np.exp(total - largest))))


def _lower_factor(covariance: FloatArray) -> FloatArray:
    """Lower triangular L, ``L L.T = covariance``, also where rounding makes that indefinite."""
    std = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance / np.outer(std, std))
    root = vectors * np.sqrt(np.maximum(values, np.finfo(np.float64).eps))
    upper = np.linalg.qr(root.T)[1]
    sign = np.where(np.diag(upper) < 0.0, -1.0, 1.0)
    return np.asarray(std[:, None] * upper.T * sign)


def _truncated(
    below: FloatArray, above: FloatArray, uniform: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Log probability between two bounds, and the quantile of what lies between them."""
    # In the lower tail, where a difference of probabilities keeps its digits.
    is_high = above > -below
    low = np.where(is_high, -above, below)
    high = np.where(is_high, -below, above)
    log_low, log_high = log_ndtr(low), log_ndtr(high)
    inside = log_high + np.log1p(-np.exp(log_low - log_high))
    log_quantile = np.logaddexp(log_low, np.log(uniform) + inside)
    # Rounding must not leave the bounds.
    z = np.clip(ndtri_exp(log_quantile), low, high)
    return inside, np.where(is_high, -z, z)
