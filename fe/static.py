"""Static displacement of a body clamped on a surface, equilibrium checked in every solve."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.factorisation import factorise
from carrierflex.fe.node_dofs import dofs_of
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.fe.surface_integrals import rigid_motion

#: Largest imbalance of force or moment, relative to the sum of the magnitudes that enter it.
_EQUILIBRIUM_TOLERANCE = 1e-9


class AccuracyError(ArithmeticError):
    """A numerical check failed; the message holds the measured and the allowed figure."""


#: What returns u of ``K u = f``, shape (n_dofs, n_cases), from K, held degrees of freedom and f.
HeldSolver = Callable[[sp.csr_array, NDArray[np.int64], NDArray[np.float64]], NDArray[np.float64]]


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


def held_displacement(
    K: sp.csr_array, fixed: NDArray[np.int64], loads: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Displacement [m] under `loads` [N] with the degrees of freedom `fixed` held at zero.

    One factorisation serves all columns.

    Parameters
    ----------
    K : csr_array, shape (n_dofs, n_dofs)
        Stiffness [N/m].
    fixed : ndarray of int
        Degrees of freedom that are held.
    loads : ndarray, shape (n_dofs, n_cases)
        Forces [N].

    Returns
    -------
    ndarray, shape (n_dofs, n_cases)
        Displacement [m].

    Raises
    ------
    SingularMatrixError
        Where what is held does not hold the body.
    """
    return factorise(K, fixed=fixed).solve(loads)


def clamped_displacement(
    model: StructuralModel,
    clamped_nodes: NDArray[np.int64],
    loads: NDArray[np.float64],
    *,
    solver: HeldSolver = held_displacement,
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
    solver : callable
        What solves K u = f with some degrees of freedom held.

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
    fixed = dofs_of(np.unique(clamped_nodes)).ravel()
    u = solver(model.K, fixed, loads)
    nodal_reaction = np.zeros_like(loads)
    nodal_reaction[fixed] = (model.K[fixed] @ u) - loads[fixed]
    R = rigid_motion(model.points, np.zeros(3)).reshape(model.n_dofs, 6)
    reaction, applied = R.T @ nodal_reaction, R.T @ loads
    scale = np.abs(R.T) @ np.abs(loads) + np.abs(R.T) @ np.abs(nodal_reaction)
    # A component that no load enters has nothing to be compared with.
    imbalance = float((np.abs(reaction + applied) / np.where(scale > 0.0, scale, 1.0)).max())
    if not imbalance < _EQUILIBRIUM_TOLERANCE:
        raise AccuracyError(
            f"{model.name}: load and reaction differ by {imbalance:.2e} of their size; expected "
            f"less than {_EQUILIBRIUM_TOLERANCE:.0e}"
        )
    return StaticSolution(u, reaction, imbalance)
