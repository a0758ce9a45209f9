"""The mounting about an operating point.

Roots, frequency response of the sensors, frequencies over speed and torque.

Small motions about the rest under constant loads. A bushing shows its tangent stiffness ``K1 + 3 K3
u² + 5 K5 u⁴`` and its damping ``C1 + C3 u²`` at the deflection u that the loads (and gravity, where
it is set) give it; the fluid branch keeps its states; the elasto-plastic spring sticks, as it does
for motions below ``2 Fy / Kp`` from peak to peak.

What changes with the speed: only pitch and yaw, by the gyroscopic moment of the turning shaft. It
is left out of the simulation in time (docs/mounting_model.md gives its size); the Campbell diagram
holds it, so that the reader sees how little it does. Roll stands apart from it, and no stiffness of
this model depends on speed or angle of the shaft.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from carrierflex.reduction.state_space import Signals, StateSpace
from carrierflex.simulation.mounting.equations import Block, mounting_blocks
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray, check_parameters
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.stage.linearised import CampbellDiagram, excitation_hz
from carrierflex.simulation.stage.stage_data import StageData

Array = NDArray[np.float64]

#: Polar inertia of main shaft and planet carrier [kg m²]: figure 12 of the 2011 paper.
SHAFT_POLAR_INERTIA = 108.0

#: A root turns if its imaginary part exceeds this share of its size; below, rounding splits a
#: double real root.
_TURNS = 1e-7


@dataclass(frozen=True, eq=False)
class MountingModes:
    """Roots of the mounting about an operating point.

    Oscillating modes first, then those that creep.

    Parameters
    ----------
    names : tuple of str
        Coordinates, length n.
    roots : ndarray of complex, shape (k,)
        One root [1/s] of each oscillating pair, by ascending frequency, then the real ones from the
        slowest to the fastest.
    shape : ndarray of complex, shape (n, k)
        Coordinates of each mode, largest entry 1; in a mode of the fluid branch alone they are
        small beside it.
    """

    names: tuple[str, ...]
    roots: NDArray[np.complex128]
    shape: NDArray[np.complex128]

    @property
    def frequency_hz(self) -> Array:
        """Damped natural frequency, shape (k,); 0 where the mode creeps."""
        return np.asarray(self.roots.imag / (2.0 * np.pi), dtype=np.float64)

    @property
    def damping_ratio(self) -> Array:
        """Share of critical damping, shape (k,).

        1 where the mode creeps, negative where it grows.
        """
        return np.asarray(-self.roots.real / np.abs(self.roots), dtype=np.float64)

    @property
    def stable(self) -> bool:
        """Whether no root grows."""
        return bool((self.roots.real < 0.0).all())

    def leading_coordinates(self) -> tuple[str, ...]:
        """Coordinate that moves most in each mode (radians beside metres)."""
        return tuple(self.names[index] for index in np.abs(self.shape).argmax(axis=0))


def linearised_block(block: Block, loads: Array) -> Block:
    """Linear block of the same coordinates for small motions about the rest under `loads`.

    Parameters
    ----------
    block : Block
        With or without nonlinear elements.
    loads : ndarray, shape (3,)
        Torque [N m], ntl_y, ntl_z [N].

    Returns
    -------
    Block
        Tangent stiffness and damping, no nonlinear law.

    Raises
    ------
    ArithmeticError
        Where the bushings find no equilibrium under these loads.
    """
    return replace(
        block,
        K=block.tangent_stiffness(loads),
        C=block.tangent_damping(loads),
        law=np.zeros(5),
        preload=np.zeros(len(block.rows)),
        user_law=None,
        tables=None,
    )


def mounting_modes(
    rig: MountingRig,
    parameters: ParameterArray,
    loads: Array,
    *,
    speed: float = 0.0,
    polar_inertia: float = SHAFT_POLAR_INERTIA,
) -> MountingModes:
    """Roots and shapes of ``ẋ = A x`` about the rest under constant loads.

    Parameters
    ----------
    rig : MountingRig
        Geometry and masses.
    parameters : ndarray
        Flat parameter set.
    loads : ndarray, shape (3,)
        Torque [N m], ntl_y, ntl_z [N] of the operating point.
    speed : float
        Speed of the main shaft [rad/s]; at 0 the model is that of the simulation in time.
    polar_inertia : float
        Of what turns with the main shaft [kg m²].

    Returns
    -------
    MountingModes
        Oscillating modes by ascending frequency, then creeping ones.

    Raises
    ------
    ValueError
        Where a load or a parameter is refused.
    ArithmeticError
        Where the bushings find no equilibrium.
    """
    blocks = _linearised_blocks(rig, parameters, loads)
    roots, vectors = np.linalg.eig(_state_matrix(blocks, speed * polar_inertia))
    turning = np.abs(roots.imag) > _TURNS * np.abs(roots)
    roots = np.where(turning, roots, roots.real)
    pairs, real = np.flatnonzero(turning & (roots.imag > 0.0)), np.flatnonzero(~turning)
    order = np.concatenate(
        [pairs[np.argsort(roots[pairs].imag)], real[np.argsort(np.abs(roots[real]))]]
    )
    shape = vectors[_coordinates(blocks)][:, order]
    shape = shape / shape[np.abs(shape).argmax(axis=0), np.arange(len(order))]
    return MountingModes(blocks[0].names + blocks[1].names, roots[order], shape)


def frequency_response(
    rig: MountingRig, parameters: ParameterArray, loads: Array, frequency_hz: Array
) -> NDArray[np.complex128]:
    """Sensors per unit of each load, ``H = g T (jω - A)⁻¹ B e^{-jωτ}``, about a rest under load.

    Parameters
    ----------
    rig, parameters, loads
        As for :func:`mounting_modes`.
    frequency_hz : ndarray, shape (k,)
        Frequencies, zero or positive.

    Returns
    -------
    ndarray of complex, shape (k, 6, 3)
        Sensors in the order of ``SENSORS`` over torque [m/(N m)], ntl_y and ntl_z [m/N], with gain
        g and delay τ of the sensors.

    Raises
    ------
    ValueError
        Where a frequency is negative or not finite, or a load or a parameter is refused.
    ArithmeticError
        Where the bushings find no equilibrium.
    """
    frequency_hz = np.asarray(frequency_hz, dtype=np.float64)
    if not (np.isfinite(frequency_hz) & (frequency_hz >= 0.0)).all():
        raise ValueError(
            f"frequency response: smallest frequency is {frequency_hz.min()} Hz; "
            "expected numbers >= 0"
        )
    s = 2j * np.pi * frequency_hz
    response = np.zeros((len(s), 6, 3), dtype=np.complex128)
    for block in _linearised_blocks(rig, parameters, loads):
        A, B, _ = block.state_matrices()
        states = np.linalg.solve(s[:, None, None] * np.eye(len(A)) - A, B)
        response += block.output @ states[:, : len(block.names)]
    gains = np.array([parameters[INDEX[f"gain_{sensor}"]] for sensor in SENSORS])
    return np.asarray(
        response * gains[:, None] * np.exp(-s * parameters[INDEX["delay"]])[:, None, None]
    )


def mounting_state_space(
    rig: MountingRig, parameters: ParameterArray, loads: Array, name: str = "mounting"
) -> StateSpace:
    """The mounting about the rest under constant loads: changes of load in, of the sensors out.

    Parameters
    ----------
    rig, parameters, loads
        As for :func:`mounting_modes`.
    name : str
        Of the model.

    Returns
    -------
    StateSpace
        Inputs torque, ntl_y, ntl_z; outputs the six sensors with their gains. States are the
        coordinates, their velocities and the deflections of the fluid branches.

    Raises
    ------
    ValueError
        Where the sensors have a delay, which no model of finite order has, or a load or a parameter
        is refused.
    ArithmeticError
        Where the bushings find no equilibrium.
    """
    if parameters[INDEX["delay"]] != 0.0:
        raise ValueError(
            f"{name}: the sensors have a delay of {parameters[INDEX['delay']]:g} s, which A, B, C, "
            "D cannot hold; expected delay = 0 in [truth] of a copy of the case, and the delay in "
            "the other program"
        )
    blocks = _linearised_blocks(rig, parameters, loads)
    A, B = zip(*(block.state_matrices()[:2] for block in blocks), strict=True)
    gains = np.array([parameters[INDEX[f"gain_{sensor}"]] for sensor in SENSORS])
    C = np.hstack(
        [
            np.pad(block.output, ((0, 0), (0, len(a) - len(block.names))))
            for block, a in zip(blocks, A, strict=True)
        ]
    )
    states = [state for block in blocks for state in _block_states(block)]
    return StateSpace(
        name,
        scipy.linalg.block_diag(*A),
        np.vstack(B),
        gains[:, None] * C,
        np.zeros((len(SENSORS), 3)),
        Signals(*zip(*states, strict=True)),
        Signals(("torque", "ntl_y", "ntl_z"), ("N m", "N", "N")),
        Signals(SENSORS, ("m",) * len(SENSORS)),
        dict(zip(("torque [N m]", "ntl_y [N]", "ntl_z [N]"), loads.tolist(), strict=True)),
    )


def _block_states(block: Block) -> Iterator[tuple[str, str]]:
    """Name and unit of every state of a block."""
    units = ["rad" if name.startswith("theta") else "m" for name in block.names]
    yield from zip(block.names, units, strict=True)
    yield from ((f"d{name}/dt", f"{u}/s") for name, u in zip(block.names, units, strict=True))
    n_elements = len(block.weights)
    for number in range(len(block.state_matrices()[0]) - 2 * len(block.names)):
        element = f"of element {number % n_elements + 1} along {block.names[0]}"
        yield (f"fluid {element}", "m") if number < n_elements else (f"fluid rate {element}", "m/s")


def campbell_diagram(
    rig: MountingRig,
    parameters: ParameterArray,
    loads: Array,
    speeds: Sequence[float],
    *,
    polar_inertia: float = SHAFT_POLAR_INERTIA,
) -> CampbellDiagram:
    """Frequencies over the speed of the main shaft [rad/s], beside the lines of excitation.

    The gyroscopic moment ``J Ω`` couples pitch and yaw and drives their frequencies apart; roll,
    bearing and axial motion stay where they are. A mode that creeps at a speed has frequency 0
    there.

    Parameters
    ----------
    rig, parameters, loads, polar_inertia
        As for :func:`mounting_modes`.
    speeds : sequence of float
        Speeds of the main shaft [rad/s].

    Returns
    -------
    CampbellDiagram
        All oscillating modes; orders ``1P``, ``3P`` and ``mesh``.
    """
    points = [
        mounting_modes(rig, parameters, loads, speed=w, polar_inertia=polar_inertia) for w in speeds
    ]
    turning = [modes.frequency_hz[modes.frequency_hz > 0.0] for modes in points]
    most = max(len(row) for row in turning)
    rows = [np.concatenate([np.zeros(most - len(row)), row]) for row in turning]
    orders = excitation_hz(speeds, StageData())
    return CampbellDiagram(np.asarray(speeds, dtype=np.float64), np.array(rows), orders)


def _linearised_blocks(
    rig: MountingRig, parameters: ParameterArray, loads: Array
) -> tuple[Block, Block]:
    check_parameters(parameters)
    loads = np.asarray(loads, dtype=np.float64)
    if loads.shape != (3,) or not np.isfinite(loads).all():
        raise ValueError(
            f"operating point: torque, ntl_y, ntl_z are {loads}; expected three finite numbers"
        )
    vertical, horizontal = mounting_blocks(rig, parameters)
    return linearised_block(vertical, loads), linearised_block(horizontal, loads)


def _coordinates(blocks: tuple[Block, Block]) -> NDArray[np.intp]:
    """Places of the coordinates of both blocks in the joint state."""
    second = len(blocks[0].state_matrices()[0])
    return np.concatenate(
        [np.arange(len(blocks[0].names)), second + np.arange(len(blocks[1].names))]
    )


def _state_matrix(blocks: tuple[Block, Block], spin: float) -> Array:
    """A of both blocks, joined by the gyroscopic moment of `spin` = J Ω [N m s] about +x.

    The spin follows the tilted shaft, ``H = J Ω (1, theta_z, -theta_y)``: its rate adds ``J Ω
    θ̇_z`` to the inertia in pitch and ``-J Ω θ̇_y`` to that in yaw.
    """
    matrices = [block.state_matrices()[0] for block in blocks]
    n = len(matrices[0])
    A = np.zeros((n + len(matrices[1]), n + len(matrices[1])))
    A[:n, :n], A[n:, n:] = matrices
    pitch, yaw = blocks[0].names.index("theta_y"), blocks[1].names.index("theta_z")
    n_v, n_h = len(blocks[0].names), len(blocks[1].names)
    A[n_v : 2 * n_v, n + n_h + yaw] = -spin * np.linalg.inv(blocks[0].M)[:, pitch]
    A[n + n_h : n + 2 * n_h, n_v + pitch] = spin * np.linalg.inv(blocks[1].M)[:, yaw]
    return A
