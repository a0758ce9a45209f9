"""Runs, or channels, that are one record under two names: equal samples, or equal noise."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, sample_of

FloatArray = NDArray[np.float64]

#: Difference of two inputs over their size that is none.
_SAME_INPUT = 1e-3
#: Correlation of the noise of two independent records is below this by many deviations; that of a
#: copy with new noise twice as large as the old is 0.45.
_CORRELATED = 0.3
_NOISE_ORDER = 6
#: Covariance of these differences one sample apart, over that of none, below which what two records
#: share is noise: white noise has -6/7, noise with a memory of 0.7 has -0.83, a motion or a tone
#: that both repeat 0.8.
_NOISE_TURNS = -0.75
#: Median sizes to which the differences are cut: the jumps of friction repeat, and are few.
_JUMP = 4.0
_FEWEST_SAMPLES = 100


def copied_runs(campaign: Campaign) -> dict[str, str]:
    """Runs that are copies, each with the name of the first run that it is a copy of.

    Two runs are one record where their inputs agree and their samples are equal, or the noise of
    their channels (differences of order 6) is correlated.

    Parameters
    ----------
    campaign : Campaign
        Records.

    Returns
    -------
    dict of str to str
        Empty where every run is a record of its own.
    """
    original: dict[str, str] = {}
    for first, second in combinations(campaign.runs, 2):
        if second.name not in original and _is_copy(first, second):
            original[second.name] = original.get(first.name, first.name)
    return original


def without_copies(campaign: Campaign, copies: Mapping[str, str]) -> Campaign:
    """Campaign with every record once; the same object where there are no copies.

    A copy in the training records tells what is held out, whatever its condition is called, and in
    a bootstrap it counts one record twice.

    Parameters
    ----------
    campaign : Campaign
        Records.
    copies : mapping of str to str
        Its copies, of :func:`copied_runs`.
    """
    if not copies:
        return campaign
    return replace(campaign, runs=tuple(run for run in campaign.runs if run.name not in copies))


def _is_copy(first: Run, second: Run) -> bool:
    if first.time.size != second.time.size:
        return False
    if all(_same(first.signals[name], second.signals[name]) for name in first.signals):
        return True
    if not all(_alike(first.inputs[name], second.inputs[name]) for name in first.inputs):
        return False
    known: list[float] = []
    low = 0
    for name in first.signals:
        value = _noise_correlation(first.signals[name], second.signals[name])
        if np.isfinite(value):
            known.append(value)
            low += value <= _CORRELATED
        # Of hundreds of runs under one load most pairs are settled by half of their channels.
        if low > 0.5 * len(first.signals):
            return False
    return bool(known) and float(np.median(known)) > _CORRELATED


def _same(first: FloatArray, second: FloatArray) -> bool:
    """Whether a signal that is not constant has equal samples."""
    return bool(
        np.array_equal(first, second, equal_nan=True)
        and np.isfinite(first).any()
        and np.nanmax(first) > np.nanmin(first)
    )


def _alike(first: FloatArray, second: FloatArray) -> bool:
    size = float(np.sqrt(np.mean(first**2)))
    return float(np.sqrt(np.mean((first - second) ** 2))) <= _SAME_INPUT * size


def _noise_correlation(first: FloatArray, second: FloatArray) -> float:
    one, two = np.diff(first, _NOISE_ORDER), np.diff(second, _NOISE_ORDER)
    both = np.isfinite(one) & np.isfinite(two)
    if np.count_nonzero(both) < _FEWEST_SAMPLES:
        return float("nan")
    one, two = (np.where(both, values, 0.0) for values in (one, two))
    norm = float(np.sqrt((one @ one) * (two @ two)))
    # Signals without noise differ by rounding, whose correlation says nothing.
    smallest = 1e-9 * float(np.nanmax(np.abs(first)))
    if norm <= both.sum() * smallest**2:
        return float("nan")
    one, two = _without_jumps(one), _without_jumps(two)
    norm = float(np.sqrt((one @ one) * (two @ two)))
    shared = float(one @ two)
    next_shared = 0.5 * float(one[1:] @ two[:-1] + one[:-1] @ two[1:])
    # What two releases or two equal drives repeat is motion, and no sign of one record.
    return shared / norm if next_shared < _NOISE_TURNS * shared else 0.0


def _without_jumps(differences: FloatArray) -> FloatArray:
    """Differences cut to a few times their median size."""
    most = _JUMP * float(np.median(np.abs(differences)))
    return np.clip(differences, -most, most) if most > 0.0 else differences


def _is_copied(runs: Sequence[Run], first: str, second: str) -> bool:
    """Whether two channels read one signal in every run, where it can be seen its noise too.

    Sensors at mirrored places of a simulation without noise agree too, and are no copies.
    """
    pairs = [(run.signals[first], run.signals[second]) for run in runs]
    has_shared_noise = (_noise_correlation(*pair) > _CORRELATED for pair in pairs)
    return all(_alike(*pair) for pair in pairs) and any(has_shared_noise)


def copy_findings(campaign: Campaign, copies: Mapping[str, str]) -> Iterator[CampaignWarning]:
    """One finding for every run that is a copy, of `copies`, and for every such channel.

    Yields
    ------
    CampaignWarning
        Checks ``copy``, ``copied_channel``.
    """
    for one, other in combinations(campaign.channels, 2):
        if _is_copied(campaign.runs, one.name, other.name):
            yield CampaignWarning(
                "copied_channel",
                f"{one.name}, {other.name}",
                f"{one.name} and {other.name} read the same signal in every run",
                "look for the cables or the columns of both; leave out the one that is wrong until "
                "it is found",
                1.0,
                sample_of(campaign.runs[0].file, 0),
            )
    files = {run.name: run.file for run in campaign.runs}
    for copy, original in copies.items():
        yield CampaignWarning(
            "copy",
            copy,
            f"run {copy} is the record of run {original} under another name: the same inputs and "
            "the same samples or noise",
            "remove one of the two, as the diagnosis does: with a copy among the training "
            "records, the held-out test is no test",
            1.0,
            sample_of(files[copy], 0),
        )
