"""The measurement campaign: channels, runs and what the baseline simulation already contains.

The objects check what the contract says about their content; the files they come from are read and
written in :mod:`carrierflex.identification.campaign.campaign_files`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from carrierflex.identification.campaign.campaign_kinds import (
    NOT_SI_UNITS,
    CampaignKind,
    campaign_kind,
)
from carrierflex.identification.campaign.records import PREDICTION_SUFFIX, Run


@dataclass(frozen=True, eq=False)
class Channel:
    """One measured signal.

    Parameters
    ----------
    name : str
        Column name in the run files.
    quantity, unit : str
        What is measured and in which unit.
    angle : float, optional
        Housing angle of the sensor [rad] (kind carrier).
    radius : float, optional
        Radius of the point it looks at [m] (kind carrier).
    sensor : str, optional
        Position on the housing (kind mounting).
    noise_std : float, optional
        Standard deviation of the noise, in `unit`.
    """

    name: str
    quantity: str
    unit: str
    angle: float | None = None
    radius: float | None = None
    sensor: str | None = None
    noise_std: float | None = None

    def __post_init__(self) -> None:
        if any(mark in self.name for mark in ',"\r\n') or self.name != self.name.strip():
            raise ValueError(
                f"channel name {self.name!r} cannot head a CSV column; expected no commas, quotes or outer spaces"
            )


@dataclass(frozen=True, eq=False)
class Baseline:
    """The simulation whose gap is to be explained.

    Parameters
    ----------
    source : str
        ``model`` (our simulator, driven with the measured inputs) or ``columns`` (predictions in
        the run files).
    effects : tuple of str
        Effects the baseline already contains, re-fitted together with any candidate.
    """

    source: str
    effects: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.source not in ("model", "columns"):
            raise ValueError(
                f"[baseline]: key 'source' is '{self.source}'; expected one of model, columns"
            )


@dataclass(frozen=True, eq=False)
class Campaign:
    """What was measured and what the simulation already contains.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.
    name : str
        Title.
    baseline : Baseline
        The simulation whose gap is to be explained.
    rig : mapping
        Nominal facts of the rig, by the keys of the kind.
    channels : tuple of Channel
        Measured signals.
    runs : tuple of Run
        Records.
    input_units : mapping of str to str
        Units of inputs that differ from the contract's (kind element: voltage analogue).

    Raises
    ------
    ValueError
        Where names repeat, a quantity, unit or effect is unknown, or a run's columns do not match.
    """

    kind: str
    name: str
    baseline: Baseline
    rig: Mapping[str, Any]
    channels: tuple[Channel, ...]
    runs: tuple[Run, ...]
    input_units: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        kind = self.contract
        if not self.channels or not self.runs:
            raise ValueError(
                f"{len(self.channels)} channels and {len(self.runs)} runs; expected at least one of each"
            )
        check_effects(self.baseline.effects, kind)
        check_channels(self.channels, kind)
        for what in ("name", "file"):
            check_different([getattr(run, what) for run in self.runs], f"[[runs]] {what}")
        expected = expected_columns(kind, self.channels, self.baseline)
        for run in self.runs:
            check_columns(["time", *run.columns()], expected, f"run {run.name}")

    @property
    def contract(self) -> CampaignKind:
        """What this kind of campaign holds."""
        return campaign_kind(self.kind, self.rig.get("drive"))

    def channels_of(self, quantity: str) -> tuple[Channel, ...]:
        """Channels that measure one quantity, in the order of the campaign."""
        return tuple(channel for channel in self.channels if channel.quantity == quantity)


def check_different(names: Iterable[str], what: str) -> None:
    """Refuse a name that stands twice.

    Raises
    ------
    ValueError
        Where a name repeats.
    """
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise ValueError(f"{what} '{name}' stands twice; expected different names")
        seen.add(name)


def check_effects(effects: Iterable[str], kind: CampaignKind) -> None:
    """Refuse an effect id that the kind does not know.

    Raises
    ------
    ValueError
        Where an id is unknown or stands twice.
    """
    effects = tuple(effects)
    check_different(effects, "[baseline]: effect")
    for effect in effects:
        if effect not in kind.effects:
            raise ValueError(
                f"[baseline]: unknown effect '{effect}' in 'effects'; kind {kind.name} knows {', '.join(kind.effects)}"
            )


def check_channels(channels: Iterable[Channel], kind: CampaignKind) -> None:
    """Refuse channels whose name, quantity or unit the kind does not allow.

    Raises
    ------
    ValueError
        Where a name repeats or is that of an input, a quantity is unknown, or a unit is wrong.
    """
    channels = tuple(channels)
    check_different([channel.name for channel in channels], "[[channels]] name")
    for channel in channels:
        where = f"[[channels]] {channel.name}"
        if channel.name == "time" or channel.name in kind.inputs:
            raise ValueError(
                f"{where}: key 'name' is that of an input column; expected another name"
            )
        if channel.quantity not in kind.quantities:
            raise ValueError(
                f"{where}: key 'quantity' is '{channel.quantity}'; expected one of {', '.join(kind.quantities)}"
            )
        expected = kind.quantities[channel.quantity]
        others = {*kind.inputs.values(), *NOT_SI_UNITS} - {expected}
        allowed = channel.unit not in others if kind.any_unit else channel.unit == expected
        if not allowed:
            raise ValueError(f"{where}: key 'unit' is '{channel.unit}'; expected '{expected}'")


def expected_columns(
    kind: CampaignKind, channels: Iterable[Channel], baseline: Baseline
) -> dict[str, str]:
    """Columns of every run file after ``time``: what each one is, by its name.

    Raises
    ------
    ValueError
        Where a channel has the name of another channel's prediction.
    """
    names = [channel.name for channel in channels]
    predictions = (
        [name + PREDICTION_SUFFIX for name in names] if baseline.source == "columns" else []
    )
    check_different([*names, *predictions], "column")
    return {
        **dict.fromkeys(kind.inputs, "input"),
        **dict.fromkeys(names, "channel"),
        **dict.fromkeys(predictions, "prediction"),
    }


def check_columns(found: Iterable[str], expected: Mapping[str, str], where: str) -> None:
    """Refuse a run file whose header does not match the campaign.

    Parameters
    ----------
    found : iterable of str
        Column names in the order of the file.
    expected : mapping of str to str
        Result of :func:`expected_columns`.
    where : str
        File or run, for the message.

    Raises
    ------
    ValueError
        Where ``time`` does not come first, or a column is missing, unknown or repeated.
    """
    found = tuple(found)
    if not found or found[0] != "time":
        raise ValueError(f"{where}: first column is '{found[0] if found else ''}'; expected 'time'")
    check_different(found, f"{where}: column")
    for name, what in expected.items():
        if name not in found:
            raise ValueError(
                f"{where}: no column for the {what} '{name}'; found {', '.join(found)}"
            )
    for name in found[1:]:
        if name not in expected:
            raise ValueError(
                f"{where}: column '{name}' is neither an input nor a channel; expected time, {', '.join(expected)}"
            )
