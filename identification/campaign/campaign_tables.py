"""What campaign.toml holds, one top table a kind of campaign (versions 1 and 2 of the contract)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema

from carrierflex.files.problems import Problems, refuse
from carrierflex.files.toml_values import (
    Count,
    Expected,
    Flag,
    KeysOf,
    Number,
    Positive,
    PositiveCount,
    Text,
    Texts,
    TomlTable,
    different,
    key,
)
from carrierflex.identification.campaign.campaign import (
    Channel,
    channel_conflicts,
    effect_conflicts,
)
from carrierflex.identification.campaign.campaign_kinds import (
    CARRIER,
    ELEMENT_BY_DRIVE,
    MOUNTING,
    CampaignKind,
)
from carrierflex.identification.campaign.file_names import RUN_SUFFIXES, checked_file_name
from carrierflex.simulation.mounting.rig_keys import RIG_KEYS


def _plain_file(name: str, info: ValidationInfo) -> str:
    return checked_file_name(name, f"key '{info.field_name}'")


def _run_file(name: str, info: ValidationInfo) -> str:
    _plain_file(name, info)
    if not name.lower().endswith(RUN_SUFFIXES):
        defect = f"key '{info.field_name}' is '{name}'"
        raise ValueError(f"{defect}; expected a name ending in {' or '.join(RUN_SUFFIXES)}")
    return name


class ChannelTable(TomlTable):
    """One measured signal."""

    name: Text = key("Column name in the run files")
    quantity: Text = key("What is measured")
    unit: Text = key("Unit of the column")
    noise_std: Positive | None = key(
        "Standard deviation of the noise, in the channel's unit",
        default=None,
    )


class CarrierChannelTable(ChannelTable):
    """One proximity sensor at the rim of the carrier."""

    angle_deg: Number = key("Housing angle about x from the z axis", "deg")
    radius_m: Positive = key("Radius of the point that the sensor looks at", "m")


class MountingChannelTable(ChannelTable):
    """One motion sensor on the housing."""

    sensor: Annotated[
        Literal["ssx", "spx", "ssz", "spz", "spy", "sbx"],
        Expected("one of ssx, spx, ssz, spz, spy, sbx"),
    ] = key("Position on the housing")


class RunTable(TomlTable):
    """Where a run stands."""

    name: Text = key("Name of the run")
    file: Annotated[Text, AfterValidator(_run_file)] = key(
        "File of the run in the campaign's folder, CSV or Parquet",
    )
    condition: Text = key("Free text; runs of the same condition are repeats of one another")


class BaselineTable(TomlTable):
    """The simulation whose gap is to be explained."""

    source: Annotated[Literal["model", "columns"], Expected("one of model, columns")] = key(
        "model: this program's simulator; columns: predictions <channel>_sim in the run files",
    )
    effects: Texts = key("Effects that the baseline already contains", default_factory=list)

    @model_validator(mode="after")
    def _states_effects(self) -> "BaselineTable":
        if self.source == "model" and "effects" not in self.model_fields_set:
            raise ValueError(
                "missing key 'effects'; expected a list of strings where source is 'model'",
            )
        return self


@dataclass(frozen=True, eq=False)
class KnownEffects:
    """Check of a baseline: its effects are ids of the kind."""

    kind: CampaignKind

    def __get_pydantic_core_schema__(
        self,
        source: Any,
        handler: GetCoreSchemaHandler,
    ) -> CoreSchema:
        """Check the effects after the table itself."""
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def __get_pydantic_json_schema__(
        self,
        schema: CoreSchema,
        handler: GetJsonSchemaHandler,
    ) -> dict[str, Any]:
        """Schema of the table with the ids that the kind knows."""
        table = dict(handler.resolve_ref_schema(handler(schema)))
        effects = {**table["properties"]["effects"], "items": {"enum": list(self.kind.effects)}}
        return {**table, "properties": {**table["properties"], "effects": effects}}

    def _checked(self, table: BaselineTable) -> BaselineTable:
        refuse(effect_conflicts(table.effects, self.kind))
        return table


def channels_of(
    tables: Sequence[ChannelTable],
    kind: CampaignKind,
) -> tuple[tuple[Channel, ...], dict[str, str]]:
    """Channels of the tables, and the units of inputs that a voltage analogue declares among them.

    Raises
    ------
    ValueError
        Where a name repeats, a name, quantity or unit is not of the kind, or nothing is measured.
    """
    channels: list[Channel] = []
    input_units: dict[str, str] = {}
    problems = Problems()
    for table in tables:
        if kind.any_unit and table.name in kind.inputs and table.quantity == table.name:
            input_units[table.name] = table.unit
            continue
        with problems.at():
            channels.append(_channel(table))
    problems.messages += channel_conflicts(channels, kind)
    if not channels and not problems.messages:
        problems.messages.append(
            "[[channels]]: every channel is an input; expected at least one measured channel",
        )
    refuse(problems.messages)
    return tuple(channels), input_units


def _channel(table: ChannelTable) -> Channel:
    values = table.given()
    angle = values.get("angle_deg")
    return Channel(
        name=table.name,
        quantity=table.quantity,
        unit=table.unit,
        angle=None if angle is None else float(np.deg2rad(angle)),
        radius=values.get("radius_m"),
        sensor=values.get("sensor"),
        noise_std=table.noise_std,
    )


def _channels_of_kind(kind: CampaignKind) -> AfterValidator:
    def checked(tables: list[ChannelTable]) -> list[ChannelTable]:
        channels_of(tables, kind)
        return tables

    return AfterValidator(checked)


class CarrierRigTable(TomlTable):
    """Nominal facts of the carrier's rig."""

    nominal_torque: Positive = key("Torque on the main shaft that counts as 100 %", "N m")
    sensor_radius: Positive = key("Radius of the circle that the sensors face", "m")
    n_planets: PositiveCount = key("Number of planets")
    deflection_curves: Annotated[Text, AfterValidator(_plain_file)] | None = key(
        "Deflection curves, a CSV file in the campaign's folder; by default the default carrier's",
        default=None,
    )


class MountingRigTable(TomlTable):
    """Nominal facts of the mounting rig; a campaign states all of them."""


Drive = Annotated[Literal["force", "displacement"], Expected("one of force, displacement")]


class ElementRigTable(TomlTable):
    """How one mount, damper or spring is driven."""

    drive: Drive = key("What drives the element; the other one is measured")
    mass: Positive | None = key("Mass on the element, fitted where absent", "kg", default=None)
    periodic: Flag = key("Whether the drive repeats", default=False)
    period_samples: PositiveCount | None = key("Samples of a period", default=None)
    settle_samples: Count | None = key(
        "First samples that are left out of every score",
        default=None,
    )

    @model_validator(mode="after")
    def _states_its_period(self) -> "ElementRigTable":
        if self.periodic and self.period_samples is None:
            raise ValueError(
                "missing key 'period_samples'; expected a whole number >= 1 where periodic = true",
            )
        return self


class SimulatedTable(TomlTable):
    """Mark of a campaign that this program simulated: such a folder may be replaced."""

    software: Text = key("Program that wrote the run files")
    sha256: Annotated[
        dict[str, Annotated[str, Field(pattern="^[0-9a-f]{64}$")]],
        Expected("SHA-256 in 64 hexadecimal digits by file name"),
    ] = key("SHA-256 of each run file")


class _CampaignDocument(TomlTable):
    format: Literal["carrierflex-campaign"] = key("Kind of the file")
    version: Annotated[Literal[1, 2], Expected("1 or 2")] = key("Version of the format")
    simulated: SimulatedTable | None = key(
        "Mark of a simulated campaign; a folder without it is a measurement and never replaced",
        default=None,
    )
    name: Text = key("Title")
    runs: Annotated[
        list[RunTable],
        Field(min_length=1),
        different("[[runs]] name"),
        different("[[runs]] file", "file"),
    ] = key("Runs")


class CarrierCampaignDocument(_CampaignDocument):
    """Proximity sensors at the rim of the planet carrier."""

    kind: Literal["carrier"] = key("Kind of the campaign")
    baseline: Annotated[BaselineTable, KnownEffects(CARRIER)] = key(
        "The simulation whose gap is to be explained",
    )
    rig: CarrierRigTable = key("Nominal facts of the rig")
    channels: Annotated[
        list[CarrierChannelTable],
        Field(min_length=1),
        _channels_of_kind(CARRIER),
    ] = key("Sensors")


class MountingCampaignDocument(_CampaignDocument):
    """Motion sensors on the gearbox housing on its two bushings."""

    kind: Literal["mounting"] = key("Kind of the campaign")
    baseline: Annotated[BaselineTable, KnownEffects(MOUNTING)] = key(
        "The simulation whose gap is to be explained",
    )
    rig: Annotated[MountingRigTable, KeysOf(RIG_KEYS)] = key("Nominal facts of the rig")
    channels: Annotated[
        list[MountingChannelTable],
        Field(min_length=1),
        _channels_of_kind(MOUNTING),
    ] = key("Sensors")


def _channels_of_drive(tables: list[ChannelTable], info: ValidationInfo) -> list[ChannelTable]:
    # A wrong rig is told for itself; without its drive nothing can be said about the channels.
    if "rig" in info.data:
        channels_of(tables, ELEMENT_BY_DRIVE[info.data["rig"].drive])
    return tables


class ElementCampaignDocument(_CampaignDocument):
    """One mount, damper or spring on a test rig."""

    kind: Literal["element"] = key("Kind of the campaign")
    baseline: Annotated[BaselineTable, KnownEffects(ELEMENT_BY_DRIVE["force"])] = key(
        "The simulation whose gap is to be explained",
    )
    rig: ElementRigTable = key("Rig")
    channels: Annotated[
        list[ChannelTable],
        Field(min_length=1),
        AfterValidator(_channels_of_drive),
    ] = key("Measured signal; the input too where its unit is not SI")


CampaignDocument = CarrierCampaignDocument | MountingCampaignDocument | ElementCampaignDocument

#: Top table of campaign.toml by its key ``kind``.
DOCUMENT_OF_KIND: dict[str, type[CampaignDocument]] = {
    "carrier": CarrierCampaignDocument,
    "mounting": MountingCampaignDocument,
    "element": ElementCampaignDocument,
}
