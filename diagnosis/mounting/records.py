"""Records of a mounting campaign, thinned to what the slow motion of the housing holds.

Loads and signals are averaged over the same groups of samples. The mean over a group commutes with
a linear system, and the bushings' laws change little within a fiftieth of a second, so that the
averaged loads give the averaged signals.

Noise that was not declared is estimated from fifth differences of the samples, in which a slow
motion vanishes. Where neighbouring samples are alike the differences hold less than its variance;
the same differences of every second sample hold more of it, which gives the memory of the noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.sample_statistics import (
    GAIN,
    ORDER,
    difference_square,
)
from carrierflex.simulation.mounting.inputs import MountingInputs

#: Sampling frequency that is enough [Hz], and the share of the loads' power above a quarter of it
#: that forbids thinning. Straight lines between loads 0.05 s apart would put the damping off by 2
#: %.
_ENOUGH_HZ = 50.0
_FAST_POWER = 1e-3
_BLOCKS = 8
#: Samples of a block at least.
_FEWEST_IN_BLOCK = 40
#: A mean of the zeroing samples below this share of its own noise was taken out with the noise in
#: it.
_ZEROED = 1e-3
_LOADS = ("torque", "ntl_y", "ntl_z")
#: Longest memory from sample to sample that is told from motion.
_LONGEST = 0.8
#: Share of the differences at a distance of two samples from which motion, which is only known from
#: what it does at the others, would give the memory.
_MOST_MOTION = 0.2
#: Rounds of motion and memory in turn.
_ROUNDS = 6


@dataclass(frozen=True, eq=False)
class MountingRecord:
    """One run, ready to be compared."""

    #: name, condition: run and its condition
    name: str
    condition: str
    inputs: MountingInputs  # Averaged loads
    measured: FloatArray  # Averaged signals [m], NaN where missing, shape (n, n_channels)
    block: NDArray[np.int64]  # Block of every sample, shape (n,)
    #: noise, zero_noise: variance of the averaged noise, and of the error that the zeroing leaves
    #: for the whole run [m²], shape (n_channels,)
    noise: FloatArray
    zero_noise: FloatArray
    zeroing_samples: int  # Averaged samples of the zero

    @property
    def n_blocks(self) -> int:
        """Blocks of the record."""
        return int(self.block[-1]) + 1

    @property
    def time(self) -> FloatArray:
        """Time [s]."""
        return self.inputs.time

    @property
    def is_measured(self) -> NDArray[np.bool_]:
        """Samples of every channel that were measured."""
        return np.isfinite(self.measured)

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return self.inputs.step


@dataclass(frozen=True)
class _Noise:
    """Noise of one channel: variance of a sample [m²], correlation of neighbouring samples."""

    variance: float
    memory: float

    def of_mean(self, n: int) -> float:
        """Variance of the mean of n samples in a row [m²]."""
        apart = np.arange(1, n)
        alike = 2.0 * float(np.sum((1.0 - apart / n) * self.memory**apart))
        return self.variance * (1.0 + alike) / n


def mounting_records(campaign: Campaign) -> tuple[MountingRecord, ...]:
    """Thinned records of every run."""
    for run in campaign.within_use().runs:
        _check(run, campaign)
    if all(_is_constant(run.inputs[name]) for run in campaign.runs for name in _LOADS):
        raise ValueError(
            "torque, ntl_y and ntl_z are constant in every run; expected loads that change"
        )
    declared = {
        channel.name: _Noise(channel.noise_std**2, 0.0)
        for channel in campaign.channels
        if channel.noise_std is not None
    }
    silent = [channel.name for channel in campaign.channels if channel.noise_std is None]
    signals = {
        (run.name, name): run.within_use().signals[name] for run in campaign.runs for name in silent
    }
    estimated = dict(zip(signals, _difference_noise(tuple(signals.values())), strict=True))
    return tuple(
        _record(run, campaign, declared | {name: estimated[run.name, name] for name in silent})
        for run in campaign.runs
    )


def _check(run: Run, campaign: Campaign) -> None:
    if run.time.size < 2 * _FEWEST_IN_BLOCK:
        raise ValueError(
            f"run {run.name}: {run.time.size} samples; expected at least {2 * _FEWEST_IN_BLOCK}"
        )
    for channel in campaign.channels:
        present = int(np.isfinite(run.signals[channel.name]).sum())
        if present < _FEWEST_IN_BLOCK:
            raise ValueError(
                f"run {run.name}: column '{channel.name}' holds {present} measured samples; "
                "expected a signal, or leave the channel out"
            )
    if all(_is_constant(run.signals[channel.name]) for channel in campaign.channels):
        raise ValueError(
            f"run {run.name}: every channel is constant throughout; expected signals that change"
        )


def _is_constant(values: FloatArray) -> bool:
    present = values[np.isfinite(values)]
    return bool(present.size == 0 or np.ptp(present) == 0.0)


def _record(run: Run, campaign: Campaign, noise: Mapping[str, _Noise]) -> MountingRecord:
    inputs = MountingInputs.from_columns(run.time, run.inputs)
    names = [channel.name for channel in campaign.channels]
    signals = np.column_stack([run.within_use().signals[name] for name in names])
    zeroing = int(campaign.rig["zeroing_samples"])
    # The zero is that of the record's beginning, whether or not it counts.
    first = np.column_stack([run.signals[name][:zeroing] for name in names])
    q = _thinning(inputs)
    columns = {name: _means(values, q) for name, values in inputs.columns().items()}
    counts = _means(run.in_use.astype(np.float64), q) == 1.0
    # Variance that the zero carries into the whole run.
    zero = np.array([noise[name].of_mean(len(first)) for name in names])
    is_zeroed = np.abs(first.mean(axis=0)) <= _ZEROED * np.sqrt(zero)
    return MountingRecord(
        run.name,
        run.condition,
        MountingInputs(**columns),
        # A group with a missing sample is missing: the mean of its rest belongs to another instant.
        np.column_stack([_means(column, q) for column in signals.T]),
        _blocks(counts),
        np.array([noise[name].of_mean(q) for name in names]),
        np.where(is_zeroed, zero, 0.0),
        max(1, round(zeroing / q)),
    )


def _blocks(counts: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Block of every sample: like numbers of samples that count, the others in between."""
    n = int(counts.sum())
    if n < 2 * _FEWEST_IN_BLOCK:
        raise ValueError(
            f"{n} averaged samples lie in the windows of 'use'; expected at least "
            f"{2 * _FEWEST_IN_BLOCK}"
        )
    blocks = max(2, min(_BLOCKS, n // _FEWEST_IN_BLOCK))
    number = np.maximum(np.cumsum(counts) - 1, 0)
    return np.asarray(number * blocks // n, dtype=np.int64)


def _thinning(inputs: MountingInputs) -> int:
    """Samples averaged into one; 1 where time is uneven or the loads are fast."""
    q = int(1.0 / (_ENOUGH_HZ * inputs.step) + 1e-6)
    if q < 2 or not inputs.uniform:
        return 1
    frequency = np.fft.rfftfreq(inputs.time.size, inputs.step)
    for column in inputs.loads.T:
        power = np.abs(np.fft.rfft((column - column.mean()) * np.hanning(column.size))) ** 2
        if power[frequency > _ENOUGH_HZ / 4.0].sum() > _FAST_POWER * power.sum():
            return 1
    return q


def _means(values: FloatArray, q: int) -> FloatArray:
    return np.asarray(values[: values.size // q * q].reshape(-1, q).mean(axis=1), dtype=np.float64)


def _difference_noise(signals: Sequence[FloatArray]) -> tuple[_Noise, ...]:
    """Noise of records of slow motion that one measuring chain took."""
    squares = [[difference_square(signal, lag) for lag in range(1, 5)] for signal in signals]
    if any(np.isnan(of_signal[0]) for of_signal in squares):
        raise ValueError(
            "a channel without 'noise_std' has no six samples in a row; expected its 'noise_std'"
        )
    memories = [_memory_and_motion(of_signal) for of_signal in squares]
    clean = [memory for memory, motion in memories if motion < _MOST_MOTION]
    memory = float(np.median(clean)) if clean else 0.0
    return tuple(_Noise(of_signal[0] / _visible_share(memory), memory) for of_signal in squares)


def _memory_and_motion(squares: Sequence[float]) -> tuple[float, float]:
    """Memory of one signal, and the share of motion in the differences at the second distance."""
    first, second, third, fourth = squares
    if not np.all(np.isfinite(squares)) or min(first, second) <= 0.0:
        return 0.0, 1.0
    motion = 0.0
    for _ in range(_ROUNDS):
        memory = _memory((second - motion) / first)
        variance = first / _visible_share(memory)
        at_third = max(third - variance * _visible_share(memory**3), 0.0)
        at_fourth = max(fourth - variance * _visible_share(memory**4), 0.0)
        growth = 2.0 * ORDER
        if at_third < at_fourth and at_third > 0.0:
            growth = min(growth, np.log(at_fourth / at_third) / np.log(4.0 / 3.0))
        motion = min(at_third * (2.0 / 3.0) ** growth, second)
    return memory, motion / second


def _visible_share(memory: float) -> float:
    """Share of the variance of noise with a memory that the fifth differences see."""
    apart = range(1, ORDER + 1)
    products = [(-1) ** m * comb(2 * ORDER, ORDER + m) * memory**m for m in apart]
    return 1.0 + 2.0 * sum(products) / GAIN


def _memory(ratio: float) -> float:
    """Memory of noise from the squares of every second sample's differences over every one's."""

    def excess(memory: float) -> float:
        return _visible_share(memory**2) / _visible_share(memory) - ratio

    if excess(0.0) >= 0.0:
        return 0.0
    return float(brentq(excess, 0.0, _LONGEST)) if excess(_LONGEST) > 0.0 else _LONGEST
