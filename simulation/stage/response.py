"""The stage run through time.

Chunks of steps, what is kept, the energy balance, and what happens when it runs away.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.stage.contact_laws import (
    mesh_stiffness_over,
    spline_energy,
)
from carrierflex.simulation.stage.march import advance
from carrierflex.simulation.stage.modal_form import (
    ModalStage,
    StepMatrices,
    grouped,
    modal_stage,
    resolved,
    step_matrices,
)
from carrierflex.simulation.stage.roller_contact import roller_loads
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.statics import (
    SteadyLoad,
    channel_forces,
    frozen_stiffness,
    mesh_amplitudes,
    static_coordinates,
)

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
    motion = stage.motion
    x, y = _start(stage, start, _checked(drive(np.zeros(1)))[0], gravity)
    reference = stored_energy(stage, x[None], y[None])[0]
    spent = np.zeros(5)
    for first in range(0, n_kept, CHUNK):
        count = min(CHUNK, n_kept - first)
        middles = (first * every + np.arange(count * every) + 0.5) * h
        loads = _checked(drive(np.asarray(middles, np.float64)))
        x_kept, y_kept, work, done, unsettled = advance(
            matrices, x, y, motion @ model.channels.B, model.channels.free, loads, every
        )
        time = (first + 1 + np.arange(len(x_kept))) / sample_rate
        stored = stored_energy(stage, x_kept, y_kept) - reference
        energy = np.concatenate([spent + work, stored[:, None]], axis=1)
        c = x_kept @ motion
        runaway = np.flatnonzero(~(np.abs(c[:, 1:]) < _RUN_AWAY).all(axis=1))
        n_bounded = runaway[0] if len(runaway) else len(c)
        if n_bounded:
            instants = _checked(drive(time[:n_bounded]))
            c_rate = y_kept[:n_bounded] @ motion
            yield StageRecord(time[:n_bounded], c[:n_bounded], c_rate, instants, energy[:n_bounded])
        if n_bounded < count:
            if n_bounded < len(c):
                raise StageDivergedError(time[n_bounded], _largest(model, c[n_bounded]))
            raise _diverged(model, x @ motion, (first * every + done) * h, unsettled)
        spent = spent + work[-1]


@lru_cache(maxsize=1)
def _prepared(model: StageModel, h: float, gravity: float) -> tuple[ModalStage, StepMatrices]:
    """Modes, group by group, and step of the model that ran last, which its load cases share."""
    stage = grouped(resolved(modal_stage(model), h))
    return stage, step_matrices(stage, h, gravity)


def _start(
    stage: ModalStage,
    start: tuple[NDArray[np.float64], NDArray[np.float64]],
    drive: NDArray[np.float64],
    gravity: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Modes and the forces on those without inertia, then the rates of both, shapes (k + m + 7,).

    Of coordinates and rates; modes without inertia begin in their answer to the forces there.
    """
    model = stage.model
    channels, to_modes = model.channels, stage.Phi.T @ model.M
    angle = float(start[0][0])
    forces, _ = channel_forces(
        channels,
        channels.B.T @ start[0] - channels.free,
        angle,
        frozen_stiffness(channels, angle),
    )
    c, s = np.cos(angle), np.sin(angle)
    torque, wanted, y, z = drive
    loads = [torque, model.data.chain.generator_constant * wanted, -gravity * s, -gravity * c]
    loads += [c * y + s * z, c * z - s * y, 1.0]
    x = np.concatenate([to_modes @ start[0], forces, loads])
    return x, np.concatenate([to_modes @ start[1], np.zeros(len(forces) + len(loads))])


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
    stage: ModalStage, x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Kinetic and elastic energy in the carrier frame [J], shape (N,).

    Of states and rates of shape (N, k + m + 7), as in :func:`_start`.
    """
    channels, k = stage.model.channels, len(stage.omega)
    energy = 0.5 * (y[:, :k] ** 2).sum(axis=1) + 0.5 * ((stage.omega * x[:, :k]) ** 2).sum(axis=1)
    energy += 0.5 * ((x[:, k:] @ stage.answer.T) ** 2).sum(axis=1)
    delta = x @ (stage.motion @ channels.B) - channels.free
    # What the linear part holds of the channels goes, what they hold themselves comes.
    linear = channels.reference[: channels.housing.start]
    energy -= 0.5 * (linear * delta[:, : channels.housing.start] ** 2).sum(axis=1)
    real, imag = mesh_amplitudes(channels)
    penetration = np.maximum(delta[:, channels.meshes] - channels.gaps, 0.0)
    stiffness = mesh_stiffness_over(real, imag, channels.mesh_teeth * delta[:, 0])
    energy += 0.5 * (channels.of_flanks(stiffness) * penetration**2).sum(axis=1)
    for i, clearance in enumerate(channels.clearance):
        channel = channels.clearances.start + 2 * i
        r = np.linalg.norm(delta[:, channel : channel + 2], axis=1)
        closed = 0.5 * channels.reference[channel]
        energy += closed * (np.maximum(r - clearance, 0.0) ** 2 - r**2)
    rolling = delta[:, channels.rolling]
    energy -= 0.5 * (channels.reference[channels.rolling] * rolling**2).sum(axis=1)
    for b in range(len(channels.rollers.directions)):
        motion = rolling[:, 4 * b : 4 * b + 4]
        energy += roller_loads(channels.rollers, b, motion, delta[:, 0])[1]
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
