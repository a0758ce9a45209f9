"""Faces of a CAD solid, measured.

Which are planes and cylinders, about which axis, of which radius, at which station.

The kind is found from points and normals on the face, not from the name that its writer gave it:
some programs write cylinders as B-spline surfaces.
"""

from dataclasses import dataclass

import gmsh
import numpy as np
from numpy.typing import NDArray

#: Points sampled along each parameter of a face, and along each of its edges.
_ON_FACE, _ON_EDGE = 7, 65
#: Deviation of sampled normals from those of a plane or cylinder.
_SAME_NORMAL = 1e-6
#: Deviation of sampled points from the plane or cylinder [m].
_SAME_POINT = 1e-6


@dataclass(frozen=True, eq=False)
class CadFace:
    """One face of the solid in gmsh's current model.

    Parameters
    ----------
    tag : int
        gmsh's number of the face.
    kind : str
        ``plane``, ``cylinder`` or ``other``.
    direction : ndarray, shape (3,)
        Unit normal of a plane, unit axis of a cylinder, either sign; zero for other faces.
    point : ndarray, shape (3,)
        A point of the plane or of the cylinder's axis, the middle of another face's samples [m].
    radius : float
        Radius of the cylinder [m]; 0 for other faces.
    outline : ndarray, shape (k, 3)
        Points of the face's edges [m].
    edges : frozenset of int
        gmsh's numbers of its edges.
    area : float
        Area [m^2].
    """

    tag: int
    kind: str
    direction: NDArray[np.float64]
    point: NDArray[np.float64]
    radius: float
    outline: NDArray[np.float64]
    edges: frozenset[int]
    area: float

    def __str__(self) -> str:
        if self.kind == "other":
            return f"other surface about {_shown(self.point)} m, area {self.area:.4g} m^2"
        along = self.outline @ self.direction
        if self.kind == "plane":
            r = np.linalg.norm(np.cross(self.outline, self.direction), axis=1)
            return (
                f"plane, normal {_shown(self.direction)}, station {along.mean():.5g} m, radii {r.min():.4g} to "
                f"{r.max():.4g} m, area {self.area:.4g} m^2"
            )
        foot = self.point - (self.point @ self.direction) * self.direction
        return (
            f"cylinder, axis {_shown(self.direction)} through {_shown(foot)}, radius {self.radius:.5g} m, stations "
            f"{along.min():.5g} to {along.max():.5g} m, area {self.area:.4g} m^2"
        )


def _shown(vector: NDArray[np.float64]) -> str:
    # Adding zero turns -0 into 0.
    return "(" + ", ".join(f"{x:.5g}" for x in np.round(vector, 7) + 0.0) + ")"


def cad_faces() -> tuple[CadFace, ...]:
    """Measure every face of gmsh's current model."""
    return tuple(_measured(tag) for _, tag in gmsh.model.getEntities(2))


def _measured(tag: int) -> CadFace:
    points, normals = _samples(tag)
    edges = frozenset(
        abs(edge) for _, edge in gmsh.model.getBoundary([(2, tag)], combined=False, oriented=False)
    )
    outline = np.concatenate([_edge_points(edge) for edge in sorted(edges)]) if edges else points
    kind, direction, point, radius = _fitted(points, normals)
    area = float(gmsh.model.occ.getMass(2, tag))
    return CadFace(tag, kind, direction, point, radius, outline, edges, area)


def _samples(tag: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low, high = gmsh.model.getParametrizationBounds(2, tag)
    # Inside the bounds: at their ends a surface may be degenerate, as a sphere at its poles.
    u, v = (np.linspace(a, b, _ON_FACE + 2)[1:-1] for a, b in zip(low, high, strict=True))
    parameters = np.stack(np.meshgrid(u, v), axis=-1).ravel()
    points = np.array(gmsh.model.getValue(2, tag, parameters)).reshape(-1, 3)
    return points, np.array(gmsh.model.getNormal(tag, parameters)).reshape(-1, 3)


def _edge_points(edge: int) -> NDArray[np.float64]:
    low, high = gmsh.model.getParametrizationBounds(1, edge)
    return np.array(gmsh.model.getValue(1, edge, np.linspace(low[0], high[0], _ON_EDGE))).reshape(
        -1, 3
    )


def _fitted(
    points: NDArray[np.float64], normals: NDArray[np.float64]
) -> tuple[str, NDArray[np.float64], NDArray[np.float64], float]:
    """Kind, direction, point and radius of the plane or cylinder through the samples."""
    centre = points.mean(axis=0)
    mean = normals.mean(axis=0)
    if (
        np.abs(normals - mean).max() < _SAME_NORMAL
        and np.abs((points - centre) @ mean).max() < _SAME_POINT
    ):
        return "plane", _signed(mean / np.linalg.norm(mean)), centre, 0.0
    # Normals of a cylinder are perpendicular to its axis: the direction of their smallest second
    # moment.
    moments, directions = np.linalg.eigh(normals.T @ normals / len(normals))
    if moments[1] > _SAME_NORMAL and np.abs(normals @ directions[:, 0]).max() < _SAME_NORMAL:
        axis = _signed(directions[:, 0])
        point, radius, residual = circle_through(points - np.outer(points @ axis, axis))
        if residual < _SAME_POINT:
            return "cylinder", axis, point, radius
    return "other", np.zeros(3), centre, 0.0


def _signed(direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """One sign of the two: the largest component is positive, and what is rounding beside it is zero."""
    clean = np.where(np.abs(direction) < 1e-12, 0.0, direction)
    return np.asarray(clean * np.sign(clean[np.abs(clean).argmax()]))


def circle_through(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, float]:
    """Centre (3,) [m], radius [m] and largest deviation [m] of the circle through coplanar `points`, shape (n, 3).

    Least squares of ``2 c·p + (R² - c²) = p²``, linear in the centre c and exact for points on a
    circle (Kåsa 1976).
    """
    middle = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - middle, full_matrices=False)
    flat = (points - middle) @ axes[:2].T
    A = np.column_stack([2.0 * flat, np.ones(len(flat))])
    a, b, c = np.linalg.lstsq(A, (flat**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(c + a**2 + b**2, 0.0)))
    deviation = float(np.abs(np.hypot(flat[:, 0] - a, flat[:, 1] - b) - radius).max())
    return middle + axes[:2].T @ np.array([a, b]), radius, deviation
