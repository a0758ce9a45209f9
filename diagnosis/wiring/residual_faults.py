"""Faults of a record that stand out only once the prediction of the baseline is taken away.

Beside a signal three thousand times the noise a tone of ten floors, or a sample that repeats the
one before, is no more to be seen than the gap itself.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from carrierflex.diagnosis.wiring.rivals import PredictedRecord
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, sample_of
from carrierflex.identification.campaign_check.tones import answers_few_lines, turns_with_the_shaft

FloatArray = NDArray[np.float64]

#: Share of the samples that lone samples may be, and of the gap that they must make, to be told.
_FEW, _MOST_OF_THE_GAP = 0.02, 0.5
#: Size of a lone sample over the median size in its channel, and over its two neighbours.
_FAR, _ALONE = 10.0, 3.0
#: A line's power over the median of its surroundings, and the half width of these in lines.
_STANDS_OUT, _SURROUNDINGS = 60.0, 40
_FEWEST_SAMPLES = 256
#: Runs that must show a tone; its largest amplitude over its smallest, and the same of the signals,
#: which tell a tone that is there by itself from one that grows with the load.
_IN_RUNS = 0.6
_STEADY = 1.3
_GROWS = 1.5
#: Share of the gap above the floor that a tone must make.
_OF_THE_GAP = 0.3


def residual_findings(
    records: Sequence[PredictedRecord], campaign: Campaign, floor: float
) -> Iterator[CampaignWarning]:
    """Findings about what the fitted baseline leaves of the records.

    Parameters
    ----------
    records : sequence of PredictedRecord
        All runs beside the fitted baseline, which leaves a gap.
    campaign : Campaign
        The same runs.
    floor : float
        Mean square of the noise.

    Yields
    ------
    CampaignWarning
        Checks ``outliers`` and ``tone``.
    """
    runs = {run.name: run for run in campaign.runs}
    files = {run.name: run.file for run in campaign.runs}
    for c, channel in enumerate(campaign.channels):
        residuals = {
            record.run: record.measured[:, c] - record.predicted[:, c] for record in records
        }
        known = np.concatenate([values[np.isfinite(values)] for values in residuals.values()])
        above = float(np.sum(known**2)) - floor * known.size
        if above <= 0.0:
            continue
        yield from _lone_samples(channel.name, channel.unit, residuals, files, above)
        yield from _steady_tone(channel.name, channel.unit, c, residuals, records, runs, above)


def _lone_samples(
    channel: str,
    unit: str,
    residuals: Mapping[str, FloatArray],
    files: Mapping[str, str],
    above: float,
) -> Iterator[CampaignWarning]:
    """Few samples, each far beyond its neighbours, that make most of the gap of a channel."""
    count = 0
    size = 0
    square = 0.0
    worst = ("", 0, 0.0)
    for run, residual in residuals.items():
        values = np.abs(np.where(np.isfinite(residual), residual, 0.0))
        neighbours = np.maximum(values[:-2], values[2:])
        middle = values[1:-1]
        typical = float(np.median(values[values > 0.0])) if values.any() else 0.0
        alone = (middle > _FAR * typical) & (middle > _ALONE * neighbours)
        size += values.size
        count += int(alone.sum())
        square += float(np.sum(middle[alone] ** 2))
        if alone.any():
            k = int(np.argmax(np.where(alone, middle, 0.0)))
            worst = max(worst, (run, k + 1, float(middle[k])), key=lambda entry: entry[2])
    if 0 < count <= _FEW * size and square > _MOST_OF_THE_GAP * above:
        run, sample, distance = worst
        yield CampaignWarning(
            "outliers",
            channel,
            f"{count} samples make {min(square / above, 1.0):.0%} of the gap, each alone, the "
            f"worst {distance:.3g} {unit} from the prediction in run {run}",
            "dropouts or spikes of the measuring chain: leave these cells empty",
            float(count),
            sample_of(files[run], sample),
        )


def _steady_tone(
    channel: str,
    unit: str,
    number: int,
    residuals: Mapping[str, FloatArray],
    records: Sequence[PredictedRecord],
    runs: Mapping[str, Run],
    above: float,
) -> Iterator[CampaignWarning]:
    """A line at one frequency, as large in runs whose signals are not."""
    shown = []
    for record in records:
        frequency, amplitude = _strongest_line(record.time, residuals[record.run])
        if amplitude > 0.0 and not _is_of_the_machine(runs[record.run], record, number, frequency):
            level = float(np.nanstd(record.measured[:, number]))
            shown.append((frequency, amplitude, level, record))
    if len(shown) < 2:
        return
    typical = float(np.median([entry[0] for entry in shown]))
    alike = [
        entry
        for entry in shown
        if abs(entry[0] - typical) < 2.0 / float(entry[3].time[-1] - entry[3].time[0])
    ]
    amplitudes = np.array([entry[1] for entry in alike])
    levels = np.array([entry[2] for entry in alike])
    if len(alike) <= _IN_RUNS * len(records) or len(alike) < 2:
        return
    square = sum(0.5 * entry[1] ** 2 * entry[3].time.size for entry in alike)
    is_steady = amplitudes.max() < _STEADY * amplitudes.min()
    if is_steady and levels.max() > _GROWS * levels.min() and square > _OF_THE_GAP * above:
        yield CampaignWarning(
            "tone",
            channel,
            f"a tone of {typical:.3f} Hz, amplitude {float(np.median(amplitudes)):.3g} {unit}, in "
            f"{len(alike)} of {len(records)} runs beside the prediction, as large in all of them "
            "while the signals are not",
            "look for electrical hum (shield, ground, filter before sampling) or for something "
            "else that vibrates at this frequency",
            typical,
            sample_of(runs[alike[0][3].run].file, 0),
        )


def _is_of_the_machine(run: Run, record: PredictedRecord, number: int, frequency: float) -> bool:
    """Whether a line is an order of the shaft, or of a drive or its harmonics."""
    residual = record.measured[:, number] - record.predicted[:, number]
    known = np.isfinite(residual)
    time = run.time - run.time[0]
    level = np.interp(time, record.time[known] - record.time[0], residual[known])
    if "carrier_angle" in run.inputs and turns_with_the_shaft(run, level, frequency):
        return True
    drives = [drive for name, drive in run.inputs.items() if name != "carrier_angle"]
    return any(answers_few_lines(drive, run.time, frequency) for drive in drives)


def _strongest_line(time: FloatArray, residual: FloatArray) -> tuple[float, float]:
    """Frequency [Hz] and amplitude of the line that stands out most; zero where none does."""
    present = np.isfinite(residual)
    if np.count_nonzero(present) < _FEWEST_SAMPLES:
        return 0.0, 0.0
    first, last = np.flatnonzero(present)[[0, -1]]
    span = slice(int(first), int(last) + 1)
    level = np.interp(time[span], time[present], residual[present])
    window = np.hanning(level.size)
    power = np.abs(np.fft.rfft((level - level.mean()) * window)) ** 2
    surroundings = median_filter(power, 2 * _SURROUNDINGS + 1, mode="nearest")
    power[:4] = 0.0
    k = int(np.argmax(power))
    if power[k] <= _STANDS_OUT * surroundings[k] or k == power.size - 1:
        return 0.0, 0.0
    step = mean_step(time[span])
    # Power of a tone between two lines is in both of them; a Hann window has 1.5 lines.
    amplitude = float(np.sqrt(np.sum(power[k - 1 : k + 2]) / 1.5)) * 2.0 / float(window.sum())
    return float(np.fft.rfftfreq(level.size, step)[k]), amplitude
