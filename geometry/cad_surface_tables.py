"""What a surfaces file holds: the carrier's frame in the CAD model and a table a surface."""

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from carrierflex.files.toml_values import (
    Expected,
    Number,
    Positive,
    Texts,
    ThreeNumbers,
    TomlTable,
    TwoNumbers,
    key,
)

Triple = tuple[float, float, float]
#: Units that a STEP file may be said to have.
StepUnit = Literal["m", "cm", "mm", "inch"]
#: Which solid of a STEP file with several: its number, or all of them as one.
ChosenSolid = int | Literal["united"]
#: How many times smaller elements at re-entrant edges are: of 1.7 to 10, few unknowns for
#: curves that change by 2 % with half the size (docs/cad.md).
FINER_AT_INNER_EDGES = 2.5


def _not_zero(vector: Triple) -> Triple:
    # The square may vanish, or overflow, where the numbers do not.
    if not 0.0 < sum(x * x for x in vector) < math.inf:
        raise ValueError("no direction")
    return vector


def _ascending(limits: tuple[float, float]) -> tuple[float, float]:
    if not limits[0] < limits[1]:
        raise ValueError("not ascending")
    return limits


Direction = Annotated[
    ThreeNumbers,
    AfterValidator(_not_zero),
    Expected("a direction: three numbers, not all zero"),
]
Window = Annotated[
    TwoNumbers,
    AfterValidator(_ascending),
    Expected("two numbers, the smaller value first"),
]
BandCount = Annotated[int, Field(ge=1, le=100), Expected("a whole number from 1 to 100")]
Finer = Annotated[float, Field(ge=1, le=8), Expected("a number from 1 to 8")]
Tolerance = Annotated[float, Field(gt=0, le=1e-3), Expected("more than 0 and at most 0.001 m")]
Width = Annotated[float, Field(gt=0, lt=5), Expected("a positive width in metres, below 5 m")]


class CylinderTable(TomlTable):
    """Part of a cylinder."""

    type: Literal["cylinder"] = key("Kind of the surface")
    point: ThreeNumbers = key("A point of the axis", "m")
    direction: Direction = key("Direction of the axis")
    radius: Positive = key("Radius", "m")
    axial_range: Window | None = key("Least and greatest station along the axis", "m", default=None)
    parts: BandCount = key("Bands that the surface has along the axis", default=1)


class PlaneTable(TomlTable):
    """Part of a plane."""

    type: Literal["plane"] = key("Kind of the surface")
    normal: Direction = key("Normal of the plane")
    station: Number = key("Distance of the plane from the origin along the normal", "m")
    radial_range: Window | None = key("Least and greatest radius about the axis", "m", default=None)
    point: ThreeNumbers = key(
        "A point of the axis that radii count from",
        "m",
        default=(0.0, 0.0, 0.0),
    )
    parts: BandCount = key("Bands that the surface has in radius", default=1)


SurfaceTable = Annotated[CylinderTable | PlaneTable, Field(discriminator="type")]


def _perpendicular(frame: "FrameTable") -> "FrameTable":
    lengths = math.hypot(*frame.axis) * math.hypot(*frame.pin_1)
    cosine = sum(a * b for a, b in zip(frame.axis, frame.pin_1, strict=True)) / lengths
    if abs(cosine) > 1e-6:
        directions = f"axis {list(frame.axis)} and pin_1 {list(frame.pin_1)}"
        raise ValueError(f"{directions}; expected a right angle between them")
    return frame


class FrameTable(TomlTable):
    """The carrier's frame in the CAD model."""

    origin: ThreeNumbers = key("Origin, on the rim's face", "m", default=(0.0, 0.0, 0.0))
    axis: Direction = key("Rotation axis, downwind", default=(1.0, 0.0, 0.0))
    pin_1: Direction = key("Direction from the axis towards pin 1", default=(0.0, 0.0, 1.0))
    solid: Annotated[ChosenSolid, Expected("a number from 1, or 'united'")] | None = key(
        "Solid of a STEP file with several: its number, or 'united' for all, which must touch",
        default=None,
    )
    length_unit: StepUnit | None = key(
        "Length unit of a STEP file that declares a wrong one", default=None
    )


class PinTable(TomlTable):
    """What the CAD model does not tell of the pins."""

    bearing_width: Width | None = key(
        "Width of the planet bearings' seat on the pins",
        "m",
        default=None,
    )


class MeshTable(TomlTable):
    """How the solid is meshed."""

    leave_out_holes_below: Width | None = key(
        "Diameter up to which round holes of a STEP file are filled before meshing",
        "m",
        default=None,
    )
    finer_at_inner_edges: Finer = key(
        "How many times smaller the elements of a STEP file's mesh are at re-entrant edges; 1: "
        "elements of one size",
        default=FINER_AT_INNER_EDGES,
    )
    bodies: dict[Literal["carrier", "pins"], Texts] = key(
        "Groups of elements of a mesh file that make up each body", default_factory=dict
    )


class MaterialTable(TomlTable):
    """Isotropic material of a body or a group of elements, in SI units whatever the mesh's."""

    E: Positive = key("Young's modulus", "Pa")
    nu: Annotated[float, Field(gt=-1, lt=0.5), Expected("more than -1 and less than 0.5")] = key(
        "Poisson's ratio"
    )
    rho: Positive = key("Density", "kg/m^3")


class SurfacesDocument(TomlTable):
    """Which surfaces of a CAD model carry which name; lengths in metres whatever the CAD's unit."""

    format: Literal["carrierflex-surfaces"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    tolerance: Tolerance = key(
        "Deviation within which a face counts as the stated one",
        "m",
        default=1e-5,
    )
    frame: Annotated[FrameTable, AfterValidator(_perpendicular)] = key(
        "The carrier's frame in the CAD model",
        default_factory=FrameTable,
    )
    pin: PinTable = key(
        "What the CAD model does not contain about the pins", default_factory=PinTable
    )
    mesh: MeshTable = key("How the solid is meshed", default_factory=MeshTable)
    materials: dict[Literal["carrier", "pins"], MaterialTable] = key(
        "Material of each body, where it is not the usual one", default_factory=dict
    )
    surfaces: Annotated[dict[str, SurfaceTable], Field(min_length=1)] = key(
        "The surfaces by name",
        expected="at least one table [surfaces.<name>]",
    )
