"""Facets of a mesh that lie on a surface which a user states by axis, radius and station."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_surfaces import SurfaceStatement
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets


def stated_facets(
    mesh: TetMesh, statement: SurfaceStatement, tolerance: float, where: str
) -> NDArray[np.int64]:
    """Boundary facets whose corners all lie on the stated plane or cylinder, in its window.

    Corners decide: the mid-side nodes of a linear mesh made quadratic lie on chords.

    Parameters
    ----------
    mesh : TetMesh
        In the carrier's frame [m].
    statement : SurfaceStatement
        What is looked for; of the body ``pins`` where its name ends in midspan, of the carrier
        otherwise.
    tolerance : float
        Distance [m] that still counts as on the surface.
    where : str
        The mesh in messages.

    Raises
    ------
    ValueError
        Where there is none.
    """
    body = "pins" if statement.name.endswith("_midspan") else "carrier"
    facets = boundary_facets(mesh.tets[mesh.bodies[body]])
    corners = mesh.points[facets[:, :3]]
    along = corners @ statement.direction
    radius = np.linalg.norm(np.cross(corners - statement.point, statement.direction), axis=2)
    measured, inside = (along, radius) if statement.kind == "plane" else (radius, along)
    low, high = statement.window
    on = np.abs(measured - statement.size) <= tolerance
    on &= (inside >= low - tolerance) & (inside <= high + tolerance)
    found = facets[on.all(axis=1)]
    if not len(found):
        raise ValueError(
            f"{where}: no facet lies on surface {statement.name!r}, the {statement}, within "
            f"{tolerance:g} m; expected one that element edges bound"
        )
    return found
