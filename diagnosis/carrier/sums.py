"""Sums over the records of a carrier campaign, accumulated once.

Products of all columns by piece and channel.

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
from carrierflex.diagnosis.carrier.laws import CarrierInputs, RimSensor
from carrierflex.diagnosis.comparison.problem import Segment
from carrierflex.identification.campaign.campaign import Campaign, Channel
from carrierflex.identification.campaign.order_analysis import (
    MAX_ORDER,
    order_amplitudes,
    too_sparse,
)
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import sensor_position
from carrierflex.simulation.carrier.effects import delayed_values
from carrierflex.simulation.carrier.run_cases import AXIAL

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Blocks of a run at most: enough draws for the bootstrap, and two revolutions a block in a
#: minute's record.
_MOST_BLOCKS = 12
#: Samples whose columns are held at once.
_CHUNK = 20_000


@dataclass(frozen=True, eq=False)
class CarrierSums:
    """Sums of a campaign; P pieces, C channels, k columns, R revolutions in all.

    Parameters
    ----------
    book : ColumnIndex
        Numbers of the columns.
    segments : tuple of Segment
        Blocks of whole revolutions.
    run_of_segment : ndarray of int, shape (P,)
        Number of the run of every piece.
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

    book: ColumnIndex
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


def rim_sensor(channel: Channel) -> RimSensor:
    """Place and direction of a channel."""
    angle, radius = sensor_position(channel)
    return RimSensor(angle, radius, channel.quantity == AXIAL)


def inputs_of(run: Run) -> CarrierInputs:
    """Inputs of a whole run."""
    angle, torque, ntl_y, ntl_z = (
        run.inputs[name] for name in ("carrier_angle", "torque", "ntl_y", "ntl_z")
    )
    return CarrierInputs(
        run.time, angle, torque, ntl_y, ntl_z, float(run.time[0]), float(run.time[-1])
    )


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
        Where the carrier turns by less than one revolution in a run.
    """
    parts = [_run_sums(run, campaign, source) for run in campaign.runs]
    book = parts[0][0]
    segments = [
        Segment(r.name, r.condition, b, int(n.sum()))
        for r, own in zip(campaign.runs, parts, strict=True)
        for b, n in enumerate(own[2])
    ]
    # Hundreds of megabytes: copied once, from the lists of the runs.
    gram = np.array([block for own in parts for block in own[1]])
    counts, orders, within, loads = (np.concatenate([own[k] for own in parts]) for k in range(2, 6))
    run_of_segment = np.repeat(np.arange(len(parts)), [len(own[1]) for own in parts])
    run_of_revolution = np.repeat(np.arange(len(parts)), [len(own[3]) for own in parts])
    return CarrierSums(
        book,
        tuple(segments),
        run_of_segment,
        gram,
        counts,
        orders,
        within,
        run_of_revolution,
        loads,
    )


_RunSums = tuple[
    ColumnIndex, list[list[FloatArray]], IntArray, NDArray[np.complex128], FloatArray, FloatArray
]


def _run_sums(run: Run, campaign: Campaign, source: ColumnSource) -> _RunSums:
    """Book, products by block and channel, counts, orders, scatter within revolutions, and loads of one run."""
    revolutions = whole_revolutions(run).samples
    blocks = np.array_split(np.arange(len(revolutions)), min(_MOST_BLOCKS, len(revolutions)))
    inputs = inputs_of(run)
    shifts = [
        replace(
            inputs,
            carrier_angle=delayed_values(
                run.time, inputs.carrier_angle, float(node / source.speed)
            ),
        )
        for node in DELAY_NODES
    ]
    book: ColumnIndex | None = None
    results: list[list[list[np.ndarray]]] = []
    for channel in campaign.channels:
        sensor, own = rim_sensor(channel), []
        for block in _chunks(blocks, revolutions):
            samples = np.sort(np.concatenate([revolutions[r] for b in block for r in b]))
            rows = source.rows(sensor, _part(inputs, samples), [_part(s, samples) for s in shifts])
            keyed = {**_target_rows(run, channel, samples, source.speed), **rows}
            book = book or ColumnIndex({key: place for place, key in enumerate(keyed)})
            table = np.array(list(keyed.values()))
            own += [
                _block_sums(table, samples, [revolutions[r] for r in b], inputs.carrier_angle)
                for b in block
            ]
        results.append([list(column) for column in zip(*own, strict=True)])
    assert book is not None
    gram = [list(block) for block in zip(*(own[0] for own in results), strict=True)]
    counts = np.array([own[1] for own in results]).T
    orders, within = (np.stack([np.concatenate(own[k]) for own in results], axis=1) for k in (2, 3))
    columns = (inputs.torque, inputs.ntl_y, inputs.ntl_z)
    loads = np.array([[column[own].mean() for column in columns] for own in revolutions])
    return book, gram, counts, orders, within, loads


def _chunks(blocks: Sequence[IntArray], revolutions: Sequence[IntArray]) -> list[list[IntArray]]:
    """Blocks grouped so that no group holds many more samples than a chunk."""
    groups: list[list[IntArray]] = [[]]
    held = 0
    for block in blocks:
        size = sum(revolutions[r].size for r in block)
        if held and held + size > _CHUNK:
            groups.append([])
            held = 0
        groups[-1].append(block)
        held += size
    return groups


def _target_rows(
    run: Run, channel: Channel, samples: IntArray, speed: float
) -> dict[Key, FloatArray]:
    """Target and another simulator's prediction, the latter at the nodes of a delay and of a moved sensor too.

    Another simulator's prediction is moved in time only: its waves turn with the carrier.
    """
    rows = {(TARGET, 0, "", 0): run.signals[channel.name][samples]}
    if channel.name in run.predictions:
        prediction = run.predictions[channel.name]
        rows[PREDICTION, 0, "", 0] = prediction[samples]
        for node, shift in enumerate(DELAY_NODES):
            if shift:
                asked = run.time[samples] - shift / speed
                rows[PREDICTION, 0, "delay", node] = np.interp(asked, run.time, prediction)
    return rows


def _part(inputs: CarrierInputs, samples: IntArray) -> CarrierInputs:
    names = ("time", "carrier_angle", "torque", "ntl_y", "ntl_z")
    return replace(inputs, **{name: getattr(inputs, name)[samples] for name in names})


def _block_sums(
    table: FloatArray, samples: IntArray, revolutions: Sequence[IntArray], angle: FloatArray
) -> tuple[FloatArray, int, NDArray[np.complex128], FloatArray]:
    """Products, number of samples, orders and scatter of one block."""
    k = len(table)
    gram, count = np.zeros((k, k)), 0
    orders = np.full((len(revolutions), MAX_ORDER + 1, k), np.nan, dtype=np.complex128)
    within = np.zeros((len(revolutions), 2))
    for r, rows in enumerate(revolutions):
        places = np.searchsorted(samples, rows)
        present = np.isfinite(table[:, places]).all(axis=0)
        own, theta = table[:, places[present]], angle[rows[present]]
        gram += own @ own.T
        count += theta.size
        if not too_sparse(theta, MAX_ORDER):
            orders[r], within[r] = order_amplitudes(own, theta)
    return gram, count, orders, within
