"""Part of a campaign: some of its runs and channels, another baseline, fewer candidates."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from carrierflex.files.problems import refuse
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import candidates_of


def campaign_part(
    campaign: Campaign,
    *,
    runs: Sequence[str] = (),
    channels: Sequence[str] = (),
    baseline: Sequence[str] | None = None,
    effects: Sequence[str] = (),
) -> Campaign:
    """Campaign as if only a part of it had been measured, or its baseline were another.

    Parameters
    ----------
    campaign : Campaign
        As it was read.
    runs, channels : sequence of str
        Names of those that stay; all of them where empty.
    baseline : sequence of str, optional
        Effects that the baseline contains, in place of its own.
    effects : sequence of str
        Effects to be looked for; all of the kind where empty.

    Returns
    -------
    Campaign
        The same where nothing is chosen.

    Raises
    ------
    ValueError
        Where a name is not known, all of them at once.
    """
    known = campaign.contract.effects
    candidates = candidates_of(campaign.baseline, campaign.contract)
    refuse(
        [
            *_unknown(runs, [run.name for run in campaign.runs], "--runs"),
            *_unknown(channels, [channel.name for channel in campaign.channels], "--channels"),
            *_unknown(baseline or (), known, "--baseline"),
            *_unknown(effects, candidates, "--effects"),
        ]
    )
    channels_of_choice = [c for c in campaign.channels if not channels or c.name in channels]
    names = {channel.name for channel in channels_of_choice}
    records = tuple(run for run in campaign.runs if not runs or run.name in runs)
    if len(channels_of_choice) < len(campaign.channels):
        records = tuple(run.of_channels(names) for run in records)
    declared = campaign.baseline
    contained = declared.effects if baseline is None else tuple(baseline)
    others = (name for name in candidates if effects and name not in effects)
    ruled_out = {*declared.impossible, *others}
    impossible = tuple(name for name in candidates if name in ruled_out and name not in contained)
    return replace(
        campaign,
        channels=tuple(channels_of_choice),
        runs=records,
        baseline=replace(declared, effects=contained, impossible=impossible),
    )


def _unknown(names: Iterable[str], known: Sequence[str], option: str) -> list[str]:
    return [
        f"{option} names '{name}'; expected one of {', '.join(known)}"
        for name in names
        if name not in known
    ]
