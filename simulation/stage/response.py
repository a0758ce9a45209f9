"""The stage run through time.

Chunks of steps, what is kept, the energy balance, and what happens when it runs away.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.contact_laws import (
    fill_mesh_stiffness,
    mesh_stiffness_at,
    mesh_stiffness_over,
    penetration_gradient,
    play_force,
    play_gradient,
    spline_energy,
    spline_force,
)
from carrierflex.simulation.stage.modal_form import (
    ModalStage,
    StepMatrices,
    grouped,
    modal_stage,
    step_matrices,
)
from carrierflex.simulation.stage.roller_contact import roller_energy, roller_gradient
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.statics import SteadyLoad, mesh_amplitudes, static_coordinates

#: Steps a mesh period that resolve it: below this the midpoint rule is 1 % off at the mesh
#: frequency.
FEWEST_STEPS_PER_MESH = 18.0
#: Kept states a chunk: progress is shown and memory bounded in between.
CHUNK = 500
#: Coordinates beyond this [m or rad] are not small motions; windings of shafts reach a few rad.
_RUN_AWAY = 1e3

#: Loads over time: time [s], shape (k,) to (k, 4): torque [N m], wanted generator speed [rad/s],
#: radial y and z [N].
Drive = Callable[[NDArray[np.float64]], NDArray[np.float64]]


#: Change of the channels' motion over a step with which Newton's method ends [m]: it leaves less
#: than a thousandth, 1e-8 of a loaded mesh's approach.
_CONVERGED = 1e-9
#: Share of the largest motion over a step that rounding may leave; matters where a run is about to
#: run away.
_ROUNDING = 1e-11
_MOST_ITERATIONS = 60
#: Newton's steps are halved from here on: whoever has not arrived by now goes to and fro between
#: pieces of a contact law.
_HALVED_FROM = 16
#: Newton's equations are solved by the inverse of an earlier step's matrix, refined until the last
#: refinement is this share of the change, and by a new inverse where one takes less of the error
#: than a refinement must.
_REFINED, _SLOW, _MOST_REFINEMENTS = 1e-3, 0.2, 4
#: First channels: the carrier angle, then the flanks.
_FLANKS = 1


@dataclass(frozen=True, eq=False)
class StageRecord:
    """States of the stage at N kept instants.

    Parameters
    ----------
    time : ndarray, shape (N,)
        [s].
    c, c_rate : ndarray, shape (N, n)
        Coordinates of :class:`StageModel` and their rates; the first is the carrier angle.
    drive : ndarray, shape (N, 4)
        Loads at those instants.
    energy : ndarray, shape (N, 6)
        Since the start [J]: from torque, from generator, from weight, radial load and constant
        forces, from the mount beyond its turning mean, dissipated, stored.
    """

    time: NDArray[np.float64]
    c: NDArray[np.float64]
    c_rate: NDArray[np.float64]
    drive: NDArray[np.float64]
    energy: NDArray[np.float64]

    @property
    def imbalance(self) -> NDArray[np.float64]:
        """Input less dissipated less stored [J], shape (N,)."""
        return np.asarray(self.energy[:, :4].sum(axis=1) - self.energy[:, 4] - self.energy[:, 5])


class StageDivergedError(RuntimeError):
    """A run that left the range of small motions.

    Parameters
    ----------
    time : float
        Where it did [s].
    coordinate : str
        The coordinate that did, in words.
    settled : bool
        False where the contact forces of a step found no balance while the motions were still
        small.
    """

    def __init__(self, time: float, coordinate: str, *, settled: bool = True) -> None:
        what = (
            "the run left the range of small motions"
            if settled
            else "the contact forces found no balance"
        )
        super().__init__(
            f"{what} at t = {time:.6g} s in '{coordinate}'; use a smaller step, or smaller loads"
        )
        self.time = time
        self.coordinate = coordinate
        self.settled = settled

    def __reduce__(self) -> tuple[Any, ...]:
        """What another process makes it of."""
        return partial(StageDivergedError, settled=self.settled), (self.time, self.coordinate)


def steady_drive(model: StageModel, load: SteadyLoad) -> Drive:
    """Drive of a steady load whose mean speed is the model's.

    The generator's set speed follows from the paper's eq. 9.
    """
    wanted = model.data.ratio * model.speed - load.torque / (
        model.data.ratio * model.data.chain.generator_constant
    )
    row = np.array([load.torque, wanted, load.ntl_y, load.ntl_z])
    return lambda time: np.tile(row, (len(time), 1))


def quasi_static_start(
    model: StageModel, load: SteadyLoad
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coordinates and rates of the static answer as the carrier turns.

    Little is left to ring down, shapes (n,).
    """
    turn = 1e-4
    before, here, after = (static_coordinates(model, load, angle) for angle in (-turn, 0.0, turn))
    rate = (after - before) / (2.0 * turn) * model.speed
    rate[0] = model.speed
    return here, rate


def run_stage(
    model: StageModel,
    drive: Drive,
    start: tuple[NDArray[np.float64], NDArray[np.float64]],
    *,
    duration: float,
    sample_rate: float,
    step: float,
    gravity: float = 9.81,
) -> Iterator[StageRecord]:
    """Records of a run, chunk by chunk; the first kept instant is one sample after the start.

    Parameters
    ----------
    model : StageModel
        The stage.
    drive : callable
        Loads over time.
    start : tuple of ndarray
        Coordinates and rates at time zero, shapes (n,).
    duration : float
        [s].
    sample_rate : float
        Kept states a second [1/s].
    step : float
        Longest step [s]; the one used divides the sample interval.
    gravity : float
        [m/s^2].

    Yields
    ------
    StageRecord
        Up to `CHUNK` instants.

    Raises
    ------
    ValueError
        Before the run, where the step does not resolve the mesh frequency or a load is not finite.
    StageDivergedError
        Where a coordinate runs away; the records until then have been yielded.
    """
    every = steps_per_sample(
        model.speed, model.channels.mesh_teeth, sample_rate=sample_rate, step=step
    )
    h = 1.0 / (sample_rate * every)
    n_kept = _n_kept(duration, sample_rate)
    stage, matrices = _prepared(model, h, gravity)
    inverse = stage.Phi.T @ model.M
    q, v = np.asarray(inverse @ start[0], np.float64), np.asarray(inverse @ start[1], np.float64)
    reference = stored_energy(stage, q[None], v[None])[0]
    spent = np.zeros(5)
    for first in range(0, n_kept, CHUNK):
        count = min(CHUNK, n_kept - first)
        middles = (first * every + np.arange(count * every) + 0.5) * h
        loads = _checked(drive(np.asarray(middles, np.float64)))
        q_kept, v_kept, work, done, unsettled = _advance(
            matrices, q, v, model.channels.free, loads, every
        )
        time = (first + 1 + np.arange(len(q_kept))) / sample_rate
        stored = stored_energy(stage, q_kept, v_kept) - reference
        energy = np.concatenate([spent + work, stored[:, None]], axis=1)
        c = q_kept @ stage.Phi.T
        runaway = np.flatnonzero(~(np.abs(c[:, 1:]) < _RUN_AWAY).all(axis=1))
        kept = runaway[0] if len(runaway) else len(c)
        if kept:
            instants = _checked(drive(time[:kept]))
            yield StageRecord(
                time[:kept], c[:kept], v_kept[:kept] @ stage.Phi.T, instants, energy[:kept]
            )
        if kept < count:
            if kept < len(c):
                raise StageDivergedError(time[kept], _largest(model, c[kept]))
            raise _diverged(model, stage.Phi @ q, (first * every + done) * h, unsettled)
        spent = spent + work[-1]


@lru_cache(maxsize=1)
def _prepared(model: StageModel, h: float, gravity: float) -> tuple[ModalStage, StepMatrices]:
    """Modes, group by group, and step of the model that ran last, which its load cases share."""
    stage = grouped(modal_stage(model))
    return stage, step_matrices(stage, h, gravity)


def _n_kept(duration: float, sample_rate: float) -> int:
    n_kept = round(duration * sample_rate)
    if n_kept < 1:
        raise ValueError(
            f"duration {duration} s at {sample_rate} samples a second contains no sample; "
            "expected one or more"
        )
    return n_kept


def steps_per_sample(speed: float, mesh_teeth: int, *, sample_rate: float, step: float) -> int:
    """Steps between kept instants, the longest that are at most `step` [s].

    Raises
    ------
    ValueError
        Where the step does not resolve the mesh frequency of a carrier at `speed` [rad/s] with
        `mesh_teeth` meshes a turn.
    """
    if not (sample_rate > 0.0 and step > 0.0):
        raise ValueError(f"sample rate {sample_rate} 1/s and step {step} s must be positive")
    period = 2.0 * np.pi / (abs(speed) * mesh_teeth) if speed != 0.0 else np.inf
    if step > period / FEWEST_STEPS_PER_MESH:
        raise ValueError(
            f"step is {step} s, too large for the mesh period of {period:.4g} s; expected at most "
            f"{period / FEWEST_STEPS_PER_MESH:.4g} s"
        )
    return max(1, int(np.ceil(1.0 / (sample_rate * step) - 1e-9)))


def _checked(drive: NDArray[np.float64]) -> NDArray[np.float64]:
    if not np.isfinite(drive).all():
        column = int(np.argwhere(~np.isfinite(drive))[0, 1])
        name = ("torque", "generator speed", "ntl_y", "ntl_z")[column]
        raise ValueError(f"{name} is not finite; expected finite loads at every instant")
    return drive


def _diverged(
    model: StageModel, c: NDArray[np.float64], time: float, unsettled: int
) -> StageDivergedError:
    """Error of a step that failed.

    The coordinate that is far off, or the channel whose force found no balance.
    """
    if unsettled < 0 or not (np.abs(c[1:]) < _RUN_AWAY).all():
        return StageDivergedError(time, _largest(model, c))
    return StageDivergedError(time, model.channels.labels[unsettled], settled=False)


def _largest(model: StageModel, c: NDArray[np.float64]) -> str:
    size = np.abs(c[1:])
    return model.labels[1 + int(np.argmax(np.where(np.isfinite(size), size, np.inf)))]


def stored_energy(
    stage: ModalStage, q: NDArray[np.float64], v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Kinetic and elastic energy in the carrier frame [J], shape (N,).

    Of modal states of shape (N, n).
    """
    channels = stage.model.channels
    energy = 0.5 * (v**2).sum(axis=1) + 0.5 * ((stage.omega * q) ** 2).sum(axis=1)
    delta = q @ (stage.Phi.T @ channels.B) - channels.free
    # What the linear part holds of the channels goes, what they hold themselves comes.
    linear = channels.reference[: channels.housing.start]
    energy -= 0.5 * (linear * delta[:, : channels.housing.start] ** 2).sum(axis=1)
    real, imag = mesh_amplitudes(channels)
    penetration = np.maximum(delta[:, channels.meshes] - channels.gaps, 0.0)
    k = mesh_stiffness_over(real, imag, channels.mesh_teeth * delta[:, 0])
    energy += 0.5 * (channels.of_flanks(k) * penetration**2).sum(axis=1)
    for i, clearance in enumerate(channels.clearance):
        channel = channels.clearances.start + 2 * i
        for instant, (y, z) in enumerate(delta[:, channel : channel + 2]):
            contact = play_force(y, z, clearance)[2]
            energy[instant] += channels.reference[channel] * (contact - 0.5 * (y * y + z * z))
    rolling = delta[:, channels.rolling]
    energy -= 0.5 * (channels.reference[channels.rolling] * rolling**2).sum(axis=1)
    for b in range(len(channels.rollers.directions)):
        for instant, angle in enumerate(delta[:, 0]):
            energy[instant] += roller_energy(
                channels.rollers, b, rolling[instant, 4 * b : 4 * b + 4], angle
            )
    for i, (stiffness, clearance, friction) in enumerate(channels.splines):
        twist = channels.rubbing.start + 3 * i
        for instant, (twisted, y, z) in enumerate(delta[:, twist : twist + 3]):
            energy[instant] += spline_energy(y, z, stiffness, clearance, friction * abs(twisted))
    return energy


def joined_records(records: list[StageRecord]) -> StageRecord:
    """One record from consecutive ones."""
    names = ("time", "c", "c_rate", "drive", "energy")
    return StageRecord(
        *(np.concatenate([getattr(record, name) for record in records]) for name in names)
    )


@numba.njit(cache=True, fastmath={"contract"})
def _add_product(
    factor: float,
    columns: NDArray[np.float64],
    x: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """``out += factor * matrix @ x`` of a matrix given by columns: vectorised."""
    for j in range(len(x)):
        share = factor * x[j]
        for i in range(len(out)):
            out[i] += share * columns[j, i]


@numba.njit(cache=True, fastmath={"contract"})
def _turned(series: NDArray[np.float64], angle: float, out: NDArray[np.float64]) -> None:
    """Sum of a matrix's series at a carrier angle."""
    c, s = np.cos(angle), np.sin(angle)
    c_2, s_2 = c * c - s * s, 2.0 * c * s
    for i in range(len(out)):
        for j in range(len(out)):
            out[i, j] = (
                series[0, i, j]
                + c * series[1, i, j]
                + s * series[2, i, j]
                + c_2 * series[3, i, j]
                + s_2 * series[4, i, j]
            )


@numba.njit(cache=True)
def _flanks(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    teeth: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the flanks."""
    old_k, mid_k, new_k = teeth
    turned = k.h * s[0]
    if abs(turned) <= 1e-12:
        turned = np.inf
    force[0] = 0.0
    for j in range(len(k.gaps)):
        i = j % len(mid_k)
        channel, share = _FLANKS + j, k.shares[j]
        stiffness = share * mid_k[i]
        old = delta[channel] - k.gaps[j]
        new = old + k.h * s[channel]
        mean, slope = penetration_gradient(old, new)
        force[channel] = (
            k.reference[channel] * (delta[channel] + 0.5 * k.h * s[channel]) - stiffness * mean
        )
        tangent[channel, channel] = k.h * (0.5 * k.reference[channel] - stiffness * slope)
        old, new = max(old, 0.0), max(new, 0.0)
        rise, risen = new_k[i] - mid_k[i], mid_k[i] - old_k[i]
        force[0] -= 0.5 * share * (rise * new * new + risen * old * old) / turned
        # The drive and the flanks turn each other's stiffness.
        tangent[0, channel] = -k.h * share * rise * new / turned
        tangent[channel, 0] = -0.5 * k.h * share * (rise + risen) * mean / turned


@numba.njit(cache=True)
def _clearances(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the bearings with clearance."""
    for i in range(len(k.clearance)):
        y = _FLANKS + len(k.gaps) + k.K_turning.shape[1] + 2 * i
        z = y + 1
        stiffness = k.reference[y]
        new_y, new_z = delta[y] + k.h * s[y], delta[z] + k.h * s[z]
        fy, fz, yy, yz, zy, zz = play_gradient(delta[y], delta[z], new_y, new_z, k.clearance[i])
        force[y] = stiffness * (0.5 * (delta[y] + new_y) - fy)
        force[z] = stiffness * (0.5 * (delta[z] + new_z) - fz)
        scale = k.h * stiffness
        tangent[y, y], tangent[y, z] = scale * (0.5 - yy), -scale * yz
        tangent[z, y], tangent[z, z] = -scale * zy, scale * (0.5 - zz)


@numba.njit(cache=True)
def _rollers(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    stored: NDArray[np.float64],
    by_angle: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the roller bearings, and the torque of each on the drive."""
    first = _first_roller(k)
    old, new, gradient, stiffness = np.empty(4), np.empty(4), np.empty(4), np.empty((4, 4))
    angles = (delta[0], delta[0] + k.h * s[0])
    for b in range(len(stored)):
        for i in range(4):
            old[i] = delta[first + i]
            new[i] = old[i] + k.h * s[first + i]
        by_angle[b] = roller_gradient(
            k.rollers, b, (old, new), angles, stored[b], gradient, stiffness
        )
        force[0] -= by_angle[b]
        for i in range(4):
            closed = k.reference[first + i]
            force[first + i] = closed * 0.5 * (old[i] + new[i]) - gradient[i]
            for j in range(4):
                tangent[first + i, first + j] = -0.5 * k.h * stiffness[i, j]
            tangent[first + i, first + i] += 0.5 * k.h * closed
        first += 4


@numba.njit(cache=True)
def _first_roller(k: StepMatrices) -> int:
    """First channel of the roller bearings."""
    return _FLANKS + len(k.gaps) + k.K_turning.shape[1] + 2 * len(k.clearance)


@numba.njit(cache=True)
def _add_roller_work(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    by_angle: NDArray[np.float64],
    stored: NDArray[np.float64],
) -> None:
    """Energy of every roller bearing after the step: what its forces' work adds [J]."""
    first = _first_roller(k)
    for b in range(len(stored)):
        stored[b] += k.h * by_angle[b] * s[0]
        for channel in range(first, first + 4):
            moved = k.h * s[channel]
            linear = k.reference[channel] * (delta[channel] + 0.5 * moved)
            stored[b] += (linear - force[channel]) * moved
        first += 4


@numba.njit(cache=True)
def _splines(
    k: StepMatrices,
    s: NDArray[np.float64],
    delta: NDArray[np.float64],
    force: NDArray[np.float64],
    tangent: NDArray[np.float64],
) -> None:
    """Force and tangent of the sun's spline at the middle of the step."""
    for i in range(len(k.splines)):
        twist = len(delta) - 3 * (len(k.splines) - i)
        stiffness, clearance, friction = k.splines[i]
        middle = delta[twist : twist + 3] + 0.5 * k.h * s[twist : twist + 3]
        y, z = middle[1], middle[2]
        limit = friction * abs(middle[0])
        fy, fz, yy, yz, zy, zz, y_L, z_L = spline_force(y, z, stiffness, clearance, limit)
        force[twist + 1] = stiffness * y - fy
        force[twist + 2] = stiffness * z - fz
        scale = 0.5 * k.h
        by_twist = scale * friction * np.sign(middle[0])
        tangent[twist + 1, twist], tangent[twist + 2, twist] = -y_L * by_twist, -z_L * by_twist
        tangent[twist + 1, twist + 1], tangent[twist + 1, twist + 2] = (
            scale * (stiffness - yy),
            -scale * yz,
        )
        tangent[twist + 2, twist + 1], tangent[twist + 2, twist + 2] = (
            -scale * zy,
            scale * (stiffness - zz),
        )


@numba.njit(cache=True)
def _quill_energies(k: StepMatrices, delta: NDArray[np.float64]) -> float:
    """Energy of the sun's quill beyond the linear part's [J]."""
    energy = 0.0
    for i in range(len(k.splines)):
        twist = len(delta) - 3 * (len(k.splines) - i)
        stiffness, clearance, friction = k.splines[i]
        y, z = delta[twist + 1], delta[twist + 2]
        energy += spline_energy(y, z, stiffness, clearance, friction * abs(delta[twist]))
    return energy


@numba.njit(cache=True)
def _roller_energies(k: StepMatrices, delta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Energy of every roller bearing [J]."""
    energy = np.zeros(len(k.rollers.directions))
    for b in range(len(energy)):
        first = _first_roller(k) + 4 * b
        energy[b] = roller_energy(k.rollers, b, delta[first : first + 4], delta[0])
    return energy


@numba.njit(cache=True)
def _newton_matrix(k: StepMatrices, tangent: NDArray[np.float64]) -> NDArray[np.float64]:
    """``1 - W tangent`` by columns, shape (m, m)."""
    columns = np.eye(len(tangent))
    for first, size in k.blocks:
        for i in range(first, first + size):
            for j in range(first, first + size):
                if tangent[i, j] != 0.0:
                    columns[j] -= tangent[i, j] * k.W_columns[i]
    return columns


@numba.njit(cache=True)
def _subtract_tangent(
    k: StepMatrices,
    tangent: NDArray[np.float64],
    change: NDArray[np.float64],
    force: NDArray[np.float64],
) -> None:
    """Take what a change of velocities makes of the forces from them."""
    for first, size in k.blocks:
        for i in range(first, first + size):
            for j in range(first, first + size):
                force[i] -= tangent[i, j] * change[j]


@numba.njit(cache=True)
def _largest_size(x: NDArray[np.float64]) -> float:
    """Largest absolute value."""
    largest = 0.0
    for value in x:
        largest = max(largest, abs(value))
    return largest


@numba.njit(cache=True)
def _newton_step(
    k: StepMatrices,
    tangent: NDArray[np.float64],
    residual: NDArray[np.float64],
    inverse: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Change of the velocities, ``(1 - W tangent) change = residual``.

    By `inverse`, that of an earlier such matrix by columns, which is changed where it is made anew.
    """
    m = len(residual)
    change, defect = np.zeros(m), np.empty(m)
    lost, rest = np.empty(m), np.empty(m)
    _add_product(1.0, inverse, residual, change)
    largest = _largest_size(change)
    size = largest
    for _ in range(_MOST_REFINEMENTS):
        lost[:] = 0.0
        _subtract_tangent(k, tangent, change, lost)
        for i in range(m):
            defect[i] = residual[i] - change[i]
        _add_product(-1.0, k.W_columns, lost, defect)
        rest[:] = 0.0
        _add_product(1.0, inverse, defect, rest)
        before, size = size, _largest_size(rest)
        if size > _SLOW * before:
            break
        for i in range(m):
            change[i] += rest[i]
        if size <= _REFINED * largest:
            return change
    inverse[:] = np.linalg.inv(_newton_matrix(k, tangent))
    change[:] = 0.0
    _add_product(1.0, inverse, residual, change)
    return change


@numba.njit(cache=True)
def _solve_channels(
    k: StepMatrices,
    s_free: NDArray[np.float64],
    delta: NDArray[np.float64],
    old_k: NDArray[np.float64],
    stored: NDArray[np.float64],
    force: NDArray[np.float64],
    inverse: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Mid-step velocities of the channels, and the meshes' new stiffness.

    `stored` is the energy of every roller bearing, `inverse` as in :func:`_newton_step`; both
    change.
    """
    m = len(s_free)
    s = s_free.copy()
    _add_product(1.0, k.W_columns, force, s)
    tangent, residual = np.zeros((m, m)), np.empty(m)
    angle = delta[0]
    first = _FLANKS + len(k.gaps)
    n_turning = k.K_turning.shape[1]
    K, mount = np.empty((n_turning, n_turning)), np.empty((n_turning, n_turning))
    _turned(k.K_turning, angle + 0.5 * k.h * s_free[0], K)
    _turned(k.C_turning, angle + 0.5 * k.h * s_free[0], mount)
    steady = np.zeros(n_turning)
    for i in range(n_turning):
        for j in range(n_turning):
            mount[i, j] += 0.5 * k.h * K[i, j]
            tangent[first + i, first + j] = -mount[i, j]
            steady[i] -= K[i, j] * delta[first + j]
    mid_k, new_k = np.empty_like(old_k), np.empty_like(old_k)
    by_angle = np.zeros(len(stored))
    rounding = _ROUNDING * k.h * _largest_size(s)
    change = residual
    for iteration in range(_MOST_ITERATIONS):
        fill_mesh_stiffness(k.real, k.imag, k.mesh_teeth * (angle + 0.5 * k.h * s[0]), mid_k)
        fill_mesh_stiffness(k.real, k.imag, k.mesh_teeth * (angle + k.h * s[0]), new_k)
        _flanks(k, s, delta, (old_k, mid_k, new_k), force, tangent)
        for i in range(n_turning):
            force[first + i] = steady[i]
            for j in range(n_turning):
                force[first + i] -= mount[i, j] * s[first + j]
        _clearances(k, s, delta, force, tangent)
        # A call costs more than the loop over nothing in it.
        if len(stored):
            _rollers(k, s, delta, stored, by_angle, force, tangent)
        if len(k.splines):
            _splines(k, s, delta, force, tangent)
        for i in range(m):
            residual[i] = s[i] - s_free[i]
        _add_product(-1.0, k.W_columns, force, residual)
        if not np.isfinite(residual).all():
            return s, new_k, int(np.argmin(np.isfinite(residual)))
        change = _newton_step(k, tangent, residual, inverse)
        largest = _largest_size(change)
        if iteration >= _HALVED_FROM and largest * k.h > _CONVERGED:
            change *= 0.5
        # Forces of the new velocities but for a second-order rest, and in balance with them to
        # rounding.
        _subtract_tangent(k, tangent, change, force)
        for i in range(m):
            s[i] -= change[i]
        if not np.isfinite(largest):
            return s, new_k, int(np.argmin(np.isfinite(change)))
        if largest * k.h <= _CONVERGED + rounding:
            if len(stored):
                _add_roller_work(k, s, delta, force, by_angle, stored)
            return s, new_k, -1
    return s, new_k, int(np.argmax(np.abs(change)))


@numba.njit(cache=True)
def _advance(
    k: StepMatrices,
    q: NDArray[np.float64],
    v: NDArray[np.float64],
    free: NDArray[np.float64],
    drive: NDArray[np.float64],
    every: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], int, int]:
    """Advance by ``len(drive)`` steps, keeping every `every`-th state."""
    n_kept = len(drive) // every
    q_kept = np.zeros((n_kept, len(q)))
    v_kept = np.zeros((n_kept, len(q)))
    work = np.zeros((n_kept, 5))
    delta = k.B @ q - free
    total = np.zeros(5)
    a = np.ones(len(k.P))
    rates = np.empty(len(k.P))
    known, free_w, w = np.empty(len(q)), np.empty(len(q)), np.empty(len(q))
    s_free = np.empty(len(delta))
    force, before = np.zeros(len(delta)), np.zeros(len(delta))
    inverse = np.eye(len(delta))
    first = _FLANKS + len(k.gaps)
    stiffness = mesh_stiffness_at(k.real, k.imag, k.mesh_teeth * delta[0])
    stored = _roller_energies(k, delta)
    speed = k.B[0] @ v
    for step in range(len(drive)):
        middle = delta[0] + 0.5 * k.h * speed
        c, s_ = np.cos(middle), np.sin(middle)
        a[0], a[1] = drive[step, 0], k.generator_constant * drive[step, 1]
        a[2], a[3] = -k.gravity * s_, -k.gravity * c
        a[4] = c * drive[step, 2] + s_ * drive[step, 3]
        a[5] = c * drive[step, 3] - s_ * drive[step, 2]
        for i in range(len(q)):
            known[i] = (2.0 / k.h) * v[i] - k.stiffness[i] * q[i]
        _add_product(1.0, k.P, a, known)
        packed = 0
        for first_mode, size in k.groups:
            modes = slice(first_mode, first_mode + size)
            block = k.A_inverse[packed : packed + size * size].reshape(size, size)
            np.dot(block, known[modes], free_w[modes])
            packed += size * size
        np.dot(k.B, free_w, s_free)
        for i in range(len(force)):
            force[i], before[i] = 2.0 * force[i] - before[i], force[i]
        s, stiffness, unsettled = _solve_channels(
            k, s_free, delta, stiffness, stored, force, inverse
        )
        w[:] = free_w
        _add_product(1.0, k.A_inverse_B, force, w)
        if unsettled >= 0 or not np.isfinite(w).all():
            return (
                q_kept[: step // every],
                v_kept[: step // every],
                work[: step // every],
                step,
                unsettled,
            )
        np.dot(k.P, w, rates)
        total[0] += k.h * a[0] * rates[0]
        total[1] += k.h * (a[1] - k.generator_constant * rates[1]) * rates[1]
        for i in range(2, len(a)):
            total[2] += k.h * a[i] * rates[i]
        for i in range(len(k.C_mean)):
            total[3] += k.h * force[first + i] * s[first + i]
            for j in range(len(k.C_mean)):
                total[4] += k.h * s[first + i] * k.C_mean[i, j] * s[first + j]
        if len(k.splines):
            # What a spline takes and its quill does not store, friction dissipates.
            rubbing = slice(len(delta) - 3 * len(k.splines), len(delta))
            total[4] -= k.h * (force[rubbing] @ s[rubbing])
            total[4] -= _quill_energies(k, delta + k.h * s) - _quill_energies(k, delta)
        lost = 0.0
        for i in range(len(q)):
            lost += k.structural[i] * w[i] * w[i]
            q[i] += k.h * w[i]
            v[i] = 2.0 * w[i] - v[i]
        total[4] += k.h * lost
        speed = 2.0 * s[0] - speed
        for i in range(len(delta)):
            delta[i] += k.h * s[i]
        if (step + 1) % every == 0:
            kept = step // every
            q_kept[kept] = q
            v_kept[kept] = v
            work[kept] = total
    return q_kept, v_kept, work, len(drive), -1
