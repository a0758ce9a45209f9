"""Small meshes with exact answers.

Structured boxes, bars of circular section and rings, straight or curved.
"""

from itertools import permutations

import numpy as np

from carrierflex.geometry.tet_mesh import TET_EDGES, TetMesh, boundary_facets

#: Corners of a cube's six tetrahedra about its diagonal (Kuhn 1960), as paths along the axes.
_PATHS = tuple(permutations(range(3)))


def box_mesh(lengths, cells, body="carrier"):
    """Straight-sided box from the origin, surfaces ``start`` (x = 0) and ``end``.

    ``end`` lies at x = lengths[0].
    """
    corners = np.stack(
        np.meshgrid(*(np.arange(n + 1) for n in cells), indexing="ij"), axis=-1
    ).reshape(-1, 3)
    return _quadratic(
        corners * np.array(lengths) / np.array(cells), _kuhn_tetrahedra(cells), lengths[0], body
    )


def round_bar(radius, length, n, body="carrier", n_long=None):
    """Bar of circular section along x.

    A square of 2 n by 2 n cells, each of its rings moved onto a circle.
    """
    n_long = n_long or max(1, round(n * length / (2.0 * radius)))
    cells = (n_long, n, n)
    quarter = (
        np.stack(np.meshgrid(*(np.arange(k + 1) for k in cells), indexing="ij"), axis=-1).reshape(
            -1, 3
        )
        / cells
    )
    corners, tets = [], []
    # Mirrored quarters, so that the rings' corners always lie on element edges.
    for quadrant, (sign_y, sign_z) in enumerate(((1, 1), (-1, 1), (1, -1), (-1, -1))):
        corners.append(quarter * np.array([length, sign_y, sign_z]))
        tets.append(_kuhn_tetrahedra(cells) + quadrant * len(quarter))
    points, numbers = np.unique(np.round(np.concatenate(corners), 12), axis=0, return_inverse=True)
    mesh = _quadratic(points, numbers.ravel()[np.concatenate(tets)], length, body)
    moved = mesh.points.copy()
    ring, distance = np.abs(moved[:, 1:]).max(axis=1), np.hypot(moved[:, 1], moved[:, 2])
    moved[:, 1:] *= (radius * ring / np.where(distance > 0.0, distance, 1.0))[:, None]
    return TetMesh(moved, mesh.tets, mesh.surfaces, mesh.bodies)


def ring_mesh(radius, thickness, length, cells, body="carrier"):
    """Ring about the x axis, a box of `cells` (around, radial, axial) bent until its ends meet.

    Surfaces by where they face.

    Mid-side nodes lie on the circles: ``radius`` is the mean one.
    """
    box = box_mesh((1.0, 1.0, 1.0), cells)
    angle, r = 2.0 * np.pi * box.points[:, 0], radius + thickness * (box.points[:, 1] - 0.5)
    bent = np.stack([length * box.points[:, 2], -r * np.sin(angle), r * np.cos(angle)], axis=1)
    _, first, number = np.unique(
        np.round(bent, 9) + 0.0, axis=0, return_index=True, return_inverse=True
    )
    points, tets = bent[first], number.ravel()[box.tets]
    facets = boundary_facets(tets)
    distance = np.hypot(points[:, 1], points[:, 2])[facets]
    surfaces = {
        "bore": facets[(np.abs(distance - radius + thickness / 2.0) < 1e-9).all(axis=1)],
        "outside": facets[(np.abs(distance - radius - thickness / 2.0) < 1e-9).all(axis=1)],
        "skin": facets,
    }
    return TetMesh(points, tets, surfaces, {body: np.arange(len(tets))})


def _kuhn_tetrahedra(cells):
    strides = np.array([(cells[1] + 1) * (cells[2] + 1), cells[2] + 1, 1])
    starts = (
        np.stack(np.meshgrid(*(np.arange(n) for n in cells), indexing="ij"), axis=-1).reshape(-1, 3)
        @ strides
    )
    paths = [np.concatenate([[0], np.cumsum(strides[list(path)])]) for path in _PATHS]
    return np.concatenate([starts[:, None] + path for path in paths])


def _quadratic(corners, tets, length, body):
    """Add mid-side nodes, right inside-out elements and name the end faces."""
    edges = corners[tets[:, 1:]] - corners[tets[:, :1]]
    tets = np.where((np.linalg.det(edges) < 0.0)[:, None], tets[:, [1, 0, 2, 3]], tets)
    pairs = np.sort(tets[:, TET_EDGES].reshape(-1, 2), axis=1)
    unique, numbers = np.unique(pairs, axis=0, return_inverse=True)
    points = np.concatenate([corners, corners[unique].mean(axis=1)])
    elements = np.concatenate([tets, len(corners) + numbers.reshape(-1, 6)], axis=1)
    facets = boundary_facets(elements)
    x = points[facets][..., 0]
    surfaces = {
        "start": facets[(np.abs(x) < 1e-9).all(axis=1)],
        "end": facets[(np.abs(x - length) < 1e-9).all(axis=1)],
        "skin": facets,
    }
    return TetMesh(points, elements, surfaces, {body: np.arange(len(elements))})
