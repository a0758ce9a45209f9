"""Where a free decay is released: after a rest, or several times in one record."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, key_of
from carrierflex.identification.campaign_check.sample_statistics import neighbour_noise

FloatArray = NDArray[np.float64]

AT_REST, SEVERAL = "wiring/at_rest", "wiring/several_releases"
#: Growth of the deflection's size from one period to the next that no free motion has.
_GROWS = 3.0
#: Share of the largest deflection from which a growth is a release.
_LEAST = 0.1
#: Periods before a release in which the motion is that small.
_SILENCE = 4
#: Size of noise over its scatter from sample to sample.
_NOISE = 5.0
#: Fewest samples of a period, and of a record.
_FEWEST = 8


def releases(values: FloatArray) -> tuple[int, ...]:
    """Samples at which a free decay is released.

    A free motion loses energy: from one period to the next its size does not grow. Where it grows
    threefold something has moved it, and the motion from there on is a decay of its own.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Deflection at even steps.

    Returns
    -------
    tuple of int
        Ascending; 0 where the record begins in motion. Empty where nothing moves.
    """
    known = np.isfinite(values)
    if np.count_nonzero(known) < 4 * _FEWEST:
        return ()
    y = np.interp(np.arange(values.size), np.flatnonzero(known), values[known])
    y = np.abs(y - np.median(y))
    noise = _NOISE * neighbour_noise(values[known])
    largest = float(y.max())
    if largest <= noise or largest <= 0.0:
        return ()
    period = _period(values[known] - np.median(values[known]))
    # A beat grows slowly, or from a short silence: some periods before, one from a sample on.
    silence = _SILENCE * period
    before = maximum_filter1d(y, silence, origin=(silence - 1) // 2, mode="nearest")
    before = np.concatenate([before[:1], before[:-1]])
    after = maximum_filter1d(y, period, origin=-(period // 2), mode="nearest")
    level = np.maximum(before, min(noise, largest / _GROWS**2))
    grows = np.flatnonzero((after > _GROWS * level) & (after > _LEAST * largest))
    starts = [0] if y[:period].max() > max(_LEAST * largest, _GROWS * noise) else []
    for first in _first_of_groups(grows, period):
        rise = np.flatnonzero(y[first:] > _GROWS * level[first])
        start = max(first + int(rise[0]) - 1, 0)
        if not starts or start > starts[-1] + period:
            starts.append(start)
    return tuple(starts)


def release_findings(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Free decays that rest before their release, or hold several.

    Parameters
    ----------
    campaign : Campaign
        Campaign without an input.

    Yields
    ------
    CampaignWarning
        Check ``release``, one a run.
    """
    name = campaign.channels[0].name
    for run in campaign.runs:
        starts = releases(run.within_use().signals[name])
        times = [float(run.time[start]) for start in starts]
        end = float(run.time[-1])
        if len(starts) > 1:
            yield CampaignWarning(
                "release",
                run.name,
                f"run {run.name} is released {len(starts)} times, at "
                f"{', '.join(f'{time:.2f}' for time in times)} s",
                "make a run of every release: carrierflex import cuts the logger's file there",
                float(len(starts)),
                key_of("[[runs]]", "use"),
                SEVERAL,
            )
        elif starts and starts[0] > 0:
            yield CampaignWarning(
                "release",
                run.name,
                f"run {run.name} rests until {times[0]:.2f} s and is released then",
                f"use = [[{times[0]:.2f}, {end:.2f}]], or import the logger's file again, which "
                "cuts the rest",
                times[0],
                key_of("[[runs]]", "use"),
                AT_REST,
            )


def cut_at_releases(run: Run) -> tuple[Run, ...]:
    """Runs of a free decay that each begin with their release.

    Parameters
    ----------
    run : Run
        Record without an input; its first signal is the deflection.

    Returns
    -------
    tuple of Run
        The run itself where it begins with its only release, or nothing moves; else one a release,
        with its number at the end of the name where there are several.
    """
    starts = releases(next(iter(run.signals.values())))
    if starts in ((), (0,)):
        return (run,)
    runs = []
    for number, (start, end) in enumerate(zip(starts, (*starts[1:], None), strict=True), 1):
        rows = slice(start, end)
        name = run.name if len(starts) == 1 else f"{run.name}-{number}"
        runs.append(
            replace(
                run,
                name=name,
                file=f"{name}.parquet",
                time=run.time[rows],
                signals={key: values[rows] for key, values in run.signals.items()},
            )
        )
    return tuple(runs)


def _period(values: FloatArray) -> int:
    """Samples of a period of the strongest line."""
    power = np.abs(np.fft.rfft(values)) ** 2
    power[0] = 0.0
    cycles = int(np.argmax(power))
    return max(values.size // max(cycles, 1), _FEWEST)


def _first_of_groups(samples: NDArray[np.int64], distance: int) -> list[int]:
    """First sample of every group that is at least a distance from the one before."""
    if not samples.size:
        return []
    starts = np.flatnonzero(np.diff(samples) > distance) + 1
    return [int(samples[k]) for k in (0, *starts)]
