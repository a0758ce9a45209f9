"""The rim's sensor circle read from a sixth of it.

Every angle is an image of one between 0 and 60 degrees.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.rim_circle import rim_recovery
from carrierflex.fe.structural_model import N_SENSOR_ANGLES, sensor_names
from carrierflex.geometry.parameters import HALF_SECTOR_ANGLE
from carrierflex.geometry.tet_mesh import TetMesh


@dataclass(frozen=True, eq=False)
class HalfSectorSensors:
    """Recovery rows of a whole body's sensors on its half sector.

    Parameters
    ----------
    names : tuple of str
        Those of the whole body's sensors.
    rows : csr_array, shape (n_sensors, n_half)
        Displacement [m] of the sensor's place on the half sector, along the direction that its
        image makes the sensor's.
    images : ndarray of int, shape (n_sensors,)
        Number of the image (:data:`carrierflex.geometry.dihedral_group.MOTIONS`) that carries this
        place to the sensor's.
    """

    names: tuple[str, ...]
    rows: sp.csr_array
    images: NDArray[np.int64]


def half_sector_sensors(half: TetMesh, radius: float) -> HalfSectorSensors:
    """Sensor circle of :class:`carrierflex.fe.structural_model.Sensors` from the half sector 0..60 deg.

    Parameters
    ----------
    half : TetMesh
        Half sector with the surface ``rim_face``.
    radius : float
        Radius of the circle [m].
    """
    n_half = N_SENSOR_ANGLES // 6
    axial, radial = rim_recovery(half, radius, HALF_SECTOR_ANGLE * np.arange(n_half + 1) / n_half)
    third, place = np.divmod(np.arange(N_SENSOR_ANGLES), 2 * n_half)
    mirrored = place > n_half
    # The second half of a third is the mirror image that the next rotation brings.
    images = np.where(mirrored, 2 * ((third + 1) % 3) + 1, 2 * third)
    place = np.where(mirrored, 2 * n_half - place, place)
    rows = sp.csr_array(sp.vstack([axial[place], radial[place]]))
    return HalfSectorSensors(sensor_names(), rows, np.tile(images, 2))
