"""Residual vectors: what the kept modes lack of a known static answer, added as modes of their own.

Loads at pilots are answered exactly by the constraint modes, unit torque and tilting moment among
them. Loads on the interior, weight and centrifugal force, are not: with the pilots held their
answer is a sum over all fixed-interface modes.
"""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.structural_model import StructuralModel


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
