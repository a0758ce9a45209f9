"""Sums over the records of a carrier campaign, accumulated once.

Products of all columns by segment and channel.

Fits and held-out scores are algebra on these sums. What needs more of the columns than fits in
memory, the screen's flexible features and the order amplitudes of a model, passes over the records
again (:mod:`carrierflex.diagnosis.carrier.records.run_columns`).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.records.column_basis import (
    ColumnBasis,
    column_basis,
    every_column,
)
from carrierflex.diagnosis.carrier.records.columns import ColumnIndex, ColumnSource
from carrierflex.diagnosis.carrier.records.run_columns import (
    BlockColumns,
    RunColumns,
    columns_of_campaign,
)
from carrierflex.diagnosis.comparison.problem import Segment
from carrierflex.files.temporary_store import Rows, zero_rows
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.order_analysis import (
    highest_order,
    order_amplitudes,
    too_sparse,
)
from carrierflex.identification.campaign.revolutions import whole_revolutions

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

#: Blocks of a run at most: enough draws for the bootstrap, and two revolutions a block in a
#: minute's record.
_MOST_BLOCKS = 12
#: Bytes that products of all columns would take, up to which a run has several blocks; and those of
#: a whole diagnosis, beyond which a campaign is refused.
_USUAL_MEMORY = 600_000_000
_MOST_MEMORY = 8_000_000_000
#: Bytes of the program itself, and of what works on records and products: an estimate.
_PROGRAM = 300_000_000
_AT_WORK = 800_000_000
#: Bytes of products up to which they are kept in memory, beyond on disk.
_IN_MEMORY = 150_000_000
#: Bytes of products that are unpacked at once.
_AT_ONCE = 50_000_000
#: Every which sample is looked at for whether the basis holds.
_CHECKED = 25


@dataclass(frozen=True, eq=False)
class CarrierSums:
    """Sums of a campaign; P segments, C channels, k columns, R revolutions in all.

    Parameters
    ----------
    index : ColumnIndex
        Numbers of the columns, the target first.
    segments : tuple of Segment
        Blocks of whole revolutions.
    run_of_segment : ndarray of int, shape (P,)
        Number of the run of every segment.
    target : ndarray, shape (P, C, k)
        Products of the target with every column, itself first.
    basis : ColumnBasis
        Columns of every channel that the others are combinations of; b of them.
    products : Rows, shape (P, C, b (b + 1) / 2)
        Products of the columns of the basis with each other: the upper triangle, row by row. Those
        of a large campaign are on disk and read for some segments at a time.
    counts : ndarray of int, shape (P, C)
        Samples that are not missing.
    orders : ndarray of complex, shape (R, C, n + 1)
        Order amplitudes of the measured signal by revolution, 0 to n; NaN where a revolution is too
        sparse.
    within : ndarray, shape (R, C, 2)
        Sum of squares of the measured signal about those orders, and its degrees of freedom.
    run_of_revolution : ndarray of int, shape (R,)
        Number of the run of every revolution.
    loads : ndarray, shape (R, 3)
        Mean torque [N m] and radial load [N] along y and z of every revolution.
    """

    index: ColumnIndex
    segments: tuple[Segment, ...]
    run_of_segment: IntArray
    target: FloatArray
    basis: ColumnBasis
    products: Rows
    counts: IntArray
    orders: ComplexArray
    within: FloatArray
    run_of_revolution: IntArray
    loads: FloatArray

    @property
    def nbytes(self) -> int:
        """Bytes of the products."""
        return self.target.nbytes + self.products.nbytes

    def gram(self, columns: IntArray, segments: slice = slice(None)) -> FloatArray:
        """Products of some columns, the target first, shape (P, C, u, u), of some segments."""
        weights = self.basis.weights[:, columns[1:] - 1]
        used = np.flatnonzero(weights.any(axis=(0, 1)))
        weights = weights[..., used]
        places = self.places(used[:, None], used)
        first = segments.indices(len(self.target))[0]
        target = self.target[segments]
        result = np.empty((*target.shape[:2], columns.size, columns.size))
        result[..., 0, :] = result[..., 0] = target[..., columns]
        stored = self.products.shape[2]
        step = max(1, _AT_ONCE // (8 * len(weights) * max(used.size**2, stored)))
        for p in range(0, len(result), step):
            some = slice(p, min(p + step, len(result)))
            kept = self.products[first + some.start : first + some.stop]
            products = weights @ kept[..., places]
            result[some, :, 1:, 1:] = products @ np.swapaxes(weights, 1, 2)
        return result

    def with_target(self, columns: IntArray, weights: FloatArray) -> "CarrierSums":
        """Sums of the same record, its target replaced by a combination of columns.

        Parameters
        ----------
        columns : ndarray of int, shape (u,)
            Numbers of the columns, the target first.
        weights : ndarray, shape (n_runs, C, u)
            Weight of each of them by run and channel; zero for the target.
        """
        every = np.arange(self.basis.size)
        places = self.places(every[:, None], every)
        of_columns = self.basis.weights[:, columns[1:] - 1]
        target = np.empty_like(self.target)
        for p, run in enumerate(self.run_of_segment):
            combined = np.einsum("cub,cu->cb", of_columns, weights[run, :, 1:])
            with_basis = np.einsum("cab,cb->ca", self.products[p : p + 1][0][:, places], combined)
            target[p, :, 0] = np.einsum("ca,ca->c", with_basis, combined)
            target[p, :, 1:] = np.einsum("cka,ca->ck", self.basis.weights, with_basis)
        # The orders are those of the signals that were replaced.
        no_orders = np.broadcast_to(np.complex128(np.nan), self.orders.shape)
        return replace(self, target=target, orders=no_orders)

    def places(self, rows: IntArray, columns: IntArray) -> IntArray:
        """Where the products of columns of the basis stand in the triangle."""
        first, second = np.minimum(rows, columns), np.maximum(rows, columns)
        size = self.basis.size
        return np.asarray(first * size - first * (first - 1) // 2 + second - first)


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
    runs = campaign.within_use().runs
    index = columns_of_campaign(runs[0], campaign.channels[0], source)
    n_channels = len(campaign.channels)
    basis = column_basis(runs, campaign.channels, source)
    sums = _filled(campaign, source, index, basis)
    if sums is None:
        # Columns that were combinations where they were looked at, and are none elsewhere.
        sums = _filled(campaign, source, index, every_column(index.size - 1, n_channels))
    assert sums is not None
    segments = []
    for p, r in enumerate(sums.run_of_segment.tolist()):
        block = p - int(np.argmax(sums.run_of_segment == r))
        n_samples = int(sums.counts[p].sum())
        segments.append(Segment(runs[r].name, runs[r].condition, block, n_samples))
    return replace(sums, segments=tuple(segments))


def _filled(
    campaign: Campaign, source: ColumnSource, index: ColumnIndex, basis: ColumnBasis
) -> CarrierSums | None:
    """Sums without their segments; None where the basis does not hold."""
    n_blocks = _blocks_a_run(campaign, index.size, basis.size)
    runs = campaign.within_use().runs
    revolutions = [len(whole_revolutions(run).samples) for run in runs]
    numbers = np.arange(len(runs))
    run_of_segment = np.repeat(numbers, np.minimum(n_blocks, revolutions))
    run_of_revolution = np.repeat(numbers, revolutions)
    n_channels = len(campaign.channels)
    shape, turns = (run_of_segment.size, n_channels), (run_of_revolution.size, n_channels)
    n_orders = highest_order(source.rig.n_planets) + 1
    sums = CarrierSums(
        index=index,
        segments=(),
        run_of_segment=run_of_segment,
        target=np.empty((*shape, index.size)),
        basis=basis,
        products=zero_rows((*shape, basis.size * (basis.size + 1) // 2), _IN_MEMORY),
        counts=np.empty(shape, dtype=np.int64),
        orders=np.full((*turns, n_orders), np.nan, dtype=np.complex128),
        within=np.zeros((*turns, 2)),
        run_of_revolution=run_of_revolution,
        loads=np.empty((run_of_revolution.size, 3)),
    )
    for r, run in enumerate(runs):
        if not _fill(sums, r, RunColumns(run, source), campaign, n_blocks):
            return None
    return sums


def blocks_of_run(records: CarrierSums, run: int, columns: RunColumns) -> list[IntArray]:
    """Numbers of the revolutions of every segment of a run, as the sums have them."""
    return columns.blocks(int(np.count_nonzero(records.run_of_segment == run)))


def _blocks_a_run(campaign: Campaign, n_columns: int, n_basis: int) -> int:
    """Blocks that every run is divided into: as many as leave memory free, 1 to 12.

    Raises
    ------
    ValueError
        Where one block a run does not fit.
    """
    n_runs, n_channels = len(campaign.runs), len(campaign.channels)
    needed = needed_memory(campaign, n_columns, n_basis)
    if needed > _MOST_MEMORY:
        raise ValueError(
            f"{n_runs} runs of {n_channels} channels: a diagnosis takes {needed / 1e9:.1f} GB of "
            f"memory; expected at most {_MOST_MEMORY / 1e9:.0f} GB: leave out channels, or runs of "
            "conditions that others have too"
        )
    # Whatever is a combination in these records: the same campaign has the same segments.
    every = 4 * n_runs * n_channels * n_columns * (n_columns + 1)
    return int(np.clip(_USUAL_MEMORY // every, 1, _MOST_BLOCKS))


def needed_memory(campaign: Campaign, n_columns: int, n_basis: int) -> int:
    """Bytes that a diagnosis takes at most: program, records, products, and what works on them.

    Parameters
    ----------
    campaign : Campaign
        Records.
    n_columns, n_basis : int
        Columns of a sensor, and those that are different.
    """
    n_runs, n_channels = len(campaign.runs), len(campaign.channels)
    records = sum(8 * run.time.size * (1 + len(run.columns())) for run in campaign.runs)
    n_kept = n_basis * (n_basis + 1) // 2 + n_columns
    # Lines beside the orders are taken out of a copy of the records.
    return _PROGRAM + 2 * records + 8 * n_runs * n_channels * n_kept + _AT_WORK


def _fill(
    sums: CarrierSums, run: int, columns: RunColumns, campaign: Campaign, n_blocks: int
) -> bool:
    """Put the sums of one run where they stand among all; tell whether the basis holds."""
    blocks = columns.blocks(n_blocks)
    inputs = columns.inputs
    loads = (inputs.torque, inputs.ntl_y, inputs.ntl_z)
    first_turn = int(np.argmax(sums.run_of_revolution == run))
    first_segment = int(np.argmax(sums.run_of_segment == run))
    products = np.zeros((len(blocks), *sums.products.shape[1:]))
    for r, rows in enumerate(columns.revolutions):
        sums.loads[first_turn + r] = [column[rows].mean() for column in loads]
    for c, channel in enumerate(campaign.channels):
        members = sums.basis.members[c]
        upper = np.triu_indices(members.size)
        places = sums.places(*upper)
        turn = first_turn
        for p, block in enumerate(columns.of(channel, blocks), start=first_segment):
            if not sums.basis.holds(c, block.rows[1:, ::_CHECKED]):
                return False
            end = turn + len(block.revolutions)
            target, gram = _add_block(
                block, 1 + members, sums.orders[turn:end, c], sums.within[turn:end, c]
            )
            sums.target[p, c] = target
            products[p - first_segment, c, places] = gram[upper]
            sums.counts[p, c] = sum(block.present(rows).size for rows in block.revolutions)
            turn = end
    sums.products[first_segment : first_segment + len(blocks)] = products
    return True


def _add_block(
    block: BlockColumns, members: IntArray, orders: ComplexArray, within: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Products of the target with all columns, and of those of the basis with each other.

    Fills the target's orders and what is left of it.
    """
    target = np.zeros(len(block.rows))
    gram = np.zeros((members.size, members.size))
    highest = orders.shape[-1] - 1
    for r, rows in enumerate(block.revolutions):
        present = block.present(rows)
        columns = block.rows[:, present]
        target += columns @ columns[0]
        own = columns[members]
        gram += own @ own.T
        theta = block.inputs.carrier_angle[present]
        if not too_sparse(theta, highest):
            amplitudes, within[r] = order_amplitudes(columns[:1], theta, highest)
            orders[r] = amplitudes[:, 0]
    return target, gram


def segment_squares(residual: FloatArray, gram: FloatArray) -> FloatArray:
    """Sum of squares by segment and channel; a perfect fit leaves rounding of either sign."""
    squares = np.einsum("pck,pckl,pcl->pc", residual, gram, residual, optimize=True)
    return np.maximum(squares, 0.0)
