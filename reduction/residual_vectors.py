"""Residual vectors: what the kept modes lack of a known static answer, added as modes of their own.

Loads at pilots are answered exactly by the constraint modes, unit torque and tilting moment among
them. Loads on the interior, weight and centrifugal force, are not: with the pilots held their
answer is a sum over all fixed-interface modes.
"""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.fixed_interface_modes import FixedInterfaceModes
from carrierflex.reduction.held_structure import HeldStructure
from carrierflex.reduction.modes.mode_orientation import oriented

#: A vector that is this small beside the answer it is what is left of holds nothing new [share of
#: strain energy].
_NEGLIGIBLE = 1e-10


def body_loads(structure: StructuralModel) -> NDArray[np.float64]:
    """Nodal forces of unit accelerations and of unit rotation.

    Parameters
    ----------
    structure : StructuralModel
        The body.

    Returns
    -------
    ndarray, shape (n_dofs, 4)
        Weight along x, y and z for 1 m/s^2 [N], and centrifugal force about the x axis for 1 rad/s
        [N].
    """
    R = structure.rigid_modes
    # Acceleration of a turning body: the distance from the axis, a field that is linear in the
    # coordinates.
    outward = np.zeros(structure.n_dofs)
    n = 3 * len(structure.points)
    if structure.layout is not None:
        components, points = structure.layout.names.components, structure.layout.points
        for axis in (1, 2):
            outward[components == axis] = points[components == axis, axis]
    else:
        outward[1:n:3], outward[2:n:3] = structure.points[:, 1], structure.points[:, 2]
        for i, point in enumerate(structure.rigid_points):
            outward[n + 6 * i + 1 : n + 6 * i + 3] = point[1:]
    return structure.M @ np.column_stack([R[:, :3], outward])


def residual_vectors(
    fixed_interface: HeldStructure,
    structure: StructuralModel,
    modes: FixedInterfaceModes,
    loads: NDArray[np.float64] | None,
) -> FixedInterfaceModes:
    """Pseudo-modes that complete the kept modes to the exact static answer to some loads.

    ``U = K_held⁻¹ F``, less its part in the kept modes, ``U - Φ Φᵀ M U``, is orthonormalised by its
    own small eigenvalue problem: mass-normalised, stiffness diagonal, orthogonal to every kept mode
    in mass and stiffness.

    Parameters
    ----------
    fixed_interface : HeldStructure
        Body with its pilots held.
    structure : StructuralModel
        The body.
    modes : FixedInterfaceModes
        Kept modes.
    loads : ndarray, shape (n_dofs, k), or None
        Nodal forces [N], of any size; None: no residual vectors.

    Returns
    -------
    FixedInterfaceModes
        At most k pseudo-modes with their pseudo-frequencies; loads that the kept modes answer
        already add none.

    References
    ----------
    .. [1] R. R. Craig, A. J. Kurdila, "Fundamentals of Structural Dynamics", 2nd ed. (2006),
       section 17.
    """
    if loads is None or loads.shape[1] == 0:
        return FixedInterfaceModes(np.zeros((structure.n_dofs, 0)), np.zeros(0))
    U = fixed_interface.static_response(loads)
    energy = np.einsum("nk,nk->k", U, loads)
    U = U[:, energy > 0.0] / np.sqrt(energy[energy > 0.0])
    for _ in range(2):  # once more for the rounding of the first time
        U = U - modes.Phi @ (modes.Phi.T @ (structure.M @ U))
    K_u, M_u = U.T @ (structure.K @ U), U.T @ (structure.M @ U)
    sizes, directions = np.linalg.eigh((K_u + K_u.T) / 2.0)
    W = directions[:, sizes > _NEGLIGIBLE] / np.sqrt(sizes[sizes > _NEGLIGIBLE])
    if W.shape[1] == 0:
        return FixedInterfaceModes(np.zeros((structure.n_dofs, 0)), np.zeros(0))
    mu, Z = scipy.linalg.eigh(W.T @ M_u @ W)
    order = np.argsort(-mu)
    # Flexibility normalised vectors have the mass mu = 1 / omega².
    omega = 1.0 / np.sqrt(mu[order])
    return FixedInterfaceModes(oriented(U @ W @ Z[:, order] * omega, omega), omega)
