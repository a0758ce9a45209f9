"""Records of a mounting campaign, thinned to what the slow motion of the housing holds.

Loads and signals are averaged over the same groups of samples. The mean over a group commutes with
a linear system, and the bushings' laws change little within a fiftieth of a second, so that the
averaged loads give the averaged signals.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.mounting.difference_noise import DifferenceNoise, difference_noise
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.mounting.inputs import MountingInputs

#: Sampling frequency that is enough [Hz], and the share of the loads' power above a quarter of it
#: that forbids thinning. Straight lines between loads 0.05 s apart would put the damping off by 2
#: %.
_ENOUGH_HZ = 50.0
_FAST_POWER = 1e-3
_BLOCKS = 8
#: Samples of a block at least.
FEWEST_IN_BLOCK = 40
#: A mean of the zeroing samples below this share of its own noise was taken out with the noise in
#: it.
_ZEROED = 1e-3
_LOADS = ("torque", "ntl_y", "ntl_z")


@dataclass(frozen=True, eq=False)
class MountingRecord:
    """One run, ready to be compared.

    Parameters
    ----------
    name, condition : str
        Run and its condition.
    inputs : MountingInputs
        Averaged loads.
    measured : ndarray, shape (n, n_channels)
        Averaged signals [m], NaN where missing.
    block : ndarray of int, shape (n,)
        Block of every sample.
    noise, zero_noise : ndarray, shape (n_channels,)
        Variance of the averaged noise, and of the error that the zeroing leaves for the whole run
        [m²].
    zeroing_samples : int
        Averaged samples of the zero.
    """

    name: str
    condition: str
    inputs: MountingInputs
    measured: FloatArray
    block: NDArray[np.int64]
    noise: FloatArray
    zero_noise: FloatArray
    zeroing_samples: int

    @property
    def n_blocks(self) -> int:
        """Blocks of the record."""
        return int(self.block[-1]) + 1

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return self.inputs.step


def mounting_records(campaign: Campaign) -> tuple[MountingRecord, ...]:
    """Thinned records of every run.

    Parameters
    ----------
    campaign : Campaign
        Of kind ``mounting``.

    Returns
    -------
    tuple of MountingRecord
        In the order of the runs.

    Raises
    ------
    ValueError
        Where a channel holds nothing, no signal changes, the loads never change, or a run is too
        short.
    """
    for run in campaign.within_use().runs:
        _check(run, campaign)
    if all(_is_constant(run.inputs[name]) for run in campaign.runs for name in _LOADS):
        raise ValueError(
            "torque, ntl_y and ntl_z are constant in every run: nothing but rest; "
            "expected loads that change"
        )
    noise = _noise(campaign)
    return tuple(_record(run, campaign, own) for run, own in zip(campaign.runs, noise, strict=True))


def _check(run: Run, campaign: Campaign) -> None:
    if run.time.size < 2 * FEWEST_IN_BLOCK:
        raise ValueError(
            f"run {run.name}: {run.time.size} samples; expected at least {2 * FEWEST_IN_BLOCK}"
        )
    for channel in campaign.channels:
        present = int(np.isfinite(run.signals[channel.name]).sum())
        if present < FEWEST_IN_BLOCK:
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


def _noise(campaign: Campaign) -> list[list[DifferenceNoise]]:
    """Noise of every channel by run: as declared, or from the records."""
    signals = {
        (run.name, channel.name): run.within_use().signals[channel.name]
        for run in campaign.runs
        for channel in campaign.channels
        if channel.noise_std is None
    }
    found = dict(zip(signals, difference_noise(tuple(signals.values())), strict=True))
    return [
        [
            found[run.name, channel.name]
            if channel.noise_std is None
            else DifferenceNoise(channel.noise_std**2, 0.0)
            for channel in campaign.channels
        ]
        for run in campaign.runs
    ]


def _record(run: Run, campaign: Campaign, noise: Sequence[DifferenceNoise]) -> MountingRecord:
    inputs = MountingInputs.from_columns(run.time, run.inputs)
    names = [channel.name for channel in campaign.channels]
    signals = np.column_stack([run.within_use().signals[name] for name in names])
    zeroing = int(campaign.rig["zeroing_samples"])
    # The zero is that of the record's beginning, whether or not it counts.
    first = np.column_stack([run.signals[name][:zeroing] for name in names])
    q = _thinning(inputs)
    columns = {name: _means(values, q) for name, values in inputs.columns().items()}
    counts = _means(run.in_use.astype(np.float64), q) == 1.0
    return MountingRecord(
        run.name,
        run.condition,
        MountingInputs(**columns),
        # A group with a missing sample is missing: the mean of its rest belongs to another instant.
        np.column_stack([_means(column, q) for column in signals.T]),
        _blocks(counts),
        np.array([own.of_mean(q) for own in noise]),
        _zero_noise(first, np.array([own.of_mean(len(first)) for own in noise])),
        max(1, round(zeroing / q)),
    )


def _blocks(counts: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Block of every sample: like numbers of samples that count, the others in between."""
    n = int(counts.sum())
    if n < 2 * FEWEST_IN_BLOCK:
        raise ValueError(
            f"{n} averaged samples lie in the windows of 'use'; expected at least "
            f"{2 * FEWEST_IN_BLOCK}"
        )
    blocks = max(2, min(_BLOCKS, n // FEWEST_IN_BLOCK))
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


def _zero_noise(first: FloatArray, error: FloatArray) -> FloatArray:
    """Variance that the zero carries into the whole run.

    That of its mean, `error`, where the noise was zeroed with the signal.
    """
    zeroed = np.abs(first.mean(axis=0)) <= _ZEROED * np.sqrt(error)
    return np.where(zeroed, error, 0.0)
