"""Statics of the stage condensed to the few connections whose stiffness nobody published.

Every equilibrium of :func:`carrierflex.simulation.stage.statics.static_coordinates` is linear but
for carrier bearings, sun and mount. What lies between them is eliminated once, so that a turn of
the paper's four load cases takes a millisecond and a posterior can be sampled:

    ``delta = D f + W lambda``,   ``lambda = k_ref delta - F(delta)``

in the fixed frame, channels: both carrier bearings' y and z, the sun's y and z, each slice of the
teeth, which may part, six motions of the housing. Planets sit on springs without clearance.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numba
import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.stage.contact_laws import play_force, play_stiffness, spline_force
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.part_loads import part_loads, spring_load
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader, sensor_signals
from carrierflex.simulation.stage.response import StageRecord
from carrierflex.simulation.stage.springs import mount_matrices
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import StageModel, stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, linear_statics, turning_force

#: Radial clearance of the sun's spline where it rubs [m], never used up.
SPLINE_CLEARANCE = 0.3e-3
#: Pattern of the pins' position errors: the drawing's tolerance, one pin against two.
PIN_PATTERN = (1.0, -1.0, -1.0)
#: Stiffness that the linear part has at bearings and sun [N/m].
_REFERENCE = 1e9
#: As in the stage's statics.
_MOST_STEPS, _FLOATING, _CUT_SHORT, _LONGEST_STEP = 200, 1e-3, 0.5, 1e4
_CONVERGED, _BISECTIONS = 1e-8, 60


@dataclass(frozen=True)
class Supports:
    """What a hypothesis varies inside the stage; SI units."""

    phi_PLC: float = 0.0
    theta_PLC: float = 0.0
    upwind_radial: float = BearingData.upwind_radial
    downwind_radial: float = BearingData.downwind_radial
    clearance: float = 1.0
    """Share of the published clearances."""
    x: float = MountingData.x
    axial_stiffness: float = MountingData.axial_stiffness
    tilt_stiffness: float = MountingData.tilt_stiffness
    sun_radial: float = BearingData.sun_radial
    sun_friction: float = BearingData.sun_friction
    pin_offset: float = 0.0
    """Size of `PIN_PATTERN` [m]."""
    n_slices: int = 2
    """Slices of the teeth; 1: they do not resist tilt."""


#: Half the diametral clearances of the two carrier bearings (GRC) [m].
PUBLISHED_CLEARANCE = (0.1375e-3, 0.1225e-3)


def stage_data(supports: Supports) -> StageData:
    """Data of the stage with these supports, for the stage itself."""
    s = supports
    upwind, downwind = PUBLISHED_CLEARANCE
    return StageData(
        mesh=MeshData(n_slices=s.n_slices),
        bearings=BearingData(
            upwind_radial=s.upwind_radial,
            downwind_radial=s.downwind_radial,
            upwind_clearance=s.clearance * upwind,
            downwind_clearance=s.clearance * downwind,
            sun_radial=s.sun_radial,
            sun_friction=s.sun_friction,
            sun_clearance=SPLINE_CLEARANCE if s.sun_friction > 0.0 else 0.0,
        ),
        mounting=MountingData(
            x=s.x, axial_stiffness=s.axial_stiffness, tilt_stiffness=s.tilt_stiffness
        ),
    )


def stage_effects(supports: Supports) -> StageEffects:
    """Kink and pins of the stage with these supports."""
    return StageEffects(
        phi_PLC=supports.phi_PLC,
        theta_PLC=supports.theta_PLC,
        pin_offset=tuple(supports.pin_offset * sign for sign in PIN_PATTERN),
    )


def outputs(
    model: StageModel, record: StageRecord, sensors: Sequence[Sensor]
) -> NDArray[np.float64]:
    """What is compared or predicted, shape (N, 2 n_sensors + 14).

    Sensors on the housing, the same on the ground [m]; radial and tangential force of the pins
    [N], moments about the same directions [N m], planet by planet; force of the shaft on its main
    bearing along y and z of the carrier frame [N].
    """
    reader = rim_reader(model)
    signals = [
        sensor_signals(
            model, record, sensors, effects=ReadingEffects(reference=reference), reader=reader
        )[sensor.name]
        for reference in ("housing", "ground")
        for sensor in sensors
    ]
    loads = part_loads(model, record.c)
    across = np.concatenate([loads.pin_force[:, :, 1:], loads.pin_moment[:, :, 1:]], axis=2)
    main = spring_load(model, "main_bearing", record.c)[:, 1:3]
    return np.column_stack([*signals, across.reshape(len(record.c), -1), main])


@dataclass(frozen=True, eq=False)
class CondensedStage:
    """The stage seen by its unpublished connections, at A carrier angles in the fixed frame.

    Load columns: torque, weight, vertical radial load, kink about the carrier's y and z, pattern of
    the pins.

    Parameters
    ----------
    angles : ndarray, shape (A,)
        Carrier angles of a turn [rad].
    W : ndarray, shape (A, n + 6, n + 6)
        Motion of the channels by unit channel forces.
    D : ndarray, shape (A, n + 6, 6)
        Motion of the channels by unit loads.
    C : ndarray, shape (A, n_outputs, n + 12)
        Outputs by unit channel forces and unit loads.
    K_mean : ndarray, shape (6, 6)
        Stiffness of the mount that the linear part has.
    reference : ndarray, shape (n,)
        Stiffness of the other channels that it has [N/m].
    teeth : ndarray, shape (n - 6, 2)
        Stiffness [N/m] and gap [m] of every slice of drive and coast flanks.
    data : StageData
        The stage.
    """

    angles: NDArray[np.float64]
    W: NDArray[np.float64]
    D: NDArray[np.float64]
    C: NDArray[np.float64]
    K_mean: NDArray[np.float64]
    reference: NDArray[np.float64]
    teeth: NDArray[np.float64]
    data: StageData

    def turn(self, supports: Supports, loads: Sequence[SteadyLoad]) -> NDArray[np.float64]:
        """Outputs over a turn, shape (n_loads, A, n_outputs); NaN where contact does not settle.

        Parameters
        ----------
        supports : Supports
            Connections, kink and pins.
        loads : sequence of SteadyLoad
            Loads; the horizontal one is left out.
        """
        s, data = supports, self.data
        mounting = replace(
            data.mounting,
            x=s.x,
            axial_stiffness=s.axial_stiffness,
            tilt_stiffness=s.tilt_stiffness,
        )
        K, _ = mount_matrices(mounting, np.array([data.housing.x, 0.0, 0.0]))
        upwind, downwind = PUBLISHED_CLEARANCE
        laws = np.array(
            [
                [s.upwind_radial, s.clearance * upwind],
                [s.downwind_radial, s.clearance * downwind],
                [s.sun_radial, SPLINE_CLEARANCE if s.sun_friction > 0.0 else 0.0],
            ]
        )
        constant = [*stage_effects(s).misalignment, s.pin_offset]
        f = np.array([[load.torque, load.gravity, load.ntl_z, *constant] for load in loads])
        # The spline turns the sun's torque; without friction its law is the play's.
        limits = np.full(len(loads), np.inf)
        if s.sun_friction > 0.0:
            limits = (
                s.sun_friction * np.abs(f[:, 0]) / data.gear.ratio / data.bearings.spline_radius
            )
        forces = _channel_forces(
            self.W, self.D, f, self.K_mean - K, self.reference, laws, self.teeth, limits
        )
        both = np.concatenate([forces, np.broadcast_to(f[:, None], (*forces.shape[:2], 6))], axis=2)
        return np.asarray(np.einsum("aoi,lai->lao", self.C, both))


def condensed_stage(
    body: StageBody, sensors: Sequence[Sensor], n_angles: int = 12, n_slices: int = 2
) -> CondensedStage:
    """Eliminate everything of the stage but the channels.

    Parameters
    ----------
    body : StageBody
        Shaft, carrier and pins.
    sensors : sequence of Sensor
        Sensors.
    n_angles : int
        Carrier angles of a turn.
    n_slices : int
        Slices of the teeth over the face width.
    """
    start = Supports(upwind_radial=_REFERENCE, downwind_radial=_REFERENCE, sun_radial=_REFERENCE)
    start = replace(start, clearance=0.0, tilt_stiffness=1e5, n_slices=n_slices)
    data = stage_data(start)
    plain = stage_model(body, data, speed=0.0)
    # Rotations about y and z: theta of pi/2 and pi (StageEffects.misalignment).
    units = (
        Supports(phi_PLC=1.0, theta_PLC=0.5 * np.pi),
        Supports(phi_PLC=1.0, theta_PLC=np.pi),
        Supports(pin_offset=1.0),
    )
    changed = [
        stage_model(body, data, effects=stage_effects(effects), speed=0.0) for effects in units
    ]
    rows = [plain.springs[name].G[1:3] for name in ("upwind_seat", "downwind_seat", "sun")]
    channels, flanks = plain.channels, plain.channels.meshes
    B = np.column_stack(
        [
            (plain.L.T @ np.concatenate(rows).T)[1:],
            channels.B[1:, flanks],
            channels.B[1:, channels.housing],
        ]
    )
    reference = np.concatenate([np.full(6, _REFERENCE), channels.reference[flanks]])
    means = np.array([mesh.mean for mesh in channels.stiffness])
    teeth = np.column_stack([channels.of_flanks(means), channels.gaps])
    linear = linear_statics(plain)
    Z = linear.answer(B)
    angles = 2.0 * np.pi * np.arange(n_angles) / n_angles
    still = SteadyLoad(0.0, gravity=0.0)
    W, D, C = [], [], []
    for angle in angles:
        R = _turned(angle, len(reference))
        steady = [SteadyLoad(1.0, gravity=0.0), SteadyLoad(0.0, gravity=1.0)]
        steady.append(SteadyLoad(0.0, ntl_z=1.0, gravity=0.0))
        f = [turning_force(plain, load, angle)[1:] for load in steady]
        f += [turning_force(model, still, angle)[1:] for model in changed]
        y = linear.answer(np.stack(f, axis=1))
        W.append(R @ (B.T @ Z) @ R.T)
        D.append(R @ (B.T @ y))
        answers = [outputs(plain, _record(angle, np.column_stack([Z @ R.T, y[:, :3]])), sensors)]
        answers += [
            outputs(model, _record(angle, y[:, 3 + i : 4 + i]), sensors)
            for i, model in enumerate(changed)
        ]
        C.append(np.concatenate(answers).T)
    return CondensedStage(
        angles, np.array(W), np.array(D), np.array(C), plain.channels.K_mean, reference, teeth, data
    )


def _record(angle: float, y: NDArray[np.float64]) -> StageRecord:
    """Record whose instants are the columns of y, all at one carrier angle."""
    c = np.column_stack([np.full(y.shape[1], angle), y.T])
    n = len(c)
    return StageRecord(np.zeros(n), c, np.zeros_like(c), np.zeros((n, 4)), np.zeros((n, 6)))


def _turned(angle: float, n: int) -> NDArray[np.float64]:
    """Matrix that takes the channels' motions from the carrier to the fixed frame.

    Of n channels before the housing's; teeth have a number each, the same in both frames.
    """
    R = np.eye(n + 6)
    for y in (0, 2, 4, n + 1, n + 4):
        c, s = np.cos(angle), np.sin(angle)
        R[y : y + 2, y : y + 2] = [[c, -s], [s, c]]
    return R


@numba.njit(cache=True)
def _contact(
    delta: NDArray[np.float64],
    reference: NDArray[np.float64],
    laws: NDArray[np.float64],
    teeth: NDArray[np.float64],
    limit: float,
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Forces of both bearings, the sun and the teeth beyond the linear part, and their tangent."""
    for i in range(3):
        y, z, closed = delta[2 * i], delta[2 * i + 1], reference[2 * i]
        k, clearance = laws[i]
        if i == 2 and np.isfinite(limit):
            fy, fz, yy, yz, zy, zz, _, _ = spline_force(y, z, k, clearance, limit)
        else:
            fy, fz, _ = play_force(y, z, clearance)
            yy, yz, zz = play_stiffness(y, z, clearance)
            fy, fz, yy, yz, zy, zz = k * fy, k * fz, k * yy, k * yz, k * yz, k * zz
        force[2 * i], force[2 * i + 1] = closed * y - fy, closed * z - fz
        tangent[2 * i, 2 * i], tangent[2 * i, 2 * i + 1] = closed - yy, -yz
        tangent[2 * i + 1, 2 * i], tangent[2 * i + 1, 2 * i + 1] = -zy, closed - zz
    for i in range(6, len(delta)):
        k, gap = teeth[i - 6]
        k = k if delta[i] > gap else 0.0
        force[i] = reference[i] * delta[i] - k * (delta[i] - gap)
        tangent[i, i] = reference[i] - k


@numba.njit(cache=True)
def _equilibrium(
    free: NDArray[np.float64],
    W: NDArray[np.float64],
    reference: NDArray[np.float64],
    laws: NDArray[np.float64],
    teeth: NDArray[np.float64],
    limit: float,
    lambda_: NDArray[np.float64],
) -> bool:
    """Contact forces of one equilibrium, in place; whether they settled.

    Newton's method with the step along which the energy is lowest, as in the stage's statics.
    """
    n = len(free)
    force, trial, tangent, ignored = np.zeros(n), np.zeros(n), np.zeros((n, n)), np.zeros((n, n))
    added = _FLOATING
    size = np.abs(reference * free).max()
    for _ in range(_MOST_STEPS):
        delta = free + W @ lambda_
        _contact(delta, reference, laws, teeth, limit, force, tangent)
        residual = lambda_ - force
        if np.abs(residual).max() <= _CONVERGED * size:
            return True
        slope_matrix = -tangent @ W
        for i in range(n):
            slope_matrix[i] += added * reference[i] * W[i]
            slope_matrix[i, i] += 1.0
        step = -np.linalg.solve(slope_matrix, residual)
        moved = W @ step
        start, per_length = moved @ lambda_, moved @ step
        first = start - force @ moved
        low, high, length = 0.0, 1.0, 1.0
        _contact(delta + moved, reference, laws, teeth, limit, trial, ignored)
        last = start + per_length - trial @ moved
        if np.abs(last) > 0.1 * np.abs(first):
            while last < 0.0 and high < _LONGEST_STEP:
                high *= 2.0
                _contact(delta + high * moved, reference, laws, teeth, limit, trial, ignored)
                last = start + high * per_length - trial @ moved
            if last > 0.0 > first:
                for _ in range(_BISECTIONS):
                    length = 0.5 * (low + high)
                    _contact(delta + length * moved, reference, laws, teeth, limit, trial, ignored)
                    slope = start + length * per_length - trial @ moved
                    if np.abs(slope) <= 0.01 * np.abs(first):
                        break
                    if slope > 0.0:
                        high = length
                    else:
                        low = length
        lambda_ += length * step
        added = min(max(added * (10.0 if length < _CUT_SHORT else 0.03), 1e-12), 1.0)
    return False


@numba.njit(cache=True)
def _settled(
    free: NDArray[np.float64],
    W: NDArray[np.float64],
    closed: NDArray[np.float64],
    laws: NDArray[np.float64],
    teeth: NDArray[np.float64],
    limit: float,
    start: NDArray[np.float64],
) -> tuple[NDArray[np.float64], bool]:
    """Forces of bearings, sun and teeth, and whether they settled.

    Teeth join where their contact is not that of the linear part.
    """
    n = len(free)
    lambda_, forces = np.zeros(n), start.copy()
    active = np.arange(n) < 6
    while True:
        rows = np.flatnonzero(active)
        settled = _equilibrium(
            free[rows], W[rows][:, rows], closed[rows], laws, teeth[rows[6:] - 6], limit, forces
        )
        lambda_[:] = 0.0
        lambda_[rows] = forces
        unlike = ((free + W @ lambda_)[6:] > teeth[:, 1]) != (closed[6:] > 0.0)
        if not settled or not (unlike & ~active[6:]).any():
            return lambda_, settled
        active[6:] |= unlike
        forces = lambda_[active]


@numba.njit(cache=True)
def _channel_forces(
    W: NDArray[np.float64],
    D: NDArray[np.float64],
    loads: NDArray[np.float64],
    mount: NDArray[np.float64],
    reference: NDArray[np.float64],
    laws: NDArray[np.float64],
    teeth: NDArray[np.float64],
    limits: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Forces of all channels, shape (n_loads, A, n_channels); the housing's are eliminated."""
    n_loads, n_angles, n = len(loads), len(W), len(reference)
    result = np.zeros((n_loads, n_angles, n + 6))
    closed = reference.copy()
    closed[:6] = np.repeat(laws[:, 0], 2)
    more = (closed - reference)[:6]
    last = np.zeros((n_loads, 6))
    for a in range(n_angles):
        # Housing: delta_h = S (d_h + W_hn lambda_n), lambda_h = (K_mean - K) delta_h.
        S = np.linalg.inv(np.eye(6) - np.ascontiguousarray(W[a, n:, n:]) @ mount)
        to_housing = np.ascontiguousarray(W[a, n:, :n])
        through = np.ascontiguousarray(W[a, :n, n:]) @ mount @ S
        d_h = np.ascontiguousarray(D[a, n:])
        d_n = np.ascontiguousarray(D[a, :n]) + through @ d_h
        # Bearings and sun: the linear part takes their stiffness with contact closed.
        W_b = np.ascontiguousarray(W[a, :n, :6]) + through @ np.ascontiguousarray(to_housing[:, :6])
        taken = (W_b * more) @ np.linalg.inv(np.eye(6) + W_b[:6] * more)
        d_n = d_n - taken @ d_n[:6]
        W_b = W_b - taken @ W_b[:6]
        W_n = np.zeros((n, n))
        W_n[:, :6] = W_b
        # The teeth's columns, where they are needed.
        complete = False
        for i in range(n_loads):
            free = d_n @ loads[i]
            lambda_, settled = np.zeros(n), False
            lambda_[:6] = last[i]
            forces = lambda_[:6]
            settled = _equilibrium(
                free[:6], W_b[:6], closed[:6], laws, teeth[:0], limits[i], forces
            )
            touching = (free + W_b @ forces)[6:] > teeth[:, 1]
            if not settled or (touching != (closed[6:] > 0.0)).any():
                if not complete:
                    W_full = W[a, :n, :n] + through @ to_housing
                    W_n[:] = W_full - taken @ np.ascontiguousarray(W_full[:6])
                    complete = True
                lambda_, settled = _settled(free, W_n, closed, laws, teeth, limits[i], last[i])
            if not settled:
                result[i, a] = np.nan
                last[i] = 0.0
                continue
            last[i] = lambda_[:6]
            result[i, a, :n] = lambda_
            result[i, a, :6] -= more * (free[:6] + W_n[:6] @ lambda_)
            result[i, a, n:] = mount @ (S @ (d_h @ loads[i] + to_housing @ result[i, a, :n]))
    return result
