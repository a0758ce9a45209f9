"""What campaign.toml holds, one top table a kind of campaign (versions 1 and 2 of the contract)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import pairwise
from typing import Annotated, Any, Literal

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
    NotNegative,
    Number,
    Planets,
    Positive,
    PositiveCount,
    Text,
    Texts,
    TomlTable,
    different,
    key,
)
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.identification.campaign.campaign_kinds import (
    CARRIER,
    ELEMENT_BY_DRIVE,
    MOUNTING,
    CampaignKind,
    campaign_kind,
)
from carrierflex.identification.campaign.declarations import (
    Baseline,
    Channel,
    InputSignal,
    KnownValue,
    baseline_conflicts,
    channel_conflicts,
    input_conflicts,
)
from carrierflex.identification.campaign.file_names import RUN_SUFFIXES, checked_file_name
from carrierflex.identification.campaign.signal_tables import (
    CarrierChannelTable,
    CarrierInputTable,
    ChannelTable,
    ElementChannelTable,
    InputTable,
    MountingChannelTable,
    channel_of,
    input_of,
)
from carrierflex.simulation.carrier.effects.inside_stage import STAGE_EFFECTS
from carrierflex.simulation.element.drives import BASE, FREE_DECAY
from carrierflex.simulation.mounting.rig_keys import RIG_KEYS


def channels_of(
    tables: Sequence[ChannelTable],
    kind: CampaignKind,
) -> tuple[tuple[Channel, ...], tuple[InputSignal, ...]]:
    """Channels of the tables, and the inputs that a voltage analogue declares among them."""
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
    """Inputs that the tables declare."""
    inputs = tuple(input_of(table) for table in tables)
    refuse(input_conflicts(inputs, kind))
    return inputs


def _allowed(read: Callable[[Any, CampaignKind], object], kind: CampaignKind) -> AfterValidator:
    """Check of a list of channels or inputs: what the kind does not allow is refused."""

    def checked(tables: list[TomlTable]) -> list[TomlTable]:
        read(tables, kind)
        return tables

    return AfterValidator(checked)


def _plain_file(name: str, info: ValidationInfo) -> str:
    return checked_file_name(name, f"key '{info.field_name}'")


def _run_file(name: str, info: ValidationInfo) -> str:
    _plain_file(name, info)
    if not name.lower().endswith(RUN_SUFFIXES):
        defect = f"key '{info.field_name}' is '{name}'"
        raise ValueError(f"{defect}; expected a name ending in {' or '.join(RUN_SUFFIXES)}")
    return name


_WINDOWS = "a list of windows [start, end] with start < end"
Window = Annotated[tuple[float, float], Field(strict=False)]


def _apart(windows: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Refuse windows that end before they start, or before the one before them."""
    times = [time for window in windows for time in window]
    if not all(first < second for first, second in pairwise(times)):
        listed = ", ".join(f"[{start:g}, {end:g}]" for start, end in windows)
        raise ValueError(f"key 'use' is {listed}; expected {_WINDOWS}, in order and apart")
    return windows


class RunTable(TomlTable):
    """Where a run stands."""

    name: Text = key("Name of the run")
    file: Annotated[Text, AfterValidator(_run_file)] = key(
        "File of the run in the campaign's folder, CSV or Parquet",
    )
    condition: Text = key("Free text; runs of the same condition are repeats of one another")
    use: (
        Annotated[list[Window], Field(min_length=1), Expected(_WINDOWS), AfterValidator(_apart)]
        | None
    ) = key(
        "Windows of time that count; samples outside are left out of fits and scores",
        "s",
        since=2,
        default=None,
    )


class KnownValueTable(TomlTable):
    """What is known of a parameter beforehand."""

    value: Number = key("Value, in the unit of the parameter")
    std: NotNegative = key("Standard deviation, in the same unit; zero holds the value")


class BaselineTable(TomlTable):
    """The simulation whose gap is to be explained."""

    source: Annotated[
        Literal["model", "columns", "stage"], Expected("one of model, columns, stage")
    ] = key(
        "model: this program's simulator; columns: predictions <channel>_sim in the run files; "
        "stage: the planetary stage of `case` under the measured loads (kind carrier)",
        newer_values={"stage": 2},
    )
    case: Annotated[Text, AfterValidator(_plain_file)] | None = key(
        "Stage case of source = 'stage', a TOML file in the campaign's folder",
        since=2,
        default=None,
    )
    effects: Texts = key("Effects that the baseline already contains", default_factory=list)
    fixed: dict[str, KnownValueTable] = key(
        "Known physics by 'effect.parameter': a value and its standard deviation",
        since=2,
        default_factory=dict,
    )
    impossible: Texts = key("Effects that are not to be looked for", since=2, default_factory=list)
    clock_shift: dict[str, KnownValueTable] = key(
        "By run, what `import` added to the time of another simulator's predictions",
        "s",
        since=2,
        default_factory=dict,
    )

    @model_validator(mode="after")
    def _states_effects(self) -> "BaselineTable":
        if self.source == "model" and "effects" not in self.model_fields_set:
            raise ValueError(
                "missing key 'effects'; expected a list of strings where source is 'model'",
            )
        if (self.source == "stage") != (self.case is not None):
            raise ValueError(
                f"key 'case' is {self.case!r} and key 'source' is '{self.source}'; expected the "
                "file of a stage case where source is 'stage', and only there"
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
        properties = dict(table["properties"])
        inside = STAGE_EFFECTS if self.kind.name == "carrier" else ()
        for name, known in (
            ("effects", self.kind.effects),
            ("impossible", (*self.kind.effects, *inside)),
        ):
            properties[name] = {**properties[name], "items": {"enum": list(known)}}
        return {**table, "properties": properties}

    def _checked(self, table: BaselineTable) -> BaselineTable:
        refuse(baseline_conflicts(baseline_of(table), self.kind))
        return table


def baseline_of(table: BaselineTable) -> Baseline:
    """Baseline that a table states."""
    fixed, shifts = (
        {name: KnownValue(known.value, known.std) for name, known in tables.items()}
        for tables in (table.fixed, table.clock_shift)
    )
    effects, impossible = tuple(table.effects), tuple(table.impossible)
    return Baseline(table.source, effects, fixed, impossible, shifts, table.case or "")


class CarrierRigTable(TomlTable):
    """Nominal facts of the carrier's rig."""

    nominal_torque: Positive = key("Torque on the main shaft that counts as 100 %", "N m")
    sensor_radius: Positive = key("Radius of the circle that the sensors face", "m")
    n_planets: Planets = key("Number of planets, 3 to 8")
    radial_load: Annotated[Literal["none"], Expected("'none', or no such key")] | None = key(
        "none: the rig has no radial load, and the run files have no columns of it",
        since=2,
        default=None,
    )
    deflection_curves: Annotated[Text, AfterValidator(_plain_file)] | None = key(
        "Deflection curves, a CSV file in the campaign's folder; by default the default carrier's",
        default=None,
    )
    tolerances: dict[str, Positive] | None = key(
        "Standard deviation of dimensions [m] and material constants from their drawing, by name, "
        "and `curves`: of each order of the deflection curves over their RMS. The sizes of the "
        "curves are then the drawing's, and a dimension may be the cause",
        since=2,
        default=None,
    )

    @model_validator(mode="after")
    def _has_curves_of_its_planets(self) -> "CarrierRigTable":
        of_default = CarrierParameters.n_planets
        if self.n_planets != of_default and self.deflection_curves is None:
            raise ValueError(
                f"key 'n_planets' is {self.n_planets}, and the default carrier has {of_default}; "
                "expected key 'deflection_curves' with those of the carrier"
            )
        return self


class MountingRigTable(TomlTable):
    """Nominal facts of the mounting rig; a campaign states all of them."""


Drive = Annotated[
    Literal["force", "displacement", "free_decay", "base"],
    Expected("one of force, displacement, free_decay, base"),
]


class ElementRigTable(TomlTable):
    """How one mount, damper or spring is driven."""

    drive: Drive = key(
        "What drives the element: a force, a displacement, nothing after a release, or its base",
        newer_values={"free_decay": 2, "base": 2},
    )
    mass: Positive | None = key("Mass on the element, fitted where absent", "kg", default=None)
    periodic: Flag = key("Whether the drive repeats", default=False)
    period_samples: PositiveCount | None = key("Samples of a period", default=None)
    settle_samples: Count | None = key(
        "First samples that are left out of every score",
        default=None,
    )

    @model_validator(mode="after")
    def _states_its_period(self) -> "ElementRigTable":
        if self.periodic and self.drive == FREE_DECAY:
            raise ValueError("key 'periodic' is true; expected false where drive = 'free_decay'")
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
        since=2,
        default=None,
    )
    name: Text = key("Title")
    turbine: Text | None = key(
        "Turbine, or another machine of a fleet, that was measured", since=2, default=None
    )
    recorded: Annotated[date, Expected("a date as 2026-01-31, without quotes")] | None = key(
        "Day of the records", since=2, default=None
    )
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
        _allowed(channels_of, CARRIER),
    ] = key("Sensors")
    inputs: Annotated[list[CarrierInputTable], _allowed(inputs_of, CARRIER)] = key(
        "What is known of the errors of input columns", since=2, default_factory=list
    )


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
        _allowed(channels_of, MOUNTING),
    ] = key("Sensors")
    inputs: Annotated[list[InputTable], _allowed(inputs_of, MOUNTING)] = key(
        "What is known of the errors of input columns", since=2, default_factory=list
    )


def _channels_of_drive(
    tables: list[ElementChannelTable], info: ValidationInfo
) -> list[ElementChannelTable]:
    # A wrong rig is told for itself; without its drive nothing can be said about the channels.
    if "rig" not in info.data:
        return tables
    drive = info.data["rig"].drive
    kind = ELEMENT_BY_DRIVE[drive]
    channels_of(tables, kind)
    for table in tables:
        if drive == BASE and table.motion is None:
            defect = f"[[channels]] {table.name}: missing key 'motion'"
            raise ValueError(f"{defect}; expected relative or absolute where drive = 'base'")
        if drive != BASE and table.motion is not None:
            raise ValueError(
                f"[[channels]] {table.name}: key 'motion' is '{table.motion}'; expected no such "
                f"key where drive = '{drive}'"
            )
    return tables


def _inputs_of_drive(tables: list[InputTable], info: ValidationInfo) -> list[InputTable]:
    if "rig" in info.data:
        names = [table.name for table in tables]
        inputs_of(tables, campaign_kind("element", {"drive": info.data["rig"].drive}, names))
    return tables


class ElementCampaignDocument(_CampaignDocument):
    """One mount, damper or spring on a test rig."""

    kind: Literal["element"] = key("Kind of the campaign")
    baseline: Annotated[BaselineTable, KnownEffects(ELEMENT_BY_DRIVE["force"])] = key(
        "The simulation whose gap is to be explained",
    )
    rig: ElementRigTable = key("Rig")
    channels: Annotated[
        list[ElementChannelTable],
        Field(min_length=1),
        AfterValidator(_channels_of_drive),
    ] = key("Measured signal")
    inputs: Annotated[list[InputTable], AfterValidator(_inputs_of_drive)] = key(
        "Units of an analogue's input, and what is known of the errors of input columns",
        since=2,
        default_factory=list,
    )


CampaignDocument = CarrierCampaignDocument | MountingCampaignDocument | ElementCampaignDocument

#: Top table of campaign.toml by its key ``kind``.
DOCUMENT_OF_KIND: dict[str, type[CampaignDocument]] = {
    "carrier": CarrierCampaignDocument,
    "mounting": MountingCampaignDocument,
    "element": ElementCampaignDocument,
}
