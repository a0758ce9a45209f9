"""Lines in the spectrum that belong to nothing that turns or drives: mains hum and other tones."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from carrierflex.files.quantities import sized
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, sample_of

FloatArray = NDArray[np.float64]

#: A line's power over the median of its surroundings, and the half width of these in lines.
_STANDS_OUT, _SURROUNDINGS = 60.0, 40
#: Lines beside the peak that may still stand out: a tone keeps its frequency, an order does not.
_NARROW = 3
#: Amplitude of the nearest order over that of the line from which the line is that order.
_LIKE_AN_ORDER = 0.7
#: Share of the runs that must show a tone.
IN_RUNS = 0.6
#: Amplitude of a tone over the noise that is told.
_LOUD = 1.0
_FEWEST_SAMPLES = 256
#: Harmonics of a drive of few lines that a nonlinear element shows.
_MOST_HARMONICS = 10.0
#: A line of a drive over its surroundings; power that drives whatever is beside it, and power that
#: is rounding, both over the strongest line.
_LINE_OF_DRIVE = 20.0
#: Lines of the spectrum to either side that are the same line.
_WIDTH = 4
_STRONG = 1e-3
_ROUNDING = 1e-12
_MAINS_HZ = (50.0, 60.0)


@dataclass(frozen=True)
class Tone:
    """A line of a spectrum."""

    frequency_hz: float  # Frequency [Hz]
    amplitude: float  # In the unit of the signal


def tone_findings(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Tones that stand at the same frequency in most runs of a channel.

    Yields
    ------
    CampaignWarning
        Check ``tone``.
    """
    runs = [run for run in campaign.runs if run.time.size >= _FEWEST_SAMPLES]
    for channel in campaign.channels:
        tones = [
            (run, tone)
            for run in runs
            for tone in lines_that_stand_out(run.time, run.signals[channel.name])
            if not _is_expected(run, run.signals[channel.name], tone.frequency_hz)
        ]
        for run, tone in sorted(tones, key=lambda pair: -pair[1].amplitude):
            width = 2.0 / float(run.time[-1] - run.time[0])
            alike = {
                other.name
                for other, candidate in tones
                if abs(candidate.frequency_hz - tone.frequency_hz)
                < max(width, 2.0 / float(other.time[-1] - other.time[0]))
            }
            if len(alike) > IN_RUNS * len(runs):
                yield CampaignWarning(
                    "tone",
                    channel.name,
                    f"{_named(tone.frequency_hz, run)}, amplitude "
                    f"{sized(tone.amplitude, channel.unit)}, in {len(alike)} of {len(runs)} runs; "
                    "nothing turns or drives there",
                    "look for electrical hum (shield, ground, filter before sampling) or for "
                    "something else that vibrates at this frequency",
                    tone.frequency_hz,
                    sample_of(run.file, 0),
                )
                break


def lines_that_stand_out(time: FloatArray, values: FloatArray) -> list[Tone]:
    """Narrow lines of one record that stand out of what is beside them.

    Parameters
    ----------
    time, values : ndarray, shape (n,)
        Time [s] and signal; NaN where missing.
    """
    present = np.isfinite(values)
    if np.count_nonzero(present) < _FEWEST_SAMPLES:
        return []
    span = slice(np.argmax(present), present.size - np.argmax(present[::-1]))
    time, level = time[span], np.interp(time[span], time[present], values[present])
    frequency, power, scale = _spectrum(level, time)
    typical = median_filter(power, 2 * _SURROUNDINGS + 1, mode="nearest")
    stands_out = power > _STANDS_OUT * np.maximum(typical, np.finfo(float).tiny)
    tones = []
    for line in np.flatnonzero(stands_out[1:-1]).tolist():
        k = line + 1
        amplitude = float(np.sqrt(power[k]) * scale)
        floor = np.sqrt(typical[k]) * scale * np.sqrt(level.size) / 2.0
        around = stands_out[max(k - 3 * _NARROW, 0) : k + 3 * _NARROW + 1]
        is_peak = power[k] >= power[k - 1] and power[k] >= power[k + 1]
        if not is_peak or around.sum() > 2 * _NARROW + 1 or amplitude < _LOUD * floor:
            continue
        tones.append(Tone(float(frequency[k]), amplitude))
    return tones


def _spectrum(values: FloatArray, time: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Frequency [Hz], power, and the factor from its root to an amplitude."""
    window = np.blackman(values.size)
    step = mean_step(time)
    line = np.polynomial.Polynomial.fit(time, values, 1)(time)
    power = np.abs(np.fft.rfft((values - line) * window)) ** 2
    frequency = np.asarray(np.fft.rfftfreq(values.size, step), dtype=np.float64)
    return frequency, np.asarray(power, dtype=np.float64), 2.0 / float(window.sum())


def _is_expected(run: Run, values: FloatArray, frequency: float) -> bool:
    """Whether a frequency is that of an order of the shaft, or of an input or its harmonics."""
    return turns_with_the_shaft(run, values, frequency) or is_driven(run, frequency)


def is_driven(run: Run, frequency: float) -> bool:
    """Whether a force or load of a run has power at a frequency [Hz], or at its divisor."""
    return any(
        name != "carrier_angle" and _drives_at(column, run.time, frequency)
        for name, column in run.inputs.items()
    )


def turns_with_the_shaft(run: Run, values: FloatArray, frequency: float) -> bool:
    """Whether a line [Hz] is an order: as strong beside the angle as beside the time.

    An order keeps its place in angle, a tone in time, so that a tone between two orders, or one
    that slips past an order while the speed changes, has little of the order's wave.
    """
    if "carrier_angle" not in run.inputs:
        return False
    present = np.isfinite(values)
    values = np.interp(run.time, run.time[present], values[present])
    angle = run.inputs["carrier_angle"]
    duration = float(run.time[-1] - run.time[0])
    turns = abs(float(angle[-1] - angle[0])) / (2.0 * np.pi)
    if turns <= 0.0 or frequency < 2.0 / duration:
        return True
    order = float(np.round(frequency * duration / turns))
    window = np.blackman(values.size)
    line = np.polynomial.Polynomial.fit(run.time, values, 1)(run.time)
    weighted = (values - line) * window
    of_order = abs(np.sum(weighted * np.exp(-1j * order * angle)))
    of_tone = abs(np.sum(weighted * np.exp(-2j * np.pi * frequency * run.time)))
    return bool(of_order > _LIKE_AN_ORDER * of_tone)


def _drives_at(values: FloatArray, time: FloatArray, frequency: float) -> bool:
    """Whether an input has power at a frequency, or at one that it is a multiple of."""
    if not np.ptp(values) > 0.0:
        return False
    lines, power, _ = _spectrum(values, time)
    typical = median_filter(power, 2 * _SURROUNDINGS + 1, mode="nearest")
    is_line = (power > _LINE_OF_DRIVE * typical) & (power > _ROUNDING * power.max())
    strong = is_line | (power > _STRONG * power.max())
    nearest = int(np.argmin(np.abs(lines - frequency)))
    if strong[max(nearest - _WIDTH, 0) : nearest + _WIDTH + 1].any():
        return True
    return _is_a_harmonic(lines, power, frequency)


def answers_few_lines(values: FloatArray, time: FloatArray, frequency: float) -> bool:
    """Whether an input of few lines has one, or its multiple, at a frequency [Hz].

    Parameters
    ----------
    values, time : ndarray, shape (n,)
        Input and time [s].
    frequency : float
        Frequency of a line in a signal.
    """
    if not np.ptp(values) > 0.0:
        return False
    lines, power, _ = _spectrum(values, time)
    return _is_a_harmonic(lines, power, frequency)


def _is_a_harmonic(lines: FloatArray, power: FloatArray, frequency: float) -> bool:
    """Whether a nonlinear element answers there: at multiples of a drive of few lines."""
    loud = np.flatnonzero(power > 0.05 * power.max())
    if loud.size > 30:
        return False
    ratio = frequency / np.maximum(lines[loud], lines[1])
    near = np.abs(ratio - np.round(ratio)) * lines[loud] < _WIDTH * lines[1]
    return bool((near & (ratio < _MOST_HARMONICS)).any())


def _named(frequency: float, run: Run) -> str:
    """Frequency in words, with the mains behind it where it folds back there."""
    rate = (run.time.size - 1) / float(run.time[-1] - run.time[0])
    for mains in _MAINS_HZ:
        for harmonic in (1, 2, 3):
            folded = abs(harmonic * mains - rate * np.round(harmonic * mains / rate))
            if abs(folded - frequency) < 2.0 / float(run.time[-1] - run.time[0]) + 1e-3 * rate:
                return f"a tone of {frequency:.3f} Hz, where {harmonic * mains:.0f} Hz would appear"
    return f"a tone of {frequency:.3f} Hz"
