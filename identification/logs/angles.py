"""The carrier's angle as loggers give it: wrapped, counted in pulses, or a train of pulses."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Share of rows of a pulse train at its two levels.
_AT_LEVELS = 0.8
#: A step of time over the median one in which turns may be lost.
_GAP = 1.5


def unwrapped_angle(values: FloatArray, time: FloatArray, turn: float) -> FloatArray:
    """Angle that goes on, from one that begins anew after a turn (or a counter that overflows).

    Parameters
    ----------
    values : ndarray, shape (n,)
        Angle; missing samples NaN stay missing.
    time : ndarray, shape (n,)
        Instants [s]: in a gap it goes on with the speed beside it, by whole turns.
    turn : float
        Where it begins anew, in the unit of `values`.

    Returns
    -------
    ndarray, shape (n,)
        From row to row no step is larger than half a turn.
    """
    result = values.copy()
    present = np.isfinite(values)
    angle, instant = np.unwrap(values[present], period=turn), time[present]
    if angle.size > 2:
        step, elapsed = np.diff(angle), np.diff(instant)
        regular = elapsed < _GAP * np.median(elapsed)
        speed = float(np.median(step[regular] / elapsed[regular]))
        lost = np.where(regular, 0.0, np.rint((speed * elapsed - step) / turn))
        angle = angle + turn * np.concatenate([[0.0], np.cumsum(lost)])
    result[present] = angle
    return result


def angle_of_pulses(train: FloatArray, time: FloatArray, pulses_per_turn: float) -> FloatArray:
    """Angle [rad] from a signal that rises once a pulse, linear between the rising edges.

    Parameters
    ----------
    train : ndarray, shape (n,)
        Signal at two levels.
    time : ndarray, shape (n,)
        Instants [s].
    pulses_per_turn : float
        Rising edges of a turn.

    Returns
    -------
    ndarray, shape (n,)
        Zero at the first edge; before the first and beyond the last edge it goes on as between the
        two edges beside them.

    Raises
    ------
    ValueError
        Where the signal has fewer than two edges.
    """
    middle = 0.5 * (np.nanmax(train) + np.nanmin(train))
    present = np.flatnonzero(np.isfinite(train))
    high = train[present] > middle
    rises = np.flatnonzero(~high[:-1] & high[1:])
    if rises.size < 2:
        raise ValueError(
            f"the train of pulses rises {rises.size} times; expected two pulses at least"
        )
    first, second = present[rises], present[rises + 1]
    share = (middle - train[first]) / (train[second] - train[first])
    edges = time[first] + share * (time[second] - time[first])
    number = np.arange(edges.size, dtype=np.float64)
    counted = np.interp(time, edges, number)
    before, after = time < edges[0], time > edges[-1]
    counted[before] = (time[before] - edges[0]) / (edges[1] - edges[0])
    counted[after] = number[-1] + (time[after] - edges[-1]) / (edges[-1] - edges[-2])
    return 2.0 * np.pi * counted / pulses_per_turn


def is_pulse_train(values: FloatArray) -> bool:
    """Whether a signal stands at two levels most of the time and changes between them."""
    present = values[np.isfinite(values)]
    if present.size < 10 or np.ptp(present) == 0.0:
        return False
    low, high = present.min(), present.max()
    near = np.minimum(np.abs(present - low), np.abs(present - high)) < 0.1 * (high - low)
    edges = np.count_nonzero(np.diff(present > 0.5 * (low + high)))
    return bool(np.mean(near) > _AT_LEVELS and edges > 3)
