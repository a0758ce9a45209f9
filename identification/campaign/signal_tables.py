"""What campaign.toml holds of signals: one table a channel, one an input."""

import math
from typing import Annotated, Any, Literal

from carrierflex.files.toml_values import Expected, Number, Positive, Text, TomlTable, key
from carrierflex.identification.campaign.declarations import (
    Channel,
    InputSignal,
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
