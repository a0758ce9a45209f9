"""Class of the missing effect of an element: table, what the drive can show, decision, shapes."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from carrierflex.diagnosis.classes.answer import class_answer
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.laws import DELAY, DRIVE_SIDE, TIME_VARIATION
from carrierflex.diagnosis.element.classes.shapes import measured_shape
from carrierflex.diagnosis.element.classes.splines import SplineBasis
from carrierflex.diagnosis.element.classes.table import CLASS_GROUPS, ElementTable, element_table
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord

#: Windows of a run over which its amplitude and frequency are followed.
_WINDOWS = 40
_FEWEST_IN_WINDOW = 4
_DRIVE_NOTE = (
    "the drive itself changes with time: a slow change with time is not separable from it in these "
    "records"
)
_ONE_FREQUENCY_NOTE = (
    "one frequency drives all runs: a slow change with time is not separable from what it leaves "
    "in these records"
)
#: Bins of a spectrum that one line takes at most, by participation, through the Hann window.
_LINE_BINS = 3.0


def element_class_answer(
    model: ElementModel,
    records: Sequence[ElementRecord],
    noise: FloatArray,
    noise_note: str = "",
    known: ElementTable | None = None,
) -> ClassAnswer | None:
    """Class of the missing effect.

    Parameters
    ----------
    model : ElementModel
        Baseline and library.
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the channel's noise by run.
    noise_note : str
        What the records cannot say of their noise.
    known : ElementTable, optional
        Table of these records and this noise, where it was made already.

    Returns
    -------
    ClassAnswer or None
        None where the records are too short.
    """
    constants = ClassConstants()
    own = known or element_table(model, records, noise, constants)
    if own is None:
        return None
    note = _note_of_time(own, constants)
    left_out = {TIME_VARIATION} if note else set()
    if model.states:
        # After a release a delay is a shift of the clock, and nothing is applied.
        left_out |= {DELAY, DRIVE_SIDE}
    candidates = [name for name in CLASS_GROUPS if name not in left_out]
    return class_answer(
        own.scores,
        candidates,
        shape_of=partial(measured_shape, own, model.units),
        drive_note="; ".join(text for text in (noise_note, note) if text),
    )


def _note_of_time(own: ElementTable, constants: ClassConstants) -> str:
    """Why a slow change with time cannot be told in these records; empty where it can."""
    if not is_separable_from_time(own, constants.separable_from_drive):
        return _DRIVE_NOTE
    return _ONE_FREQUENCY_NOTE if has_one_frequency(own) else ""


def has_one_frequency(own: ElementTable) -> bool:
    """Whether every run is driven at one and the same frequency.

    Then the band of the motion holds one line, whose height and phase alone splines of time fit.
    A line through the Hann window takes two bins by participation (and 2.2 at most, between two
    bins); two equal lines apart take four.
    """
    places = []
    for record in own.records:
        u = record.record.drive[record.counts]
        power = np.abs(np.fft.rfft((u - u.mean()) * np.hanning(u.size))) ** 2
        if power.sum() ** 2 >= _LINE_BINS * np.square(power).sum():
            return False
        width = 1.0 / (u.size * record.step)
        places.append((width * float(np.argmax(power)), width))
    low, high = min(places), max(places)
    return high[0] - low[0] <= low[1] + high[1]


def is_separable_from_time(own: ElementTable, highest: float) -> bool:
    """Whether neither amplitude nor frequency of the motion follows time.

    R² of the windowed log RMS of x, and of v / x, on the time splines common to all runs.
    """
    rows = []
    amplitudes = []
    frequencies = []
    for record in own.records:
        counted = np.flatnonzero(record.counts)
        # A decay that soon ends has fewer samples than windows.
        parts = np.array_split(counted, min(_WINDOWS, counted.size // _FEWEST_IN_WINDOW))
        x = np.array([np.std(record.x[part]) for part in parts])
        v = np.array([np.std(record.v[part]) for part in parts])
        middle = np.array([part.mean() for part in parts]) * record.step
        level = np.log(np.maximum(x, 1e-12 * own.bases.size.half_range))
        rate = np.log(np.maximum(v, 1e-12 * own.bases.size.speed)) - level
        amplitudes.append(level - level.mean())
        frequencies.append(rate - rate.mean())
        rows.append(_centred(own.bases.time, middle))
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
