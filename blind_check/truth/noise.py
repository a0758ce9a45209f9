"""Random parts that every truth shares.

Coloured noise, slow ripple, and streams of random numbers by case.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from carrierflex.blind_check.labels import KINDS, CasePlan

FloatArray = NDArray[np.float64]


def case_rng(plan: CasePlan) -> np.random.Generator:
    """Random numbers of one case: from seed, kind and number alone, whatever else is made."""
    return np.random.default_rng([plan.seed, KINDS.index(plan.kind), plan.number])


def noise_rng(plan: CasePlan, repeat: int) -> np.random.Generator:
    """Random numbers of the noise of one record of a case."""
    return np.random.default_rng([plan.seed, KINDS.index(plan.kind), plan.number, 1 + repeat])


def added_rng(plan: CasePlan) -> np.random.Generator:
    """Random numbers of runs that are added to a case: those of the case stay what they are."""
    return np.random.default_rng([plan.seed, KINDS.index(plan.kind), plan.number, 0, 1])


def coloured_noise(
    rng: np.random.Generator, shape: tuple[int, ...], *, memory: float
) -> FloatArray:
    """Stationary noise of variance 1, ``e_k = a e_(k-1) + sqrt(1 - a²) w_k``, over the last axis.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    shape : tuple of int
        Shape; time is the last axis.
    memory : float
        Coefficient a, from 0 (white) to below 1.

    Returns
    -------
    ndarray
        Noise.
    """
    white = rng.standard_normal(shape)
    state = memory * rng.standard_normal((*shape[:-1], 1))
    coloured, _ = lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white, axis=-1, zi=state)
    return np.asarray(coloured)


def slow_ripple(rng: np.random.Generator, time: FloatArray, *, size: float) -> FloatArray:
    """Sum of three slow sines whose largest value is at most `size`."""
    ripple = np.zeros_like(time)
    for period in rng.uniform(5.0, 30.0, 3):
        ripple += np.sin(2.0 * np.pi * (time / period + rng.uniform())) * size / 3.0
    return ripple


def largest_leak(plan: CasePlan) -> float:
    """What errors of measurement may leave by themselves, over the floor.

    0.3, or 3 % of the gap where that is more; with nothing missing 0.1: less than a sample of the
    noise tells of its own size, so that nothing can be found.
    """
    return max(0.3, 0.03 * plan.ratio) if plan.effects else 0.1


def uniform_std(largest: float) -> float:
    """Standard deviation of an error of which every size up to a largest is as likely."""
    return largest / float(np.sqrt(3.0))


def root_mean_square(values: FloatArray) -> float:
    """Root of the mean square over everything."""
    return float(np.sqrt(np.mean(np.square(values))))
