"""The half sector as a stack of wedges of 15 nodes, its surfaces and their rigid motions."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from validation.independent_carrier.section_mesh import (
    HALF_SECTOR,
    PIN,
    Dimensions,
    FloatArray,
    IntArray,
    Section,
)

#: Distance [m] at which a node lies on a surface.
_ON = 1e-7
_GAUSS = math.sqrt(0.6) * np.array([-1.0, 0.0, 1.0]), np.array([5.0, 8.0, 5.0]) / 9.0


@dataclass(frozen=True, eq=False)
class Stack:
    """Half sector of carrier, carrier with bonded pins, or pin.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes (x, y, z) [m].
    wedges : dict of str to ndarray of int, shape (m, 15)
        Elements of each body in CalculiX's order of nodes.
    """

    points: FloatArray
    wedges: dict[str, IntArray]

    @property
    def on_pin_plane(self) -> NDArray[np.bool_]:
        """Nodes in the plane of pin 1 and the axis."""
        return np.abs(self.points[:, 1]) < _ON

    @property
    def on_web_plane(self) -> NDArray[np.bool_]:
        """Nodes in the plane of the next web and the axis."""
        c, s = math.cos(HALF_SECTOR), math.sin(HALF_SECTOR)
        return np.abs(c * self.points[:, 1] + s * self.points[:, 2]) < _ON

    def on_plane(self, x: float, inner: float, outer: float) -> NDArray[np.bool_]:
        """Nodes of the ring from radius inner to outer in the plane x."""
        r = np.hypot(self.points[:, 1], self.points[:, 2])
        return (np.abs(self.points[:, 0] - x) < _ON) & (r > inner - _ON) & (r < outer + _ON)

    def on_bore(self, d: Dimensions, x: tuple[float, float]) -> NDArray[np.bool_]:
        """Nodes of the bore of pin 1 (or of the pin's face) from x[0] to x[1]."""
        r = np.hypot(self.points[:, 1], self.points[:, 2] - d["centre_distance"])
        between = (self.points[:, 0] > x[0] - _ON) & (self.points[:, 0] < x[1] + _ON)
        return (np.abs(r - d["pin_hole_diameter"] / 2.0) < _ON) & between


def stations(d: Dimensions) -> dict[str, tuple[float, float]]:
    """Axial extent of every layer, of the bores and of the pin's seat of the planet [m]."""
    a = d["upwind_plate_thickness"]
    b = a + d["plate_gap"]
    end = b + d["downwind_plate_thickness"]
    middle, half = (a + b) / 2.0, d["bearing_width"] / 2.0
    return {
        "hub": (-d["hub_length"], 0.0),
        "plate_a": (0.0, a),
        "webs": (a, b),
        "plate_b": (b, end),
        "seat": (end, end + d["seat_length"]),
        PIN: (0.0, end),
        "midspan": (middle - half, middle + half),
    }


def stack(
    section: Section, d: Dimensions, bodies: Mapping[str, Sequence[str]], size: float
) -> Stack:
    """Extrude the section into layers of wedges.

    Parameters
    ----------
    section : Section
        Plane mesh.
    d : dict
        Dimensions [m].
    bodies : dict of str to sequence of str
        Layers that each body fills.
    size : float
        Largest thickness of a row of elements [m].
    """
    extents = stations(d)
    levels = _levels(d, size)
    n = len(section.points)
    elements: dict[str, IntArray] = {}
    for body, layers in bodies.items():
        rows = []
        for layer in layers:
            triangles = section.triangles[section.regions[layer]]
            low, high = extents[layer]
            inside = (levels[:-1] > low - _ON) & (levels[1:] < high + _ON)
            rows += [_wedges(triangles, int(k), n) for k in np.flatnonzero(inside)]
        elements[body] = np.concatenate(rows)
    used, compact = np.unique(np.concatenate(list(elements.values())), return_inverse=True)
    row, node = np.divmod(used, n)
    halves = np.sort(np.concatenate([levels, (levels[1:] + levels[:-1]) / 2.0]))
    a, b = section.points[node].T
    splits = np.cumsum([len(rows) for rows in elements.values()])[:-1]
    wedges = np.split(compact.reshape(-1, 15), splits)
    return Stack(np.stack([halves[row], -b, a], axis=1), dict(zip(elements, wedges, strict=True)))


def _wedges(triangles: IntArray, row: int, n: int) -> IntArray:
    bottom, middle, top = (triangles + (2 * row + k) * n for k in range(3))
    return np.concatenate(
        [bottom[:, :3], top[:, :3], bottom[:, 3:], top[:, 3:], middle[:, :3]], axis=1
    )


def _levels(d: Dimensions, size: float) -> FloatArray:
    """Stations of the rows of elements: thin next to every change of section."""
    extents = stations(d)
    a, b = extents["webs"]
    low, high = extents["midspan"]
    spans = (
        (*extents["hub"], "last"),
        (*extents["plate_a"], "both"),
        (a, low, "first"),
        (low, high, "none"),
        (high, b, "last"),
        (*extents["plate_b"], "both"),
        (*extents["seat"], "first"),
    )
    levels = [_graded(*span, size) for span in spans]
    return np.concatenate([levels[0][:1], *(level[1:] for level in levels)])


def _graded(first: float, last: float, thin: str, size: float) -> FloatArray:
    """Stations from first to last, closer at the thin end or at both."""
    rows = math.ceil((last - first) / size) + (thin != "none")
    t = np.arange(rows + 1) / rows
    graded = {
        "none": t,
        "both": (t + (1.0 - np.cos(math.pi * t)) / 2.0) / 2.0,
        "first": (t + t**2) / 2.0,
        "last": (t + 1.0 - (1.0 - t) ** 2) / 2.0,
    }[thin]
    return np.asarray(first + (last - first) * graded)


def surface_moments(
    points: FloatArray, facets: Sequence[IntArray], origin: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Integrals ``B = ∫ Rᵀ N dA``, shape (6, 3 n), and ``Z = ∫ Rᵀ R dA`` of facets.

    R is the rigid motion about the origin; facets have six nodes (triangles) or eight.
    """
    B, Z = np.zeros((6, len(points), 3)), np.zeros((6, 6))
    for nodes in facets:
        N, dN, weights = _triangle_rule() if nodes.shape[1] == 6 else _quadrilateral_rule()
        corners = points[nodes]
        x = np.einsum("qk,mki->mqi", N, corners)
        tangents = np.einsum("qkj,mki->mqji", dN, corners)
        area = np.linalg.norm(np.cross(tangents[..., 0, :], tangents[..., 1, :]), axis=-1) * weights
        R = _rigid(x - origin)
        Z += np.einsum("mq,mqic,mqid->cd", area, R, R)
        local = np.einsum("mq,mqic,qk->mkci", area, R, N)
        for c in range(6):
            np.add.at(B[c], nodes, local[:, :, c])
    return B.reshape(6, -1), Z


def _rigid(r: FloatArray) -> FloatArray:
    """Displacement at r of the three translations and the three turns, shape (..., 3, 6)."""
    R = np.zeros((*r.shape[:-1], 3, 6))
    R[..., :, :3] = np.eye(3)
    for c, axis in enumerate(np.eye(3)):
        R[..., :, 3 + c] = np.cross(axis, r)
    return R


def _triangle_rule() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shapes and gradients of six-node triangles at seven points exact to degree 5 (Radon)."""
    root = math.sqrt(15.0)
    points, weights = [(1.0 / 3.0, 1.0 / 3.0)], [9.0 / 80.0]
    for sign in (1.0, -1.0):
        a, weight = (6.0 - sign * root) / 21.0, (155.0 - sign * root) / 2400.0
        points += [(a, a), (1.0 - 2.0 * a, a), (a, 1.0 - 2.0 * a)]
        weights += [weight] * 3
    s, t = np.array(points).T
    r = 1.0 - s - t
    N = np.stack(
        [r * (2 * r - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * r * s, 4 * s * t, 4 * t * r], 1
    )
    ds = np.stack([1 - 4 * r, 4 * s - 1, 0 * s, 4 * (r - s), 4 * t, -4 * t], 1)
    dt = np.stack([1 - 4 * r, 0 * s, 4 * t - 1, -4 * s, 4 * s, 4 * (r - t)], 1)
    return N, np.stack([ds, dt], axis=2), np.array(weights)


#: Corners and mid-sides of the eight-node quadrilateral.
_EIGHT = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (0, -1), (1, 0), (0, 1), (-1, 0)], float)


def _quadrilateral_rule() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Shapes and gradients of eight-node quadrilaterals at three by three Gauss points."""
    points = np.array([(s, t) for s in _GAUSS[0] for t in _GAUSS[0]])
    # Of degree two along each axis: central differences are exact.
    gradients = [(_eight(points + unit) - _eight(points - unit)) / 2.0 for unit in np.eye(2)]
    return _eight(points), np.stack(gradients, axis=2), np.outer(_GAUSS[1], _GAUSS[1]).ravel()


def _eight(points: FloatArray) -> FloatArray:
    s, t = points.T
    columns = []
    for a, b in _EIGHT:
        if a == 0.0:
            columns.append((1.0 - s**2) * (1.0 + b * t) / 2.0)
        elif b == 0.0:
            columns.append((1.0 + a * s) * (1.0 - t**2) / 2.0)
        else:
            columns.append((1.0 + a * s) * (1.0 + b * t) * (a * s + b * t - 1.0) / 4.0)
    return np.stack(columns, axis=1)


#: Faces of a wedge: two triangles and three quadrilaterals, nodes as in the rules above.
_TRIANGLES = ((0, 1, 2, 6, 7, 8), (3, 4, 5, 9, 10, 11))
_SIDES = (
    (0, 1, 4, 3, 6, 13, 9, 12),
    (1, 2, 5, 4, 7, 14, 10, 13),
    (2, 0, 3, 5, 8, 12, 11, 14),
)


def facets_on(wedges: IntArray, on: NDArray[np.bool_]) -> list[IntArray]:
    """Faces of the wedges all of whose nodes are marked: triangles, then quadrilaterals."""
    facets = []
    for faces in (_TRIANGLES, _SIDES):
        every = np.concatenate([wedges[:, list(face)] for face in faces])
        facets.append(every[on[every].all(axis=1)])
    return [nodes for nodes in facets if len(nodes)]
