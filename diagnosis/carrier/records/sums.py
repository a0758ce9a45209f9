"""Sums over the records of a carrier campaign, accumulated once: products of all columns.

Fits, held-out scores and the class table are algebra on these sums, run slice by run slice where a
campaign is large; the orders of what a model leaves take another pass over the records. Of some 300
columns of a sensor fewer than half are different: a tilt of the housing, its column at a sensor
moved by 3 deg and an offset are one constant, in every run alike. The products are of those.
"""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from carrierflex.diagnosis.carrier.records.columns import (
    ColumnIndex,
    ColumnSource,
    blocks_of_runs,
    columns_of_campaign,
    inputs_of,
    some_samples,
)
from carrierflex.diagnosis.comparison.problem import ComplexArray, FloatArray, IntArray, Segment
from carrierflex.files.temporary_store import Rows, zero_rows
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions

#: Length of a column of unit length that must lie off the others for it to be in the basis: those
#: that stand far off first, so that the weights of the rest are small. What is a combination misses
#: by rounding, 1e-13.
_OFF_THE_OTHERS = (1e-2, 1e-4, 1e-6, 1e-8)
#: Share of the largest below which a weight of columns of unit length is rounding, and any other
#: value, as the miss of a combination.
_ROUNDING_OF_WEIGHTS, ROUNDING = 1e-11, 1e-10
#: Samples at which the columns are compared, over all runs, and fewest of a run.
_SAMPLES = 2000
_FEWEST = 12
#: Blocks of a run at most: enough draws for the bootstrap, and two revolutions a block in a
#: minute's record.
MOST_BLOCKS = 12
#: Bytes that products of all columns would take, up to which a run has several blocks; and those of
#: a whole diagnosis, beyond which a campaign is refused.
_USUAL_MEMORY = 600_000_000
_MOST_MEMORY = 8_000_000_000
#: Bytes of the program itself and of what works on records and products: an estimate.
_PROGRAM = 1_100_000_000
#: Bytes of products of one kind up to which they are in memory: beyond on disk, in fewer blocks, or
#: for some runs.
IN_MEMORY = 150_000_000
#: Bytes of an array that is in memory at once: unpacked products, and those of a slice of the runs
#: for a usual set of so many columns. Weights of a slice, their derivatives and what works on them
#: are some four times as large.
_AT_ONCE = 50_000_000
_USUAL_COLUMNS = 40
#: Every which sample is looked at for whether the basis holds.
_CHECKED = 25


@dataclass(frozen=True, eq=False)
class _ColumnBasis:
    """Basis of the columns of every sensor, the target left out; C channels, k - 1 columns."""

    members: tuple[IntArray, ...]
    weights: FloatArray  # (C, k - 1, b) every column by those of the basis
    largest: FloatArray  # (C, k - 1) largest size of every column where it was looked at

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
        limit = ROUNDING * largest
        return bool((np.abs(missed).max(axis=1, initial=0.0) <= limit).all())


def _every_column(n_columns: int, n_channels: int) -> _ColumnBasis:
    """Basis of all columns."""
    members = np.arange(n_columns)
    weights = np.broadcast_to(np.eye(n_columns), (n_channels, n_columns, n_columns))
    return _ColumnBasis((members,) * n_channels, weights, np.zeros((n_channels, n_columns)))


def _column_basis(
    runs: Sequence[Run], channels: Sequence[Channel], source: ColumnSource
) -> _ColumnBasis:
    """Basis of the columns of every sensor at some samples of all runs."""
    n_samples = max(_FEWEST, _SAMPLES // len(runs))
    members, of_channels, largest = [], [], []
    # Channel by channel: the columns of all of them are several times the records.
    columns = some_samples(runs, source, n_samples)
    n_effects = columns_of_campaign(runs[0], channels[0], source).flexible.start - 1
    for channel in channels:
        table = np.array(list(columns.rows(channel).values())[1:])
        table = table[:, np.isfinite(table).all(axis=0)]
        chosen, combinations = _combinations(table, n_effects)
        members.append(chosen)
        of_channels.append(combinations)
        largest.append(np.abs(table).max(axis=1, initial=0.0))
    weights = np.zeros((len(channels), len(largest[0]), max(chosen.size for chosen in members)))
    for c, combinations in enumerate(of_channels):
        weights[c, :, : combinations.shape[1]] = combinations
    return _ColumnBasis(tuple(members), weights, np.array(largest))


def _combinations(rows: FloatArray, n_effects: int) -> tuple[IntArray, FloatArray]:
    """Numbers of the rows in the basis, and every row by these."""
    # The first rows are those of effects, which are combinations of one another only: a load that
    # is zero in a run leaves them zero there.
    length = np.linalg.norm(rows, axis=1)
    scaled = rows / np.where(length > 0.0, length, 1.0)[:, None]
    # In an orthonormal basis of all rows: fewer numbers than samples.
    scaled = np.asarray(np.linalg.qr(scaled.T, mode="r")).T
    members: list[int] = []
    directions = np.empty((scaled.shape[1], scaled.shape[1]))
    groups = (np.arange(n_effects), np.arange(n_effects, len(rows)))
    for group in groups:
        off = _off(scaled[group], directions[: len(members)])
        for limit in _OFF_THE_OTHERS:
            # What lies within the others by the last limit is in no basis.
            numbers = np.flatnonzero(np.linalg.norm(off, axis=1) > _OFF_THE_OTHERS[-1])
            rest, first = off[numbers], 0
            while True:
                above = np.flatnonzero(np.linalg.norm(rest[first:], axis=1) > limit)
                if not above.size:
                    break
                first += int(above[0])
                known = directions[: len(members)]
                direction = _off(rest[first] / np.linalg.norm(rest[first]), known)  # rounding
                direction /= np.linalg.norm(direction)
                directions[len(members)] = direction
                members.append(int(group[numbers[first]]))
                rest -= np.outer(rest @ direction, direction)
                first += 1
            off = rest
            group = group[numbers]
    chosen = np.array(sorted(members), dtype=np.int64)
    weights = np.zeros((len(rows), chosen.size))
    weights[chosen] = np.eye(chosen.size)
    by_direction = scaled @ directions[: len(members)].T
    for group in groups:
        usable = chosen[chosen <= group[-1]]
        n_usable = usable.size
        # Members lie in the directions up to their own.
        in_turn = np.array(members[:n_usable], dtype=np.int64)
        by_member = solve_triangular(
            by_direction[in_turn, :n_usable], by_direction[group, :n_usable].T, trans=1, lower=True
        )
        by_all = by_member.T[:, np.argsort(in_turn)]
        # Anew by those that count: what rounding makes of the others makes up for each other.
        others = np.flatnonzero(~np.isin(group, chosen))
        counts, of_row = np.unique(
            np.abs(by_all[others]) >= _ROUNDING_OF_WEIGHTS, axis=0, return_inverse=True
        )
        for pattern, used in enumerate(map(np.flatnonzero, counts)):
            rows_alike = group[others[of_row == pattern]]
            solved = np.linalg.lstsq(scaled[usable[used]].T, scaled[rows_alike].T, rcond=None)[0]
            weights[np.ix_(rows_alike, used)] = solved.T
    return chosen, weights * length[:, None] / length[chosen]


def _off(rows: FloatArray, directions: FloatArray) -> FloatArray:
    """What of some rows lies off orthonormal directions."""
    return np.asarray(rows - (rows @ directions.T) @ directions)


@dataclass(frozen=True, eq=False)
class CarrierSums:
    """Sums of a campaign; P segments, C channels, k columns, R revolutions in all."""

    index: ColumnIndex  # Numbers of the columns, the target first
    segments: tuple[Segment, ...]  # Blocks of whole revolutions
    run_of_segment: IntArray  # Number of the run of every segment, shape (P,)
    target: FloatArray  # Products of the target with every column, itself first, shape (P, C, k)
    basis: _ColumnBasis  # Columns of every channel that the others are combinations of; b of them
    #: Products of the columns of the basis with each other: the upper triangle, row by row. Those
    #: of a large campaign are on disk and read for some segments at a time, shape (P, C, b (b + 1).
    products: Rows
    counts: IntArray  # Samples that are not missing, shape (P, C)
    #: Order amplitudes of the measured signal by revolution, NaN where one is too sparse, shape (R,
    #: C, n + 1)
    orders: ComplexArray
    #: Sum of squares of the measured signal about those orders, and its degrees of freedom, shape
    #: (R, C, 2)
    within: FloatArray
    run_of_revolution: IntArray  # Number of the run of every revolution, shape (R,)
    #: Mean torque [N m] and radial load [N] along y and z of every revolution, shape (R, 3)
    loads: FloatArray

    def __getstate__(self) -> dict[str, Any]:
        """Without the products that are stored."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def mean_loads(self) -> FloatArray:
        """Mean loads of every run, shape (n_runs, 3)."""
        runs = np.unique(self.run_of_revolution)
        return np.array([self.loads[self.run_of_revolution == r].mean(axis=0) for r in runs])

    def gram(self, columns: IntArray, segments: slice = slice(None)) -> FloatArray:
        """Products of some columns, the target first, shape (P, C, u, u), of some segments."""
        weights = self.basis.weights[:, columns[1:] - 1]
        used = np.flatnonzero(weights.any(axis=(0, 1)))
        weights = weights[..., used]
        triangle = self.triangle(used[:, None], used)
        first = segments.indices(len(self.target))[0]
        target = self.target[segments]
        result = np.empty((*target.shape[:2], columns.size, columns.size))
        result[..., 0, :] = result[..., 0] = target[..., columns]
        n_stored = self.products.shape[2]
        step = max(1, _AT_ONCE // (8 * len(weights) * max(used.size**2, n_stored)))
        for p in range(0, len(result), step):
            some = slice(p, min(p + step, len(result)))
            stored = self.products[first + some.start : first + some.stop]
            products = weights @ stored[..., triangle]
            result[some, :, 1:, 1:] = products @ np.swapaxes(weights, 1, 2)
        return result

    def segments_of(self, runs: slice) -> slice:
        """Segments of some neighbouring runs."""
        first, end = np.searchsorted(self.run_of_segment, [runs.start, runs.stop])
        return slice(int(first), int(end))

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Runs whose weights and products are in memory at once; a usual campaign is one slice."""
        n_runs = int(self.run_of_segment[-1]) + 1
        usual_bytes = 8 * self.counts.size * _USUAL_COLUMNS**2
        n_slices = min(-(-usual_bytes // _AT_ONCE), n_runs)
        edges = np.linspace(0, n_runs, n_slices + 1).astype(int).tolist()
        return tuple(slice(first, end) for first, end in pairwise(edges))

    def run_in_slice(self, runs: slice) -> IntArray:
        """Number of the run of every segment of a slice, counted in the slice."""
        return self.run_of_segment[self.segments_of(runs)] - runs.start

    def gram_of_slice(self, columns: IntArray, runs: slice) -> FloatArray:
        """Products of some columns by segment of a slice and channel, for the next step of a fit.

        Those that fit in memory are stored, shape (P, C, u, u).
        """
        key = ("segments", tuple(columns.tolist()), runs.start)
        return self._stored_at(key, lambda: self.gram(columns, self.segments_of(runs)))

    def gram_of_runs(self, columns: IntArray, runs: slice) -> FloatArray:
        """The same by run of a slice."""
        run_of_segment = self.run_in_slice(runs)
        first = np.searchsorted(run_of_segment, np.arange(runs.stop - runs.start))
        if first.size == run_of_segment.size:
            return self.gram_of_slice(columns, runs)
        key = ("runs", tuple(columns.tolist()), runs.start)
        return self._stored_at(
            key, lambda: np.add.reduceat(self.gram_of_slice(columns, runs), first, axis=0)
        )

    def _stored_at(
        self, key: tuple[str, tuple[int, ...], int], make: Callable[[], FloatArray]
    ) -> FloatArray:
        """Products that are stored, or made and stored: the last used up to a limit of bytes."""
        stored = self._stored
        if key not in stored:
            stored[key] = make()
        stored.move_to_end(key)
        while len(stored) > 1 and sum(one.nbytes for one in stored.values()) > IN_MEMORY:
            stored.popitem(last=False)
        return stored[key]

    @cached_property
    def _stored(self) -> OrderedDict[tuple[str, tuple[int, ...], int], FloatArray]:
        """Products by name, columns and first run."""
        return OrderedDict()

    def products_of_basis(self, segments: slice, first: IntArray) -> FloatArray:
        """Products of target and basis over groups of segments, (n_groups, C, 1 + b, 1 + b)."""
        stored = np.add.reduceat(self.products[segments], first, axis=0)
        target = np.add.reduceat(self.target[segments], first, axis=0)
        result = np.zeros((*stored.shape[:2], *2 * (self.basis.size + 1,)))
        result[..., 1:, 1:] = stored[..., self._square]
        for c, members in enumerate(self.basis.members):
            with_target = target[:, c, np.append(0, 1 + members)]
            result[:, c, 0, : 1 + members.size] = with_target
            result[:, c, : 1 + members.size, 0] = with_target
        return result

    def by_basis(self, channel: int, weights: FloatArray) -> FloatArray:
        """Rows by target and basis, shape (m, 1 + b), of weights of some columns from the first."""
        of_columns = self.basis.weights[channel, : weights.shape[1] - 1]
        return np.hstack([weights[:, :1], weights[:, 1:] @ of_columns])

    def with_target(self, columns: IntArray, weights: FloatArray) -> "CarrierSums":
        """Sums whose target is a sum of columns by weights of shape (n_runs, C, u)."""
        triangle = self._square
        of_columns = self.basis.weights[:, columns[1:] - 1]
        target = np.empty_like(self.target)
        for p, run in enumerate(self.run_of_segment):
            combined = np.einsum("cub,cu->cb", of_columns, weights[run, :, 1:])
            with_basis = np.einsum("cab,cb->ca", self.products[p : p + 1][0][:, triangle], combined)
            target[p, :, 0] = np.einsum("ca,ca->c", with_basis, combined)
            target[p, :, 1:] = np.einsum("cka,ca->ck", self.basis.weights, with_basis)
        # The orders are those of the signals that were replaced.
        no_orders = np.broadcast_to(np.complex128(np.nan), self.orders.shape)
        return replace(self, target=target, orders=no_orders)

    @property
    def _square(self) -> IntArray:
        """Numbers of the products of all columns of the basis in their triangle, shape (b, b)."""
        every = np.arange(self.basis.size)
        return self.triangle(every[:, None], every)

    def triangle(self, rows: IntArray, columns: IntArray) -> IntArray:
        """Numbers of the products of columns of the basis in their triangle."""
        first, second = np.minimum(rows, columns), np.maximum(rows, columns)
        size = self.basis.size
        return np.asarray(first * size - first * (first - 1) // 2 + second - first)


def accumulated_sums(
    campaign: Campaign, source: ColumnSource, like: CarrierSums | None = None
) -> CarrierSums:
    """Accumulate the sums of a campaign; `like` are others of it with the segments that it has."""
    runs = campaign.within_use().runs
    index = columns_of_campaign(runs[0], campaign.channels[0], source)
    n_channels = len(campaign.channels)
    basis = _column_basis(runs, campaign.channels, source)
    # Columns may be combinations where they were looked at, and none elsewhere.
    for one in (basis, _every_column(len(index) - 1, n_channels)):
        n_blocks = _blocks_a_run(campaign, index if like is None else like.index, one.size)
        sums = _filled(campaign, source, index, one, n_blocks)
        if sums is not None:
            break
    assert sums is not None
    number = np.arange(len(sums.run_of_segment))
    block = number - np.searchsorted(sums.run_of_segment, sums.run_of_segment)
    columns = (sums.run_of_segment, block, sums.counts.sum(axis=1))
    return replace(
        sums,
        segments=tuple(
            Segment(runs[r].name, runs[r].condition, k, n_samples)
            for r, k, n_samples in zip(*(one.tolist() for one in columns), strict=True)
        ),
    )


def _filled(
    campaign: Campaign,
    source: ColumnSource,
    index: ColumnIndex,
    basis: _ColumnBasis,
    n_blocks: int,
) -> CarrierSums | None:
    """Sums without their segments; None where the basis does not hold."""
    runs = campaign.within_use().runs
    loads, n_turns = [], []
    for run in runs:
        inputs, turns = inputs_of(run), whole_revolutions(run).samples
        n_turns.append(len(turns))
        columns = (inputs.torque, inputs.ntl_y, inputs.ntl_z)
        loads += [[column[samples].mean() for column in columns] for samples in turns]
    numbers, n_channels = np.arange(len(runs)), len(campaign.channels)
    run_of_segment = np.repeat(numbers, np.minimum(n_blocks, n_turns))
    shape, of_turns = (run_of_segment.size, n_channels), (len(loads), n_channels)
    highest = highest_order(source.rig.n_planets)
    sums = CarrierSums(
        index=index,
        segments=(),
        run_of_segment=run_of_segment,
        target=np.empty((*shape, len(index))),
        basis=basis,
        products=zero_rows((*shape, basis.size * (basis.size + 1) // 2), IN_MEMORY),
        counts=np.empty(shape, dtype=np.int64),
        orders=np.zeros((*of_turns, highest + 1), dtype=np.complex128),
        within=np.zeros((*of_turns, 2)),
        run_of_revolution=np.repeat(numbers, n_turns),
        loads=np.array(loads),
    )
    for c, blocks in blocks_of_runs(runs, campaign.channels, source, n_blocks):
        if c == 0:
            products: FloatArray = np.zeros((len(blocks), *sums.products.shape[1:]))
        members = basis.members[c]
        upper = np.triu_indices(members.size)
        triangle = sums.triangle(*upper)
        for k, block in enumerate(blocks):
            present = block.present
            if not basis.holds(c, present[1:, ::_CHECKED]):
                return None
            orders, off_orders = block.orders(block.rows[0], highest)
            sums.orders[block.turns, c] = orders
            sums.within[block.turns, c] = off_orders
            of_basis = present[1 + members]
            sums.target[block.number, c] = present @ present[0]
            products[k, c, triangle] = (of_basis @ of_basis.T)[upper]
            sums.counts[block.number, c] = present.shape[1]
        if c == n_channels - 1:
            sums.products[blocks[0].number : blocks[-1].number + 1] = products
    return sums


def _blocks_a_run(campaign: Campaign, index: ColumnIndex, n_basis: int) -> int:
    """Blocks that every run is divided into: as many as leave memory free, 1 to 12."""
    n_runs, n_channels = len(campaign.runs), len(campaign.channels)
    records = sum(8 * run.time.size * (1 + len(run.columns())) for run in campaign.runs)
    n_stored = n_basis * (n_basis + 1) // 2 + len(index)
    # Lines beside the orders are taken out of a copy of the records.
    needed = _PROGRAM + 2 * records + 8 * n_runs * n_channels * n_stored
    if needed > _MOST_MEMORY:
        raise ValueError(
            f"{n_runs} runs of {n_channels} channels: a diagnosis takes {needed / 1e9:.1f} GB of "
            f"memory; expected at most {_MOST_MEMORY / 1e9:.0f} GB: leave out channels, or runs of "
            "conditions that others have too"
        )
    # Whatever is a combination in these records: the same campaign has the same segments.
    n_columns = index.flexible.start
    every = 4 * n_runs * n_channels * n_columns * (n_columns + 1)
    return int(np.clip(_USUAL_MEMORY // every, 1, MOST_BLOCKS))


def normal_sums(
    slopes: FloatArray, gram: FloatArray, residual: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """``J.T J`` and ``J.T r`` over the channels, by segment or run."""
    products = slopes @ gram
    matrix = (products @ np.swapaxes(slopes, 2, 3)).sum(axis=1)
    return matrix, (products @ residual[..., None])[..., 0].sum(axis=1)


def segment_squares(residual: FloatArray, gram: FloatArray) -> FloatArray:
    """Sum of squares by segment and channel; a perfect fit leaves rounding of either sign."""
    products = (gram @ residual[..., None])[..., 0]
    return np.maximum((products * residual).sum(axis=-1), 0.0)
