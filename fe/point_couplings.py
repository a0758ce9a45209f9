"""Distributing couplings of single nodes with the user's own weights, the RBE3 element of Nastran.

Every averaged degree of freedom is a direction at a node, a translation or a rotation, with its
weight; the pilot follows their weighted mean motion. Node frames, the choice of averaged components
and that of the pilot's components are all free. A rotation counts at the coupling's mean arm L, its
weight times ``L²``, as NX Nastran has it, so that the result does not depend on the unit of length.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.rigid_fit import ALL_COMPONENTS, fitted_motion
from carrierflex.fe.surface_integrals import rigid_motion


@dataclass(frozen=True, eq=False)
class AveragedDofs:
    """The m degrees of freedom that a coupling averages.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes [m], each with one of the degrees of freedom at least.
    nodes : ndarray of int, shape (m,)
        Row of `points` at which each degree of freedom stands.
    directions : ndarray, shape (m, 3)
        Its unit vector.
    is_rotation : ndarray of bool, shape (m,)
        Whether it is a rotation about the direction, not a translation along it.
    weights : ndarray, shape (m,)
        Its weight, positive; only ratios count.

    Raises
    ------
    ValueError
        Where the arrays do not belong together, a weight is not positive, a direction is no unit
        vector or a node is left out.
    """

    points: NDArray[np.float64]
    nodes: NDArray[np.int64]
    directions: NDArray[np.float64]
    is_rotation: NDArray[np.bool_]
    weights: NDArray[np.float64]

    def __post_init__(self) -> None:
        m = len(self.nodes)
        if (
            self.directions.shape != (m, 3)
            or self.is_rotation.shape != (m,)
            or self.weights.shape != (m,)
        ):
            raise ValueError(
                f"averaged degrees of freedom: {m} nodes, directions {self.directions.shape}, is_rotation "
                f"{self.is_rotation.shape}, weights {self.weights.shape}; expected one entry each"
            )
        if not (np.isfinite(self.weights).all() and (self.weights > 0.0).all()):
            raise ValueError(
                f"averaged degrees of freedom: smallest weight {self.weights.min()}; expected positive ones"
            )
        if np.abs(np.linalg.norm(self.directions, axis=1) - 1.0).max(initial=0.0) > 1e-9:
            raise ValueError("averaged degrees of freedom: a direction is not a unit vector")
        if not np.array_equal(np.unique(self.nodes), np.arange(len(self.points))):
            raise ValueError(
                "averaged degrees of freedom: expected one at least at each of the points, and at no other"
            )


def point_coupling(
    dofs: AveragedDofs,
    point: NDArray[np.float64],
    components: tuple[int, ...] = ALL_COMPONENTS,
    *,
    subject: str = "the coupling",
) -> NDArray[np.float64]:
    """Motion of a pilot from averaged degrees of freedom, ``G = (Rᵀ W R)⁻¹ Rᵀ W``.

    Parameters
    ----------
    dofs : AveragedDofs
        What is averaged.
    point : ndarray, shape (3,)
        Position of the pilot [m], anywhere.
    components : tuple of int
        Motions of the pilot that follow, numbered as in :data:`carrierflex.fe.rigid_fit.MOTIONS`;
        the others stay free.
    subject : str
        What is being coupled, to begin an error message with.

    Returns
    -------
    ndarray, shape (k, m)
        One row a component, one column a degree of freedom; its transpose spreads a force or moment
        over these.

    Raises
    ------
    ValueError
        Where a component is not determined by the averaged degrees of freedom.

    Examples
    --------
    The mean of four nodes around the pilot; a moment about x is carried by nodes 1 and 3.

    >>> square = np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0], [0, -1.0, 0]])
    >>> dofs = AveragedDofs(square, np.repeat(np.arange(4), 3), np.tile(np.eye(3), (4, 1)), np.zeros(12, bool), np.ones(12))
    >>> G = point_coupling(dofs, np.zeros(3))
    >>> [float(round(value, 12)) for value in G[3, 2::3]]
    [0.0, 0.5, 0.0, -0.5]
    """
    reference = dofs.points.mean(axis=0)
    R = np.einsum("mi,mij->mj", dofs.directions, rigid_motion(dofs.points[dofs.nodes], reference))
    R[dofs.is_rotation] = 0.0
    R[dofs.is_rotation, 3:] = dofs.directions[dofs.is_rotation]
    arm = float(np.linalg.norm(dofs.points - point, axis=1).mean())
    weights = np.where(dofs.is_rotation & (arm > 0.0), dofs.weights * arm**2, dofs.weights)
    B = R.T * weights
    return fitted_motion(B @ R, B, point - reference, components, subject=subject)
