"""Effective interface mass.

How much of a body each fixed-interface mode carries along when its interface moves rigidly.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.surface_integrals import rigid_body_modes
from carrierflex.reduction.reduced_model import ReducedModel

#: Stiffness between pilots and modes, over the geometric mean of their own, that counts as
#: rounding.
_UNCOUPLED = 1e-6
#: Directions of the columns.
DIRECTIONS = ("x", "y", "z", "about x", "about y", "about z")


def effective_interface_mass(model: ReducedModel) -> NDArray[np.float64]:
    """Share of the body's mass and inertia that each mode takes part in, by direction.

    With the interface moving as a rigid body about the centre of mass, ``L = Φᵀ M Ψ R_b``; mode i
    carries ``L_ij²`` (modes mass-normalised) in direction j. Over all modes the shares add up to
    what moves relative to the interface.

    Parameters
    ----------
    model : ReducedModel
        One body with its pilots and fixed-interface modes; k modes.

    Returns
    -------
    ndarray, shape (k, 6)
        Share of the mass (x, y, z) and of the inertia about the centre of mass (about x, y, z) [-].

    Raises
    ------
    ValueError
        Where the body has no pilots.

    References
    ----------
    .. [1] D. C. Kammer, M. J. Triller, "Selection of component modes for Craig-Bampton substructure
       representations", Journal of Vibration and Acoustics 118 (1996).
    """
    if not model.pilots:
        raise ValueError(f"{model.name}: no pilots; expected an interface that can move")
    R = rigid_motion_of_interface(model)
    moved = np.zeros(model.n_coordinates, dtype=bool)
    for rows in model.pilot_coordinates.values():
        moved[rows] = True
    L = model.M[~moved] @ R
    normal = np.sqrt(np.diag(model.M)[~moved])  # 1 for mass-normalised modes
    return np.asarray((L / normal[:, None]) ** 2 / np.diag(R.T @ model.M @ R))


def has_fixed_interface_modes(model: ReducedModel) -> bool:
    """Whether the modes are those with the pilots held.

    Then no stiffness couples them with the pilots.
    """
    moved = np.zeros(model.n_coordinates, dtype=bool)
    for rows in model.pilot_coordinates.values():
        moved[rows] = True
    scale = np.sqrt(np.abs(model.K.diagonal()))
    coupling = np.abs(model.K[np.ix_(moved, ~moved)])
    return bool((coupling <= _UNCOUPLED * np.outer(scale[moved], scale[~moved])).all())


def rigid_motion_of_interface(model: ReducedModel) -> NDArray[np.float64]:
    """Reduced coordinates of six unit rigid motions about the centre of mass, shape (n, 6).

    Modes stay at rest.
    """
    R = np.zeros((model.n_coordinates, 6))
    for name, rows in model.pilot_coordinates.items():
        motion = rigid_body_modes(
            np.zeros((0, 3)), model.pilots[name][None], model.mass_properties.centre
        )
        R[rows] = motion[list(model.components_of(name))]
    return R
