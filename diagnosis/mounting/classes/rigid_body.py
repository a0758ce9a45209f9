"""The housing as a rigid body of six motions, and what forces on it do to the sensors.

Coordinates ``q = (theta_x, theta_y, theta_z, b_z, b_y, d_x)``: the first three move freely on the
bushings, the baseline holds the others. ``M q'' + C q' + K q = G (T, F_y, F_z) + p`` with the
generalised forces p that the baseline lacks. On linear bushings the free motions are three
oscillators that do not know of one another, so that a force p_i answers with
``H_i p_i``, ``H_i(s) = 1 / (M_ii s² + C_ii s + K_ii)``, exactly where p is straight between
samples.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.signal import cont2discrete, lfilter

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig

#: Coordinates that move freely on the bushings; bearing and axial guide hold the rest.
N_FREE = 3
#: Compliance of a bearing that the equations are written with, so that its motion has a row.
_ANY_COMPLIANCE = 1e-7


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Matrices of the housing on linear bushings.

    Parameters
    ----------
    M, C, K : ndarray, shape (6, 6)
        Mass, damping, stiffness; the bearing's own stiffness is not in K.
    G : ndarray, shape (6, 3)
        Generalised forces of torque, ntl_y, ntl_z.
    rows : ndarray, shape (2, 2, 6)
        Deflection of starboard and port bushing in y and in z over the coordinates.
    output : ndarray, shape (n_channels, 6)
        Channels over the coordinates.
    stiffness, damping : float
        Radial stiffness and damping of each bushing.
    """

    M: FloatArray
    C: FloatArray
    K: FloatArray
    G: FloatArray
    rows: FloatArray
    output: FloatArray
    stiffness: float
    damping: float

    @property
    def free_output(self) -> FloatArray:
        """Channels over the free coordinates, shape (n_channels, 3)."""
        return self.output[:, :N_FREE]

    @cached_property
    def to_free(self) -> FloatArray:
        """Free coordinates from the channels by least squares, shape (3, n_channels)."""
        return np.asarray(np.linalg.pinv(self.free_output))

    @property
    def shows_motion(self) -> bool:
        """Whether the channels show every free coordinate."""
        return bool(np.linalg.matrix_rank(self.free_output) == N_FREE)

    def on_coordinates(self, forces: FloatArray) -> FloatArray:
        """Generalised forces on the free coordinates of forces in the bushings.

        Parameters
        ----------
        forces : ndarray, shape (m, 2, 2, n)
            Internal forces of starboard and port bushing in y and in z, positive against a positive
            deflection.

        Returns
        -------
        ndarray, shape (m, 3, n)
            What acts on the housing.
        """
        rows = self.rows[:, :, :N_FREE].reshape(4, N_FREE)
        return np.asarray(-rows.T @ forces.reshape(len(forces), 4, -1))

    def of_side(self, forces: FloatArray, side: int) -> FloatArray:
        """Generalised forces on the free coordinates of forces in one bushing, shape (m, 3, n).

        Parameters
        ----------
        forces : ndarray, shape (m, 2, n)
            Internal forces in y and in z.
        side : int
            0 starboard, 1 port.
        """
        return np.asarray(-self.rows[side, :, :N_FREE].T @ forces)

    def response(self, p: FloatArray, step: float) -> FloatArray:
        """Free coordinates that generalised forces make, from rest under their first values.

        Parameters
        ----------
        p : ndarray, shape (..., 3, n)
            Generalised forces, straight between samples.
        step : float
            Sampling interval [s].

        Returns
        -------
        ndarray, shape (..., 3, n)
            Motion [rad].
        """
        found = np.empty(p.shape)
        for i in range(N_FREE):
            own = p[..., i, :]
            numerator, denominator = _oscillator(self.M[i, i], self.C[i, i], self.K[i, i], step)
            moved = lfilter(numerator, denominator, own - own[..., :1], axis=-1)
            found[..., i, :] = moved + own[..., :1] / self.K[i, i]
        return found


@lru_cache(maxsize=64)
def _oscillator(M: float, C: float, K: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator of one oscillator under forces straight between samples."""
    numerator, denominator, _ = cont2discrete(([1.0], [M, C, K]), step, method="foh")
    return numerator.reshape(-1), denominator


def rigid_body(
    rig: MountingRig, sensors: tuple[str, ...], stiffness: float, damping: float
) -> RigidBody:
    """Housing on linear bushings.

    Parameters
    ----------
    rig : MountingRig
        Geometry and masses.
    sensors : tuple of str
        Sensor of every channel.
    stiffness, damping : float
        Radial stiffness and damping of each bushing.
    """
    every = replace(rig, axial_motion=True)
    values = parameter_array(
        every, {"K1": stiffness, "C1": damping, "main_bearing_compliance": _ANY_COMPLIANCE}
    )
    held = values.copy()
    held[INDEX["main_bearing_compliance"]] = _ANY_COMPLIANCE
    vertical, horizontal = mounting_blocks(every, held)
    places = ((vertical, (0, 1, 3)), (horizontal, (2, 4, 5)))
    M = np.zeros((6, 6))
    C = np.zeros((6, 6))
    K = np.zeros((6, 6))
    G, output = np.zeros((6, 3)), np.zeros((6, 6))
    for block, own in places:
        index = np.ix_(own, own)
        M[index] = block.M
        C[index] = block.C
        K[index] = block.K
        G[list(own)] = block.G
        output[:, own] = block.output
    for held_place in (3, 4):
        K[held_place, held_place] -= 1.0 / _ANY_COMPLIANCE
    rows = np.zeros((2, 2, 6))
    rows[:, 0, places[1][1]] = horizontal.rows[0]
    rows[:, 1, places[0][1]] = vertical.rows
    numbers = [SENSORS.index(sensor) for sensor in sensors]
    return RigidBody(M, C, K, G, rows, output[numbers], stiffness, damping)
