"""What the classes see of a run: gap, nearest motion, deflection of the bushings, loads.

Columns are made of the measured motion, and its noise is bent with it by every curved column. The
nearest motion is therefore the baseline's own prediction with that part of the gap which stands
clear of the noise (Wiener: each frequency by the share of the gap in what was measured there).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.classes.rigid_body import N_FREE, RigidBody
from carrierflex.diagnosis.mounting.records import MountingRecord
from carrierflex.identification.campaign.signals import with_gain

#: Width of the bands in which gap and noise are compared [Hz].
_BAND_HZ = 0.25
#: Density of noise whose neighbours are correlated over that of white noise, at low frequencies.
_COLOURED = 3.0
#: Seconds by which a record is continued before it is filtered.
_REACH = 8.0


@dataclass(frozen=True, eq=False)
class BushingMotion:
    """One run in the space of generalised forces.

    Parameters
    ----------
    record : MountingRecord
        The run.
    step : float
        Sampling interval [s].
    loads : ndarray, shape (n, 3)
        Torque, ntl_y, ntl_z, evenly sampled.
    gap : ndarray, shape (n_channels, n)
        Measured less baseline; NaN where nothing was measured.
    predicted, signals : ndarray, shape (n_channels, n)
        Signals of the linear bushings, and the nearest ones to what was measured.
    q, rate : ndarray, shape (3, n)
        Free coordinates from the loaded rest, and their rates.
    u, v : ndarray, shape (2, 2, n)
        Deflection and speed of starboard and port bushing in y and in z.
    zeroing : int
        Samples of the zero.
    """

    record: MountingRecord
    step: float
    loads: FloatArray
    gap: FloatArray
    predicted: FloatArray
    signals: FloatArray
    q: FloatArray
    rate: FloatArray
    u: FloatArray
    v: FloatArray
    zeroing: int

    @property
    def time(self) -> FloatArray:
        """Time from the first sample [s]."""
        return self.step * np.arange(self.loads.shape[0], dtype=np.float64)

    def zeroed(self, values: FloatArray) -> FloatArray:
        """Values less their mean over the samples of the zero, over the last axis."""
        return values - values[..., : self.zeroing].mean(axis=-1, keepdims=True)


def bushing_motions(
    body: RigidBody, records: Sequence[MountingRecord], predicted: Sequence[FloatArray]
) -> tuple[BushingMotion, ...]:
    """Every run with the motion of its bushings.

    Parameters
    ----------
    body : RigidBody
        Housing on the fitted linear bushings.
    records : sequence of MountingRecord
        Runs.
    predicted : sequence of ndarray, shape (n, n_channels)
        What the linear bushings alone predict.
    """
    gaps = [
        _on_grid(record, record.measured - own)
        for record, own in zip(records, predicted, strict=True)
    ]
    filled = [_filled(gap) for gap in gaps]
    found = []
    for number, record in enumerate(records):
        near = np.empty(filled[number].shape)
        for channel in range(len(near)):
            own = [
                (gap[channel], other.inputs.step)
                for gap, other in zip(filled, records, strict=True)
            ]
            noise = float(np.mean([other.noise[channel] for other in records]))
            near[channel] = _nearest(own, number, noise)
        base = _on_grid(record, predicted[number])
        found.append(_motion(body, record, gaps[number], base, near))
    return tuple(found)


def _motion(
    body: RigidBody,
    record: MountingRecord,
    gap: FloatArray,
    predicted: FloatArray,
    near: FloatArray,
) -> BushingMotion:
    signals = predicted + near
    step = record.inputs.step
    loads = record.inputs.loads
    zeroing = record.zeroing_samples
    rest = body.G[:N_FREE] @ loads[:zeroing].mean(axis=0)
    q = body.to_free @ signals + (rest / np.diag(body.K)[:N_FREE])[:, None]
    rate = np.gradient(q, step, axis=1)
    u, v = (np.einsum("bdq,qn->bdn", body.rows[:, :, :N_FREE], own) for own in (q, rate))
    return BushingMotion(record, step, loads, gap, predicted, signals, q, rate, u, v, zeroing)


def _on_grid(record: MountingRecord, values: FloatArray) -> FloatArray:
    """Values of the samples on the even grid of the loads, shape (n_channels, n)."""
    inputs = record.inputs
    if inputs.uniform:
        return np.ascontiguousarray(values.T)
    return np.array([np.interp(inputs.grid, inputs.time, column) for column in values.T])


def _filled(gap: FloatArray) -> FloatArray:
    """Gap with missing samples on straight lines between their neighbours."""
    found = gap.copy()
    places = np.arange(gap.shape[1])
    for row in found:
        known = np.isfinite(row)
        row[~known] = np.interp(places[~known], places[known], row[known])
    return found


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

    kept = with_gain(ends, step, gain, reach=round(_REACH / step))
    return np.asarray(kept + share[0] * np.linspace(ends[0], ends[-1], gap.size))
