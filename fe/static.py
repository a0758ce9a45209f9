"""Static displacement of a body clamped on a surface, equilibrium checked in every solve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.factorisation import factorise
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.fe.surface_integrals import rigid_motion

#: Largest imbalance of force or moment, relative to the sum of the magnitudes that enter it.
_EQUILIBRIUM_TOLERANCE = 1e-9


class AccuracyError(ArithmeticError):
    """A numerical check failed; the message holds the measured and the allowed figure."""


@dataclass(frozen=True, eq=False)
class StaticSolution:
    """Displacement and reaction of a clamped body.

    Parameters
    ----------
    u : ndarray, shape (n_dofs, n_cases)
        Nodal displacement [m].
    reaction : ndarray, shape (6, n_cases)
        Force [N] and moment about the origin [N m] that the clamp exerts on the body.
    imbalance : float
        Largest relative imbalance of load and reaction over the cases.
    """

    u: NDArray[np.float64]
    reaction: NDArray[np.float64]
    imbalance: float


def clamped_displacement(
    model: StructuralModel, clamped_nodes: NDArray[np.int64], loads: NDArray[np.float64]
) -> StaticSolution:
    """Solve K u = f with the displacement of `clamped_nodes` zero.

    Parameters
    ----------
    model : StructuralModel
        The body.
    clamped_nodes : ndarray of int
        Nodes held in all three directions.
    loads : ndarray, shape (n_dofs, n_cases)
        Nodal forces [N], one column a load case; one factorisation serves them all.

    Returns
    -------
    StaticSolution
        Displacement, reaction and the measured imbalance.

    Raises
    ------
    SingularMatrixError
        Where the clamp does not hold the body.
    AccuracyError
        Where load and reaction do not balance to 1e-9.
    """
    held = (3 * np.unique(clamped_nodes)[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(model.n_dofs), held)
    u = np.zeros_like(loads)
    u[free] = factorise(model.K[free][:, free].tocsr()).solve(loads[free])
    nodal_reaction = np.zeros_like(loads)
    nodal_reaction[held] = (model.K[held] @ u) - loads[held]
    R = rigid_motion(model.points, np.zeros(3)).reshape(model.n_dofs, 6)
    reaction, applied = R.T @ nodal_reaction, R.T @ loads
    scale = np.abs(R.T) @ np.abs(loads) + np.abs(R.T) @ np.abs(nodal_reaction)
    # A component that no load enters has nothing to be compared with.
    imbalance = float((np.abs(reaction + applied) / np.where(scale > 0.0, scale, 1.0)).max())
    if not imbalance < _EQUILIBRIUM_TOLERANCE:
        raise AccuracyError(
            f"{model.name}: load and reaction differ by {imbalance:.2e} of their size; expected less than "
            f"{_EQUILIBRIUM_TOLERANCE:.0e}"
        )
    return StaticSolution(u, reaction, imbalance)
