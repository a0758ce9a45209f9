"""The measurement campaign: channels, runs and what the baseline simulation already contains.

The objects check what the contract says about their content; the files they come from are read and
written in :mod:`carrierflex.identification.campaign.campaign_files`.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from carrierflex.files.problems import refuse, repeated_names
from carrierflex.files.shown_values import shortened
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
    gain_std, zero_std, delay_std, angle_std : float, optional
        Standard deviations of the sensor's constant errors: of its gain (relative), its zero (in
        `unit`), its delay [s] and its angular position [rad].
    motion : str, optional
        ``relative`` to the moving base or ``absolute`` (kind element, base drive).
    """

    name: str
    quantity: str
    unit: str
    angle: float | None = None
    radius: float | None = None
    sensor: str | None = None
    noise_std: float | None = None
    gain_std: float | None = None
    zero_std: float | None = None
    delay_std: float | None = None
    angle_std: float | None = None
    motion: str | None = None

    def __post_init__(self) -> None:
        if any(mark in self.name for mark in ',"\r\n') or self.name != self.name.strip():
            raise ValueError(
                f"channel name {self.name!r} cannot head a CSV column; expected no commas, quotes "
                "or outer spaces"
            )


@dataclass(frozen=True, eq=False)
class InputSignal:
    """What a campaign declares of one input column.

    Parameters
    ----------
    name : str
        Input of the kind.
    unit : str
        Its unit; another one than the contract's in a voltage analogue.
    noise_std, gain_std, zero_std, delay_std, angle_std : float, optional
        As of a :class:`Channel`.
    """

    name: str
    unit: str
    noise_std: float | None = None
    gain_std: float | None = None
    zero_std: float | None = None
    delay_std: float | None = None
    angle_std: float | None = None


@dataclass(frozen=True)
class KnownValue:
    """What is known of a parameter beforehand: a value and its standard deviation.

    A standard deviation of zero holds the parameter at the value.
    """

    value: float
    std: float


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
    fixed : mapping of str to KnownValue
        Known physics by ``effect.parameter``, published names; a prior of every fit.
    impossible : tuple of str
        Effects that are not to be looked for.
    clock_shift : mapping of str to KnownValue
        Seconds by which an import moved the predictions, by run.
    """

    source: str
    effects: tuple[str, ...] = ()
    fixed: Mapping[str, KnownValue] = field(default_factory=dict)
    impossible: tuple[str, ...] = ()
    clock_shift: Mapping[str, KnownValue] = field(default_factory=dict)

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
    inputs : tuple of InputSignal
        What is declared of input columns: units of a voltage analogue, errors.
    notes : tuple of str
        What the reader left out of the files, for the user.

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
    inputs: tuple[InputSignal, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        kind = self.contract
        if not self.channels or not self.runs:
            raise ValueError(
                f"{len(self.channels)} channels and {len(self.runs)} runs; expected at least one "
                "of each"
            )
        refuse(f"[baseline]: {conflict}" for conflict in baseline_conflicts(self.baseline, kind))
        refuse(input_conflicts(self.inputs, kind))
        check_channels(self.channels, kind)
        for what in ("name", "file"):
            check_different([getattr(run, what) for run in self.runs], f"[[runs]] {what}")
        expected = expected_columns(kind, self.channels, self.baseline)
        for run in self.runs:
            refuse(column_conflicts(["time", *run.columns()], expected, f"run {run.name}"))

    @property
    def contract(self) -> CampaignKind:
        """What this kind of campaign holds."""
        measured = self.runs[0].inputs if self.runs else ()
        names = [*(declared.name for declared in self.inputs), *measured]
        return campaign_kind(self.kind, self.rig, names)

    @property
    def input_units(self) -> dict[str, str]:
        """Units of all inputs, as declared or by the contract."""
        return {**self.contract.inputs, **{own.name: own.unit for own in self.inputs}}

    def input_of(self, name: str) -> InputSignal:
        """What is declared of one input; its unit alone where nothing is."""
        declared = {own.name: own for own in self.inputs}
        return declared.get(name) or InputSignal(name, self.contract.inputs[name])

    def within_use(self) -> "Campaign":
        """Copy whose samples outside the windows that count are missing."""
        return replace(self, runs=tuple(run.within_use() for run in self.runs))

    def channels_of(self, quantity: str) -> tuple[Channel, ...]:
        """Channels that measure one quantity, in the order of the campaign."""
        return tuple(channel for channel in self.channels if channel.quantity == quantity)


def check_different(names: Iterable[str], what: str) -> None:
    """Refuse names that stand twice.

    Raises
    ------
    ValueError
        Where a name repeats.
    """
    refuse(repeated_names(names, what))


def baseline_conflicts(baseline: Baseline, kind: CampaignKind) -> Iterator[str]:
    """One text for everything in a baseline that the kind does not know or that contradicts."""
    for key, effects in (("effects", baseline.effects), ("impossible", baseline.impossible)):
        yield from repeated_names(effects, "effect")
        for effect in dict.fromkeys(effects):
            if effect not in kind.effects:
                known = ", ".join(kind.effects)
                yield f"unknown effect '{effect}' in '{key}'; kind {kind.name} knows {known}"
    for effect in baseline.effects:
        if effect in baseline.impossible:
            yield f"effect '{effect}' stands in 'effects' and in 'impossible'; expected one of them"
    for name in baseline.fixed:
        yield from _fixed_conflicts(name, baseline, kind)


def _fixed_conflicts(name: str, baseline: Baseline, kind: CampaignKind) -> Iterator[str]:
    """What is wrong with one key of ``[baseline.fixed]``."""
    effect, _, parameter = name.partition(".")
    if effect not in kind.parameters:
        known = ", ".join(kind.parameters)
        yield f"key 'fixed' holds '{name}'; expected 'effect.parameter' with one of {known}"
        return
    if parameter not in kind.parameters[effect]:
        known = ", ".join(kind.parameters[effect])
        yield f"key 'fixed' holds '{name}'; expected one of the parameters {known} of {effect}"
        return
    if effect in baseline.impossible:
        yield f"key 'fixed' holds '{name}', an effect of 'impossible'; expected another effect"
    partner = kind.partners.get((effect, parameter))
    if partner is not None and f"{effect}.{partner}" not in baseline.fixed:
        yield f"key 'fixed' holds '{name}' alone; expected '{effect}.{partner}' beside it"


def input_conflicts(inputs: Iterable[InputSignal], kind: CampaignKind) -> Iterator[str]:
    """One text for every input that the kind does not have, stands twice or has a wrong unit."""
    inputs = tuple(inputs)
    yield from repeated_names([own.name for own in inputs], "[[inputs]] name")
    for own in inputs:
        if own.name not in kind.inputs:
            known = ", ".join(kind.inputs) or "none: this drive has no input"
            yield f"[[inputs]]: key 'name' is '{own.name}'; expected one of {known}"
            continue
        expected = kind.inputs[own.name]
        if not _is_unit(own.unit, expected, kind):
            yield f"[[inputs]] {own.name}: key 'unit' is '{own.unit}'; expected '{expected}'"


def _is_unit(unit: str, expected: str, kind: CampaignKind) -> bool:
    """Whether a unit is the contract's, or that of an analogue where the kind allows one."""
    if not kind.any_unit:
        return unit == expected
    others = {*kind.inputs.values(), *kind.quantities.values(), *NOT_SI_UNITS} - {expected}
    return unit not in others


def check_channels(channels: Iterable[Channel], kind: CampaignKind) -> None:
    """Refuse channels whose name, quantity or unit the kind does not allow.

    Raises
    ------
    ValueError
        Where a name repeats or is that of an input, a quantity is unknown, or a unit is wrong.
    """
    refuse(channel_conflicts(channels, kind))


def channel_conflicts(channels: Iterable[Channel], kind: CampaignKind) -> Iterator[str]:
    """One text for everything that the kind does not allow in the channels."""
    channels = tuple(channels)
    yield from repeated_names([channel.name for channel in channels], "[[channels]] name")
    for channel in channels:
        where = f"[[channels]] {channel.name}"
        if channel.name == "time" or channel.name in kind.inputs:
            yield f"{where}: key 'name' is that of an input column; expected another name"
        if channel.quantity not in kind.quantities:
            known = ", ".join(kind.quantities)
            yield f"{where}: key 'quantity' is '{channel.quantity}'; expected one of {known}"
            continue
        expected = kind.quantities[channel.quantity]
        if not _is_unit(channel.unit, expected, kind):
            yield f"{where}: key 'unit' is '{channel.unit}'; expected '{expected}'"


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


def column_conflicts(
    columns: Iterable[str],
    expected: Mapping[str, str],
    where: str,
    *,
    others_allowed: bool = False,
    said_in: str = "",
) -> Iterator[str]:
    """One text for everything in which a header does not match the campaign.

    Parameters
    ----------
    columns : iterable of str
        Column names in the order of the file.
    expected : mapping of str to str
        Result of :func:`expected_columns`.
    where : str
        File or run, for the message.
    others_allowed : bool
        Whether columns that are neither input nor channel are left out instead of refused.
    said_in : str
        File that says which columns are expected: it may be the one that is wrong.
    """
    columns = tuple(columns)
    source = f" (as in {said_in})" if said_in else ""
    if not columns or columns[0] != "time":
        first = shortened(columns[0]) if columns else ""
        yield f"{where}: first column is '{first}'; expected 'time'"
    yield from repeated_names(columns, f"{where}: column")
    for name, what in expected.items():
        if name not in columns:
            found = shortened(", ".join(columns), 400)
            yield f"{where}: no column for the {what} '{name}'{source}; found {found}"
    for name in dict.fromkeys(columns[1:]):
        if name not in expected and name != "time" and not others_allowed:
            yield (
                f"{where}: column '{shortened(name)}' is neither an input nor a channel{source}; "
                f"expected time, {', '.join(expected)}"
            )
