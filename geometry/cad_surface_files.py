"""The file surfaces.toml.

Which surfaces of a CAD model carry which name, stated by axis, radius and station.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_surfaces import SurfaceStatement
from carrierflex.geometry.parameters import CarrierParameters, PinParameters, pin_angles

if TYPE_CHECKING:
    from carrierflex.geometry.cad_surface_tables import CylinderTable, PlaneTable
from carrierflex.files.toml_files import TomlKind, read_toml
from carrierflex.files.whole_files import whole_file

SURFACES_FILE = TomlKind(
    "a surfaces file",
    holds="tables [surfaces.<name>]",
    most_bytes=100_000,
    format="carrierflex-surfaces",
)
#: Deviation [m] written into a new file: two digits of a drawing in mm.
_TOLERANCE = 1e-5
#: Window of a surface that its file does not cut.
_EVERYWHERE = (-math.inf, math.inf)

#: Comments of a written surfaces file.
_SURFACES_HEADING = (
    "# Which faces of the CAD model are which surface. Lengths in metres whatever the unit of the "
    "CAD file.",
    "# axial_range: stations along the axis, radial_range: radii; faces are cut at both ends where "
    "they go on.",
)
_FRAME_HEADING = (
    "# The carrier's frame in the CAD model: x downwind along the axis, z towards pin 1, origin on "
    "the rim face."
)
_PIN_HEADING = (
    "# Bonded pins of the stiff variant: as thick as the bores, from the first bore's end to the "
    "last one's."
)


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
    leave_out_holes_below : float or None
        Diameter [m] up to which round holes are filled before meshing; None for none.
    body_of_group : mapping of str to str
        Body, ``carrier`` or ``pins``, by the name of a group of elements of a mesh.
    """

    surfaces: tuple[SurfaceStatement, ...]
    frame: CadFrame
    tolerance: float
    bearing_width: float | None
    leave_out_holes_below: float | None = None
    body_of_group: Mapping[str, str] = field(default_factory=dict)

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
        Where it is no TOML, of a newer version, or entries are unknown, missing or impossible; the
        message names all of them.
    """
    from carrierflex.geometry.cad_surface_tables import SurfacesDocument

    document = read_toml(path, SURFACES_FILE, SurfacesDocument)
    frame = CadFrame(
        np.array(document.frame.origin),
        _unit_vector(document.frame.axis),
        _unit_vector(document.frame.pin_1),
    )
    surfaces = tuple(_statement(name, table) for name, table in document.surfaces.items())
    return CadStatements(
        surfaces,
        frame,
        document.tolerance,
        document.pin.bearing_width,
        document.mesh.leave_out_holes_below,
        {group: body for body, groups in document.mesh.bodies.items() for group in groups},
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
        *_SURFACES_HEADING,
        f'format = "{SURFACES_FILE.format}"',
        f"version = {SURFACES_FILE.version}",
        f"tolerance = {_TOLERANCE}",
        "",
        _FRAME_HEADING,
        "[frame]\norigin = [0.0, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\npin_1 = [0.0, 0.0, 1.0]",
        "",
        _PIN_HEADING,
        f"[pin]\nbearing_width = {pin.bearing_width!r}",
        _plane_text("shaft_face", -carrier.hub_length, (carrier.hub_inner_diameter / 2.0, hub)),
        "# From the radius that the sensors face to the rim.",
        _plane_text("rim_face", 0.0, (carrier.sensor_radius, carrier.outer_radius)),
        _cylinder_text("upwind_seat", 0.0, hub, carrier.upwind_bearing_x),
        _cylinder_text("downwind_seat", 0.0, seat, (carrier.length_between_faces, seat_end)),
    ]
    for number, angle in enumerate(pin_angles(carrier.n_planets), start=1):
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
        f'\n[surfaces.{name}]\ntype = "cylinder"\npoint = [0.0, {y!r}, {z!r}]\n'
        "direction = [1.0, 0.0, 0.0]\n"
        f"radius = {radius!r}\naxial_range = [{x[0]!r}, {x[1]!r}]"
    )


def _statement(name: str, table: "CylinderTable | PlaneTable") -> SurfaceStatement:
    point = np.array(table.point)
    if table.type == "plane":
        normal = _unit_vector(table.normal)
        return SurfaceStatement(
            name,
            "plane",
            point,
            normal,
            table.station,
            table.radial_range or _EVERYWHERE,
            table.parts,
        )
    direction = _unit_vector(table.direction)
    return SurfaceStatement(
        name,
        "cylinder",
        point,
        direction,
        table.radius,
        table.axial_range or _EVERYWHERE,
        table.parts,
    )


def _unit_vector(vector: tuple[float, float, float]) -> NDArray[np.float64]:
    return np.asarray(np.array(vector) / np.linalg.norm(vector))
