"""How the records are sampled: gaps, uneven steps, steps too long for what moves."""

from collections.abc import Iterator

import numpy as np

from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning, sample_of

#: A step over the median step that is a gap, and the jitter of the steps that is told.
_GAP, _JITTER = 3.0, 0.2
#: Samples a revolution beyond those of the planets' second order: the sixth of three planets takes
#: more than twelve.
_BEYOND_SECOND_ORDER = 4
#: Share of the power of a drive above 0.8 of half the sampling rate.
_HIGHEST_SHARE = 0.05


def sampling_findings(campaign: Campaign) -> Iterator[CampaignWarning]:
    """Findings about the time column of every run.

    Yields
    ------
    CampaignWarning
        Checks ``sampling_gap``, ``uneven_steps``, ``sampling_rate``.
    """
    n_planets = int(campaign.rig.get("n_planets", CarrierParameters.n_planets))
    fewest = 4 * n_planets + _BEYOND_SECOND_ORDER
    for run in campaign.runs:
        if run.time.size > 3:
            yield from _gaps(run)
            yield from _samples_a_revolution(run, fewest)
            if campaign.kind == "element":
                for name in campaign.contract.inputs:
                    yield from _drive_spectrum(run, name)


def _gaps(run: Run) -> Iterator[CampaignWarning]:
    step = np.diff(run.time)
    typical = float(np.median(step))
    longest = int(np.argmax(step))
    line = sample_of(run.file, longest + 1)
    if step[longest] > _GAP * typical:
        missing = float(np.sum(step[step > _GAP * typical]))
        yield CampaignWarning(
            "sampling_gap",
            run.name,
            f"time jumps by {step[longest]:.4g} s where a step is {typical:.4g} s; "
            f"{missing:.4g} s are missing in all",
            "cut the run in two at the gap, or write empty cells for the samples that are missing",
            float(step[longest]),
            line,
        )
        return
    scatter = float(np.std(step)) / typical
    if scatter > _JITTER:
        yield CampaignWarning(
            "uneven_steps",
            run.name,
            f"steps of time scatter by {scatter:.0%}",
            "use the logger's own clock, not the time at which samples arrived",
            scatter,
            line,
        )


def _samples_a_revolution(run: Run, fewest: int) -> Iterator[CampaignWarning]:
    angle = run.inputs.get("carrier_angle")
    if angle is None:
        return
    revolutions = abs(float(angle[-1] - angle[0])) / (2.0 * np.pi)
    if revolutions < 1.0 or not np.diff(angle).any():
        return
    a_revolution = float(np.count_nonzero(np.diff(angle)) / revolutions)
    if a_revolution < fewest:
        yield CampaignWarning(
            "sampling_rate",
            run.name,
            f"{a_revolution:.1f} samples a revolution; orders above {a_revolution / 2.56:.0f} "
            "fold back onto lower ones",
            f"sample at least {fewest} times a revolution, behind a filter; "
            "check that carrier_angle is in rad and time in s",
            a_revolution,
            sample_of(run.file, 0),
        )


def _drive_spectrum(run: Run, name: str) -> Iterator[CampaignWarning]:
    """Power of an element's drive near half the sampling rate."""
    drive = run.inputs[name] - np.mean(run.inputs[name])
    power = np.abs(np.fft.rfft(drive * np.hanning(drive.size))) ** 2
    total = float(power.sum())
    if total <= 0.0:
        return
    share = float(power[int(0.8 * power.size) :].sum()) / total
    if share > _HIGHEST_SHARE:
        yield CampaignWarning(
            "sampling_rate",
            run.name,
            f"{share:.0%} of the power of '{name}' lies above 0.8 of half the sampling rate; more "
            "of it may have folded back",
            "sample faster, or drive with a lower band; filter before sampling",
            share,
            sample_of(run.file, 0),
        )
