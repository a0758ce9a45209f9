"""Sums over the records of a carrier campaign, accumulated once: products of all columns.

Fits and held-out scores are algebra on these sums, run slice by run slice where a campaign is
large. What needs more of the columns than fits in memory, the flexible features and the order
amplitudes of a model, passes over the records again
(:mod:`carrierflex.diagnosis.carrier.records.columns`). Of some 180 columns of a sensor fewer than
half are different: a tilt of the housing, its column at a sensor moved by 3 deg and an offset are
one constant, in every run alike. The products are of those.
"""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.records.columns import (
    BlockColumns,
    ColumnIndex,
    ColumnSource,
    RunColumns,
    columns_of_campaign,
    some_samples,
)
from carrierflex.diagnosis.comparison.problem import Segment
from carrierflex.files.temporary_store import Rows, zero_rows
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import (
    highest_order,
    order_amplitudes,
    too_sparse,
)
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
#: Part of a column of unit length that must lie off the others for it to be one of its own: those
#: that stand far off first, so that the weights of the rest are small. What is a combination misses
#: by rounding, 1e-13.
_OFF_THE_OTHERS = (1e-2, 1e-4, 1e-6, 1e-8)
#: Weights, columns of unit length, that are rounding.
_ROUNDING = 1e-11
#: Largest miss of a combination, over the largest value of its column in all runs.
_LARGEST_MISS = 1e-10
#: Samples at which the columns are compared, over all runs, and fewest of a run.
_SAMPLES = 2000
_FEWEST = 12
ComplexArray = NDArray[np.complex128]
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
#: Bytes of products of columns in a part, for a usual set of so many columns, and of those that are
#: kept. Weights of a part, their derivatives and what works on them are some four times as large.
_PART_BYTES = 50_000_000
_USUAL_COLUMNS = 40
_KEPT_BYTES = 100_000_000


@dataclass(frozen=True, eq=False)
class ColumnBasis:
    """Basis of the columns of every sensor, the target left out; C channels, k - 1 columns.

    Parameters
    ----------
    members : sequence of ndarray of int
        Numbers of the columns in the basis of every channel, counted without the target.
    weights : ndarray, shape (C, k - 1, b)
        Every column by those of the basis; zero beyond a channel's own.
    largest : ndarray, shape (C, k - 1)
        Largest size of every column where it was looked at.
    """

    members: tuple[IntArray, ...]
    weights: FloatArray
    largest: FloatArray

    @property
    def size(self) -> int:
        """Columns of the largest basis."""
        return self.weights.shape[2]

    def holds(self, channel: int, rows: FloatArray) -> bool:
        """Whether columns, shape (k - 1, n), are the combinations that they are taken for."""
        members = self.members[channel]
        rows = rows[:, np.isfinite(rows).all(axis=0)]
        missed = rows - self.weights[channel, :, : members.size] @ rows[members]
        largest = np.maximum(self.largest[channel], np.abs(rows).max(axis=1, initial=0.0))
        limit = _LARGEST_MISS * largest
        return bool((np.abs(missed).max(axis=1, initial=0.0) <= limit).all())


def every_column(n_columns: int, n_channels: int) -> ColumnBasis:
    """Basis of all columns."""
    members = np.arange(n_columns)
    weights = np.broadcast_to(np.eye(n_columns), (n_channels, n_columns, n_columns))
    return ColumnBasis((members,) * n_channels, weights, np.zeros((n_channels, n_columns)))


def column_basis(
    runs: Sequence[Run], channels: Sequence[Channel], source: ColumnSource
) -> ColumnBasis:
    """Basis of the columns of every sensor at some samples of all runs.

    Parameters
    ----------
    runs : sequence of Run
        Records within their windows of use.
    channels : sequence of Channel
        Sensors.
    source : ColumnSource
        Columns.

    Returns
    -------
    ColumnBasis
        Earlier columns before later ones.
    """
    n_samples = max(_FEWEST, _SAMPLES // len(runs))
    members = []
    of_channels = []
    largest = []
    # Channel by channel: the columns of all of them are several times the records.
    some = some_samples(runs, source, n_samples)
    for channel in channels:
        table = some.rows(channel)
        table = table[:, np.isfinite(table).all(axis=0)]
        chosen, own = _combinations(table)
        members.append(chosen)
        of_channels.append(own)
        largest.append(np.abs(table).max(axis=1, initial=0.0))
    size = max(chosen.size for chosen in members)
    weights = np.zeros((len(channels), len(largest[0]), size))
    for c, own in enumerate(of_channels):
        weights[c, :, : own.shape[1]] = own
    return ColumnBasis(tuple(members), weights, np.array(largest))


def _combinations(rows: FloatArray) -> tuple[IntArray, FloatArray]:
    """Numbers of the rows in the basis, and every row by these."""
    length = np.linalg.norm(rows, axis=1)
    scaled = rows / np.where(length > 0.0, length, 1.0)[:, None]
    members: list[int] = []
    directions = np.empty((0, rows.shape[1]))
    off = scaled.copy()
    for limit in _OFF_THE_OTHERS:
        for k in range(len(scaled)):
            size = float(np.linalg.norm(off[k]))
            if size <= limit:
                continue
            members.append(k)
            direction = off[k] / size
            direction -= (directions @ direction) @ directions  # what rounding left
            direction /= np.linalg.norm(direction)
            directions = np.vstack([directions, direction])
            off -= np.outer(off @ direction, direction)
    chosen = np.array(sorted(members), dtype=np.int64)
    weights = np.linalg.lstsq(scaled[chosen].T, scaled.T, rcond=None)[0].T
    weights[np.abs(weights) < _ROUNDING] = 0.0
    weights[chosen] = np.eye(chosen.size)
    return chosen, weights * length[:, None] / length[chosen]


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


class _KeptProducts:
    """Products by name, columns and part, the last used of them up to a limit of bytes."""

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[str, tuple[int, ...], int], FloatArray] = OrderedDict()
        self._n_bytes = 0

    def of(
        self, name: str, columns: IntArray, part: slice, make: Callable[[], FloatArray]
    ) -> FloatArray:
        """Products that are kept, or made and kept."""
        key = (name, tuple(columns.tolist()), int(part.start))
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        made = make()
        self._kept[key] = made
        self._n_bytes += made.nbytes
        while self._n_bytes > _KEPT_BYTES and len(self._kept) > 1:
            self._n_bytes -= self._kept.popitem(last=False)[1].nbytes
        return made

    def let_go(self) -> None:
        """Keep none of them."""
        self._kept.clear()
        self._n_bytes = 0


@dataclass(frozen=True, eq=False)
class RunParts:
    """Parts of the runs.

    Parameters
    ----------
    records : CarrierSums
        Sums over the records.
    n_runs : int
        Runs.
    """

    records: CarrierSums
    n_runs: int

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Runs of every part."""
        usual_bytes = 8 * self.records.counts.size * _USUAL_COLUMNS**2
        n_parts = min(-(-usual_bytes // _PART_BYTES), self.n_runs)
        edges = np.linspace(0, self.n_runs, n_parts + 1).astype(int).tolist()
        return tuple(slice(first, end) for first, end in pairwise(edges))

    def segments(self, part: slice) -> slice:
        """Segments of the runs of a part."""
        first, end = np.searchsorted(self.records.run_of_segment, [part.start, part.stop])
        return slice(int(first), int(end))

    def runs(self, part: slice) -> IntArray:
        """Number of the run of every segment of a part, counted in the part."""
        return self.records.run_of_segment[self.segments(part)] - part.start

    def gram(self, columns: IntArray, part: slice) -> FloatArray:
        """Products of some columns by segment of a part and channel, shape (P, C, u, u)."""
        return self._kept.of(
            "segments", columns, part, lambda: self.records.gram(columns, self.segments(part))
        )

    def gram_of_runs(self, columns: IntArray, part: slice) -> FloatArray:
        """Products of some columns by run of a part and channel."""
        first = np.searchsorted(self.runs(part), np.arange(part.stop - part.start))
        if first.size == self.runs(part).size:
            return self.gram(columns, part)
        return self._kept.of(
            "runs", columns, part, lambda: np.add.reduceat(self.gram(columns, part), first, axis=0)
        )

    def let_go(self) -> None:
        """Keep no products, before those of another problem are made: they are made again."""
        self._kept.let_go()

    def values(
        self, weights_in: Callable[[slice], tuple[IntArray, FloatArray]]
    ) -> tuple[IntArray, FloatArray]:
        """Numbers of the columns in use and their weights in all runs, shape (n_runs, C, u).

        Parameters
        ----------
        weights_in : callable
            The same for the runs of a part.
        """
        found = [(part, *weights_in(part)) for part in self.slices]
        columns = np.unique(np.concatenate([used for _, used, _ in found]))
        values = np.zeros((self.n_runs, self.records.counts.shape[1], columns.size))
        for part, used, of_part in found:
            values[part, :, np.searchsorted(columns, used)] = of_part
        return columns, values

    @cached_property
    def _kept(self) -> _KeptProducts:
        return _KeptProducts()
