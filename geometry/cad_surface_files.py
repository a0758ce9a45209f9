"""The file surfaces.toml.

Which surfaces of a CAD model carry which name, stated by axis, radius and station.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_surfaces import SurfaceStatement
from carrierflex.geometry.parameter_files import SURFACES_FILE
from carrierflex.geometry.parameters import CarrierParameters, PinParameters
from carrierflex.geometry.pins import pin_angles

if TYPE_CHECKING:
    from carrierflex.geometry.cad_surface_tables import CylinderTable, PlaneTable
from carrierflex.files.toml_files import read_toml
from carrierflex.files.whole_files import whole_file

#: Deviation [m] written into a new file: two digits of a drawing in mm.
TOLERANCE = 1e-5
#: Window of a surface that its file does not cut.
_EVERYWHERE = (-math.inf, math.inf)

#: First lines of a written surfaces file, and other comments of it.
HEADING = (
    "# Which faces of the CAD model are which surface. Lengths in metres whatever the unit of the "
    "CAD file.",
    "# axial_range: stations along the axis, radial_range: radii; faces are cut at both ends where "
    "they go on.",
    f'format = "{SURFACES_FILE.format}"',
    f"version = {SURFACES_FILE.version}",
)
_SENSORS = "# From the radius that the sensors face to the rim."
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

    Origin [m], x axis (downwind), z axis (towards pin 1); the CAD file's length unit where it
    declares a wrong one; the solid where it holds several: its number, or ``united`` for all.
    """

    origin: NDArray[np.float64]
    axis: NDArray[np.float64]
    pin_1: NDArray[np.float64]
    length_unit: str | None = None
    solid: int | str | None = None

    @classmethod
    def of_the_file(
        cls, length_unit: str | None = None, solid: int | str | None = None
    ) -> "CadFrame":
        """The CAD model's own frame."""
        axis, pin_1 = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
        return cls(np.zeros(3), axis, pin_1, length_unit, solid)

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
    finer_at_inner_edges : float
        How many times smaller elements are at re-entrant edges; 1 for elements of one size.
    materials : mapping of str to tuple
        Young's modulus [Pa], Poisson's ratio and density [kg/m^3] by body, where they are stated.
    """

    surfaces: tuple[SurfaceStatement, ...]
    frame: CadFrame
    tolerance: float
    bearing_width: float | None
    leave_out_holes_below: float | None
    body_of_group: Mapping[str, str]
    finer_at_inner_edges: float
    materials: Mapping[str, tuple[float, float, float]]

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
        document.frame.length_unit,
        document.frame.solid,
    )
    surfaces = tuple(_statement(name, table) for name, table in document.surfaces.items())
    return CadStatements(
        surfaces,
        frame,
        document.tolerance,
        document.pin.bearing_width,
        document.mesh.leave_out_holes_below,
        {group: body for body, groups in document.mesh.bodies.items() for group in groups},
        document.mesh.finer_at_inner_edges,
        {body: (each.E, each.nu, each.rho) for body, each in document.materials.items()},
    )


def write_cad_statements(path: Path, carrier: CarrierParameters, pin: PinParameters) -> None:
    """Write the statements that find the surfaces of the parametric carrier in its CAD model.

    Raises
    ------
    OSError
        Where the folder cannot be written.
    """
    lines = [
        *HEADING,
        f"tolerance = {TOLERANCE}",
        "",
        *frame_lines(CadFrame.of_the_file()),
        "",
        _PIN_HEADING,
        f"[pin]\nbearing_width = {pin.bearing_width!r}",
    ]
    for surface in _parametric_surfaces(carrier):
        comment = [_SENSORS] if surface.name == "rim_face" else []
        lines += ["", *comment, statement_text(surface)]
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _parametric_surfaces(carrier: CarrierParameters) -> Iterator[SurfaceStatement]:
    x, origin = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    hub, seat = carrier.hub_outer_diameter / 2.0, carrier.seat_outer_diameter / 2.0
    seat_x = (carrier.length_between_faces, carrier.length_between_faces + carrier.seat_length)
    shaft = (carrier.hub_inner_diameter / 2.0, hub)
    rim = (carrier.sensor_radius, carrier.outer_radius)
    yield SurfaceStatement("shaft_face", "plane", origin, x, -carrier.hub_length, shaft)
    yield SurfaceStatement("rim_face", "plane", origin, x, 0.0, rim)
    yield SurfaceStatement("upwind_seat", "cylinder", origin, x, hub, carrier.upwind_bearing_x)
    yield SurfaceStatement("downwind_seat", "cylinder", origin, x, seat, seat_x)
    for number, angle in enumerate(pin_angles(carrier.n_planets), start=1):
        at = carrier.centre_distance * np.array([0.0, -math.sin(angle), math.cos(angle)])
        for side, station in (
            ("upwind", carrier.upwind_bore_x),
            ("downwind", carrier.downwind_bore_x),
        ):
            name = f"pin_{number}_{side}"
            yield SurfaceStatement(name, "cylinder", at, x, carrier.pin_hole_radius, station)


def frame_lines(frame: CadFrame) -> list[str]:
    """Lines of the table [frame]."""
    vectors = {"origin": frame.origin, "axis": frame.axis, "pin_1": frame.pin_1}
    lines = [_FRAME_HEADING, "[frame]"]
    lines += [f"{name} = {_numbers(vector)}" for name, vector in vectors.items()]
    if frame.length_unit is not None:
        lines.append(f'length_unit = "{frame.length_unit}"')
    if frame.solid is not None:
        lines.append(f"solid = {frame.solid!r}")
    return lines


def statement_text(surface: SurfaceStatement) -> str:
    """Table [surfaces.NAME] of a statement."""
    lines = [f"[surfaces.{surface.name}]", f'type = "{surface.kind}"']
    if surface.kind == "plane":
        if surface.point.any():
            lines.append(f"point = {_numbers(surface.point)}")
        lines += [f"normal = {_numbers(surface.direction)}", f"station = {surface.size!r}"]
        window = "radial_range"
    else:
        lines += [f"point = {_numbers(surface.point)}"]
        lines += [f"direction = {_numbers(surface.direction)}", f"radius = {surface.size!r}"]
        window = "axial_range"
    if np.isfinite(surface.window).any():
        lines.append(f"{window} = {_numbers(surface.window)}")
    return "\n".join(lines + ([f"parts = {surface.n_bands}"] if surface.n_bands != 1 else []))


def _numbers(values: Iterable[float]) -> str:
    # Adding zero turns -0 into 0.
    return str([float(value) + 0.0 for value in values])


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
