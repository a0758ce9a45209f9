"""Pilot nodes on surfaces: the distributing coupling (RBE3 type).

A pilot's six coordinates are the rigid motion that fits the surface's displacement best in the mean square over
its area, ``q = G u`` with ``G = Z⁻¹ B``, ``B = ∫ Rᵀ N dA`` and ``Z = ∫ Rᵀ R dA``. Its transpose spreads a force and
moment F at the pilot as the traction ``R Z⁻¹ F``, linear over the surface; the surface stays free to deform.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.surface_integrals import surface_moments
from geometry.tet_mesh import TetMesh

#: Ratio of the smallest to the largest eigenvalue of Z, lengths scaled, below which a surface cannot hold a rotation.
_RANK_TOLERANCE = 1e-8


@dataclass(frozen=True, eq=False)
class Pilot:
    """A pilot node and its coupling to a surface.

    Parameters
    ----------
    name : str
        Name of the surface.
    point : ndarray, shape (3,)
        Position [m].
    G : csr_array, shape (6, n_dofs)
        Coupling: pilot motion from nodal displacement; rows translations x y z, rotations x y z.
    """

    name: str
    point: NDArray[np.float64]
    G: sp.csr_array


def distributing_pilot(mesh: TetMesh, name: str, point: NDArray[np.float64]) -> Pilot:
    """Couple a pilot at `point` to the surface `name` of `mesh`.

    Raises
    ------
    KeyError
        Where the mesh has no such surface.
    ValueError
        Where the surface cannot hold the six motions of a pilot (fewer than three points not in line).
    """
    facets = mesh.surface(name)
    B, Z = surface_moments(mesh, facets, point)
    _refuse_rank_deficient(Z, name, np.unique(facets))
    G = np.linalg.solve(Z, B.reshape(6, -1))
    return Pilot(name, np.array(point, dtype=np.float64), sp.csr_array(G))


def _refuse_rank_deficient(Z: NDArray[np.float64], name: str, nodes: NDArray[np.int64]) -> None:
    length = np.sqrt(np.trace(Z[3:, 3:]) / Z[0, 0]) if Z[0, 0] > 0.0 else 1.0
    scale = np.array([1.0, 1.0, 1.0, length, length, length])
    eigenvalues = np.linalg.eigvalsh(Z / np.outer(scale, scale))
    if not eigenvalues[0] > _RANK_TOLERANCE * eigenvalues[-1]:
        shown = ", ".join(str(node) for node in nodes[:6]) + (" ..." if len(nodes) > 6 else "")
        raise ValueError(
            f"surface {name!r} cannot hold a pilot's six motions: its nodes ({shown}) do not determine every rotation; "
            "expected a surface with area that is not a single point or line"
        )
