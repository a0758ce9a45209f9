"""The whole carrier from its half sector.

One reflection and the rotations by the pins' pitch, the dihedral group D_N of N pins.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import half_sector_angle
from carrierflex.geometry.tet_mesh import TetMesh

#: A reflection turns a tetrahedron inside out; exchanging corners 0 and 1 (and the edges that
#: follow) rights it.
_RIGHTED = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]


def rotation_about_x(angle: float) -> NDArray[np.float64]:
    """Rotation matrix about +x by `angle` [rad]: takes e(v) to e(v + angle)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def completed(half: TetMesh, n_planets: int) -> TetMesh:
    """Mirror the half sector about the pin's plane and rotate both by every multiple of the pitch.

    Parameters
    ----------
    half : TetMesh
        Half sector, from 0 to half the pins' pitch, with nodes exactly on its two cut planes; its
        surfaces are not carried over.
    n_planets : int
        Pins N of the whole carrier.

    Returns
    -------
    TetMesh
        The whole carrier, ``symmetry_order`` N; nodes on the cut planes are shared.
    """
    on_pin_plane, on_web_plane = cut_plane_nodes(half, n_planets)
    n_half, images = len(half.points), 2 * n_planets
    mirrored = half.points * np.array([1.0, -1.0, 1.0])
    points, tets = [], []
    # With the pitch p, image 2 k covers [k p, k p + p / 2], image 2 k + 1 its mirror
    # [k p - p / 2, k p].
    number = np.arange(images * n_half).reshape(images, n_half)
    for k in range(n_planets):
        R = rotation_about_x(2.0 * math.pi * k / n_planets)
        points += [half.points @ R.T, mirrored @ R.T]
        number[2 * k + 1, on_pin_plane] = number[2 * k, on_pin_plane]
    for k in range(n_planets):
        number[2 * ((k + 1) % n_planets) + 1, on_web_plane] = number[2 * k, on_web_plane]
    for k in range(n_planets):
        tets += [number[2 * k][half.tets], number[2 * k + 1][half.tets][:, _RIGHTED]]
    return _compact(
        np.concatenate(points),
        np.concatenate(tets),
        _repeated(half.bodies, len(half.tets), images),
        n_planets,
    )


def mirrored_pin(half: TetMesh) -> TetMesh:
    """Whole pin 1 from its half on the side y <= 0, by reflection about the plane y = 0."""
    on_plane = half.points[:, 1] == 0.0
    n = len(half.points)
    number = np.where(on_plane, np.arange(n), n + np.arange(n))
    points = np.concatenate([half.points, half.points * np.array([1.0, -1.0, 1.0])])
    tets = np.concatenate([half.tets, number[half.tets][:, _RIGHTED]])
    return _compact(points, tets, _repeated(half.bodies, len(half.tets), 2), 1)


def cut_plane_nodes(half: TetMesh, n_planets: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Masks of the nodes on the pin's plane (0 deg) and on the web's, shape (n,) each.

    Both are meridional planes, half the pins' pitch apart.
    """
    angle = half_sector_angle(n_planets)
    c, s = math.cos(angle), math.sin(angle)
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
