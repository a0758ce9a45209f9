"""The housing as a rigid body, and the motion of its bushings along a run.

Coordinates ``q = (theta_x, theta_y, theta_z, b_z, b_y, d_x)``: the first three move freely on the
bushings, the baseline holds the others. ``M q'' + C q' + K q = G (T, F_y, F_z) + p`` with the
generalised forces p that the baseline lacks. On linear bushings the free motions are three
oscillators without coupling, so that a force p_i answers with ``H_i p_i``,
``H_i(s) = 1 / (M_ii s² + C_ii s + K_ii)``, exactly where p is straight between samples.

Columns are made of the measured motion, and its noise is bent with it by every curved column. The
nearest motion is therefore the baseline's prediction with that share of the gap which is clear of
the noise (Wiener: each frequency by the share of the gap in what was measured there).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import cont2discrete, lfilter

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.model import MountingModel
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.identification.campaign.signals import with_gain
from carrierflex.simulation.mounting.equations import mounting_blocks
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.parameters import INDEX
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig

#: Coordinates that move freely on the bushings; bearing and axial guide hold the rest.
N_FREE = 3
#: Compliance of a bearing that the equations are written with, so that its motion has a row.
_ANY_COMPLIANCE = 1e-7
#: Width of the bands in which gap and noise are compared [Hz].
_BAND_HZ = 0.25
#: Density of noise whose neighbours are correlated over that of white noise, at low frequencies.
_COLOURED = 3.0
#: Seconds by which a record is continued before it is filtered.
_REACH = 8.0


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Matrices of the housing on linear bushings."""

    #: M, C, K: mass, damping, stiffness; the bearing's own stiffness is not in K, shape (6, 6)
    M: FloatArray
    C: FloatArray
    K: FloatArray
    G: FloatArray  # Generalised forces of torque, ntl_y, ntl_z, shape (6, 3)
    #: Deflection of starboard and port bushing in y and in z over the coordinates, shape (2, 2, 6)
    rows: FloatArray
    output: FloatArray  # Channels over the coordinates, shape (n_channels, 6)
    #: stiffness, damping: radial stiffness and damping of each bushing
    stiffness: float
    damping: float

    @property
    def free_output(self) -> FloatArray:
        """Channels over the free coordinates, shape (n_channels, 3)."""
        return self.output[:, :N_FREE]

    @property
    def shows_motion(self) -> bool:
        """Whether the channels show every free coordinate."""
        return bool(np.linalg.matrix_rank(self.free_output) == N_FREE)

    def response(self, p: FloatArray, step: float) -> FloatArray:
        """Free coordinates [rad] that generalised forces make from rest, both (..., 3, n)."""
        motion = np.empty(p.shape)
        for i in range(N_FREE):
            force = p[..., i, :]
            numerator, denominator = _oscillator(self.M[i, i], self.C[i, i], self.K[i, i], step)
            moved = lfilter(numerator, denominator, force - force[..., :1], axis=-1)
            motion[..., i, :] = moved + force[..., :1] / self.K[i, i]
        return motion


@lru_cache(maxsize=64)
def _oscillator(M: float, C: float, K: float, step: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator of one oscillator under forces straight between samples."""
    numerator, denominator, _ = cont2discrete(([1.0], [M, C, K]), step, method="foh")
    return numerator.reshape(-1), denominator


def rigid_body(
    rig: MountingRig, sensors: tuple[str, ...], stiffness: float, damping: float
) -> RigidBody:
    """Housing on linear bushings."""
    every = replace(rig, axial_motion=True)
    values = parameter_array(
        every, {"K1": stiffness, "C1": damping, "main_bearing_compliance": _ANY_COMPLIANCE}
    )
    with_bearing = values.copy()
    with_bearing[INDEX["main_bearing_compliance"]] = _ANY_COMPLIANCE
    vertical, horizontal = mounting_blocks(every, with_bearing)
    blocks = ((vertical, (0, 1, 3)), (horizontal, (2, 4, 5)))
    M = np.zeros((6, 6))
    C = np.zeros((6, 6))
    K = np.zeros((6, 6))
    G, output = np.zeros((6, 3)), np.zeros((6, 6))
    for block, coordinates in blocks:
        index = np.ix_(coordinates, coordinates)
        M[index] = block.M
        C[index] = block.C
        K[index] = block.K
        G[list(coordinates)] = block.G
        output[:, coordinates] = block.output
    for guided in (3, 4):
        K[guided, guided] -= 1.0 / _ANY_COMPLIANCE
    rows = np.zeros((2, 2, 6))
    rows[:, 0, blocks[1][1]] = horizontal.rows[0]
    rows[:, 1, blocks[0][1]] = vertical.rows
    numbers = [SENSORS.index(sensor) for sensor in sensors]
    return RigidBody(M, C, K, G, rows, output[numbers], stiffness, damping)


@dataclass(frozen=True, eq=False)
class BushingMotion:
    """One run in the space of generalised forces."""

    record: MountingRecord  # The run
    body: RigidBody  # Housing on the linear bushings
    loads: FloatArray  # Torque, ntl_y, ntl_z, evenly sampled, shape (n, 3)
    gap: FloatArray  # Measured less baseline; NaN where nothing was measured, shape (n_channels, n)
    #: predicted, signals: signals of the linear bushings, and the nearest ones to what was
    #: measured, shape (n_channels, n)
    predicted: FloatArray
    signals: FloatArray
    #: q, rate: free coordinates from the loaded rest, and their rates, shape (3, n)
    q: FloatArray
    rate: FloatArray
    #: u, v: deflection and speed of starboard and port bushing in y and in z, shape (2, 2, n)
    u: FloatArray
    v: FloatArray

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return self.record.step

    @property
    def time(self) -> FloatArray:
        """Time from the first sample [s]."""
        return self.step * np.arange(self.loads.shape[0], dtype=np.float64)

    @property
    def block(self) -> NDArray[np.int64]:
        """Block of every sample of the even grid, shape (n,)."""
        inputs, block = self.record.inputs, self.record.block
        if inputs.uniform:
            return block
        samples = np.clip(np.searchsorted(inputs.time, inputs.grid), 0, inputs.time.size - 1)
        return np.asarray(block[samples])

    def zeroed(self, values: FloatArray) -> FloatArray:
        """Values less their mean over the samples of the zero, over the last axis."""
        first = values[..., : self.record.zeroing_samples]
        return values - first.mean(axis=-1, keepdims=True)

    def signals_of(self, p: FloatArray) -> FloatArray:
        """Signals that generalised forces on the free coordinates make, (m, n_channels, n)."""
        return np.asarray(self.body.free_output @ self.zeroed(self.body.response(p, self.step)))

    def signals_of_bushings(self, forces: FloatArray) -> FloatArray:
        """Signals that forces in the bushings make, positive against a positive deflection.

        `forces`, shape (m, 2, 2, n), are those of starboard and port bushing in y and in z.
        """
        rows = self.body.rows[:, :, :N_FREE].reshape(4, N_FREE)
        return self.signals_of(-rows.T @ forces.reshape(len(forces), 4, -1))


def bushing_motions(
    model: MountingModel, records: Sequence[MountingRecord], linear: FloatArray
) -> tuple[BushingMotion, ...]:
    """Runs with the motion of their bushings, of K1 and C1; none where no channel shows it."""
    body = rigid_body(model.rig, model.sensors, float(linear[0]), float(linear[1]))
    if not body.shows_motion:
        return ()
    bare = replace(model, contained=())
    predicted = [bare.predicted(record, (), linear, {}) for record in records]
    gaps = [
        _on_grid(record, record.measured - of_channel)
        for record, of_channel in zip(records, predicted, strict=True)
    ]
    filled = [_filled(gap) for gap in gaps]
    # By least squares, shape (3, n_channels).
    to_free = np.linalg.pinv(body.free_output)
    motions = []
    for number, record in enumerate(records):
        near = np.empty(filled[number].shape)
        for channel in range(len(near)):
            of_channel = [
                (gap[channel], other.inputs.step)
                for gap, other in zip(filled, records, strict=True)
            ]
            noise = float(np.mean([other.noise[channel] for other in records]))
            near[channel] = _nearest(of_channel, number, noise)
        base = _on_grid(record, predicted[number])
        signals = base + near
        loads = record.inputs.loads
        rest = body.G[:N_FREE] @ loads[: record.zeroing_samples].mean(axis=0)
        q = to_free @ signals + (rest / np.diag(body.K)[:N_FREE])[:, None]
        rate = np.gradient(q, record.step, axis=1)
        u, v = (np.einsum("bdq,qn->bdn", body.rows[:, :, :N_FREE], way) for way in (q, rate))
        motions.append(
            BushingMotion(record, body, loads, gaps[number], base, signals, q, rate, u, v)
        )
    return tuple(motions)


def _on_grid(record: MountingRecord, values: FloatArray) -> FloatArray:
    """Values of the samples on the even grid of the loads, shape (n_channels, n)."""
    inputs = record.inputs
    if inputs.uniform:
        return np.ascontiguousarray(values.T)
    return np.array([np.interp(inputs.grid, inputs.time, column) for column in values.T])


def _filled(gap: FloatArray) -> FloatArray:
    """Gap with missing samples on straight lines between their neighbours."""
    complete = gap.copy()
    samples = np.arange(gap.shape[1])
    for row in complete:
        known = np.isfinite(row)
        row[~known] = np.interp(samples[~known], samples[known], row[known])
    return complete


def _nearest(gaps: Sequence[tuple[FloatArray, float]], number: int, noise: float) -> FloatArray:
    """Part of one run's gap that stands clear of the noise in all runs of a channel."""
    longest = max(gap.size * step for gap, step in gaps)
    fine = np.arange(0.0, 0.5 / min(step for _, step in gaps), 1.0 / longest)
    total, count = np.zeros(fine.size), np.zeros(fine.size)
    for gap, step in gaps:
        n = gap.size
        line = np.linspace(gap[0], gap[-1], n)
        power = np.abs(np.fft.rfft(gap - line)) ** 2 / n
        frequency = np.fft.rfftfreq(n, step)
        total += np.interp(fine, frequency, power) * n
        count += n * (fine <= frequency[-1])
    width = max(3, round(_BAND_HZ * longest))
    density = uniform_filter1d(total / np.maximum(count, 1.0), width, mode="nearest")
    share = np.clip(1.0 - _COLOURED * noise / np.maximum(density, 1e-300), 0.0, 1.0)
    gap, step = gaps[number]
    # The filter takes out the straight line between the ends: not one through two samples of noise.
    window = max(1, round(0.25 / (_BAND_HZ * step)))
    smooth = uniform_filter1d(gap, window, mode="nearest")
    ends = np.concatenate([smooth[:1], gap[1:-1], smooth[-1:]])

    def gain(frequency: FloatArray) -> FloatArray:
        """Share of the gap that is no noise."""
        return np.asarray(np.interp(frequency, fine, share, right=0.0))

    filtered = with_gain(ends, step, gain, reach=round(_REACH / step))
    return np.asarray(filtered + share[0] * np.linspace(ends[0], ends[-1], gap.size))
