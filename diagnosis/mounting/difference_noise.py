"""Noise of channels whose noise was not declared, told from motion by differences of their samples.

Fifth differences of a slow motion vanish. Those of noise do not, but where neighbouring samples are
alike they see less than its variance; the same differences of every second sample see more of it,
which gives the memory of the noise and with it the whole.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from scipy.optimize import brentq

from carrierflex.diagnosis.comparison.problem import FloatArray

#: Order of the differences, and their mean square over the variance of white noise (10 choose 5).
_ORDER, _GAIN = 5, 252.0
#: Median of chi² with one degree of freedom; a median is not moved by the few fast samples.
_MEDIAN_CHI2 = 0.4549
#: Longest memory from sample to sample that is told from motion.
_LONGEST = 0.8
#: Distances of samples, and the share of the differences at the second one from which motion, which
#: is only known from what it does at the others, would give the memory.
_LAGS = (1, 2, 3, 4)
_MOST_MOTION = 0.2
#: Rounds of motion and memory in turn.
_ROUNDS = 6


@dataclass(frozen=True)
class DifferenceNoise:
    """Noise of one channel.

    Parameters
    ----------
    variance : float
        Of a sample [m²].
    memory : float
        Correlation of neighbouring samples, falling as its powers; 0 of white noise.
    """

    variance: float
    memory: float

    def of_mean(self, n: int) -> float:
        """Variance of the mean of n samples in a row [m²]."""
        apart = np.arange(1, n)
        alike = 2.0 * float(np.sum((1.0 - apart / n) * self.memory**apart))
        return self.variance * (1.0 + alike) / n


def difference_noise(signals: Sequence[FloatArray]) -> tuple[DifferenceNoise, ...]:
    """Noise of records of slow motion that one measuring chain took.

    With every L-th sample the fifth differences of noise of variance s² and memory r have the mean
    square 252 s² g(r^L). The memory is that of the chain: the median over the signals in which
    motion is too slow to be seen at L = 2; none of them leaves it at zero.

    Parameters
    ----------
    signals : sequence of ndarray, shape (n,)
        Channels of all runs at even steps [m], NaN where missing.

    Returns
    -------
    tuple of DifferenceNoise
        One of each signal.

    Raises
    ------
    ValueError
        Where a signal has no six samples in a row.
    """
    squares = [[_difference_square(signal, lag) for lag in _LAGS] for signal in signals]
    if any(np.isnan(own[0]) for own in squares):
        raise ValueError(
            "a channel without 'noise_std' has no six samples in a row; expected its 'noise_std'"
        )
    told = [_told_memory(own) for own in squares]
    clean = [memory for memory, motion in told if motion < _MOST_MOTION]
    memory = float(np.median(clean)) if clean else 0.0
    return tuple(DifferenceNoise(own[0] / _seen(memory), memory) for own in squares)


def _told_memory(squares: Sequence[float]) -> tuple[float, float]:
    """Memory of one signal, and the share of motion in the differences at the second distance.

    What noise does not explain at the third and fourth distance is motion, whose growth from one to
    the other leads back to the second; it grows as L^10 at most.
    """
    first, second, third, fourth = squares
    if not np.all(np.isfinite(squares)) or min(first, second) <= 0.0:
        return 0.0, 1.0
    motion = 0.0
    for _ in range(_ROUNDS):
        memory = _memory((second - motion) / first)
        variance = first / _seen(memory)
        at_third = max(third - variance * _seen(memory**3), 0.0)
        at_fourth = max(fourth - variance * _seen(memory**4), 0.0)
        growth = 2.0 * _ORDER
        if at_third < at_fourth and at_third > 0.0:
            growth = min(growth, np.log(at_fourth / at_third) / np.log(4.0 / 3.0))
        motion = min(at_third * (2.0 / 3.0) ** growth, second)
    return memory, motion / second


def _difference_square(values: FloatArray, lag: int) -> float:
    """Square of the fifth differences of every lag-th sample over that of white noise [m²].

    NaN where there are none.
    """
    n = values.size - _ORDER * lag
    if n < 1:
        return np.nan
    weights = [(-1) ** k * comb(_ORDER, k) for k in range(_ORDER + 1)]
    differences = sum(w * values[k * lag : k * lag + n] for k, w in enumerate(weights))
    present = differences[np.isfinite(differences)]
    if present.size == 0:
        return np.nan
    return float(np.median(present**2) / _MEDIAN_CHI2 / _GAIN)


def _seen(memory: float) -> float:
    """Share of the variance of noise with a memory that the fifth differences see."""
    apart = range(1, _ORDER + 1)
    products = [(-1) ** m * comb(2 * _ORDER, _ORDER + m) * memory**m for m in apart]
    return 1.0 + 2.0 * sum(products) / _GAIN


def _memory(ratio: float) -> float:
    """Memory of noise from the squares of every second sample's differences over every one's."""

    def excess(memory: float) -> float:
        return _seen(memory**2) / _seen(memory) - ratio

    if excess(0.0) >= 0.0:
        return 0.0
    return float(brentq(excess, 0.0, _LONGEST)) if excess(_LONGEST) > 0.0 else _LONGEST
