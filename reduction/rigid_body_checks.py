"""Rigid-body motion of a reduced body found in three ways, and the mass properties each gives.

From geometry: the pilots' positions. From stiffness: the others' answer to a unit motion of one
pilot. From the eigenvalue problem: the modes of zero frequency. In a sound body the three agree,
and none of them meets a force (grounding).
"""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.fe.surface_integrals import rigid_body_modes
from carrierflex.reduction.reduced_model import MassProperties, ReducedModel

#: Rows of a unit motion of six coordinates.
_SIX = 6


def geometric_rigid_modes(model: ReducedModel) -> NDArray[np.float64]:
    """Rigid motions about the origin from the pilots' positions, shape (n, 6).

    Modal coordinates do not take part.
    """
    R = np.zeros((model.n_coordinates, _SIX))
    for name, point in model.pilots.items():
        R[model.coordinates_of(name)] = rigid_body_modes(np.zeros((0, 3)), point[None], np.zeros(3))
    return R


def stiffness_rigid_modes(model: ReducedModel) -> NDArray[np.float64]:
    """Rigid motions from K alone.

    Answer of all other coordinates to the first pilot's rigid motion, shape (n, 6).
    """
    first, point = next(iter(model.pilots.items()))
    leading = model.coordinates_of(first)
    others = np.setdiff1d(np.arange(model.n_coordinates), leading)
    R = np.zeros((model.n_coordinates, _SIX))
    R[leading] = rigid_body_modes(np.zeros((0, 3)), point[None], np.zeros(3))
    scale = 1.0 / np.sqrt(model.K.diagonal()[others])
    K = model.K[np.ix_(others, others)] * np.outer(scale, scale)
    force = -model.K[np.ix_(others, leading)] @ R[leading]
    R[others] = scale[:, None] * np.linalg.solve(K, scale[:, None] * force)
    return R


def eigen_rigid_modes(model: ReducedModel) -> NDArray[np.float64]:
    """Modes of zero frequency, combined so that the first pilot moves as in :func:`stiffness_rigid_modes`, shape (n, 6)."""
    first, point = next(iter(model.pilots.items()))
    # Frequencies do not matter here, accuracy does: coordinates are scaled to unit mass before the
    # eigenvalue problem.
    scale = 1.0 / np.sqrt(model.M.diagonal())
    _, modes = scipy.linalg.eigh(
        model.K * np.outer(scale, scale),
        model.M * np.outer(scale, scale),
        subset_by_index=[0, _SIX - 1],
    )
    modes = scale[:, None] * modes
    wanted = rigid_body_modes(np.zeros((0, 3)), point[None], np.zeros(3))
    return modes @ np.linalg.solve(modes[model.coordinates_of(first)], wanted)


def mass_properties_from(model: ReducedModel, R: NDArray[np.float64]) -> MassProperties:
    """Mass, centre and inertia about the centre from rigid motions R about the origin, ``Rᵀ M R``."""
    return rigid_mass_properties(R.T @ model.M @ R)


def rigid_mass_properties(rigid: NDArray[np.float64]) -> MassProperties:
    """Mass, centre and inertia about the centre from the rigid mass matrix about the origin, shape (6, 6)."""
    mass = float(np.trace(rigid[:3, :3]) / 3.0)
    # The coupling block is m [c]×ᵀ: its entries are the centre of mass.
    c = np.array(
        [rigid[1, 5] - rigid[2, 4], rigid[2, 3] - rigid[0, 5], rigid[0, 4] - rigid[1, 3]]
    ) / (2.0 * mass)
    return MassProperties(mass, c, rigid[3:, 3:] - mass * (c @ c * np.eye(3) - np.outer(c, c)))


def mass_difference(found: MassProperties, reference: MassProperties, length: float) -> float:
    """Largest relative difference of mass, centre (over `length` [m]) and inertia (over the largest moment)."""
    return max(
        abs(found.mass / reference.mass - 1.0),
        float(np.abs(found.centre - reference.centre).max()) / length,
        float(np.abs(found.inertia - reference.inertia).max() / np.abs(reference.inertia).max()),
    )


def grounding(model: ReducedModel) -> float:
    """Largest force or moment against a rigid motion, over the stiffness of its own coordinate.

    ``max |K R|_i / K_ii`` with R of unit translation and of unit rotation about the origin: the
    motion [m or rad] that the coordinate would need to make such a force. Zero for a free body.
    """
    pilots = np.concatenate([model.coordinates_of(name) for name in model.pilots])
    force = model.K[pilots] @ geometric_rigid_modes(model)
    return float((np.abs(force) / model.K.diagonal()[pilots, None]).max())
