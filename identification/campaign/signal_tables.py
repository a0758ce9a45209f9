"""What campaign.toml holds of signals: one table a channel, one an input."""

import math
from typing import Annotated, Any, Literal

from pydantic import model_validator

from carrierflex.files.toml_values import (
    Expected,
    NotNegative,
    Number,
    Positive,
    Text,
    TomlTable,
    key,
)
from carrierflex.identification.campaign.campaign_kinds import BENDING
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
    radius_std_m: Positive | None = key(
        "Standard deviation of the error of the radius", "m", since=2, default=None
    )


class MountingChannelTable(ChannelTable):
    """One motion sensor on the housing, or one bending moment of the main shaft."""

    sensor: (
        Annotated[
            Literal["ssx", "spx", "ssz", "spz", "spy", "sbx"],
            Expected("one of ssx, spx, ssz, spz, spy, sbx"),
        ]
        | None
    ) = key("Position on the housing (quantity housing_displacement)", default=None)
    axis: Annotated[Literal["y", "z"], Expected("y or z")] | None = key(
        "Axis of the shaft that the moment is about (quantity shaft_bending_moment)",
        since=2,
        default=None,
    )
    section_m: NotNegative | None = key(
        "Distance of the gauges' section upwind of the main bearing (the same quantity)",
        "m",
        since=2,
        default=None,
    )

    @model_validator(mode="after")
    def _has_the_keys_of_its_quantity(self) -> "MountingChannelTable":
        of_moment = {"axis": self.axis, "section_m": self.section_m}
        wanted, other = (
            (of_moment, {"sensor": self.sensor})
            if self.quantity == BENDING
            else ({"sensor": self.sensor}, of_moment)
        )
        for name, value in wanted.items():
            if value is None:
                raise ValueError(
                    f"missing key '{name}'; expected where quantity is {self.quantity}"
                )
        for name, value in other.items():
            if value is not None:
                raise ValueError(
                    f"key '{name}' is no key of quantity {self.quantity}; leave it out"
                )
        return self


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
        radius_std=values.get("radius_std_m"),
        sensor=values.get("sensor"),
        motion=values.get("motion"),
        axis=values.get("axis"),
        section=values.get("section_m"),
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
