"""Whether the drive itself changes with time, as in a sweep or a decay."""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.classes.columns import SplineBasis
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord

#: Windows of a run over which its amplitude and frequency are followed.
_WINDOWS = 40
_FEWEST_IN_WINDOW = 4
#: Splines of time: five do not imitate a stiffness that differs from run to run.
_N_TIME = 5
#: Bins of a spectrum that one line takes at most, by participation, through the Hann window.
_LINE_BINS = 3.0
_SMALLEST = np.finfo(float).tiny


def time_basis(own: Sequence[ForceRecord]) -> SplineBasis:
    """Splines of time over the longest run."""
    return SplineBasis(0.0, max(record.x.size * record.step for record in own), _N_TIME)


def is_separable_from_time(own: Sequence[ForceRecord], highest: float) -> bool:
    """Whether neither amplitude nor frequency of the motion follows time.

    R² of the windowed log RMS of x, and of v / x, on time splines common to all runs.

    Parameters
    ----------
    own : sequence of ForceRecord
        Runs.
    highest : float
        R² up to which neither does.
    """
    basis = time_basis(own)
    rows = []
    amplitudes = []
    frequencies = []
    for record in own:
        counted = np.flatnonzero(record.counts)
        # A decay that soon ends has fewer samples than windows.
        parts = np.array_split(counted, min(_WINDOWS, counted.size // _FEWEST_IN_WINDOW))
        x = np.array([np.std(record.x[part]) for part in parts])
        v = np.array([np.std(record.v[part]) for part in parts])
        middle = np.array([part.mean() for part in parts]) * record.step
        level = np.log(np.maximum(x, _SMALLEST))
        rate = np.log(np.maximum(v, _SMALLEST)) - level
        amplitudes.append(level - level.mean())
        frequencies.append(rate - rate.mean())
        rows.append(_centred(basis, middle))
    design = np.concatenate(rows, axis=1).T
    follows = [_r_squared(design, np.concatenate(values)) for values in (amplitudes, frequencies)]
    return max(follows) <= highest


def _centred(basis: SplineBasis, time: FloatArray) -> FloatArray:
    values = basis(time)
    return values - values.mean(axis=1, keepdims=True)


def _r_squared(design: FloatArray, target: FloatArray) -> float:
    """Adjusted R² of a least-squares fit."""
    c = np.linalg.lstsq(design, target, rcond=None)[0]
    total = float(target @ target)
    if total == 0.0:
        return 0.0
    degrees = max(target.size - np.linalg.matrix_rank(design), 1)
    left = float(np.sum((target - design @ c) ** 2)) / degrees
    return 1.0 - left / (total / target.size)


def has_one_frequency(drives: Sequence[tuple[FloatArray, float]]) -> bool:
    """Whether every run is driven at one and the same frequency.

    Then the band of the motion holds one line, whose height and phase alone splines of time fit.
    A line through the Hann window takes two bins by participation (and 2.2 at most, between two
    bins); two equal lines apart take four.

    Parameters
    ----------
    drives : sequence of (ndarray, float)
        Drive of each run at the samples that count, and its step [s].

    Returns
    -------
    bool
        False where a run is not driven at all.
    """
    places = []
    for u, step in drives:
        power = np.abs(np.fft.rfft((u - u.mean()) * np.hanning(u.size))) ** 2
        if power.sum() ** 2 >= _LINE_BINS * np.square(power).sum():
            return False
        width = 1.0 / (u.size * step)
        places.append((width * float(np.argmax(power)), width))
    low, high = min(places), max(places)
    return high[0] - low[0] <= low[1] + high[1]
