"""What map.toml holds: the columns of a logger's files as channels and inputs of a campaign."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationInfo

from carrierflex.files.problems import refuse
from carrierflex.files.shown_values import shown
from carrierflex.files.toml_files import TomlKind, check_header, checked_document, toml_document
from carrierflex.files.toml_values import (
    Expected,
    KeysOf,
    Number,
    Positive,
    Text,
    TomlTable,
    different,
    key,
)
from carrierflex.identification.campaign.campaign_kinds import (
    CARRIER,
    ELEMENT_BY_DRIVE,
    KIND_NAMES,
    MOUNTING,
    campaign_kind,
)
from carrierflex.identification.campaign.campaign_tables import (
    BaselineTable,
    CarrierRigTable,
    ElementRigTable,
    KnownEffects,
    MountingRigTable,
    Window,
)
from carrierflex.identification.campaign.file_names import checked_file_name
from carrierflex.identification.campaign.signal_tables import (
    CarrierChannelTable,
    CarrierInputTable,
    ElementChannelTable,
    InputTable,
    MountingChannelTable,
)
from carrierflex.simulation.mounting.rig_keys import RIG_KEYS

MAP_FILE = TomlKind(
    "a map of a logger's columns",
    holds="the keys that carrierflex new-campaign writes",
    most_bytes=1_000_000,
    format="carrierflex-map",
)
#: What stands in a new map where the user has to tell.
OPEN = "?"


def _stated(text: str, info: ValidationInfo) -> str:
    if text == OPEN:
        raise ValueError(f"key '{info.field_name}' is '?'; expected what it is: edit the map")
    return text


def _plain_name(name: str, info: ValidationInfo) -> str:
    return checked_file_name(_stated(name, info), f"key '{info.field_name}'")


Stated = Annotated[Text, AfterValidator(_stated)]
_COLUMN = "Column of the files"
_UNIT = "Unit that the column is in, as 'um', 'kN m' or 'deg'"
_FACTOR = "What the column is multiplied with before the unit; -1 turns it round"
_OFFSET = "What is added after the factor, in the unit"


class MapTimeTable(TomlTable):
    """The clock."""

    column: Stated | None = key("Column of time; default: the clock is rate_hz", default=None)
    unit: Stated = key("Unit of the column, or 'date'", "", default="s")
    format: Stated | None = key(
        "Of dates without the fraction of the second, as '%d.%m.%Y %H:%M:%S'", default=None
    )
    rate_hz: Positive | None = key(
        "Rate of the campaign; by default that of the slowest channel. Without a column, the rate "
        "of the files",
        "Hz",
        default=None,
    )


class MapRunTable(TomlTable):
    """One record."""

    name: Stated = key("Name of the run")
    files: Annotated[
        list[Annotated[Text, AfterValidator(_plain_name)]],
        Field(min_length=1),
        Expected("a list of at least one file name"),
    ] = key("Files that are given to the command: several where two loggers ran")
    group: Stated | None = key(
        "Group of the files that holds the run, as of HDF5, MAT and TDMS; default: the whole file",
        default=None,
    )
    condition: Text = key("Free text; runs of the same condition are repeats of one another")
    starts: dict[str, Number] = key(
        "Seconds to add to the time of a file, by its name", "s", default_factory=dict
    )
    use: list[Window] | None = key("Windows of time that count", "s", default=None)


class _Column(TomlTable):
    column: Stated = key(_COLUMN)
    unit: Stated = key(_UNIT)
    factor: Number = key(_FACTOR, default=1.0)
    offset: Number = key(_OFFSET, default=0.0)


class MapCarrierChannelTable(_Column, CarrierChannelTable):
    """A proximity sensor at the rim, and its column."""

    radius_m: Positive | None = key(  # type: ignore[assignment]
        "Radius of the point that the sensor looks at; default: sensor_radius of [rig]",
        "m",
        default=None,
    )


class MapMountingChannelTable(_Column, MountingChannelTable):
    """A motion sensor on the housing, and its column."""


class MapElementChannelTable(_Column, ElementChannelTable):
    """The measured signal of an element, and its column."""


class _AngleKeys(TomlTable):
    pulses_per_turn: Positive | None = key(
        "Pulses of a turn where unit = 'pulses': a counter, or a signal that rises with each",
        default=None,
    )
    wraps_at: Positive | None = key(
        "Where a counter begins anew [pulses]; an angle does after a turn", default=None
    )


class MapInputTable(_Column, _AngleKeys, InputTable):
    """An input of the kind, and its column."""


class MapCarrierInputTable(_Column, _AngleKeys, CarrierInputTable):
    """An input of a carrier, and its column."""


class MapPredictionTable(_Column):
    """Another simulator's prediction of a channel."""

    channel: Text = key("Name of the channel")


class MapSimulatedTable(TomlTable):
    """Another simulator's predictions, given with --simulated."""

    time: MapTimeTable = key("Its clock", default_factory=MapTimeTable)
    shift: Number | None = key(
        "Seconds to add to its time; default: from the signals", "s", default=None
    )
    channels: Annotated[
        list[MapPredictionTable],
        different("[[simulated.channels]] channel", "channel"),
    ] = key("Its columns; by default those with the channels' names", default_factory=list)


class _MapDocument(TomlTable):
    format: Literal["carrierflex-map"] = key("Kind of the file")
    version: Annotated[Literal[1], Expected("1")] = key("Version of the format")
    name: Text = key("Title of the campaign")
    time: MapTimeTable = key("The clock")
    simulated: MapSimulatedTable | None = key("Predictions of another simulator", default=None)
    runs: Annotated[list[MapRunTable], Field(min_length=1), different("[[runs]] name")] = key(
        "Records"
    )


class CarrierMapDocument(_MapDocument):
    """Map of proximity sensors at the rim of the planet carrier."""

    kind: Literal["carrier"] = key("Kind of the campaign")
    baseline: Annotated[BaselineTable, KnownEffects(CARRIER)] = key(
        "The simulation whose gap is to be explained"
    )
    rig: CarrierRigTable = key("Nominal facts of the rig, in SI units")
    channels: Annotated[list[MapCarrierChannelTable], Field(min_length=1)] = key("Sensors")
    inputs: list[MapCarrierInputTable] = key("Inputs of the kind")


class MountingMapDocument(_MapDocument):
    """Map of motion sensors on the gearbox housing."""

    kind: Literal["mounting"] = key("Kind of the campaign")
    baseline: Annotated[BaselineTable, KnownEffects(MOUNTING)] = key(
        "The simulation whose gap is to be explained"
    )
    rig: Annotated[MountingRigTable, KeysOf(RIG_KEYS)] = key(
        "Nominal facts of the rig, in SI units"
    )
    channels: Annotated[list[MapMountingChannelTable], Field(min_length=1)] = key("Sensors")
    inputs: list[MapInputTable] = key("Inputs of the kind")


class ElementMapDocument(_MapDocument):
    """Map of one mount, damper or spring on a test rig."""

    kind: Literal["element"] = key("Kind of the campaign")
    baseline: Annotated[BaselineTable, KnownEffects(ELEMENT_BY_DRIVE["force"])] = key(
        "The simulation whose gap is to be explained"
    )
    rig: ElementRigTable = key("Rig, in SI units")
    channels: Annotated[list[MapElementChannelTable], Field(min_length=1, max_length=1)] = key(
        "Measured signal"
    )
    inputs: list[MapInputTable] = key("What drives the element", default_factory=list)


MapDocument = CarrierMapDocument | MountingMapDocument | ElementMapDocument
#: Top table of map.toml by its key ``kind``.
MAP_OF_KIND: dict[str, type[MapDocument]] = {
    "carrier": CarrierMapDocument,
    "mounting": MountingMapDocument,
    "element": ElementMapDocument,
}


def refuse_other_inputs(document: MapDocument) -> None:
    """Refuse a map whose inputs are not those of its kind and drive.

    Raises
    ------
    ValueError
        Names what is missing or too much.
    """
    names = [table.name for table in document.inputs]
    kind = campaign_kind(document.kind, document.rig.given(), names)
    problems = [
        f"no [[inputs]] of the name '{name}'; expected one for each of {', '.join(kind.inputs)}"
        for name in kind.inputs
        if name not in names
    ]
    problems += [
        f"[[inputs]]: key 'name' is '{name}'; expected one of {', '.join(kind.inputs) or 'none'}"
        for name in names
        if name not in kind.inputs
    ]
    refuse(problems)


def read_map(path: Path) -> MapDocument:
    """Read a map.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no map, or anything in it is wrong or still '?': all of it at once.
    """
    document = toml_document(path, MAP_FILE)
    check_header(document, MAP_FILE, str(path))
    kind = document.get("kind")
    if kind not in KIND_NAMES:
        raise ValueError(
            f"{path}: key 'kind' is {shown(kind)}; expected one of {', '.join(KIND_NAMES)}"
        )
    return checked_document(document, MAP_OF_KIND[kind], str(path))
