"""Samples that no sensor gave: stretches that stand still, zeros and marks in place of nothing."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign_check.sample_statistics import (
    expected_equal,
    expected_zeros,
    stretches,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Rows of one value that are a logger standing still, where chance makes none.
_STUCK = 6
#: Largest probability of a stretch by chance, of one in a record.
_CHANCE = 1e-6
#: Distance of a zero from the line between its neighbours over the median step of the signal.
_FAR = 8.0
#: Numbers that loggers write where there is nothing.
_MARKS = (-9999.0, -999.0, 9999.0, 99999.0, -99999.0, 32767.0, -32768.0, 1e30, -1e30)


def stuck(values: FloatArray, moves: BoolArray) -> BoolArray:
    """Rows in which a channel repeats the row before while the machine moves.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Channel, missing samples NaN.
    moves : ndarray, shape (n,)
        Rows in which an input changes.

    Returns
    -------
    ndarray, shape (n,)
        The first row of a stretch still counts as measured. Plateaus at the signal's ends are a
        range that is too small, and stay.
    """
    equal = np.concatenate([[False], np.diff(values) == 0.0]) & moves
    if not equal.any():
        return equal
    inside = (values != np.nanmax(values)) & (values != np.nanmin(values))
    share = min(expected_equal(values) / values.size, 0.97)
    length = _STUCK
    if share > 0.0:
        length = max(length, int(np.ceil(np.log(_CHANCE / values.size) / np.log(share))))
    result = np.zeros(values.size, dtype=bool)
    for first, end in stretches(equal & inside):
        if end - first + 1 >= length:
            result[first:end] = True
    return result


def zeroed(values: FloatArray, moves: BoolArray) -> BoolArray:
    """Exact zeros that are none of the signal's own, shape (n,).

    All of them where chance makes none while the machine moves; else those far from the samples
    beside them.
    """
    zero_rows = (values == 0.0) & moves
    if np.count_nonzero(zero_rows) >= 2.0 + 4.0 * expected_zeros(values):
        return zero_rows
    present = np.flatnonzero(np.isfinite(values) & (values != 0.0))
    zero = np.flatnonzero(zero_rows)
    result = np.zeros(values.size, dtype=bool)
    if zero.size == 0 or present.size < 10:
        return result
    step = float(np.median(np.abs(np.diff(values[present]))))
    beside = np.interp(zero, present, values[present])
    # A signal that passes through zero has small values on both sides.
    result[zero[np.abs(beside) > _FAR * step]] = True
    return result if step > 0.0 else np.zeros(values.size, dtype=bool)


def marked(values: FloatArray) -> BoolArray:
    """Infinite values, and marks as -9999 that lie outside of all else, shape (n,)."""
    result = np.isinf(values)
    for mark in _MARKS:
        rows = values == mark
        others = np.abs(values[~rows & np.isfinite(values)])
        if rows.any() and others.size and abs(mark) > 2.0 * float(others.max()):
            result |= rows
    return result
