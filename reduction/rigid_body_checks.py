"""Rigid-body motion of a reduced body found in three ways, and the mass properties each gives.

From geometry: the pilots' positions. From stiffness: the others' answer to a unit motion of one
pilot. From the eigenvalue problem: the modes of zero frequency. In a sound body the three agree,
and none of them meets a force (grounding).
"""

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.fe.surface_integrals import rigid_body_modes
from carrierflex.reduction.modes.dense_modes import dense_modes
from carrierflex.reduction.reduced_model import MassProperties, ReducedModel

#: Masses along two axes that differ by less than this share are the same.
_SAME_AXES = 1e-6
#: Rows of a unit motion of six coordinates.
_SIX = 6


def geometric_rigid_modes(model: ReducedModel) -> NDArray[np.float64]:
    """Rigid motions about the origin from the pilots' positions, shape (n, 6).

    Modal coordinates do not take part.
    """
    R = np.zeros((model.n_coordinates, _SIX))
    points = np.reshape(list(model.pilots.values()), (-1, 3))
    motions = rigid_body_modes(np.zeros((0, 3)), points, np.zeros(3)).reshape(-1, _SIX, _SIX)
    for name, motion in zip(model.pilots, motions, strict=True):
        R[model.rows_of(name)] = motion[list(model.components_of(name))]
    return R


def leading_rows(model: ReducedModel) -> NDArray[np.int64]:
    """Six pilot coordinates that determine a rigid motion.

    Those of the first pilot with all six; else those that the rigid motions move most independently
    of one another.
    """
    complete = next((name for name in model.pilots if name not in model.pilot_components), None)
    if complete is not None:
        return model.coordinates_of(complete)
    rows = model.pilot_rows
    R = geometric_rigid_modes(model)[rows]
    scale = np.abs(R).max(axis=0)
    order = scipy.linalg.qr((R / np.where(scale > 0.0, scale, 1.0)).T, mode="r", pivoting=True)[1]
    return np.asarray(rows[order[:_SIX]])


def stiffness_rigid_modes(model: ReducedModel) -> NDArray[np.float64]:
    """Rigid motions from K alone.

    Answer of all other coordinates to the first pilot's rigid motion, shape (n, 6).
    """
    leading = leading_rows(model)
    others = np.setdiff1d(np.arange(model.n_coordinates), leading)
    R = np.zeros((model.n_coordinates, _SIX))
    R[leading] = geometric_rigid_modes(model)[leading]
    scale = 1.0 / np.sqrt(model.K.diagonal()[others])
    K = model.K[np.ix_(others, others)] * np.outer(scale, scale)
    force = -model.K[np.ix_(others, leading)] @ R[leading]
    R[others] = scale[:, None] * np.linalg.solve(K, scale[:, None] * force)
    return R


def eigen_rigid_modes(model: ReducedModel) -> NDArray[np.float64]:
    """Modes of zero frequency, combined to move the first pilot as a rigid body, shape (n, 6).

    It moves as in :func:`stiffness_rigid_modes`.
    """
    leading = leading_rows(model)
    modes = dense_modes(model.K, model.M)[1][:, :_SIX]
    wanted = geometric_rigid_modes(model)[leading]
    return modes @ np.linalg.solve(modes[leading], wanted)


def mass_properties_from(model: ReducedModel, R: NDArray[np.float64]) -> MassProperties:
    """Mass, centre and inertia about the centre from rigid motions R about the origin.

    R has the shape (n, 6).

    From ``Rᵀ M R``.
    """
    return rigid_mass_properties(R.T @ model.M @ R)


def rigid_mass_properties(rigid: NDArray[np.float64]) -> MassProperties:
    """Mass, centre and inertia about the centre from a rigid mass matrix (6, 6).

    The matrix is taken about the origin.
    """
    masses = rigid.diagonal()[:3]
    if masses.max() - masses.min() > _SAME_AXES * masses.max():
        return _mass_by_axes(rigid, masses)
    mass = float(np.trace(rigid[:3, :3]) / 3.0)
    # The coupling block is m [c]×ᵀ: its entries are the centre of mass.
    c = np.array(
        [rigid[1, 5] - rigid[2, 4], rigid[2, 3] - rigid[0, 5], rigid[0, 4] - rigid[1, 3]]
    ) / (2.0 * mass)
    return MassProperties(mass, c, rigid[3:, 3:] - mass * (c @ c * np.eye(3) - np.outer(c, c)))


def _mass_by_axes(rigid: NDArray[np.float64], masses: NDArray[np.float64]) -> MassProperties:
    """The same of a model whose mass is not the same along x, y and z.

    A chain along x has none along y. The mass is the largest of the three; the centre is that of
    the directions that tell it.
    """
    mass = float(masses.max())
    moments = np.array(
        [rigid[1, 5] - rigid[2, 4], rigid[2, 3] - rigid[0, 5], rigid[0, 4] - rigid[1, 3]]
    )
    carried = masses[[1, 2, 0]] + masses[[2, 0, 1]]
    c = np.where(carried > 0.0, moments / np.where(carried > 0.0, carried, 1.0), 0.0)
    inertia = rigid[3:, 3:] - mass * (c @ c * np.eye(3) - np.outer(c, c))
    return MassProperties(mass, c, inertia)


def mass_difference(properties: MassProperties, reference: MassProperties, length: float) -> float:
    """Largest relative difference of mass, centre and inertia.

    The centre's over `length` [m], the inertia's over the largest moment.
    """
    return max(
        abs(properties.mass / reference.mass - 1.0),
        float(np.abs(properties.centre - reference.centre).max()) / length,
        float(
            np.abs(properties.inertia - reference.inertia).max() / np.abs(reference.inertia).max()
        ),
    )


def grounding(model: ReducedModel) -> float:
    """Largest force or moment against a rigid motion, over the stiffness of its own coordinate.

    ``max |K R|_i / K_ii`` with R of unit translation and of unit rotation about the origin: the
    motion [m or rad] that the coordinate would need to make such a force. Zero for a free body; the
    only pilot of one has no stiffness that a force could be compared with.
    """
    pilots = model.pilot_rows
    force = np.abs(model.K[pilots] @ geometric_rigid_modes(model)).max(axis=1)
    diagonal = model.K.diagonal()[pilots]
    return float(
        np.divide(force, diagonal, out=np.where(force > 0.0, np.inf, 0.0), where=diagonal > 0).max()
    )
