"""Pilots' motions and fixed-interface modes as the coordinates of a reduced body of any basis.

With the pilots' motion ``u = G x`` of the coordinates x, the same span has the coordinates (u, p):

    x = Ψ u + Φ p,    G Ψ = 1,  Φᵀ K Ψ = 0,    G Φ = 0,  K Φ = M Φ Ω²,  Φᵀ M Φ = 1

Nothing is left out: as many modes p as coordinates x that the pilots leave (Craig and Bampton 1968
with every mode kept).
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.reduction.modes.dense_modes import dense_modes

#: Share of a pilot's motion that others do not have, below which it is none of its own.
INDEPENDENT = 1e-7


@dataclass(frozen=True, eq=False)
class PilotForm:
    """A body in its pilots' motions and its fixed-interface modes.

    Parameters
    ----------
    K, M, D : ndarray, shape (k, k)
        Stiffness, mass and damping, the m pilots' coordinates first.
    X : ndarray, shape (n, k)
        Former coordinates from these, ``[Ψ Φ]``.
    omega : ndarray, shape (k - m,)
        Angular frequencies of the fixed-interface modes [rad/s].
    """

    K: NDArray[np.float64]
    M: NDArray[np.float64]
    D: NDArray[np.float64]
    X: NDArray[np.float64]
    omega: NDArray[np.float64]


def pilot_form(
    K: NDArray[np.float64],
    M: NDArray[np.float64],
    D: NDArray[np.float64],
    G: NDArray[np.float64],
) -> PilotForm:
    """Change to the motions ``G x`` of pilots and fixed-interface modes.

    Parameters
    ----------
    K, M, D : ndarray, shape (n, n)
        Stiffness, mass and damping in the former coordinates x. Motions without mass are no modes:
        the pilots' constraint modes hold their flexibility.
    G : ndarray, shape (m, n)
        Motions of the pilots, independent of one another; they hold the body.

    Raises
    ------
    ValueError
        Where the pilots leave the body free to move.
    """
    s = 1.0 / np.sqrt(_size(K, M))
    K_s, M_s = (A * np.outer(s, s) for A in (K, M))
    size = np.linalg.norm(G * s, axis=1)
    Q, R = scipy.linalg.qr((G * s / size[:, None]).T)
    m = len(G)
    Y = scipy.linalg.solve_triangular(R[:m], Q[:, :m].T).T
    N = Q[:, m:]
    K_N = N.T @ K_s @ N
    scale = 1.0 / np.sqrt(np.maximum(K_N.diagonal(), np.finfo(float).tiny))
    try:
        factor = scipy.linalg.cho_factor(K_N * np.outer(scale, scale))
    except scipy.linalg.LinAlgError as error:
        raise ValueError(
            "with all pilots held the body still moves without stiffness; expected pilots that "
            "hold it: name more of them"
        ) from error
    force = scale[:, None] * (N.T @ (K_s @ Y))
    Psi = Y - N @ (scale[:, None] * scipy.linalg.cho_solve(factor, force))
    squares, phi = dense_modes(K_N, N.T @ M_s @ N)
    X = s[:, None] * np.concatenate([Psi / size, N @ phi], axis=1)
    K_r, M_r, D_r = (_symmetric(X.T @ A @ X) for A in (K, M, D))
    # Zero and one by construction.
    K_r[:m, m:], K_r[m:, :m], K_r[m:, m:] = 0.0, 0.0, np.diag(squares)
    M_r[m:, m:] = np.eye(len(squares))
    return PilotForm(K_r, M_r, D_r, X, np.sqrt(np.maximum(squares, 0.0)))


def _size(K: NDArray[np.float64], M: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mass of every coordinate, by its stiffness where it has none.

    Displacements, rotations and amplitudes have no common measure otherwise.
    """
    stiffness, mass = K.diagonal(), M.diagonal()
    has_mass = mass > 0.0
    if (mass < 0.0).any() or not (has_mass | (stiffness > 0.0)).all() or not has_mass.any():
        raise ValueError(
            "a coordinate has a negative mass, or neither mass nor stiffness; expected the "
            "matrices of a body"
        )
    ratio = float(stiffness[has_mass].sum() / mass[has_mass].sum())
    return np.where(has_mass, mass, stiffness / ratio if ratio > 0.0 else stiffness)


def independent_groups(
    motions: NDArray[np.float64], s: NDArray[np.float64]
) -> tuple[list[int], list[int]]:
    """Which of several points can move independently of those before them, and which cannot.

    Parameters
    ----------
    motions : ndarray, shape (p, 6, n)
        Six motions of every point.
    s : ndarray, shape (n,)
        Size of every coordinate.

    Returns
    -------
    chosen, others : list of int
        A point is chosen where all six of its motions are new.
    """
    chosen: list[int] = []
    others: list[int] = []
    basis = np.zeros((0, motions.shape[2]))
    for point, motion in enumerate(motions * s):
        size = np.linalg.norm(motion, axis=1)
        if not (size > 0.0).all() or len(basis) + len(motion) > motions.shape[2]:
            others.append(point)
            continue
        rows = motion / size[:, None]
        for _ in range(2):
            rows = rows - (rows @ basis.T) @ basis
        _, values, new = np.linalg.svd(rows, full_matrices=False)
        if values[-1] > INDEPENDENT:
            basis = np.concatenate([basis, new])
            chosen.append(point)
        else:
            others.append(point)
    return chosen, others


def _symmetric(A: NDArray[np.float64]) -> NDArray[np.float64]:
    return (A + A.T) / 2.0
