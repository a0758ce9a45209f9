"""Where the degrees of freedom of another program's matrices stand; their rigid motions.

Nodes may have any of their six components, and scalar points none of a node's.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.matrices.stored_matrix import SCALAR, DofNames
from carrierflex.fe.surface_integrals import rigid_motion

_SIX = 6
_TRANSLATIONS = 3


@dataclass(frozen=True, eq=False)
class DofLayout:
    """Place and component of every degree of freedom.

    Parameters
    ----------
    names : DofNames
        Node number and component of each of the n.
    points : ndarray, shape (n, 3)
        Where it stands [m]; scalar points at the origin.
    """

    names: DofNames
    points: NDArray[np.float64]

    def __len__(self) -> int:
        """Number of degrees of freedom."""
        return len(self.names)

    @property
    def is_rotation(self) -> NDArray[np.bool_]:
        """Whether each one is a rotation, shape (n,)."""
        return np.asarray(self.names.components >= _TRANSLATIONS)

    @property
    def is_scalar(self) -> NDArray[np.bool_]:
        """Whether each one is a scalar point, shape (n,)."""
        return np.asarray(self.names.components == SCALAR)

    @property
    def node_points(self) -> NDArray[np.float64]:
        """Places of the nodes [m], shape (n_nodes, 3)."""
        _, first = np.unique(self.names.nodes, return_index=True)
        return self.points[first[~self.is_scalar[first]]]

    def rigid_modes(self, origin: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rigid motions about `origin` [m], shape (n, 6).

        Translations first; rows of scalar points are zero.
        """
        R = np.zeros((len(self), _SIX))
        components = self.names.components
        moved = np.flatnonzero((components >= 0) & (components < _TRANSLATIONS))
        R[moved] = rigid_motion(self.points[moved], origin)[
            np.arange(len(moved)), components[moved]
        ]
        turned = np.flatnonzero(self.is_rotation)
        R[turned, components[turned]] = 1.0
        return R

    def at(self, rows: NDArray[np.int64]) -> "DofLayout":
        """Layout of some of the degrees of freedom, in the order of `rows`."""
        return DofLayout(self.names.at(rows), self.points[rows])

    def joined(self, other: "DofLayout") -> "DofLayout":
        """The degrees of freedom of both, the other's last."""
        names = DofNames(
            np.concatenate([self.names.nodes, other.names.nodes]),
            np.concatenate([self.names.components, other.names.components]),
        )
        return DofLayout(names, np.concatenate([self.points, other.points]))

    def dofs_of(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Rows of nodes by component, shape (n_nodes, 6); -1 where a node has no such component.

        Raises
        ------
        ValueError
            Where a node has no degree of freedom at all.
        """
        keys = self.names.keys
        order = np.argsort(keys)
        wanted = (nodes[:, None] * 8 + np.arange(1, _SIX + 1)).ravel()
        index = np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)
        rows = np.where(keys[order[index]] == wanted, order[index], -1).reshape(-1, _SIX)
        absent = np.flatnonzero((rows < 0).all(axis=1))
        if len(absent):
            raise ValueError(
                f"node {nodes[absent[0]]} has no degree of freedom in the matrices; expected one "
                f"of their {len(np.unique(self.names.nodes))} nodes"
            )
        return rows


def standard_order(layout: DofLayout) -> NDArray[np.int64] | None:
    """Order in which nodes with three translations come first, then those with all six components.

    Returns
    -------
    ndarray of int, shape (n,), or None
        Rows in that order, each node's after one another; None where a node has others, or there
        are scalar points.
    """
    order = np.argsort(layout.names.keys, kind="stable")
    nodes, components = layout.names.nodes[order], layout.names.components[order]
    _, first, counts = np.unique(nodes, return_index=True, return_counts=True)
    within = np.arange(len(nodes)) - np.repeat(first, counts)
    complete = np.isin(counts, (_TRANSLATIONS, _SIX)).all() and np.array_equal(within, components)
    if not complete:
        return None
    has_six = np.repeat(counts == _SIX, counts)
    return np.concatenate([order[~has_six], order[has_six]])
