"""Sums over the records of a carrier campaign, accumulated once.

Products of all columns by segment and channel.

Everything after this (fits, held-out scores, gap maps) is algebra on these sums; no pass over the
samples follows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.columns import (
    DELAY_NODES,
    PREDICTION,
    TARGET,
    ColumnIndex,
    ColumnSource,
    Key,
)
from carrierflex.diagnosis.comparison.problem import Segment
from carrierflex.identification.campaign.campaign import Campaign, Channel
from carrierflex.identification.campaign.order_analysis import (
    MAX_ORDER,
    order_amplitudes,
    too_sparse,
)
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.rim import CarrierInputs, inputs_of_columns
from carrierflex.simulation.sensing import delayed, delayed_angle

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Blocks of a run at most: enough draws for the bootstrap, and two revolutions a block in a
#: minute's record.
_MOST_BLOCKS = 12
#: Samples whose columns are in memory at once.
_CHUNK = 20_000
#: Bytes of all sums up to which a run has several blocks, and beyond which a campaign is refused.
_USUAL_MEMORY = 2_000_000_000
_MOST_MEMORY = 8_000_000_000


@dataclass(frozen=True, eq=False)
class CarrierSums:
    """Sums of a campaign; P segments, C channels, k columns, R revolutions in all.

    Parameters
    ----------
    index : ColumnIndex
        Numbers of the columns.
    segments : tuple of Segment
        Blocks of whole revolutions.
    run_of_segment : ndarray of int, shape (P,)
        Number of the run of every segment.
    gram : ndarray, shape (P, C, k, k)
        Products of the columns, the target among them.
    counts : ndarray of int, shape (P, C)
        Samples that are not missing.
    orders : ndarray of complex, shape (R, C, MAX_ORDER + 1, k)
        Order amplitudes of all columns by revolution; NaN where a revolution is too sparse.
    within : ndarray, shape (R, C, 2)
        Sum of squares of the target about those orders, and its degrees of freedom.
    run_of_revolution : ndarray of int, shape (R,)
        Number of the run of every revolution.
    loads : ndarray, shape (R, 3)
        Mean torque [N m] and radial load [N] along y and z of every revolution.
    """

    index: ColumnIndex
    segments: tuple[Segment, ...]
    run_of_segment: IntArray
    gram: FloatArray
    counts: IntArray
    orders: NDArray[np.complex128]
    within: FloatArray
    run_of_revolution: IntArray
    loads: FloatArray

    def with_target(self, run_weights: FloatArray) -> "CarrierSums":
        """Sums of the same record, its target replaced by a combination of columns.

        Parameters
        ----------
        run_weights : ndarray, shape (n_runs, C, k)
            Weight of every column by run and channel.
        """
        gram, orders = self.gram.copy(), self.orders.copy()
        for p, run in enumerate(self.run_of_segment):
            for c, weights in enumerate(run_weights[run]):
                products = self.gram[p, c] @ weights
                gram[p, c, 0], gram[p, c, :, 0] = products, products
                gram[p, c, 0, 0] = weights @ products
        orders[..., 0] = np.einsum(
            "rcnk,rck->rcn", self.orders, run_weights[self.run_of_revolution]
        )
        return replace(self, gram=gram, orders=orders)


def inputs_of(run: Run) -> CarrierInputs:
    """Inputs of a whole run."""
    zero = np.zeros(run.time.size)
    # A rig without radial load has no columns of it.
    return inputs_of_columns({"ntl_y": zero, "ntl_z": zero, **run.inputs, "time": run.time})


def accumulated_sums(campaign: Campaign, source: ColumnSource) -> CarrierSums:
    """Accumulate the sums of a campaign.

    Parameters
    ----------
    campaign : Campaign
        Records.
    source : ColumnSource
        Columns.

    Returns
    -------
    CarrierSums
        Sums of all runs.

    Raises
    ------
    ValueError
        Where the carrier turns by less than one revolution in a run, or the campaign is too large.
    """
    n_blocks = _blocks_a_run(campaign, source)
    runs = [_run_sums(run, campaign, source, n_blocks) for run in campaign.within_use().runs]
    segments = tuple(
        Segment(run.name, run.condition, block, int(count.sum()))
        for run, sums in zip(campaign.runs, runs, strict=True)
        for block, count in enumerate(sums.counts)
    )
    numbers = np.arange(len(runs))
    return CarrierSums(
        index=runs[0].index,
        segments=segments,
        run_of_segment=np.repeat(numbers, [len(sums.gram) for sums in runs]),
        gram=np.concatenate([sums.gram for sums in runs]),
        counts=np.concatenate([sums.counts for sums in runs]),
        orders=np.concatenate([sums.orders for sums in runs]),
        within=np.concatenate([sums.within for sums in runs]),
        run_of_revolution=np.repeat(numbers, [len(sums.loads) for sums in runs]),
        loads=np.concatenate([sums.loads for sums in runs]),
    )


@dataclass(frozen=True, eq=False)
class _BlockSums:
    """Sums of one block of a run and one channel: shapes (k, k), (), (R, orders, k), (R, 2)."""

    gram: FloatArray
    count: int
    orders: NDArray[np.complex128]
    within: FloatArray


@dataclass(frozen=True, eq=False)
class _RunSums:
    """Sums of one run, as in :class:`CarrierSums`."""

    index: ColumnIndex
    gram: FloatArray
    counts: IntArray
    orders: NDArray[np.complex128]
    within: FloatArray
    loads: FloatArray


def _blocks_a_run(campaign: Campaign, source: ColumnSource) -> int:
    """Blocks that every run is divided into: as many as leave memory free, 1 to 12.

    Raises
    ------
    ValueError
        Where one block a run does not fit.
    """
    first, channel = campaign.runs[0], campaign.channels[0]
    part = _part(inputs_of(first), np.arange(1))
    targets = _target_rows(first, channel, np.arange(1), source.speed)
    n_columns = len(targets) + len(
        source.rows(rim_sensor(channel), part, [part] * len(DELAY_NODES))
    )
    n_revolutions = sum(len(whole_revolutions(run).samples) for run in campaign.runs)
    n_channels = len(campaign.channels)
    orders = 16 * n_revolutions * n_channels * (MAX_ORDER + 1) * n_columns
    block = 8 * len(campaign.runs) * n_channels * n_columns**2
    if orders + block > _MOST_MEMORY:
        raise ValueError(
            f"{len(campaign.runs)} runs of {n_channels} channels and {n_revolutions} revolutions "
            f"in all: their sums take {(orders + block) / 1e9:.1f} GB; expected at most "
            f"{_MOST_MEMORY / 1e9:.0f} GB: leave out channels, or runs of conditions that others "
            "have too"
        )
    return int(np.clip((_USUAL_MEMORY - orders) // block, 1, _MOST_BLOCKS))


def _run_sums(run: Run, campaign: Campaign, source: ColumnSource, n_blocks: int) -> _RunSums:
    """Sums of one run over all channels, in at most `n_blocks` blocks."""
    revolutions = whole_revolutions(run).samples
    blocks = np.array_split(np.arange(len(revolutions)), min(n_blocks, len(revolutions)))
    inputs = inputs_of(run)
    columns = (inputs.torque, inputs.ntl_y, inputs.ntl_z)
    loads = np.array([[column[rows].mean() for column in columns] for rows in revolutions])
    shifted_inputs = [
        _delayed_inputs(inputs, shift / source.speed) for shift in DELAY_NODES.tolist()
    ]
    index = ColumnIndex({})
    channels: list[list[_BlockSums]] = []
    for channel in campaign.channels:
        sensor = rim_sensor(channel)
        sums: list[_BlockSums] = []
        for chunk in _chunks(blocks, revolutions):
            samples = np.sort(np.concatenate([revolutions[r] for block in chunk for r in block]))
            targets = _target_rows(run, channel, samples, source.speed)
            parts = [_part(shifted, samples) for shifted in shifted_inputs]
            rows = {**targets, **source.rows(sensor, _part(inputs, samples), parts)}
            index = ColumnIndex({key: number for number, key in enumerate(rows)})
            table = np.array(list(rows.values()))
            sums += [
                _block_sums(table, samples, [revolutions[r] for r in block], inputs.carrier_angle)
                for block in chunk
            ]
        channels.append(sums)
    return _RunSums(
        index=index,
        gram=np.stack([[block.gram for block in sums] for sums in channels], axis=1),
        counts=np.stack([[block.count for block in sums] for sums in channels], axis=1),
        orders=np.stack(
            [np.concatenate([block.orders for block in sums]) for sums in channels], axis=1
        ),
        within=np.stack(
            [np.concatenate([block.within for block in sums]) for sums in channels], axis=1
        ),
        loads=loads,
    )


def _delayed_inputs(inputs: CarrierInputs, delay: float) -> CarrierInputs:
    """Inputs whose carrier angle is that of `delay` [s] ago."""
    return replace(inputs, carrier_angle=delayed_angle(inputs.time, inputs.carrier_angle, delay))


def _chunks(blocks: Sequence[IntArray], revolutions: Sequence[IntArray]) -> list[list[IntArray]]:
    """Blocks grouped so that no group holds many more samples than a chunk."""
    groups: list[list[IntArray]] = [[]]
    n_samples = 0
    for block in blocks:
        size = sum(revolutions[r].size for r in block)
        if n_samples and n_samples + size > _CHUNK:
            groups.append([])
            n_samples = 0
        groups[-1].append(block)
        n_samples += size
    return groups


def _target_rows(
    run: Run, channel: Channel, samples: IntArray, speed: float
) -> dict[Key, FloatArray]:
    """Target and another simulator's prediction, the latter at the nodes of a delay too.

    Another simulator's prediction is moved in time only: its waves turn with the carrier.
    """
    rows = {(TARGET, 0, "", 0): run.signals[channel.name][samples]}
    if channel.name in run.predictions:
        prediction = run.predictions[channel.name]
        rows[PREDICTION, 0, "", 0] = prediction[samples]
        for node, shift in enumerate(DELAY_NODES):
            if shift:
                late = delayed(run.time, prediction, float(shift) / speed)
                rows[PREDICTION, 0, "delay", node] = late[samples]
    return rows


def _part(inputs: CarrierInputs, samples: IntArray) -> CarrierInputs:
    names = ("time", "carrier_angle", "torque", "ntl_y", "ntl_z")
    return replace(inputs, **{name: getattr(inputs, name)[samples] for name in names})


def _block_sums(
    table: FloatArray, samples: IntArray, revolutions: Sequence[IntArray], angle: FloatArray
) -> _BlockSums:
    """Sums of one block.

    Parameters
    ----------
    table : ndarray, shape (k, n)
        Columns at some samples.
    samples : ndarray of int, shape (n,)
        Numbers of these samples in the run, ascending.
    revolutions : sequence of ndarray of int
        Numbers of the samples of every revolution of the block.
    angle : ndarray
        Carrier angle of the whole run [rad].
    """
    k = len(table)
    gram = np.zeros((k, k))
    count = 0
    orders = np.full((len(revolutions), MAX_ORDER + 1, k), np.nan, dtype=np.complex128)
    within = np.zeros((len(revolutions), 2))
    for r, rows in enumerate(revolutions):
        positions = np.searchsorted(samples, rows)
        present = np.isfinite(table[:, positions]).all(axis=0)
        columns = table[:, positions[present]]
        theta = angle[rows[present]]
        gram += columns @ columns.T
        count += theta.size
        if not too_sparse(theta, MAX_ORDER):
            orders[r], within[r] = order_amplitudes(columns, theta)
    return _BlockSums(gram, count, orders, within)


def segment_squares(residual: FloatArray, gram: FloatArray) -> FloatArray:
    """Sum of squares by segment and channel; a perfect fit leaves rounding of either sign."""
    squares = np.einsum("pck,pckl,pcl->pc", residual, gram, residual, optimize=True)
    return np.maximum(squares, 0.0)


def used_columns(W: FloatArray, D: FloatArray) -> NDArray[np.int64]:
    """Numbers of the target and of every column with a weight or a derivative anywhere."""
    used = (W != 0.0).any(axis=(0, 1)) | (D != 0.0).any(axis=(0, 1, 2))
    used[0] = True
    return np.flatnonzero(used)
