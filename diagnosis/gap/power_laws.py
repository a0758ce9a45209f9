"""How the gap grows with the conditions.

Exponents of a power law by weighted regression of logarithms.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student_t

FloatArray = NDArray[np.float64]

#: A condition varies where its largest value is at least this many times its smallest.
SPAN = 1.3
#: Values below this share of the largest count as "without" (a radial load at rest of its rams).
WITHOUT = 0.01
#: A condition is told from the others where this share of its variation is its own.
_OWN_SHARE = 0.3
#: No amplitude is trusted to better than this: the law itself is not exact.
_LEAST_ERROR = 5e-3


@dataclass(frozen=True, eq=False)
class Exponent:
    """Exponent of one condition.

    Parameters
    ----------
    value : float
        Exponent; NaN where the conditions do not determine it.
    ci95 : tuple of float
        Interval of 95 %.
    p_value : float
        Probability of such an exponent where the gap does not depend on the condition.
    n_points : int
        Amplitudes that were used. With as many as unknowns the interval knows the noise only, not
        the misfit of the law.
    reason : str
        Why it is not determinable; empty where it is.
    """

    value: float
    ci95: tuple[float, float]
    p_value: float
    n_points: int
    reason: str = ""


def exponents(
    size: FloatArray, error: FloatArray, conditions: Mapping[str, FloatArray]
) -> dict[str, Exponent]:
    """Exponents p of ``size = a prod_k condition_k^p_k``, all conditions that vary fitted together.

    ``log size = log a + sum_k p_k log condition_k``, each point weighted by its relative error; the
    covariance is enlarged by ``chi²/dof`` where that exceeds 1. A condition with points at zero
    takes part in the exponents of the others as ``log(1 + x / max x)``; its own exponent comes from
    the points where it is present.

    Parameters
    ----------
    size, error : ndarray, shape (n,)
        Amplitudes and their standard deviations; only positive amplitudes are used.
    conditions : mapping of str to ndarray, shape (n,)
        Values of every condition, not negative.

    Returns
    -------
    dict of str to Exponent
        By condition.
    """
    found = {}
    for name, values in conditions.items():
        used = (size > 0.0) & (values > WITHOUT * float(values.max(initial=0.0)))
        found[name] = _exponent(
            name, size[used], error[used], {own: v[used] for own, v in conditions.items()}
        )
    return found


def _exponent(
    name: str, size: FloatArray, error: FloatArray, conditions: Mapping[str, FloatArray]
) -> Exponent:
    n = size.size
    if n < 2:
        return _none(n, "fewer than two points show it")
    columns = {own: _column(values) for own, values in conditions.items()}
    varying = [own for own, column in columns.items() if np.ptp(column) >= np.log(SPAN)]
    if name not in varying:
        return _none(n, f"{name} does not vary")
    others = [own for own in varying if own != name]
    design = np.column_stack([np.ones(n), *(columns[own] for own in others)])
    centred = columns[name] - columns[name].mean()
    alone = columns[name] - design @ np.linalg.lstsq(design, columns[name], rcond=None)[0]
    if np.linalg.norm(alone) < _OWN_SHARE * np.linalg.norm(centred):
        return _none(n, f"{name} changes together with {' and '.join(others)}")
    return _fitted(
        np.column_stack([columns[name], design]),
        np.log(size),
        np.maximum(error / size, _LEAST_ERROR),
    )


def _column(values: FloatArray) -> FloatArray:
    largest = float(values.max(initial=0.0))
    if largest <= 0.0:
        return np.zeros(values.size)
    if float(values.min()) > WITHOUT * largest:
        return np.asarray(np.log(values), dtype=np.float64)
    return np.asarray(np.log1p(values / largest), dtype=np.float64)


def _fitted(design: FloatArray, target: FloatArray, error: FloatArray) -> Exponent:
    """Weighted least squares; the first column's coefficient."""
    X, y = design / error[:, None], target / error
    covariance = np.linalg.pinv(X.T @ X)
    solution = covariance @ (X.T @ y)
    dof = len(y) - X.shape[1]
    misfit = float(np.sum((y - X @ solution) ** 2)) / dof if dof > 0 else 1.0
    std = float(np.sqrt(covariance[0, 0] * max(misfit, 1.0)))
    law = student_t(dof) if dof > 0 else norm()
    half = float(law.ppf(0.975)) * std
    value = float(solution[0])
    return Exponent(
        value, (value - half, value + half), float(2.0 * law.sf(abs(value) / std)), len(y)
    )


def _none(n: int, reason: str) -> Exponent:
    nan = float("nan")
    return Exponent(nan, (nan, nan), nan, n, reason)
