"""What a campaign declares: channels, inputs, the baseline, and what its kind allows of them.

All of it stands in campaign.toml. The records that it leads to are objects of
:mod:`carrierflex.identification.campaign.records`; nothing here holds an array, so that a document
is checked without the libraries of arrays.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from carrierflex.files.problems import refuse, repeated_names
from carrierflex.files.shown_values import shortened
from carrierflex.identification.campaign.campaign_kinds import NOT_SI_UNITS, CampaignKind
from carrierflex.simulation.carrier.effects.inside_stage import (
    STAGE_EFFECTS,
    STAGE_PARAMETERS,
    STAGE_PARTNERS,
)

#: Column of a run file that holds another simulator's prediction of a channel.
PREDICTION_SUFFIX = "_sim"


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
    axis : str, optional
        Axis of the shaft, ``y`` or ``z``, that a bending moment is about (kind mounting).
    section : float, optional
        Distance of its gauges upwind of the main bearing [m].
    noise_std : float, optional
        Standard deviation of the noise, in `unit`.
    gain_std, zero_std, delay_std, angle_std, radius_std : float, optional
        Standard deviations of the sensor's constant errors: of its gain (relative), its zero (in
        `unit`), its delay [s], its angular position [rad] and the radius it looks at [m].
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
    radius_std: float | None = None
    motion: str | None = None
    axis: str | None = None
    section: float | None = None

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


#: Key of the rig: standard deviation of each dimension and material constant from its drawing.
TOLERANCES = "tolerances"
#: Tolerance that is of the computed curves: of each order, over the curve's RMS.
CURVES = "curves"


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
        ``model`` (our simulator, driven with the measured inputs), ``columns`` (predictions in
        the run files) or ``stage`` (predictions by the planetary stage of `case`).
    effects : tuple of str
        Effects the baseline already contains, re-fitted together with any candidate.
    fixed : mapping of str to KnownValue
        Known physics by ``effect.parameter``, published names; a prior of every fit.
    impossible : tuple of str
        Effects that are not to be looked for.
    clock_shift : mapping of str to KnownValue
        Seconds by which an import moved the predictions, by run.
    case : str
        File of the stage case behind the prediction; empty where no stage makes it.
    """

    source: str
    effects: tuple[str, ...] = ()
    fixed: Mapping[str, KnownValue] = field(default_factory=dict)
    impossible: tuple[str, ...] = ()
    clock_shift: Mapping[str, KnownValue] = field(default_factory=dict)
    case: str = ""

    def __post_init__(self) -> None:
        if self.source not in ("model", "columns", "stage"):
            raise ValueError(
                f"[baseline]: key 'source' is '{self.source}'; expected one of model, columns, "
                "stage"
            )


@dataclass(frozen=True)
class SimulatedMark:
    """Table ``[simulated]`` of campaign.toml, written by this program's simulators only.

    Parameters
    ----------
    software : str
        Name and version of the program.
    sha256 : mapping of str to str
        Hexadecimal digest of each run file, by file name.
    """

    software: str
    sha256: Mapping[str, str]

    def table(self) -> dict[str, object]:
        """The table, ready for a TOML writer."""
        return {"software": self.software, "sha256": dict(self.sha256)}


def candidates_of(baseline: Baseline, kind: CampaignKind) -> tuple[str, ...]:
    """Ids of the effects that may be missing in a baseline, causes inside its stage among them."""
    return (*kind.effects, *(STAGE_EFFECTS if baseline.case else ()))


def baseline_conflicts(baseline: Baseline, kind: CampaignKind) -> Iterator[str]:
    """One text for everything in a baseline that the kind does not know or that contradicts."""
    for key, effects, known in (
        ("effects", baseline.effects, kind.effects),
        ("impossible", baseline.impossible, candidates_of(baseline, kind)),
    ):
        yield from repeated_names(effects, "effect")
        for effect in dict.fromkeys(effects):
            if effect not in known:
                listed = ", ".join(known)
                yield f"unknown effect '{effect}' in '{key}'; kind {kind.name} knows {listed}"
    if baseline.source == "stage" and kind.name != "carrier":
        yield f"key 'source' is 'stage'; expected model or columns, kind {kind.name} has no stage"
    for effect in baseline.effects:
        if effect in baseline.impossible:
            yield f"effect '{effect}' is in 'effects' and in 'impossible'; expected one of them"
    if baseline.case:
        parameters = {**kind.parameters, **STAGE_PARAMETERS}
        kind = replace(kind, parameters=parameters, partners={**kind.partners, **STAGE_PARTNERS})
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
        yield f"key 'fixed' holds '{name}' alone; expected '{effect}.{partner}' too"


def input_conflicts(inputs: Iterable[InputSignal], kind: CampaignKind) -> Iterator[str]:
    """One text for every input that the kind does not have, stands twice or has a wrong unit."""
    inputs = tuple(inputs)
    yield from repeated_names([signal.name for signal in inputs], "[[inputs]] name")
    for signal in inputs:
        if signal.name not in kind.inputs:
            known = ", ".join(kind.inputs) or "none: this drive has no input"
            yield f"[[inputs]]: key 'name' is '{signal.name}'; expected one of {known}"
            continue
        expected = kind.inputs[signal.name]
        if not _is_unit(signal.unit, expected, kind):
            yield f"[[inputs]] {signal.name}: key 'unit' is '{signal.unit}'; expected '{expected}'"


def _is_unit(unit: str, expected: str, kind: CampaignKind) -> bool:
    """Whether a unit is the contract's, or that of an analogue where the kind allows one."""
    if not kind.any_unit:
        return unit == expected
    others = {*kind.inputs.values(), *kind.quantities.values(), *NOT_SI_UNITS} - {expected}
    return unit not in others


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
    refuse(repeated_names([*names, *predictions], "column"))
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
            listed = shortened(", ".join(columns), 400)
            yield f"{where}: no column for the {what} '{name}'{source}; found {listed}"
    for name in dict.fromkeys(columns[1:]):
        if name not in expected and name != "time" and not others_allowed:
            yield (
                f"{where}: column '{shortened(name)}' is neither an input nor a channel{source}; "
                f"expected time, {', '.join(expected)}"
            )
