"""How far a reduced body is from the symmetry of its part.

Reduced matrices under the rotation by 120 degrees.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.parameters import N_PINS
from carrierflex.reduction.reduced_model import ReducedModel

#: Distance [m] within which a rotated pilot counts as lying on another.
_SAME_POINT = 1e-6


def pilot_rotation(model: ReducedModel) -> NDArray[np.float64] | None:
    """Permutation and rotation of the pilots' coordinates under +120 deg about x.

    None where the pilots do not map.

    Returns
    -------
    ndarray, shape (6 p, 6 p), or None
        Q such that a motion q of the body, turned by 120 deg, is Q q.
    """
    R = rotation_about_x(2.0 * np.pi / N_PINS)
    names = list(model.pilots)
    points = np.array([model.pilots[name] for name in names])
    Q = np.zeros((6 * len(names), 6 * len(names)))
    for i, point in enumerate(points):
        distance = np.linalg.norm(points - R @ point, axis=1)
        j = int(distance.argmin())
        if distance[j] > _SAME_POINT:
            return None
        for part in (0, 3):
            Q[6 * j + part : 6 * j + part + 3, 6 * i + part : 6 * i + part + 3] = R
    return Q


def asymmetry_ppm(model: ReducedModel) -> float | None:
    """Largest change of the pilots' static stiffness and mass under the rotation, in parts per million.

    Every entry is compared over the geometric mean of its two diagonal entries. None where the
    pilots do not map onto one another.
    """
    Q = pilot_rotation(model)
    if Q is None:
        return None
    rows = np.concatenate([model.coordinates_of(name) for name in model.pilots])
    largest = 0.0
    for matrix in (model.K, model.M):
        A = matrix[np.ix_(rows, rows)]
        scale = np.sqrt(np.outer(A.diagonal(), A.diagonal()))
        largest = max(largest, float((np.abs(Q @ A @ Q.T - A) / scale).max()))
    return 1e6 * largest
