"""Faces of a CAD solid that are one surface, and surfaces that are a pattern about an axis.

A CAD program splits a cylinder into halves and repeats a bolt hole: halves become one surface,
equal surfaces on a pitch circle one group with one number.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_recognition.oriented_faces import OrientedFace

#: Differences of length [m] and direction [rad] below which surfaces are the same.
SAME_LENGTH, PARALLEL = 2e-5, 1e-5
#: Relative difference of area below which surfaces may be copies of one another.
_SAME_AREA = 1e-3
#: Largest angle [rad] about its axis that a bore leaves out: an oil bore's mouth, no pocket.
_WIDEST_GAP = np.pi / 3.0


@dataclass(frozen=True, eq=False)
class CadSurface:
    """Faces that make up one surface.

    Parameters
    ----------
    faces : tuple of OrientedFace
        Parts of one cylinder or plane; one face of another kind.
    """

    faces: tuple[OrientedFace, ...]

    @property
    def kind(self) -> str:
        """``plane``, ``cylinder`` or ``other``."""
        return self.faces[0].face.kind

    @property
    def direction(self) -> NDArray[np.float64]:
        """Unit axis of a cylinder, unit normal of a plane, either sign."""
        return self.faces[0].face.direction

    @property
    def point(self) -> NDArray[np.float64]:
        """A point of the axis or of the plane [m]."""
        return self.faces[0].face.point

    @property
    def radius(self) -> float:
        """Radius of a cylinder [m]."""
        return self.faces[0].face.radius

    @property
    def hollow(self) -> bool:
        """Whether a cylinder is a bore."""
        return self.faces[0].hollow

    @property
    def outward(self) -> NDArray[np.float64]:
        """Unit normal of a plane, out of the material."""
        return self.faces[0].outward

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return sum(oriented.face.area for oriented in self.faces)

    @property
    def outline(self) -> NDArray[np.float64]:
        """Points of the faces' edges, shape (k, 3) [m]."""
        return np.concatenate([oriented.face.outline for oriented in self.faces])

    @property
    def triangles(self) -> NDArray[np.float64]:
        """Triangles of all faces, shape (k, 3, 3) [m]."""
        return np.concatenate([oriented.triangles for oriented in self.faces])

    def extent(self, direction: NDArray[np.float64]) -> tuple[float, float]:
        """Least and greatest station along `direction` [m]."""
        stations = self.outline @ direction
        return float(stations.min()), float(stations.max())

    def radii(
        self, point: NDArray[np.float64], direction: NDArray[np.float64]
    ) -> tuple[float, float]:
        """Least and greatest distance of the outline from an axis [m]."""
        r = np.linalg.norm(np.cross(self.outline - point, direction), axis=1)
        return float(r.min()), float(r.max())

    @property
    def goes_round(self) -> bool:
        """Whether a cylinder's faces lie on all sides of its axis."""
        return self.surrounds(self.point, self.direction)

    def surrounds(self, point: NDArray[np.float64], direction: NDArray[np.float64]) -> bool:
        """Whether the faces lie on all sides of an axis."""
        return _widest_gap(self.triangles.reshape(-1, 3) - point, direction) < _WIDEST_GAP

    def round_extent(self, direction: NDArray[np.float64]) -> tuple[float, float]:
        """Least and greatest station at which a cylinder's outline goes more than half round [m].

        Beyond them it is a notch only. The whole extent where there are no two such stations.
        """
        outline = self.outline
        stations = outline @ direction
        ends = []
        for station in np.unique(np.round(stations, 6)):
            at = np.abs(stations - station) < SAME_LENGTH
            across = outline[at] - self.point
            if at.sum() > 1 and _widest_gap(across, self.direction) < np.pi:
                ends.append(float(stations[at].mean()))
        return (ends[0], ends[-1]) if len(ends) > 1 else self.extent(direction)


def merged_surfaces(faces: Sequence[OrientedFace]) -> tuple[CadSurface, ...]:
    """Surfaces of a solid, the largest first: parts of one plane or cylinder joined."""
    surfaces: list[list[OrientedFace]] = []
    for face in faces:
        joined = [face]
        apart = []
        for other in surfaces:
            if any(_one_surface(face, member) for member in other):
                joined = [*other, *joined]
            else:
                apart.append(other)
        surfaces = [*apart, joined]
    merged = [CadSurface(tuple(joined_faces)) for joined_faces in surfaces]
    return tuple(sorted(merged, key=lambda surface: -surface.area))


def _one_surface(first: OrientedFace, second: OrientedFace) -> bool:
    """Whether two faces are parts of one plane or cylinder and lie side by side."""
    a, b = first.face, second.face
    if a.kind != b.kind or a.kind == "other":
        return False
    if float(np.linalg.norm(np.cross(a.direction, b.direction))) > PARALLEL:
        return False
    if a.kind == "plane":
        same = abs(float((a.point - b.point) @ a.direction)) < SAME_LENGTH
        return same and bool(first.outward @ second.outward > 0.0) and bool(a.edges & b.edges)
    off = float(np.linalg.norm(np.cross(a.point - b.point, a.direction)))
    same = off + abs(a.radius - b.radius) < SAME_LENGTH and first.hollow == second.hollow
    (low_a, high_a), (low_b, high_b) = (
        ((face.outline @ a.direction).min(), (face.outline @ a.direction).max()) for face in (a, b)
    )
    overlap = low_a < high_b - SAME_LENGTH and low_b < high_a - SAME_LENGTH
    return same and (overlap or bool(a.edges & b.edges))


@dataclass(frozen=True, eq=False)
class SurfaceGroup:
    """Equal surfaces about the axis, under one number.

    Parameters
    ----------
    number : int
        From 1, the group of the largest area first.
    surfaces : tuple of CadSurface
        The copies; one where the surface is no pattern.
    """

    number: int
    surfaces: tuple[CadSurface, ...]

    @property
    def first(self) -> CadSurface:
        """One of the copies."""
        return self.surfaces[0]

    def described(self) -> str:
        """Kind, size and place about the x axis, in words."""
        x, first = np.array([1.0, 0.0, 0.0]), self.first
        low, high = first.extent(x)
        low, high = round(low, 7) + 0.0, round(high, 7) + 0.0
        inner, outer = first.radii(np.zeros(3), x)
        along = abs(float(first.direction @ x)) > 1.0 - PARALLEL
        if first.kind == "plane" and along:
            side = "downwind" if first.outward @ x > 0.0 else "upwind"
            text = f"plane facing {side}, station {low:.5g} m, radii {inner:.4g} to {outer:.4g} m"
        elif first.kind == "cylinder" and along:
            off = float(np.linalg.norm(np.cross(first.point, x)))
            kind = "bore" if first.hollow else "outer cylinder"
            distance = f" at distance {off:.5g} m" if off > SAME_LENGTH else ""
            stations = f"stations {low:.5g} to {high:.5g} m"
            text = f"{kind} of radius {first.radius:.5g} m{distance}, {stations}"
        else:
            kinds = {"plane": "plane", "cylinder": f"cylinder of radius {first.radius:.4g} m"}
            text = (
                f"{kinds.get(first.kind, 'other surface')}, stations {low:.4g} to {high:.4g} m, "
                f"radii {inner:.4g} to {outer:.4g} m"
            )
        copies = f"{len(self.surfaces)} x " if len(self.surfaces) > 1 else ""
        return f"{copies}{text}, area {first.area:.4g} m^2"


def grouped_about_x(surfaces: Sequence[CadSurface]) -> tuple[SurfaceGroup, ...]:
    """Groups of surfaces that are copies of one another about the x axis, numbered by area."""
    groups: list[list[CadSurface]] = []
    for surface in surfaces:
        for group in groups:
            if _copies(group[0], surface):
                group.append(surface)
                break
        else:
            groups.append([surface])
    ordered = sorted(groups, key=lambda group: -sum(surface.area for surface in group))
    return tuple(SurfaceGroup(n, tuple(group)) for n, group in enumerate(ordered, start=1))


def _copies(first: CadSurface, second: CadSurface) -> bool:
    """Whether a turn about the x axis may take one surface to the other."""
    if first.kind != second.kind or abs(first.area - second.area) > _SAME_AREA * first.area:
        return False
    x, origin = np.array([1.0, 0.0, 0.0]), np.zeros(3)
    lengths = [
        np.array([surface.radius, *surface.extent(x), *surface.radii(origin, x)])
        for surface in (first, second)
    ]
    # Outlines are sampled: least and greatest radii agree to the samples' distance only.
    return bool(
        np.abs(lengths[0][:3] - lengths[1][:3]).max() < SAME_LENGTH
        and np.abs(lengths[0][3:] - lengths[1][3:]).max() < 1e-3
    )


def _widest_gap(across: NDArray[np.float64], direction: NDArray[np.float64]) -> float:
    """Largest angle about an axis through the origin without any of the points [rad]."""
    first = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    angles = np.sort(np.arctan2(across @ np.cross(direction, first), across @ first))
    return float(np.diff(np.append(angles, angles[0] + 2.0 * np.pi)).max())
