"""Dimensions from a TOML file.

Tables [carrier], [pin], [gear] and [main_shaft], every key a field of the parameter classes.
"""

import tomllib
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters

#: A parameter file larger than this [bytes] is not one.
_MOST_BYTES = 100_000


@dataclass(frozen=True)
class StageParameters:
    """Everything geometry needs of the planetary stage, pin and main shaft checked against the carrier."""

    carrier: CarrierParameters = field(default_factory=CarrierParameters)
    pin: PinParameters = field(default_factory=PinParameters)
    gear: GearData = field(default_factory=GearData)
    main_shaft: MainShaftParameters = field(default_factory=MainShaftParameters)

    def __post_init__(self) -> None:
        self.pin.check_fits(self.carrier)
        self.main_shaft.check_fits(self.carrier)
        if self.gear.centre_distance != self.carrier.centre_distance:
            raise ValueError(
                f"GearData.centre_distance is {self.gear.centre_distance} m; expected the carrier's centre_distance "
                f"{self.carrier.centre_distance} m"
            )


_TABLES: dict[str, type] = {
    "carrier": CarrierParameters,
    "pin": PinParameters,
    "gear": GearData,
    "main_shaft": MainShaftParameters,
}


def read_parameters(path: Path | None) -> StageParameters:
    """Read the stage's dimensions; None gives the defaults.

    Parameters
    ----------
    path : Path or None
        TOML file; tables and keys that it leaves out keep their defaults (metres, radians).

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where the file is no TOML, or names an unknown table or key, or a dimension is impossible.
    """
    if path is None:
        return StageParameters()
    if not path.is_file():
        raise FileNotFoundError(
            f"{path}: no such file; expected a TOML file with the tables {', '.join(_TABLES)}"
        )
    if path.stat().st_size > _MOST_BYTES:
        raise ValueError(
            f"{path}: {path.stat().st_size} bytes; expected a parameter file below {_MOST_BYTES} bytes"
        )
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a TOML file ({error})") from error
    parts = {}
    for name, table in document.items():
        if name not in _TABLES or not isinstance(table, dict):
            raise ValueError(
                f"{path}: unknown entry {name!r}; expected the tables {', '.join(_TABLES)}"
            )
        parts[name] = _filled(_TABLES[name], table, f"{path}, [{name}]")
    try:
        return StageParameters(**parts)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _filled(kind: type, table: dict[str, Any], where: str) -> Any:
    known = [parameter.name for parameter in fields(kind)]
    for key, value in table.items():
        if key not in known:
            raise ValueError(f"{where}: unknown key {key!r}; expected one of {', '.join(known)}")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueError(f"{where}: {key} is {value!r}; expected a number")
    try:
        return kind(**table)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from error
