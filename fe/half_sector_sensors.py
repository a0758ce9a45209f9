"""The rim's sensor circle read from the half sector's part of it.

Every angle is an image of one between a pin's plane and the next web's.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.rim_circle import rim_recovery
from carrierflex.fe.structural_model import N_SENSOR_ANGLES, rim_sensors, sensor_names
from carrierflex.geometry.parameters import half_sector_angle
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
        Number of the image (of the motions of :class:`carrierflex.geometry.dihedral_group
        .DihedralGroup`) that carries this place to the sensor's.
    """

    names: tuple[str, ...]
    rows: sp.csr_array
    images: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FoldedCircle:
    """The sensor circle's n angles as images of those that a half sector holds.

    Parameters
    ----------
    angles : ndarray, shape (k,)
        Carrier-frame angles [rad] on the half sector, from a pin's plane to the next web's.
    angle_index : ndarray of int, shape (n,)
        Which of `angles` each of the circle's is an image of.
    images : ndarray of int, shape (n,)
        Number of the image; odd ones are mirrored.
    """

    angles: NDArray[np.float64]
    angle_index: NDArray[np.int64]
    images: NDArray[np.int64]


def folded_circle(n_planets: int) -> FoldedCircle:
    """The sensor circle folded into the half sector of a carrier of `n_planets`."""
    # Whole numbers: a pitch has as many steps as the circle has angles, an angle n_planets steps.
    sector, step = np.divmod(n_planets * np.arange(N_SENSOR_ANGLES), N_SENSOR_ANGLES)
    mirrored = 2 * step > N_SENSOR_ANGLES
    # The second half of a pitch is the mirror image that the next rotation brings.
    images = np.where(mirrored, 2 * ((sector + 1) % n_planets) + 1, 2 * sector)
    step = np.where(mirrored, N_SENSOR_ANGLES - step, step)
    distinct_steps, inverse = np.unique(step, return_inverse=True)
    angles = half_sector_angle(n_planets) * (2 * distinct_steps / N_SENSOR_ANGLES)
    return FoldedCircle(angles, inverse, images)


def half_sector_sensors(half: TetMesh, radius: float, n_planets: int) -> HalfSectorSensors:
    """Sensor circle of a whole body from its half sector.

    The whole body's is :class:`carrierflex.fe.structural_model.Sensors`.

    Parameters
    ----------
    half : TetMesh
        Half sector with the surface ``rim_face``.
    radius : float
        Radius of the circle [m].
    n_planets : int
        Pins of the whole body.
    """
    circle = folded_circle(n_planets)
    axial, radial = rim_recovery(half, radius, circle.angles)
    rows = sp.csr_array(sp.vstack([axial[circle.angle_index], radial[circle.angle_index]]))
    return HalfSectorSensors(sensor_names(), rows, np.tile(circle.images, 2))


def whole_body_sensors(mesh: TetMesh, radius: float) -> HalfSectorSensors:
    """Sensor circle of a body without symmetry, which is the one image of itself.

    Parameters
    ----------
    mesh : TetMesh
        Whole body with the surface ``rim_face``.
    radius : float
        Radius of the circle [m].
    """
    sensors = rim_sensors(mesh, radius)
    images = np.zeros(len(sensors.names), dtype=np.int64)
    return HalfSectorSensors(sensors.names, sensors.rows, images)
