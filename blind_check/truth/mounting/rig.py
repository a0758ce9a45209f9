"""Housing on two bushings by the truth's own bodies.

Points, directions and cross products instead of written-out matrices.

Coordinates ``q = (roll, pitch, yaw, b_y, b_z)``: the housing rolls alone; housing, shaft and
coupling pitch and yaw about the main bearing at ``x = -L``, which moves by ``b_y, b_z`` where it
gives way. A point r of the housing moves by ``(0, b_y, b_z) + (0, pitch, yaw) x (r + L e_x) + roll
e_x x r``.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SENSORS = ("ssx", "spx", "ssz", "spz", "spy", "sbx")
N_FREE = 5

#: Rig of the paper of 2011 (figure 5, section 3, table 3 with a tenth of critical damping) and of
#: the GRC parts list; its key names are those of a campaign.
RIG: Mapping[str, Any] = MappingProxyType({
    "R_x": 0.75, "R_y": 0.1575, "R_z": 0.75, "R_b": 0.6, "R_yz": 0.2, "bushing_radial_stiffness": 20.2e6,
    "bushing_radial_damping": 1e5, "bushing_axial_stiffness": 1e6, "bushing_axial_damping": 1e4, "housing_mass": 3310.0,
    "housing_inertia": [1000.0, 900.0, 900.0], "housing_cg_x": 0.25, "shaft_mass": 2692.0, "shaft_cg_x": -0.8,
    "coupling_mass": 4100.0, "coupling_arm": 1.75, "main_bearing_x": 2.3, "gear_ratio": 81.491, "zeroing_samples": 150,
})  # fmt: skip


@dataclass(frozen=True, eq=False)
class Bodies:
    """Mass matrix, bushing rows, sensor rows and load columns of the rig.

    Parameters
    ----------
    M : ndarray, shape (5, 5)
        Mass matrix.
    radial, axial : ndarray, shape (4, 5), (2, 5)
        Deflections of the starboard and port bushing along z, then along y; along x.
    sensors : ndarray, shape (6, 5)
        What the sensors see of the housing.
    loads : ndarray, shape (5, 3)
        Generalised forces of torque, ntl_y, ntl_z.
    """

    M: FloatArray
    radial: FloatArray
    axial: FloatArray
    sensors: FloatArray
    loads: FloatArray


def _motion(point: tuple[float, float, float], *, rolls: bool) -> FloatArray:
    """Motion of a point over the coordinates, shape (3, 5)."""
    r = np.array(point)
    about_bearing = r + np.array([RIG["main_bearing_x"], 0.0, 0.0])
    columns = np.zeros((3, N_FREE))
    axes = np.eye(3)
    columns[:, 0] = np.cross(axes[0], r) if rolls else 0.0
    columns[:, 1], columns[:, 2] = (
        np.cross(axes[1], about_bearing),
        np.cross(axes[2], about_bearing),
    )
    columns[:, 3], columns[:, 4] = axes[1], axes[2]
    return columns


def bodies() -> Bodies:
    """Bodies of the rig."""
    M = np.diag([*RIG["housing_inertia"], 0.0, 0.0])
    for mass, x in (
        (RIG["housing_mass"], RIG["housing_cg_x"]),
        (RIG["shaft_mass"], RIG["shaft_cg_x"]),
        (RIG["coupling_mass"], -RIG["main_bearing_x"] - RIG["coupling_arm"]),
    ):
        point = _motion((x, 0.0, 0.0), rolls=False)
        M = M + mass * point.T @ point
    starboard, port = (_motion((0.0, side * RIG["R_x"], 0.0), rolls=True) for side in (1.0, -1.0))
    coupling = _motion((-RIG["main_bearing_x"] - RIG["coupling_arm"], 0.0, 0.0), rolls=False)
    torque = np.array([1.0 - 1.0 / RIG["gear_ratio"], 0.0, 0.0, 0.0, 0.0])
    return Bodies(
        M=M,
        radial=np.array([starboard[2], port[2], starboard[1], port[1]]),
        axial=np.array([starboard[0], port[0]]),
        sensors=_sensor_rows(),
        loads=np.array([torque, coupling[1], coupling[2]]).T,
    )


def _sensor_rows() -> FloatArray:
    """Sensors by place and direction, as equation (8) of the paper reads them."""
    R_x, R_y, R_z, R_b, R_yz = (RIG[name] for name in ("R_x", "R_y", "R_z", "R_b", "R_yz"))
    places = {
        "ssx": ((0.0, R_z, R_y), 0), "spx": ((0.0, -R_z, R_y), 0), "ssz": ((0.0, R_x, 0.0), 2), "spz": ((0.0, -R_x, 0.0), 2),
        "spy": ((-R_yz, 0.0, 0.0), 1), "sbx": ((0.0, 0.0, -R_b), 0),
    }  # fmt: skip
    return np.array([_motion(places[name][0], rolls=True)[places[name][1]] for name in SENSORS])
