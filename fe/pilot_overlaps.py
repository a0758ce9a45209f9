"""Pilots whose surfaces share nodes: refused where the body cannot tell their motions apart.

Two distributing couplings on common nodes are still two averages; they are independent as long as
their rows are. That is decided by rank: with orthonormal rows for every pilot, the smallest
singular value of all rows together is 1 for pilots that share nothing and 0 where a motion of one
is a combination of motions of the others.
"""

import logging
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from carrierflex.fe.couplings import Pilot, described_nodes

log = logging.getLogger(__name__)

#: Smallest singular value of the pilots' orthonormal rows below which they count as dependent.
_INDEPENDENCE_TOLERANCE = 1e-6


def refuse_dependent_pilots(pilots: tuple[Pilot, ...], points: NDArray[np.float64]) -> None:
    """Check that the motions of all pilots can be prescribed independently of one another.

    Parameters
    ----------
    pilots : tuple of Pilot
        Pilots with distributing couplings to one body.
    points : ndarray, shape (n, 3)
        Nodes of the body [m].

    Raises
    ------
    ValueError
        Where two pilots have one name, or a group of pilots on shared nodes is dependent; the
        message names pilots and nodes.
    """
    names = [pilot.name for pilot in pilots]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"pilot {twice!r} is given twice; expected every surface once")
    loaded = {pilot.name: np.unique(pilot.G.indices // 3) for pilot in pilots}
    shared = shared_nodes(loaded)
    if not shared:
        return
    adjacency = np.eye(len(pilots), dtype=bool)
    for first, second in shared:
        adjacency[names.index(first), names.index(second)] = True
    n_groups, group = connected_components(adjacency, directed=False)
    for number in range(n_groups):
        members = tuple(pilot for pilot, g in zip(pilots, group, strict=True) if g == number)
        if len(members) > 1:
            _refuse_dependent_group(members, shared, points)


def independence(pilots: tuple[Pilot, ...]) -> tuple[int, float]:
    """Rank of the pilots' couplings together, and the smallest singular value of their orthonormal rows (0 to 1)."""
    columns = np.unique(np.concatenate([pilot.G.indices for pilot in pilots]))
    rows = np.concatenate([np.linalg.qr(pilot.G[:, columns].toarray().T)[0].T for pilot in pilots])
    singular = np.linalg.svd(rows, compute_uv=False)
    # More rows than columns: the missing singular values are zeros.
    smallest = 0.0 if len(rows) > len(columns) else float(singular[-1])
    return int(np.count_nonzero(singular > _INDEPENDENCE_TOLERANCE)), smallest


def shared_nodes(
    surfaces: dict[str, NDArray[np.int64]],
) -> dict[tuple[str, str], NDArray[np.int64]]:
    """Nodes that belong to two of `surfaces` (name to sorted node numbers), by pair of names.

    Pairs without any left out.
    """
    shared = {
        (first, second): np.intersect1d(surfaces[first], surfaces[second], assume_unique=True)
        for first, second in combinations(surfaces, 2)
    }
    return {pair: nodes for pair, nodes in shared.items() if len(nodes)}


def _refuse_dependent_group(
    pilots: tuple[Pilot, ...],
    shared: dict[tuple[str, str], NDArray[np.int64]],
    points: NDArray[np.float64],
) -> None:
    rank, smallest = independence(pilots)
    names = [pilot.name for pilot in pilots]
    overlaps = "; ".join(
        f"{first!r} and {second!r} share {described_nodes(points, nodes)}"
        for (first, second), nodes in shared.items()
        if first in names and second in names
    )
    n_coordinates = sum(len(pilot.components) for pilot in pilots)
    if rank < n_coordinates:
        raise ValueError(
            f"pilots {', '.join(map(repr, names))} cannot move independently: their {n_coordinates} coordinates have rank "
            f"{rank}; {overlaps}; expected surfaces of their own, or fewer components"
        )
    log.info(
        "%s; their couplings stay independent (smallest singular value %.2g, 0 would be dependent)",
        overlaps,
        smallest,
    )
