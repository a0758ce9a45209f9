"""The whole carrier from its half sector.

One reflection and two rotations, the dihedral group D3.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import HALF_SECTOR_ANGLE
from carrierflex.geometry.tet_mesh import TetMesh

#: A reflection turns a tetrahedron inside out; exchanging corners 0 and 1 (and the edges that
#: follow) rights it.
_RIGHTED = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]


def rotation_about_x(angle: float) -> NDArray[np.float64]:
    """Rotation matrix about +x by `angle` [rad]: takes e(v) to e(v + angle)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def completed(half: TetMesh) -> TetMesh:
    """Mirror the half sector 0..60 deg about the pin's plane and rotate both by 120 and 240 deg.

    Parameters
    ----------
    half : TetMesh
        Half sector with nodes exactly on its two cut planes; its surfaces are not carried over.

    Returns
    -------
    TetMesh
        The whole carrier, ``symmetry_order`` 3; nodes on the cut planes are shared.
    """
    on_pin_plane, on_web_plane = cut_plane_nodes(half)
    n_half = len(half.points)
    mirrored = half.points * np.array([1.0, -1.0, 1.0])
    points, tets = [], []
    # Image 2 k covers [120 k, 120 k + 60] deg, image 2 k + 1 its mirror [120 k - 60, 120 k].
    number = np.arange(6 * n_half).reshape(6, n_half)
    for k in range(3):
        R = rotation_about_x(2.0 * math.pi * k / 3.0)
        points += [half.points @ R.T, mirrored @ R.T]
        number[2 * k + 1, on_pin_plane] = number[2 * k, on_pin_plane]
    for k in range(3):
        number[2 * ((k + 1) % 3) + 1, on_web_plane] = number[2 * k, on_web_plane]
    for k in range(3):
        tets += [number[2 * k][half.tets], number[2 * k + 1][half.tets][:, _RIGHTED]]
    return _compact(
        np.concatenate(points), np.concatenate(tets), _repeated(half.bodies, len(half.tets), 6), 3
    )


def mirrored_pin(half: TetMesh) -> TetMesh:
    """Whole pin 1 from its half on the side y <= 0, by reflection about the plane y = 0."""
    on_plane = half.points[:, 1] == 0.0
    n = len(half.points)
    number = np.where(on_plane, np.arange(n), n + np.arange(n))
    points = np.concatenate([half.points, half.points * np.array([1.0, -1.0, 1.0])])
    tets = np.concatenate([half.tets, number[half.tets][:, _RIGHTED]])
    return _compact(points, tets, _repeated(half.bodies, len(half.tets), 2), 1)


def cut_plane_nodes(half: TetMesh) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks of the nodes on the pin's meridional plane (0 deg) and on the web's (60 deg), each of shape (n,)."""
    c, s = math.cos(HALF_SECTOR_ANGLE), math.sin(HALF_SECTOR_ANGLE)
    y, z = half.points[:, 1], half.points[:, 2]
    return np.abs(y) < 1e-12, np.abs(c * y + s * z) < 1e-12


def _repeated(
    bodies: Mapping[str, NDArray[np.int64]], n_tets: int, copies: int
) -> dict[str, NDArray[np.int64]]:
    return {
        name: (elements[None, :] + n_tets * np.arange(copies)[:, None]).ravel()
        for name, elements in bodies.items()
    }


def _compact(
    points: NDArray[np.float64],
    tets: NDArray[np.int64],
    bodies: dict[str, NDArray[np.int64]],
    symmetry_order: int,
) -> TetMesh:
    used, numbers = np.unique(tets, return_inverse=True)
    return TetMesh(points[used], numbers.reshape(tets.shape), {}, bodies, symmetry_order)
