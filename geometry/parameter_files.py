"""Dimensions from a TOML file.

Tables [carrier], [pin], [gear] and [main_shaft], every key a field of the parameter classes.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

from carrierflex.files.problems import Problems, problems_of, refuse
from carrierflex.files.toml_files import TomlKind, read_toml
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters

PARAMETER_FILE = TomlKind(
    "a parameter file",
    holds="tables carrier, pin, gear, main_shaft",
    most_bytes=100_000,
)
#: Here and not beside its reader, which holds arrays: the file is told apart without them.
SURFACES_FILE = TomlKind(
    "a surfaces file",
    holds="tables [surfaces.<name>]",
    most_bytes=100_000,
    format="carrierflex-surfaces",
)


#: Dimensions in a JSON document. Words, units and limits of the keys stand in the schema
#: carrier-parameters.
Dimensions = Annotated[
    Mapping[str, Mapping[str, float]], "Dimensions, as in the schema carrier-parameters [m]"
]


@dataclass(frozen=True)
class StageParameters:
    """Everything geometry needs of the planetary stage.

    Pin and main shaft are checked against the carrier.
    """

    carrier: CarrierParameters = field(default_factory=CarrierParameters)
    pin: PinParameters = field(default_factory=PinParameters)
    gear: GearData = field(default_factory=GearData)
    main_shaft: MainShaftParameters = field(default_factory=MainShaftParameters)

    def __post_init__(self) -> None:
        refuse(self._conflicts())

    def _conflicts(self) -> Iterator[str]:
        problems = Problems()
        with problems.at():
            self.pin.check_fits(self.carrier)
        with problems.at():
            self.main_shaft.check_fits(self.carrier)
        yield from problems.messages
        if self.gear.centre_distance != self.carrier.centre_distance:
            yield (
                f"[gear] centre_distance is {self.gear.centre_distance} m; expected the "
                f"carrier's centre_distance {self.carrier.centre_distance} m"
            )
        yield from self.gear.assembly_conflicts(self.carrier.n_planets)


def _shipped_sets() -> dict[str, Path]:
    """Files of dimensions that come with the package, by name."""
    with as_file(files("carrierflex.geometry") / "sets") as folder:
        return {path.stem: path for path in folder.glob("*.toml")}


def read_parameters(path: Path | None) -> StageParameters:
    """Read the stage's dimensions; None gives the defaults.

    Parameters
    ----------
    path : Path or None
        TOML file; tables and keys that it leaves out keep their defaults (metres, radians). Or the
        name of a set that comes with the package: ``four_planets``.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where the file is no TOML, names unknown tables or keys, or dimensions are impossible; all
        of it at once.
    """
    if path is None:
        return StageParameters()
    from carrierflex.geometry.parameter_tables import ParameterTables

    path = _shipped_sets().get(str(path), path)
    tables = read_toml(path, PARAMETER_FILE, ParameterTables)
    try:
        return StageParameters(tables.carrier, tables.pin, tables.gear, tables.main_shaft)
    except ValueError as error:
        refuse(problems_of(error), str(path))
        raise
