"""What campaign.toml holds of signals: one table a channel, one an input."""

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import AfterValidator

from carrierflex.files.problems import Problems, refuse
from carrierflex.files.toml_values import Expected, Number, Positive, Text, TomlTable, key
from carrierflex.identification.campaign.campaign_kinds import CampaignKind
from carrierflex.identification.campaign.declarations import (
    Channel,
    InputSignal,
    channel_conflicts,
    input_conflicts,
)


class ChannelTable(TomlTable):
    """One measured signal."""

    name: Text = key("Column name in the run files")
    quantity: Text = key("What is measured")
    unit: Text = key("Unit of the column")
    noise_std: Positive | None = key(
        "Standard deviation of the noise, in the channel's unit",
        default=None,
    )
    gain_std: Positive | None = key(
        "Standard deviation of the gain's error, relative", since=2, default=None
    )
    zero_std: Positive | None = key(
        "Standard deviation of the zero's error, in the channel's unit", since=2, default=None
    )
    delay_std: Positive | None = key(
        "Standard deviation of the delay's error", "s", since=2, default=None
    )


class CarrierChannelTable(ChannelTable):
    """One proximity sensor at the rim of the carrier."""

    angle_deg: Number = key("Housing angle about x from the z axis", "deg")
    radius_m: Positive = key("Radius of the point that the sensor looks at", "m")
    angle_std_deg: Positive | None = key(
        "Standard deviation of the error of the angle", "deg", since=2, default=None
    )


class MountingChannelTable(ChannelTable):
    """One motion sensor on the housing."""

    sensor: Annotated[
        Literal["ssx", "spx", "ssz", "spz", "spy", "sbx"],
        Expected("one of ssx, spx, ssz, spz, spy, sbx"),
    ] = key("Position on the housing")


class ElementChannelTable(ChannelTable):
    """The measured signal of an element."""

    motion: (
        Annotated[Literal["relative", "absolute"], Expected("one of relative, absolute")] | None
    ) = key(
        "Deflection relative to the moving base, or in space (drive = 'base')",
        since=2,
        default=None,
    )


class InputTable(TomlTable):
    """What is declared of one input column."""

    name: Text = key("Input column of the kind")
    unit: Text = key("Unit of the column")
    noise_std: Positive | None = key(
        "Standard deviation of the noise, in the input's unit", default=None
    )
    gain_std: Positive | None = key(
        "Standard deviation of the gain's error, relative", default=None
    )
    zero_std: Positive | None = key(
        "Standard deviation of the zero's error, in the input's unit", default=None
    )
    delay_std: Positive | None = key("Standard deviation of the delay's error", "s", default=None)


class CarrierInputTable(InputTable):
    """What is declared of one input column of a carrier."""

    angle_std_deg: Positive | None = key(
        "Standard deviation of the error of the angle", "deg", default=None
    )


#: Errors of a signal that a table may declare under the name of the object's field.
_ERRORS = ("noise_std", "gain_std", "zero_std", "delay_std")


def channels_of(
    tables: Sequence[ChannelTable],
    kind: CampaignKind,
) -> tuple[tuple[Channel, ...], tuple[InputSignal, ...]]:
    """Channels of the tables, and the inputs that a voltage analogue declares among them.

    Raises
    ------
    ValueError
        Where a name repeats, a name, quantity or unit is not of the kind, or nothing is measured.
    """
    channels: list[Channel] = []
    inputs: list[InputSignal] = []
    problems = Problems()
    for table in tables:
        if kind.any_unit and table.name in kind.inputs and table.quantity == table.name:
            inputs.append(input_of(table))
            continue
        with problems.at():
            channels.append(channel_of(table))
    problems.messages += channel_conflicts(channels, kind)
    if not channels and not problems.messages:
        problems.messages.append(
            "[[channels]]: every channel is an input; expected at least one measured channel",
        )
    refuse(problems.messages)
    return tuple(channels), tuple(inputs)


def inputs_of(tables: Sequence[InputTable], kind: CampaignKind) -> tuple[InputSignal, ...]:
    """Inputs that the tables declare.

    Raises
    ------
    ValueError
        Where a name repeats or is no input of the kind, or a unit is not the contract's.
    """
    inputs = tuple(input_of(table) for table in tables)
    refuse(input_conflicts(inputs, kind))
    return inputs


def channel_of(table: ChannelTable) -> Channel:
    """Channel that a table declares."""
    values = table.given()
    angle = values.get("angle_deg")
    return Channel(
        name=table.name,
        quantity=table.quantity,
        unit=table.unit,
        angle=None if angle is None else math.radians(angle),
        radius=values.get("radius_m"),
        sensor=values.get("sensor"),
        motion=values.get("motion"),
        **_errors(values),
    )


def input_of(table: InputTable | ChannelTable) -> InputSignal:
    """Input that a table declares."""
    return InputSignal(table.name, table.unit, **_errors(table.given()))


def _errors(values: dict[str, Any]) -> dict[str, float | None]:
    angle = values.get("angle_std_deg")
    return {
        **{name: values.get(name) for name in _ERRORS},
        "angle_std": None if angle is None else math.radians(angle),
    }


def channels_of_kind(kind: CampaignKind) -> AfterValidator:
    """Check of a list of channels: what the kind does not allow is refused."""

    def checked(tables: list[ChannelTable]) -> list[ChannelTable]:
        channels_of(tables, kind)
        return tables

    return AfterValidator(checked)


def inputs_of_kind(kind: CampaignKind) -> AfterValidator:
    """Check of a list of inputs: what the kind does not allow is refused."""

    def checked(tables: list[InputTable]) -> list[InputTable]:
        inputs_of(tables, kind)
        return tables

    return AfterValidator(checked)
