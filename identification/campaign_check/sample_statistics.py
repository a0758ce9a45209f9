"""Statistics of one signal that need no model: noise between neighbours, resolution, motion."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Order of the differences that tell noise from a smooth signal, and their mean square over the
#: variance of white noise (10 choose 5).
ORDER, GAIN = 5, 252.0
#: Median of chi² with one degree of freedom: a median is not moved by few jumps.
_MEDIAN_CHI2 = 0.4549
#: Equal neighbours in a row that are a sensor or a logger standing still, where chance makes none.
STUCK = 6
#: Largest probability of a stretch by chance, of one in a record, and share of equal neighbours
#: from which chance explains any.
_CHANCE, _MOST_EQUAL = 1e-6, 0.97


def neighbour_noise(values: FloatArray) -> float:
    """Standard deviation of the noise between neighbouring samples, in the unit of `values`.

    ``median((difference of order 5)²) / (0.4549 · 252)`` is the variance of white noise beside a
    signal that is smooth over six samples; noise with a memory is underestimated.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Signal, missing samples NaN.

    Returns
    -------
    float
        NaN where fewer than two differences can be taken.
    """
    return float(np.sqrt(difference_square(values)))


def difference_square(values: FloatArray, lag: int = 1) -> float:
    """Median square of the differences of every lag-th sample over that of white noise.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Signal, missing samples NaN.
    lag : int
        Distance of the samples.

    Returns
    -------
    float
        Variance of white noise, in the square of the unit of `values`; NaN where fewer than two
        differences can be taken.
    """
    differences = values
    for _ in range(ORDER):
        differences = differences[lag:] - differences[:-lag]
    square = differences[np.isfinite(differences)] ** 2
    return float(np.median(square)) / (_MEDIAN_CHI2 * GAIN) if square.size > 1 else np.nan


def quantisation_step(values: FloatArray) -> float:
    """Step of a quantised signal, zero where it has none.

    Distinct values whose distances are all whole multiples of the smallest one. A ramp or triangle
    that moves by the same distance from sample to sample stands on such levels too, and shows no
    step.
    """
    distinct = np.unique(values[np.isfinite(values)])
    if distinct.size < 3:
        return 0.0
    distance = np.diff(distinct)
    # Values that differ by rounding alone are the same level.
    distance = distance[distance > 1e-9 * max(abs(distinct[0]), abs(distinct[-1]))]
    if distance.size < 2:
        return 0.0
    step = float(distance.min())
    multiple = distance / step
    if np.abs(multiple - np.round(multiple)).max() >= 0.05:
        return 0.0
    change = np.diff(values) / step
    same, by_one_step = np.abs(np.diff(change)), np.abs(np.abs(change[1:]) - 1.0)
    is_straight = np.nanmedian(np.maximum(same, by_one_step)) < 0.05
    return 0.0 if is_straight else step


def moving(run: Run) -> BoolArray:
    """Whether an input changes from the sample before, shape (n,); False for the first.

    Where no input changes the machine may stand still, and a signal may be constant. A record
    without inputs (a free decay) moves throughout.
    """
    changes = np.full(run.time.size, not run.inputs)
    for values in run.inputs.values():
        changes[1:] |= np.diff(values) != 0.0
    return changes


def expected_equal(values: FloatArray) -> float:
    """Neighbours that chance makes equal in a quantised signal; none in another."""
    step = quantisation_step(values)
    if step == 0.0:
        return 0.0
    change = np.abs(np.diff(values))
    change = change[np.isfinite(change)]
    spread = float(np.median(change[change > 0.0]))
    return change.size * min(1.0, step / spread)


def expected_zeros(values: FloatArray) -> float:
    """Samples that chance makes zero in a quantised signal; none in another."""
    present = values[np.isfinite(values)]
    width = 0.05 * float(np.std(present)) or 1.0
    density = np.count_nonzero(np.abs(present) < width) / (2.0 * width)
    return float(density * quantisation_step(values))


def stretches(equal: BoolArray) -> list[tuple[int, int]]:
    """First and one past the last index of every stretch of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], equal, [False]]).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]


def repeats(values: FloatArray, moves: BoolArray) -> tuple[list[tuple[int, int]], int]:
    """Stretches that repeat the sample before, and the length that chance does not make.

    Plateaus at the signal's ends are a range that is too small, and are left out.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Channel, missing samples NaN.
    moves : ndarray, shape (n,)
        Samples at which an input changes.

    Returns
    -------
    list of (int, int)
        First and one past the last index of every stretch.
    int
        Equal neighbours in a row that chance makes less than once in a million records.
    """
    equal = np.concatenate([[False], np.diff(values) == 0.0]) & moves
    if not equal.any():
        return [], STUCK
    inside = (values != np.nanmax(values)) & (values != np.nanmin(values))
    share = min(expected_equal(values) / values.size, _MOST_EQUAL)
    length = STUCK
    if share > 0.0:
        length = max(length, int(np.ceil(np.log(_CHANCE / values.size) / np.log(share))))
    return stretches(equal & inside), length
