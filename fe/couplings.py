"""Pilot nodes on surfaces: the distributing coupling (RBE3 type).

A pilot's six coordinates are the rigid motion that fits the surface's displacement best in the mean
square over its area, ``q = G u`` with ``G = Z⁻¹ B``, ``B = ∫ Rᵀ N dA`` and ``Z = ∫ Rᵀ R dA``. Its
transpose spreads a force and moment F at the pilot as the traction ``R Z⁻¹ F``, linear over the
surface; the surface stays free to deform. The pilot may stand anywhere, and may have fewer
components than six. With weights of the user's own, node by node and direction by direction, sums
take the integrals' place (:mod:`carrierflex.fe.point_couplings`).
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.point_couplings import AveragedDofs, point_coupling
from carrierflex.fe.rigid_fit import ALL_COMPONENTS, MOTIONS, fitted_motion
from carrierflex.fe.surface_integrals import facet_moments
from carrierflex.geometry.tet_mesh import NamedSurfaces

_SHOWN_NODES = 3


@dataclass(frozen=True, eq=False)
class Pilot:
    """A pilot node and its coupling to a surface.

    Parameters
    ----------
    name : str
        Name of the surface.
    point : ndarray, shape (3,)
        Position [m].
    G : csr_array, shape (k, n_dofs)
        Coupling: pilot motion from nodal displacement, one row a component.
    components : tuple of int
        The pilot's motions, numbered translations x y z, rotations x y z from 0 to 5; all six by
        default.
    """

    name: str
    point: NDArray[np.float64]
    G: sp.csr_array
    components: tuple[int, ...] = ALL_COMPONENTS

    def nodal_forces(self, load: ArrayLike) -> NDArray[np.float64]:
        """Nodal forces [N], shape (n_dofs,), of a `load` (6,) at the pilot [N, N m].

        Raises
        ------
        ValueError
            Where the load acts on a motion that is not coupled: nothing would carry it.
        """
        components = list(self.components)
        load = np.asarray(load, dtype=np.float64)
        lost = [i for i in np.flatnonzero(load) if i not in components]
        if lost:
            raise ValueError(
                f"pilot {self.name!r} is loaded along its {', '.join(MOTIONS[i] for i in lost)}, "
                "which is not coupled; expected a load on "
                f"{', '.join(MOTIONS[i] for i in components)} only"
            )
        return np.asarray(self.G.T @ load[components])


def distributing_pilot(
    mesh: NamedSurfaces,
    name: str,
    point: NDArray[np.float64],
    *,
    components: tuple[int, ...] = ALL_COMPONENTS,
) -> Pilot:
    """Couple a pilot at `point` to the surface `name` of `mesh`.

    Every part of the surface counts by its area.

    Parameters
    ----------
    mesh : NamedSurfaces
        Mesh with the surface.
    name : str
        Name of the surface.
    point : ndarray, shape (3,)
        Position [m], on the surface or off it.
    components : tuple of int
        Motions of the pilot that follow the surface, 0 to 5; the others stay free.

    Raises
    ------
    KeyError
        Where the mesh has no such surface.
    ValueError
        Where the surface does not determine one of the components (all its points on a line).
    """
    point = np.array(point, dtype=np.float64)
    surface = mesh.surface(name)
    nodes, facets = np.unique(surface, return_inverse=True)
    reference = mesh.points[nodes].mean(axis=0) if len(nodes) else point
    B, Z = facet_moments(mesh.points[nodes], facets.reshape(surface.shape), reference)
    subject = f"surface {name!r} with {described_nodes(mesh.points, nodes)}"
    G = fitted_motion(Z, B.reshape(6, -1), point - reference, components, subject=subject)
    return Pilot(name, point, _on_all_dofs(G, nodes, len(mesh.points)), tuple(components))


def weighted_pilot(
    mesh: NamedSurfaces,
    name: str,
    point: NDArray[np.float64],
    weights: NDArray[np.float64],
    *,
    frames: NDArray[np.float64] | None = None,
    components: tuple[int, ...] = ALL_COMPONENTS,
) -> Pilot:
    """Couple a pilot to the nodes of a surface with the user's own weights.

    Parameters
    ----------
    mesh, name, point, components
        As in :func:`distributing_pilot`.
    weights : ndarray, shape (s,) or (s, 3)
        Weight of each of the surface's s nodes, ascending by number as
        ``np.unique(mesh.surface(name))`` gives them, or of each of its three directions; zero
        leaves the direction out. Only ratios count.
    frames : ndarray, shape (3, 3) or (s, 3, 3), optional
        Directions at the nodes, unit vectors as rows; x y z by default. A bore that holds its pin
        by its radial motion alone has the radial direction here and zero weight on the others.

    Raises
    ------
    KeyError
        Where the mesh has no such surface.
    ValueError
        Where weights or frames have the wrong shape, a weight is negative or not finite, or a
        component is not determined.
    """
    point = np.array(point, dtype=np.float64)
    nodes = np.unique(mesh.surface(name))
    each = _checked_weights(np.asarray(weights, dtype=np.float64), nodes, name)
    directions = _checked_frames(frames, len(nodes), name)
    node, axis = np.nonzero(each)
    weighted, row = np.unique(node, return_inverse=True)
    used = nodes[weighted]
    dofs = AveragedDofs(
        mesh.points[used],
        row,
        directions[node, axis],
        np.zeros(len(node), dtype=np.bool_),
        each[node, axis],
    )
    subject = f"surface {name!r} with weights on {described_nodes(mesh.points, used)}"
    G = point_coupling(dofs, point, components, subject=subject)
    along = np.zeros((len(node), len(used), 3))
    along[np.arange(len(node)), row] = dofs.directions
    return Pilot(
        name,
        point,
        _on_all_dofs(G @ along.reshape(len(node), -1), used, len(mesh.points)),
        tuple(components),
    )


def described_nodes(points: NDArray[np.float64], nodes: NDArray[np.int64]) -> str:
    """Count of `nodes`, and number and coordinates of the first few.

    ``2 nodes (0 at (0, 0, 0) m, 7 at (1, 1, 1) m)``.
    """
    if not len(nodes):
        return "no nodes"
    shown = [
        f"{node} at ({', '.join(f'{x:.4g}' for x in points[node])}) m"
        for node in nodes[:_SHOWN_NODES]
    ]
    more = ", ..." if len(nodes) > _SHOWN_NODES else ""
    return f"{len(nodes)} node{'s' if len(nodes) > 1 else ''} ({', '.join(shown)}{more})"


def _on_all_dofs(G: NDArray[np.float64], nodes: NDArray[np.int64], n_nodes: int) -> sp.csr_array:
    """Spread columns of the dofs of `nodes` over those of all nodes."""
    local = sp.csr_array(G)
    columns = dofs_of(nodes).ravel()
    return sp.csr_array(
        (local.data, columns[local.indices], local.indptr), shape=(len(G), 3 * n_nodes)
    )


def _checked_weights(
    weights: NDArray[np.float64], nodes: NDArray[np.int64], name: str
) -> NDArray[np.float64]:
    if weights.shape not in ((len(nodes),), (len(nodes), 3)):
        raise ValueError(
            f"surface {name!r} has {len(nodes)} nodes, weights have shape {weights.shape}; "
            "expected one weight, or three, a node"
        )
    each = np.repeat(weights[:, None], 3, axis=1) if weights.ndim == 1 else weights
    wrong = ~(np.isfinite(each) & (each >= 0.0)).all(axis=1)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise ValueError(
            f"surface {name!r}: weight of node {nodes[first]} is {weights[first]}; expected finite "
            "ones, zero or positive"
        )
    if not each.any():
        raise ValueError(
            f"surface {name!r}: all weights are zero; expected positive ones on three nodes at "
            "least"
        )
    return each


def _checked_frames(frames: NDArray[np.float64] | None, n: int, name: str) -> NDArray[np.float64]:
    if frames is None:
        return np.broadcast_to(np.eye(3), (n, 3, 3))
    if frames.shape not in ((3, 3), (n, 3, 3)):
        raise ValueError(
            f"surface {name!r}: frames have shape {frames.shape}; expected (3, 3) or ({n}, 3, 3)"
        )
    error = np.abs(frames @ np.swapaxes(frames, -1, -2) - np.eye(3)).max()
    if not error < 1e-9:
        raise ValueError(
            f"surface {name!r}: frames deviate from orthonormal rows by {error:.1e}; expected unit "
            "vectors"
        )
    return np.broadcast_to(frames, (n, 3, 3))
