"""Force, tangent and energy of a bearing's line contacts (compiled).

Numba's cache of :mod:`carrierflex.simulation.stage.response` does not see changes here: touch that
file after one.
"""

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

#: Minus a ninth of a number's bits and these are those of its ninth root's inverse, within 3.4 %;
#: in single precision, whose conversions every processor has for several numbers at once.
_NINTH, _BITS = np.float32(-1.0 / 9.0), np.float32((10.0 / 9.0 * 127.0 - 0.058) * 2.0**23)
#: Approach [m] below which a slice is as soft as there.
_LEAST = 1e-30


class RollerSet(NamedTuple):
    """Rollers of b bearings, Z rollers in a row, S slices in all rows."""

    directions: NDArray[np.float64]
    """Cosine and sine of the roller angles at the carrier angle 0, shape (b, Z, 2)."""
    cage: float
    """Turn of the cage over the carrier's."""
    x: NDArray[np.float64]
    """Axial place of the slices [m], shape (S,)."""
    stiffness: NDArray[np.float64]
    """Of the slices [N/m^(10/9)], shape (b, S)."""
    gap: NDArray[np.float64]
    """Radial clearance and profile [m], shape (S,)."""


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _ninth_root(x: float) -> float:
    """``x^(1/9)`` of a number from :data:`_LEAST` on, in operations that the compiler vectorises.

    The inverse ``y`` by the series of ``(1 - r)^(-1/9)``, ``r = 1 - x y^9``, twice: 0.3 of the
    start from the number's bits, then 1e-3, then rounding.
    """
    bits = np.float32(np.float32(x).view(np.int32)) * _NINTH + _BITS
    y = np.float64(np.int32(bits).view(np.float32))
    for _ in range(2):
        cube = y * y * y
        r = 1.0 - x * (cube * cube * cube)
        series = 5.0 / 81.0 + r * (95.0 / 2187.0 + r * (665.0 / 19683.0))
        y += y * (r * (1.0 / 9.0 + r * series))
    square = y * y
    square *= square
    return x * (square * square)


@numba.njit(cache=True, error_model="numpy", fastmath={"contract"})
def _ninth_roots(approach: NDArray[np.float64], roots: NDArray[np.float64]) -> None:
    """Ninth roots of what is positive, apart from what the compiler does not vectorise."""
    for i in range(len(approach)):
        roots[i] = _ninth_root(max(approach[i], _LEAST))


@numba.njit(cache=True, fastmath={"contract"})
def roller_load(
    rollers: RollerSet,
    b: int,
    motion: NDArray[np.float64],
    angle: float,
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> tuple[float, float]:
    """Gradient of the energy by the motion (`force`, shape (4,)) and its tangent (shape (4, 4)).

    Returned: by the carrier angle, and the energy ``Σ 9/19 k delta^(19/9)`` [J].

    Parameters
    ----------
    rollers : RollerSet
        Rollers.
    b : int
        Which bearing.
    motion : ndarray, shape (4,)
        y, z [m], ry, rz [rad] of the planet against the pin.
    angle : float
        Carrier angle [rad].
    force, tangent : ndarray
        Take the answer.
    """
    # Once: an array of a tuple is counted in and out wherever it is named.
    positions, gaps = rollers.x, rollers.gap
    stiffness, directions = rollers.stiffness, rollers.directions
    y, z, ry, rz = motion[0], motion[1], motion[2], motion[3]
    n_rollers, n_slices = directions.shape[1], len(positions)
    turn_c, turn_s = np.cos(rollers.cage * angle), np.sin(rollers.cage * angle)
    # Of the rollers that may touch: cosine and sine, approach and root of every slice.
    lines = np.empty((2, n_rollers))
    approach, roots = np.empty(n_rollers * n_slices), np.empty(n_rollers * n_slices)
    reach, least, n = 0.0, np.inf, 0
    for j in range(n_slices):
        reach, least = max(reach, abs(positions[j])), min(least, gaps[j])
    for i in range(n_rollers):
        c0, s0 = directions[b, i, 0], directions[b, i, 1]
        s, c = s0 * turn_c + c0 * turn_s, c0 * turn_c - s0 * turn_s
        middle, slope = s * y - c * z, s * rz + c * ry
        if middle + reach * abs(slope) > least:
            lines[0, n], lines[1, n] = c, s
            for j in range(n_slices):
                approach[n * n_slices + j] = middle + slope * positions[j] - gaps[j]
            n += 1
    _ninth_roots(approach[: n * n_slices], roots)
    force[:] = 0.0
    tangent[:] = 0.0
    by_angle, energy = 0.0, 0.0
    for i in range(n):
        Q, M, k, kx, kxx = 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(n_slices):
            delta, x = approach[i * n_slices + j], positions[j]
            if delta <= 0.0:
                continue
            secant = stiffness[b, j] * roots[i * n_slices + j]
            push = secant * delta
            energy += push * delta
            Q += push
            M += push * x
            k += secant
            kx += secant * x
            kxx += secant * x * x
        c, s = lines[0, i], lines[1, i]
        # d delta / d motion = (s, -c, x c, x s).
        force[0] += Q * s
        force[1] -= Q * c
        force[2] += M * c
        force[3] += M * s
        by_angle += Q * (c * y + s * z) + M * (c * rz - s * ry)
        tangent[0, 0] += k * s * s
        tangent[0, 1] -= k * s * c
        tangent[1, 1] += k * c * c
        tangent[0, 2] += kx * s * c
        tangent[0, 3] += kx * s * s
        tangent[1, 2] -= kx * c * c
        tangent[1, 3] -= kx * s * c
        tangent[2, 2] += kxx * c * c
        tangent[2, 3] += kxx * s * c
        tangent[3, 3] += kxx * s * s
    for i in range(4):
        for j in range(i, 4):
            # The tangent of k delta^(10/9) is 10/9 of its secant.
            tangent[i, j] *= 10.0 / 9.0
            tangent[j, i] = tangent[i, j]
    return by_angle * rollers.cage, 9.0 / 19.0 * energy


@numba.njit(cache=True)
def roller_loads(
    rollers: RollerSet, b: int, motion: NDArray[np.float64], angle: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """As :func:`roller_load` at N instants: gradients by the motion, (N, 4), and energies, (N,)."""
    load, energy, tangent = np.empty(motion.shape), np.empty(len(motion)), np.empty((4, 4))
    for i in range(len(motion)):
        _, energy[i] = roller_load(rollers, b, motion[i], angle[i], load[i], tangent)
    return load, energy
