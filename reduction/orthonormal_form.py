"""The eigen-orthonormalised form of a reduced body.

Uncoupled modes of the free body, as Adams-type codes want it.

The same space as the physical form; what is lost is that a coordinate is a pilot's motion.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.reduced_model import ReducedModel

#: A free body has six modes without stiffness.
_N_RIGID = 6
#: Frequencies that differ by less than this share are one.
_EQUAL = 1e-8


@dataclass(frozen=True, eq=False)
class OrthonormalForm:
    """Coordinates p with ``q = X p``, in which mass is the identity and stiffness diagonal.

    Parameters
    ----------
    X : ndarray, shape (n, k)
        Modes of the free reduced body in its physical coordinates, mass-normalised, rigid-body
        modes first; fewer than n where coordinates have no mass.
    omega : ndarray, shape (k,)
        Angular frequencies [rad/s], ascending; exactly zero for the rigid-body modes.
    n_rigid : int
        Number of rigid-body modes; floating-frame codes leave these columns out.
    """

    X: NDArray[np.float64]
    omega: NDArray[np.float64]
    n_rigid: int


def orthonormal_form(model: ReducedModel) -> OrthonormalForm:
    """Orthonormalise a reduced body: ``K_r X = M_r X Ω²``, ``Xᵀ M_r X = 1``.

    Parameters
    ----------
    model : ReducedModel
        A free body.

    Returns
    -------
    OrthonormalForm
        Modes, six of them rigid.

    Raises
    ------
    ValueError
        Where the body is not free: a seventh mode without stiffness, or fewer than six.
    """
    squared, X = dense_modes(model.K, model.M)
    # Rounding of the stiffest modes hides a stiffness below this share of theirs.
    rigid = squared <= max(1e-13 * squared[-1], 1e-6 * squared[min(_N_RIGID, squared.size - 1)])
    if int(rigid.sum()) != _N_RIGID:
        raise ValueError(
            f"{model.name}: {int(rigid.sum())} modes without stiffness; expected {_N_RIGID}, a "
            "free body"
        )
    omega = np.sqrt(np.where(rigid, 0.0, squared))
    return OrthonormalForm(_turned(X, omega), omega, _N_RIGID)


def _turned(X: NDArray[np.float64], omega: NDArray[np.float64]) -> NDArray[np.float64]:
    """Modes of equal frequencies turned, and signs chosen, as rounding would not change them.

    An eigensolver gives any basis of a frequency's modes, by the last digits of the matrices: here
    the one whose products with fixed directions of no symmetry are a triangle with positive
    diagonal.
    """
    fixed = np.random.default_rng(0).standard_normal(X.shape)
    starts = np.flatnonzero(np.diff(omega, prepend=-1.0) > _EQUAL * omega)
    # The first mode begins a group, though its frequency is zero.
    groups = np.split(np.arange(omega.size), starts[starts > 0])
    result = np.empty_like(X)
    for group in groups:
        Q, R = np.linalg.qr(X[:, group].T @ fixed[:, : len(group)])
        result[:, group] = X[:, group] @ (Q * np.sign(np.diag(R)))
    return result
