"""The file surfaces.toml.

Which surfaces of a CAD model carry which name, stated by axis, radius and station.
"""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.whole_files import whole_file
from carrierflex.geometry.cad_surfaces import SurfaceStatement
from carrierflex.geometry.parameters import CarrierParameters, PinParameters, pin_angles

FORMAT = "carrierflex-surfaces"
VERSION = 1
#: A statements file larger than this [bytes] is not one.
_MOST_BYTES = 100_000
#: Deviation [m] within which a face counts as the stated one where the file does not say: two
#: digits of a drawing in mm.
_TOLERANCE = 1e-5
_TOP = ("format", "version", "tolerance", "frame", "pin", "surfaces")
_KEYS = {
    "cylinder": ("type", "point", "direction", "radius", "axial_range", "parts"),
    "plane": ("type", "normal", "station", "radial_range", "point", "parts"),
}


@dataclass(frozen=True, eq=False)
class CadFrame:
    """Where the carrier's frame lies in the CAD model's.

    Origin [m], x axis (downwind) and z axis (towards pin 1).
    """

    origin: NDArray[np.float64]
    axis: NDArray[np.float64]
    pin_1: NDArray[np.float64]

    @classmethod
    def of_the_file(cls) -> "CadFrame":
        """The CAD model's own frame."""
        return cls(np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]))

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Rotation matrix that takes directions of the CAD model into the carrier's frame."""
        return np.stack([self.axis, np.cross(self.pin_1, self.axis), self.pin_1])


@dataclass(frozen=True, eq=False)
class CadStatements:
    """Content of a surfaces file.

    Parameters
    ----------
    surfaces : tuple of SurfaceStatement
        In the carrier's frame.
    frame : CadFrame
        The carrier's frame in the CAD model.
    tolerance : float
        Deviation [m] of position and radius within which a face counts as the stated one.
    bearing_width : float or None
        Width [m] of the planet bearings' seat on the pins; None where the file does not say.
    """

    surfaces: tuple[SurfaceStatement, ...]
    frame: CadFrame
    tolerance: float
    bearing_width: float | None

    def named(self, name: str) -> SurfaceStatement:
        """The statement of that name; KeyError lists the names there are."""
        for surface in self.surfaces:
            if surface.name == name:
                return surface
        raise KeyError(
            f"no surface {name!r} is stated; stated are {', '.join(s.name for s in self.surfaces)}"
        )


def read_cad_statements(path: Path) -> CadStatements:
    """Read a surfaces file.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no TOML, of a newer version, or an entry is unknown, missing or impossible; the
        message names it.
    """
    if not path.is_file():
        raise FileNotFoundError(
            f"{path}: no such file; expected a TOML file with the table [surfaces]"
        )
    if path.stat().st_size > _MOST_BYTES:
        raise ValueError(
            f"{path}: {path.stat().st_size} bytes; expected a surfaces file below {_MOST_BYTES} bytes"
        )
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a TOML file ({error})") from error
    _check_header(document, path)
    tables = document.get("surfaces")
    if not isinstance(tables, dict) or not tables:
        raise ValueError(
            f"{path}: no table [surfaces.<name>]; expected one for every surface to be found"
        )
    tolerance = _number(document, "tolerance", f"{path}", default=_TOLERANCE)
    if not 0.0 < tolerance <= 1e-3:
        raise ValueError(
            f"{path}: tolerance is {tolerance} m; expected more than 0 and at most 0.001 m"
        )
    pin = _table(document, "pin", ("bearing_width",), path)
    width = _number(pin, "bearing_width", f"{path}, [pin]") if pin else None
    if width is not None and not 0.0 < width < 5.0:
        raise ValueError(
            f"{path}, [pin]: bearing_width is {width} m; expected a positive width in metres"
        )
    statements = tuple(
        _statement(name, table, f"{path}, [surfaces.{name}]") for name, table in tables.items()
    )
    return CadStatements(
        statements,
        _frame(_table(document, "frame", ("origin", "axis", "pin_1"), path), path),
        tolerance,
        width,
    )


def write_cad_statements(path: Path, carrier: CarrierParameters, pin: PinParameters) -> None:
    """Write the statements that find the surfaces of the parametric carrier in its CAD model.

    Raises
    ------
    OSError
        Where the folder cannot be written.
    """
    seat_end = carrier.length_between_faces + carrier.seat_length
    hub, seat = carrier.hub_outer_diameter / 2.0, carrier.seat_outer_diameter / 2.0
    lines = [
        "# Which faces of the CAD model are which surface. Lengths in metres whatever the unit of the CAD file.",
        "# axial_range: stations along the axis, radial_range: radii; faces are cut at both ends where they go on.",
        f'format = "{FORMAT}"',
        f"version = {VERSION}",
        f"tolerance = {_TOLERANCE}",
        "",
        "# The carrier's frame in the CAD model: x downwind along the axis, z towards pin 1, origin on the rim face.",
        "[frame]\norigin = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\npin_1 = [0.0, 0.0, 1.0]",
        "",
        "# Bonded pins of the stiff variant: as thick as the bores, from the first bore's end to the last one's.",
        f"[pin]\nbearing_width = {pin.bearing_width!r}",
        _plane_text("shaft_face", -carrier.hub_length, (carrier.hub_inner_diameter / 2.0, hub)),
        "# From the radius that the sensors face to the rim.",
        _plane_text("rim_face", 0.0, (carrier.sensor_radius, carrier.outer_radius)),
        _cylinder_text("upwind_seat", 0.0, hub, carrier.upwind_bearing_x),
        _cylinder_text("downwind_seat", 0.0, seat, (carrier.length_between_faces, seat_end)),
    ]
    for number, angle in enumerate(pin_angles(), start=1):
        for side, x in (("upwind", carrier.upwind_bore_x), ("downwind", carrier.downwind_bore_x)):
            at = carrier.centre_distance * np.array([-math.sin(angle), math.cos(angle)])
            lines.append(_cylinder_text(f"pin_{number}_{side}", at, carrier.pin_hole_radius, x))
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _plane_text(name: str, station: float, radii: tuple[float, float]) -> str:
    return (
        f'\n[surfaces.{name}]\ntype = "plane"\nnormal = [1.0, 0.0, 0.0]\nstation = {station!r}\n'
        f"radial_range = [{radii[0]!r}, {radii[1]!r}]"
    )


def _cylinder_text(
    name: str, at: NDArray[np.float64] | float, radius: float, x: tuple[float, float]
) -> str:
    y, z = (float(value) for value in np.broadcast_to(at, 2))
    return (
        f'\n[surfaces.{name}]\ntype = "cylinder"\npoint = [0.0, {y!r}, {z!r}]\ndirection = [1.0, 0.0, 0.0]\n'
        f"radius = {radius!r}\naxial_range = [{x[0]!r}, {x[1]!r}]"
    )


def _check_header(document: dict[str, Any], path: Path) -> None:
    if document.get("format") != FORMAT:
        raise ValueError(f"{path}: format is {document.get('format')!r}; expected {FORMAT!r}")
    version = document.get("version")
    if isinstance(version, bool) or not isinstance(version, int) or not 1 <= version:
        raise ValueError(f"{path}: version is {version!r}; expected {VERSION}")
    if version > VERSION:
        raise ValueError(
            f"{path}: written for a newer version ({version}); expected {VERSION}: update carrierflex"
        )
    for key in document:
        if key not in _TOP:
            raise ValueError(f"{path}: unknown entry {key!r}; expected {', '.join(_TOP)}")


def _table(
    document: dict[str, Any], name: str, keys: tuple[str, ...], path: Path
) -> dict[str, Any]:
    table = document.get(name, {})
    if not isinstance(table, dict) or not set(table) <= set(keys):
        raise ValueError(f"{path}, [{name}]: found {table!r}; expected the keys {', '.join(keys)}")
    return table


def _frame(table: dict[str, Any], path: Path) -> CadFrame:
    where = f"{path}, [frame]"
    axis = _unit(table, "axis", where, default=(1.0, 0.0, 0.0))
    pin_1 = _unit(table, "pin_1", where, default=(0.0, 0.0, 1.0))
    if abs(float(axis @ pin_1)) > 1e-6:
        raise ValueError(
            f"{where}: axis {axis.tolist()} and pin_1 {pin_1.tolist()}; expected a right angle between them"
        )
    return CadFrame(_vector(table, "origin", where, default=(0.0, 0.0, 0.0)), axis, pin_1)


def _statement(name: str, table: Any, where: str) -> SurfaceStatement:
    if not isinstance(table, dict) or table.get("type") not in _KEYS:
        found = table.get("type") if isinstance(table, dict) else table
        raise ValueError(f"{where}: type is {found!r}; expected 'cylinder' or 'plane'")
    kind = table["type"]
    for key in table:
        if key not in _KEYS[kind]:
            raise ValueError(f"{where}: unknown key {key!r}; expected {', '.join(_KEYS[kind])}")
    point = _vector(table, "point", where, default=None if kind == "cylinder" else (0.0, 0.0, 0.0))
    parts = table.get("parts", 1)
    if isinstance(parts, bool) or not isinstance(parts, int) or not 1 <= parts <= 100:
        raise ValueError(f"{where}: parts is {parts!r}; expected a whole number from 1")
    if kind == "plane":
        normal, station = _unit(table, "normal", where), _number(table, "station", where)
        return SurfaceStatement(
            name, kind, point, normal, station, _window(table, "radial_range", where), parts
        )
    radius = _number(table, "radius", where)
    if not radius > 0.0:
        raise ValueError(f"{where}: radius is {radius}; expected a positive radius in metres")
    direction = _unit(table, "direction", where)
    return SurfaceStatement(
        name, kind, point, direction, radius, _window(table, "axial_range", where), parts
    )


def _window(table: dict[str, Any], key: str, where: str) -> tuple[float, float]:
    if key not in table:
        return -math.inf, math.inf
    low, high = _numbers(table[key], 2, f"{where}: {key}")
    if not low < high:
        raise ValueError(f"{where}: {key} is {[low, high]}; expected the smaller value first")
    return low, high


def _number(table: dict[str, Any], key: str, where: str, *, default: float | None = None) -> float:
    if key not in table and default is not None:
        return default
    return _numbers(table.get(key), 1, f"{where}: {key}")[0]


def _vector(
    table: dict[str, Any], key: str, where: str, *, default: tuple[float, ...] | None = None
) -> NDArray[np.float64]:
    return np.array(_numbers(table.get(key, default), 3, f"{where}: {key}"))


def _unit(
    table: dict[str, Any], key: str, where: str, *, default: tuple[float, ...] | None = None
) -> NDArray[np.float64]:
    vector = _vector(table, key, where, default=default)
    length = float(np.linalg.norm(vector))
    if not length > 0.0:
        raise ValueError(f"{where}: {key} is {vector.tolist()}; expected a direction")
    return np.asarray(vector / length)


def _numbers(value: Any, count: int, what: str) -> list[float]:
    values = value if isinstance(value, (list, tuple)) else [value]
    numeric = all(
        isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x) for x in values
    )
    if len(values) != count or not numeric:
        expected = "a number" if count == 1 else f"{count} numbers"
        raise ValueError(f"{what} is {value!r}; expected {expected}")
    return [float(x) for x in values]
