"""Rigid couplings (RBE2 type): surfaces that follow their pilots, by a change of coordinates.

Every node of a rigid surface moves as ``u = R(x) q`` with its pilot's six coordinates q. Put together, ``u = L û`` with û the
free nodes' displacement followed by the pilots' coordinates, and the body becomes ``LᵀKL``, ``LᵀML``: no penalty, and force
and moment at a pilot are exactly those of its surface. Where a distributing coupling leaves the surface free to deform, a rigid
one forbids it: the truth of a fitted part lies between the two.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe.couplings import Pilot
from fe.structural_model import StructuralModel
from fe.surface_integrals import rigid_motion
from geometry.tet_mesh import TetMesh


def rigidly_coupled(structure: StructuralModel, mesh: TetMesh) -> StructuralModel:
    """Copy of a body whose pilots hold their surfaces rigid instead of following their mean motion.

    Parameters
    ----------
    structure : StructuralModel
        Body with distributing pilots, as :func:`fe.structural_model.structural_model` makes it.
    mesh : TetMesh
        Its mesh.

    Returns
    -------
    StructuralModel
        Same pilots and sensors; ``points`` are the nodes that kept their own degrees of freedom, ``rigid_points`` the pilots
        that follow them, ``L`` gives the displacement of all nodes.

    Raises
    ------
    ValueError
        Where two surfaces share nodes, which cannot follow two pilots; the message says which.
    """
    surfaces = {pilot.name: np.unique(mesh.surface(pilot.name)) for pilot in structure.pilots}
    _refuse_shared_nodes(surfaces)
    n = len(mesh.points)
    is_free = np.ones(n, dtype=bool)
    for nodes in surfaces.values():
        is_free[nodes] = False
    free = np.flatnonzero(is_free)
    L = _coordinates(mesh, free, structure.pilots, surfaces)
    n_dofs = L.shape[1]
    first = 3 * len(free)
    pilots = tuple(
        replace(pilot, G=_selection(first + 6 * number, n_dofs)) for number, pilot in enumerate(structure.pilots)
    )
    sensors = structure.sensors
    return StructuralModel(
        name=structure.name,
        K=_symmetric(L.T @ structure.K @ L),
        M=_symmetric(L.T @ structure.M @ L),
        points=mesh.points[free],
        pilots=pilots,
        sensors=replace(sensors, rows=sp.csr_array(sensors.rows @ L)) if sensors else None,
        rigid_points=np.array([pilot.point for pilot in structure.pilots]),
        L=L,
    )


def _refuse_shared_nodes(surfaces: dict[str, NDArray[np.int64]]) -> None:
    names = list(surfaces)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            shared = np.intersect1d(surfaces[first], surfaces[second])
            if len(shared):
                shown = ", ".join(str(node) for node in shared[:6]) + (" ..." if len(shared) > 6 else "")
                raise ValueError(
                    f"rigid surfaces {first!r} and {second!r} share {len(shared)} nodes ({shown}), which cannot follow two "
                    "pilots; expected surfaces without common nodes"
                )


def _coordinates(
    mesh: TetMesh,
    free: NDArray[np.int64],
    pilots: tuple[Pilot, ...],
    surfaces: dict[str, NDArray[np.int64]],
) -> sp.csr_array:
    """Matrix L, shape (3 n, 3 n_free + 6 n_pilots)."""
    rows = [(3 * free[:, None] + np.arange(3)).ravel()]
    columns = [np.arange(3 * len(free))]
    values = [np.ones(3 * len(free))]
    for number, pilot in enumerate(pilots):
        nodes = surfaces[pilot.name]
        R = rigid_motion(mesh.points[nodes], pilot.point).reshape(-1, 6)
        rows.append(np.repeat((3 * nodes[:, None] + np.arange(3)).ravel(), 6))
        columns.append(np.tile(3 * len(free) + 6 * number + np.arange(6), len(R)))
        values.append(R.ravel())
    shape = (3 * len(mesh.points), 3 * len(free) + 6 * len(pilots))
    L = sp.csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)
    L.eliminate_zeros()
    return L


def _selection(first: int, n_dofs: int) -> sp.csr_array:
    return sp.csr_array((np.ones(6), (np.arange(6), first + np.arange(6))), shape=(6, n_dofs))


def _symmetric(A: sp.csr_array) -> sp.csr_array:
    return sp.csr_array((A + A.T) * 0.5)
