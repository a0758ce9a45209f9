"""Motion of named surfaces along their normals, for carriers without parameters."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from carrierflex.fe.rim_circle import circle_nodes
from carrierflex.fe.surface_integrals import nodal_normals
from carrierflex.geometry.shape_velocity import BoundaryMotion
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets

#: Cosine between the normals of two facets at a node above which the face goes on smoothly.
_SMOOTH = 0.9


def surface_motion(
    mesh: TetMesh, groups: Mapping[str, Sequence[str]], sensor_radius: float
) -> BoundaryMotion:
    """Motion of a boundary where one group of named surfaces after the other moves outwards.

    The nodes of the surfaces move along their outward normals by one unit: the solid grows there,
    a bore of the radius r gets r - 1. All other nodes of the boundary slide within their faces;
    where a face goes on smoothly beyond a named surface, the row of elements that follows makes the
    transition. The sensor circle's nodes stay on it, at
    their angles.

    Parameters
    ----------
    mesh : TetMesh
        Mesh with the surfaces.
    groups : mapping of str to sequence of str
        Surfaces that move together, by the name of the motion.
    sensor_radius : float
        Radius of the sensor circle [m].

    Raises
    ------
    KeyError
        Where the mesh has no such surface.
    """
    facets = np.concatenate([boundary_facets(mesh.tets[cells]) for cells in mesh.bodies.values()])
    normals = nodal_normals(mesh.points, facets)
    n = len(mesh.points)
    rates = np.zeros((*facets.shape, len(groups)))
    for number, names in enumerate(groups.values()):
        moving = np.concatenate([mesh.surface(name) for name in names])
        outward = np.zeros((n, 3))
        np.add.at(outward, moving, nodal_normals(mesh.points, moving))
        size = np.linalg.norm(outward, axis=1, keepdims=True)
        outward /= np.where(size > 0.0, size, 1.0)
        along = np.einsum("kia,kia->ki", normals, outward[facets])
        # Both facets of a bonded bore move, the pin's against its normal.
        rates[..., number] = np.where(np.abs(along) > _SMOOTH, np.sign(along), 0.0)
    circle = circle_nodes(mesh, sensor_radius)
    radial = mesh.points[circle] * [0.0, 1.0, 1.0]
    radial /= np.linalg.norm(radial, axis=1, keepdims=True)
    tangents = np.cross([1.0, 0.0, 0.0], radial)
    return BoundaryMotion(
        np.concatenate([facets.ravel(), circle, circle]),
        np.concatenate([normals.reshape(-1, 3), radial, tangents]),
        np.concatenate([rates.reshape(-1, len(groups)), np.zeros((2 * len(circle), len(groups)))]),
    )


def surface_groups(names: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Surfaces of a carrier that move together: those of all pins as one, others alone."""
    groups: dict[str, tuple[str, ...]] = {}
    for name in names:
        pin, _, kind = name.removeprefix("pin_").partition("_")
        key = f"pins_{kind}" if name.startswith("pin_") and pin.isdigit() else name
        groups[key] = (*groups.get(key, ()), name)
    return groups
