"""Rigid couplings (RBE2 type): surfaces that follow their pilots, by a change of coordinates.

Every node of a rigid surface moves as ``u = R(x) q`` with its pilot's six coordinates q. Put
together, ``u = L û`` with û the free nodes' displacement followed by the pilots' coordinates, and
the body becomes ``LᵀKL``, ``LᵀML``: no penalty, and force and moment at a pilot are exactly those
of its surface. Where a distributing coupling leaves the surface free to deform, a rigid one forbids
it: the truth of a fitted part lies between the two.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.couplings import Pilot, described_nodes
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.pilot_overlaps import independence, shared_nodes
from carrierflex.fe.rigid_fit import ALL_COMPONENTS, fitted_motion
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.geometry.tet_mesh import NamedSurfaces


def rigidly_coupled(
    structure: StructuralModel, mesh: NamedSurfaces, names: tuple[str, ...] | None = None
) -> StructuralModel:
    """Copy of a body whose pilots hold their surfaces rigid instead of following their mean motion.

    Parameters
    ----------
    structure : StructuralModel
        Body with distributing pilots, as :func:`carrierflex.fe.structural_model.structural_model`
        makes it.
    mesh : NamedSurfaces
        Its mesh.
    names : tuple of str, optional
        Pilots to make rigid, the others staying as they are; all of them by default.

    Returns
    -------
    StructuralModel
        Same pilots and sensors; ``points`` are the nodes that kept their own degrees of freedom,
        ``rigid_points`` the pilots that follow them, ``L`` gives the displacement of all nodes.

    Raises
    ------
    KeyError
        Where the body has no pilot of that name.
    ValueError
        Where two rigid surfaces share nodes, which cannot follow two pilots, where a surface is a
        point or a line, which would leave a rotation of its pilot to nothing, where a rigid pilot
        has fewer than six components, or where a rigid surface takes the nodes that another pilot
        needs; the message says which nodes.
    """
    rigid = _chosen(structure.pilots, names)
    surfaces = {pilot.name: np.unique(mesh.surface(pilot.name)) for pilot in rigid}
    _refuse_shared_nodes(surfaces, mesh.points)
    _refuse_loose_pilots(rigid, surfaces, mesh.points)
    is_free = np.ones(len(mesh.points), dtype=bool)
    for nodes in surfaces.values():
        is_free[nodes] = False
    free = np.flatnonzero(is_free)
    L = _coordinates(mesh, free, rigid, surfaces)
    selections = {
        pilot.name: _selection(3 * len(free) + 6 * number, L.shape[1])
        for number, pilot in enumerate(rigid)
    }
    pilots = tuple(
        replace(
            pilot,
            G=selections[pilot.name] if pilot.name in selections else sp.csr_array(pilot.G @ L),
        )
        for pilot in structure.pilots
    )
    _refuse_robbed_pilots(structure.pilots, pilots, surfaces, mesh.points)
    sensors = structure.sensors
    return StructuralModel(
        name=structure.name,
        K=_symmetric(L.T @ structure.K @ L),
        M=_symmetric(L.T @ structure.M @ L),
        points=mesh.points[free],
        pilots=pilots,
        sensors=replace(sensors, rows=sp.csr_array(sensors.rows @ L)) if sensors else None,
        rigid_points=np.array([pilot.point for pilot in rigid]).reshape(-1, 3),
        L=L,
    )


def _chosen(pilots: tuple[Pilot, ...], names: tuple[str, ...] | None) -> tuple[Pilot, ...]:
    if names is None:
        return pilots
    unknown = [name for name in names if name not in {pilot.name for pilot in pilots}]
    if unknown:
        raise KeyError(
            f"no pilot {unknown[0]!r} to make rigid; the body has "
            f"{', '.join(pilot.name for pilot in pilots)}"
        )
    return tuple(pilot for pilot in pilots if pilot.name in names)


def _refuse_robbed_pilots(
    before: tuple[Pilot, ...],
    after: tuple[Pilot, ...],
    rigid_surfaces: dict[str, NDArray[np.int64]],
    points: NDArray[np.float64],
) -> None:
    """Refuse distributing pilots that rigid surfaces leave no motion of their own.

    Too many of their nodes follow the rigid pilots.
    """
    averaged = {
        pilot.name: np.unique(pilot.G.indices // 3)
        for pilot in before
        if pilot.name not in rigid_surfaces
    }
    shared = {
        pair: nodes
        for pair, nodes in shared_nodes({**rigid_surfaces, **averaged}).items()
        if pair[1] in averaged
    }
    if not shared:
        return
    rank, _ = independence(after)
    if rank < sum(len(pilot.components) for pilot in after):
        overlaps = "; ".join(
            f"{first!r} and {second!r} share {described_nodes(points, nodes)}"
            for (first, second), nodes in shared.items()
        )
        raise ValueError(
            f"with {', '.join(map(repr, rigid_surfaces))} rigid the pilots cannot move "
            f"independently: {overlaps}; expected a distributing coupling with nodes of its own"
        )


def _refuse_shared_nodes(
    surfaces: dict[str, NDArray[np.int64]], points: NDArray[np.float64]
) -> None:
    for (first, second), nodes in shared_nodes(surfaces).items():
        raise ValueError(
            f"rigid surfaces {first!r} and {second!r} share {described_nodes(points, nodes)}, "
            "which cannot follow two pilots; expected surfaces without common nodes"
        )


def _refuse_loose_pilots(
    pilots: tuple[Pilot, ...], surfaces: dict[str, NDArray[np.int64]], points: NDArray[np.float64]
) -> None:
    for pilot in pilots:
        nodes = surfaces[pilot.name]
        subject = f"rigid surface {pilot.name!r} with {described_nodes(points, nodes)}"
        if pilot.components != ALL_COMPONENTS:
            raise ValueError(
                f"{subject}: its pilot has components {pilot.components} only; a rigid coupling "
                f"holds all six, expected {ALL_COMPONENTS}"
            )
        reference = points[nodes].mean(axis=0) if len(nodes) else pilot.point
        R = rigid_motion(points[nodes], reference).reshape(-1, 6)
        fitted_motion(R.T @ R, R.T, pilot.point - reference, ALL_COMPONENTS, subject=subject)


def _coordinates(
    mesh: NamedSurfaces,
    free: NDArray[np.int64],
    pilots: tuple[Pilot, ...],
    surfaces: dict[str, NDArray[np.int64]],
) -> sp.csr_array:
    """Matrix L, shape (3 n, 3 n_free + 6 n_pilots)."""
    rows = [dofs_of(free).ravel()]
    columns = [np.arange(3 * len(free))]
    values = [np.ones(3 * len(free))]
    for number, pilot in enumerate(pilots):
        nodes = surfaces[pilot.name]
        R = rigid_motion(mesh.points[nodes], pilot.point).reshape(-1, 6)
        rows.append(np.repeat(dofs_of(nodes).ravel(), 6))
        columns.append(np.tile(3 * len(free) + 6 * number + np.arange(6), len(R)))
        values.append(R.ravel())
    shape = (3 * len(mesh.points), 3 * len(free) + 6 * len(pilots))
    L = sp.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape
    )
    L.eliminate_zeros()
    return L


def _selection(first: int, n_dofs: int) -> sp.csr_array:
    return sp.csr_array((np.ones(6), (np.arange(6), first + np.arange(6))), shape=(6, n_dofs))


def _symmetric(A: sp.csr_array) -> sp.csr_array:
    return sp.csr_array((A + A.T) * 0.5)
