"""Spline columns over a visited range."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from carrierflex.diagnosis.comparison.problem import FloatArray

_CUBIC = 3


@dataclass(frozen=True, eq=False)
class SplineBasis:
    """Cubic B-splines with even knots over a range.

    Parameters
    ----------
    low, high : float
        Ends of the range; beyond them the end values are held.
    n : int
        Number of splines.
    """

    low: float
    high: float
    n: int

    def __call__(self, x: FloatArray) -> FloatArray:
        """Values at x, shape (n, x.size)."""
        inner = np.linspace(self.low, self.high, self.n - _CUBIC + 1)
        knots = np.concatenate([[self.low] * _CUBIC, inner, [self.high] * _CUBIC])
        inside = np.clip(x, self.low, self.high)
        return np.asarray(BSpline.design_matrix(inside, knots, _CUBIC).toarray().T)


def basis_over(samples: FloatArray, n: int) -> SplineBasis:
    """Splines over the range of some samples."""
    low, high = float(samples.min()), float(samples.max())
    # Without any range, as of a baseline whose force is zero, one constant is all that is shown.
    margin = 1e-9 * max(high - low, abs(high)) or 1.0
    return SplineBasis(low - margin, high + margin, n)


def difference_penalty(n: int, order: int) -> FloatArray:
    """Penalty on differences of neighbouring coefficients, of unit mean diagonal, shape (n, n).

    References
    ----------
    .. [1] P. H. C. Eilers, B. D. Marx, "Flexible smoothing with B-splines and penalties",
       Statistical Science 11 (1996) 89.
    """
    D = np.diff(np.eye(n), order, axis=0)
    P = D.T @ D
    return P / np.mean(np.diag(P))
