"""The rigid motion that fits displacements best: the algebra that all distributing couplings share.

The motion q of a point that leaves the least weighted mean square between a rigid motion ``R q``
and displacements u is ``q = Z⁻¹ B u`` with ``Z = ΣᵂRᵀR`` and ``B = ΣᵂRᵀ``. Z is formed about a
reference point within the surface, wherever the pilot stands: about a far pilot, rotations and
translations would be told apart by their last digits only. Where Z is singular some motions are not
determined (the rotation about a line of nodes); those that are can be used all the same.
"""

import numpy as np
from numpy.typing import NDArray

#: A pilot's six motions, in the order of its coordinates.
MOTIONS = (
    "translation x",
    "translation y",
    "translation z",
    "rotation x",
    "rotation y",
    "rotation z",
)
ALL_COMPONENTS = (0, 1, 2, 3, 4, 5)
#: Eigenvalue of Z, lengths scaled, over the largest one: below it a motion meets no displacement.
_RANK_TOLERANCE = 1e-8
#: Share of an undetermined motion in a component above which the component is not determined
#: either.
_SHARE_TOLERANCE = 1e-6


def fitted_motion(
    Z: NDArray[np.float64],
    B: NDArray[np.float64],
    arm: NDArray[np.float64],
    components: tuple[int, ...],
    *,
    subject: str,
) -> NDArray[np.float64]:
    """Motion of a pilot from displacements, rows of ``X Z⁻¹ B``.

    Parameters
    ----------
    Z : ndarray, shape (6, 6)
        Weighted moments of rigid motions about the reference point.
    B : ndarray, shape (6, m)
        Their weighted products with m displacements.
    arm : ndarray, shape (3,)
        Pilot minus reference point [m]; X moves the fitted motion there, ``u = u_ref + θ × arm``.
    components : tuple of int
        Motions of the pilot that are wanted, numbered as in `MOTIONS`.
    subject : str
        What is being coupled, to begin an error message with.

    Returns
    -------
    ndarray, shape (k, m)
        One row a component.

    Raises
    ------
    ValueError
        Where a component is not one of six, comes twice, or is not determined by the displacements.
    """
    _refuse_odd_components(components, subject)
    scale, eigenvalues, V = _scaled_eigenvectors(Z)
    determined = eigenvalues > _RANK_TOLERANCE * eigenvalues[-1]
    X = _moved(arm)
    wanted = list(components)
    if determined.all():
        return np.asarray((X @ np.linalg.solve(Z, B))[wanted])
    undetermined = scale[:, None] * (X @ (V[:, ~determined] / scale[:, None]))
    lost = [i for i in wanted if np.linalg.norm(undetermined[i]) > _SHARE_TOLERANCE]
    if lost or not determined.any():
        raise ValueError(
            f"{subject} cannot hold a pilot's {', '.join(MOTIONS[i] for i in lost or wanted)}: the averaged displacements do "
            "not determine it; expected nodes and directions that do (an area, or three nodes not in line), or fewer components"
        )
    inverse = (V[:, determined] / eigenvalues[determined]) @ V[:, determined].T
    return np.asarray((X @ ((inverse / np.outer(scale, scale)) @ B))[wanted])


def _scaled_eigenvectors(
    Z: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Scale s of each motion and eigenpairs, ascending, of ``Z / s sᵀ``.

    Rotations measured at the radius of gyration.
    """
    masses, inertias = float(np.trace(Z[:3, :3])), float(np.trace(Z[3:, 3:]))
    length = np.sqrt(inertias / masses) if masses > 0.0 and inertias > 0.0 else 1.0
    scale = np.array([1.0, 1.0, 1.0, length, length, length])
    eigenvalues, V = np.linalg.eigh(Z / np.outer(scale, scale))
    return scale, eigenvalues, V


def _moved(arm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rigid motion at ``reference + arm`` from the one at the reference point, shape (6, 6)."""
    X = np.eye(6)
    X[:3, 3:] = [[0.0, arm[2], -arm[1]], [-arm[2], 0.0, arm[0]], [arm[1], -arm[0], 0.0]]
    return X


def _refuse_odd_components(components: tuple[int, ...], subject: str) -> None:
    if (
        not components
        or len(set(components)) != len(components)
        or not set(components) <= set(ALL_COMPONENTS)
    ):
        raise ValueError(
            f"{subject}: components are {tuple(components)}; expected some of 0 to 5 ({', '.join(MOTIONS)}), each once"
        )
