"""Columns of one run, sensor by sensor, no more of them in memory at once than a piece holds."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.records.columns import (
    PREDICTION,
    TARGET,
    ColumnIndex,
    ColumnSource,
    Key,
    delay_nodes,
)
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.rim import CarrierInputs, inputs_of_columns
from carrierflex.simulation.sensing import delayed, delayed_angle

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

#: Samples whose columns are in memory at once.
_CHUNK = 20_000


@dataclass(frozen=True, eq=False)
class BlockColumns:
    """Columns of one sensor in one block of a run.

    Parameters
    ----------
    index : ColumnIndex
        Numbers of the columns.
    rows : ndarray, shape (k, n)
        Columns at the samples of a piece that holds the block, the target first.
    samples : ndarray of int, shape (n,)
        Numbers of these samples in the run, ascending.
    inputs : CarrierInputs
        Inputs at these samples.
    revolutions : sequence of ndarray of int
        Numbers of the samples of every revolution of the block.
    """

    index: ColumnIndex
    rows: FloatArray
    samples: IntArray
    inputs: CarrierInputs
    revolutions: Sequence[IntArray]

    def present(self, revolution: IntArray) -> IntArray:
        """Places of the samples of a revolution in which no column is missing."""
        places = np.searchsorted(self.samples, revolution)
        return places[np.isfinite(self.rows[:, places]).all(axis=0)]


@dataclass(frozen=True, eq=False)
class RunColumns:
    """What the columns of one run are computed from.

    Parameters
    ----------
    run : Run
        Record within its windows of use.
    source : ColumnSource
        Effects, rig and typical speed.
    """

    run: Run
    source: ColumnSource

    @cached_property
    def revolutions(self) -> tuple[IntArray, ...]:
        """Samples of every whole revolution."""
        return whole_revolutions(self.run).samples

    @cached_property
    def inputs(self) -> CarrierInputs:
        """Inputs of the whole run."""
        return inputs_of(self.run)

    @cached_property
    def delayed_inputs(self) -> list[CarrierInputs]:
        """Inputs whose carrier angle is that of some time ago, at the nodes of the delay."""
        inputs = self.inputs
        return [
            replace(
                inputs,
                carrier_angle=delayed_angle(
                    inputs.time, inputs.carrier_angle, shift / self.source.speed
                ),
            )
            for shift in delay_nodes(self.source.rig.n_planets).tolist()
        ]

    def blocks(self, most_blocks: int) -> list[IntArray]:
        """Numbers of the revolutions of at most `most_blocks` blocks."""
        n = len(self.revolutions)
        return np.array_split(np.arange(n), min(most_blocks, n))

    def of(
        self,
        channel: Channel,
        blocks: Sequence[IntArray],
        owners: Collection[str] | None = None,
    ) -> Iterator[BlockColumns]:
        """Columns at a sensor, block by block.

        Parameters
        ----------
        channel : Channel
            Sensor.
        blocks : sequence of ndarray of int
            Numbers of the revolutions of every block.
        owners : collection of str, optional
            Effects whose columns are wanted; all without. The target, and another simulator's
            prediction, are always among them.
        """
        for chunk in self._chunks(blocks):
            samples = np.sort(
                np.concatenate([self.revolutions[r] for block in chunk for r in block])
            )
            inputs = inputs_at(self.inputs, samples)
            rows = self._rows(channel, samples, inputs, owners)
            index = ColumnIndex({key: number for number, key in enumerate(rows)})
            table = np.array(list(rows.values()))
            for block in chunk:
                revolutions = [self.revolutions[r] for r in block]
                yield BlockColumns(index, table, samples, inputs, revolutions)

    def _rows(
        self,
        channel: Channel,
        samples: IntArray,
        inputs: CarrierInputs,
        owners: Collection[str] | None = None,
    ) -> dict[Key, FloatArray]:
        """Columns at a sensor at some samples, whose inputs are given, the target first."""
        late = [inputs_at(shifted, samples) for shifted in self.delayed_inputs]
        delays = delay_nodes(self.source.rig.n_planets)
        return {
            **_target_rows(self.run, channel, samples, delays / self.source.speed),
            **self.source.rows(rim_sensor(channel), inputs, late, owners),
        }

    def _chunks(self, blocks: Sequence[IntArray]) -> list[list[IntArray]]:
        """Blocks grouped so that no group holds many more samples than a chunk."""
        groups: list[list[IntArray]] = [[]]
        n_samples = 0
        for block in blocks:
            size = sum(self.revolutions[r].size for r in block)
            if n_samples and n_samples + size > _CHUNK:
                groups.append([])
                n_samples = 0
            groups[-1].append(block)
            n_samples += size
        return groups


@dataclass(frozen=True, eq=False)
class SomeSamples:
    """A few samples of every run, one after the other.

    Parameters
    ----------
    runs : sequence of Run
        Records within their windows of use.
    samples : sequence of ndarray of int
        Numbers of the samples in every run.
    source : ColumnSource
        Effects, rig and typical speed.
    inputs : CarrierInputs
        Inputs at all of them; m in all. Their time is the part of the run that is over, which is
        what effects follow.
    late : sequence of CarrierInputs
        The same inputs at the nodes of the delay.
    """

    runs: Sequence[Run]
    samples: Sequence[IntArray]
    source: ColumnSource
    inputs: CarrierInputs
    late: Sequence[CarrierInputs]

    def rows(self, channel: Channel) -> FloatArray:
        """All columns at a sensor, the target left out, shape (k - 1, m)."""
        delays = delay_nodes(self.source.rig.n_planets) / self.source.speed
        # Another simulator's prediction is each run's own.
        predicted = [
            np.reshape(
                list(_prediction_rows(run, channel, samples, delays).values()), (-1, samples.size)
            )
            for run, samples in zip(self.runs, self.samples, strict=True)
        ]
        rows = self.source.rows(rim_sensor(channel), self.inputs, self.late)
        return np.concatenate([np.concatenate(predicted, axis=1), list(rows.values())])


def some_samples(runs: Sequence[Run], source: ColumnSource, n_samples: int) -> SomeSamples:
    """A few samples of every run from its first to its last.

    With `n_samples` evenly spaced ones stand some close to both ends, where a delayed angle is not
    known and what is a combination elsewhere is none.

    Parameters
    ----------
    runs : sequence of Run
        Records within their windows of use.
    source : ColumnSource
        Effects, rig and typical speed.
    n_samples : int
        Evenly spaced samples of a run.
    """
    chosen = []
    parts = []
    for run in runs:
        last = run.time.size - 1
        even = np.linspace(0, last, min(n_samples, last + 1)).astype(np.int64)
        close = 2 ** np.arange(max(last, 1).bit_length()) - 1
        samples = np.unique(np.concatenate([even, close, last - close]))
        columns = RunColumns(run, source)
        chosen.append(samples)
        parts.append([inputs_at(own, samples) for own in (columns.inputs, *columns.delayed_inputs)])
    inputs, *late = [_in_a_row(own) for own in zip(*parts, strict=True)]
    return SomeSamples(runs, chosen, source, inputs, late)


def _in_a_row(parts: Sequence[CarrierInputs]) -> CarrierInputs:
    """Inputs of several runs one after the other, each run's time from 0 to 1."""
    rows = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("carrier_angle", "torque", "ntl_y", "ntl_z")
    }
    time = [(part.time - part.start) / (part.end - part.start) for part in parts]
    return CarrierInputs(time=np.concatenate(time), **rows, start=0.0, end=1.0)


def inputs_of(run: Run) -> CarrierInputs:
    """Inputs of a whole run."""
    zero = np.zeros(run.time.size)
    # A rig without radial load has no columns of it.
    return inputs_of_columns({"ntl_y": zero, "ntl_z": zero, **run.inputs, "time": run.time})


def columns_of_campaign(run: Run, channel: Channel, source: ColumnSource) -> ColumnIndex:
    """Numbers of the columns, from one sample of a run."""
    columns = RunColumns(run, source)
    first = inputs_at(columns.inputs, np.arange(1))
    shifts = delay_nodes(source.rig.n_planets)
    rows = {
        **_target_rows(run, channel, np.arange(1), shifts / source.speed),
        **source.rows(rim_sensor(channel), first, [first] * len(shifts)),
    }
    return ColumnIndex({key: number for number, key in enumerate(rows)})


def _target_rows(
    run: Run, channel: Channel, samples: IntArray, delays: FloatArray
) -> dict[Key, FloatArray]:
    """Target and another simulator's prediction."""
    target = run.signals[channel.name][samples]
    return {(TARGET, 0, "", 0): target, **_prediction_rows(run, channel, samples, delays)}


def _prediction_rows(
    run: Run, channel: Channel, samples: IntArray, delays: FloatArray
) -> dict[Key, FloatArray]:
    """Another simulator's prediction, at the nodes of a delay too; empty where there is none.

    It is moved in time only, by `delays` [s]: its waves turn with the carrier.
    """
    if channel.name not in run.predictions:
        return {}
    prediction = run.predictions[channel.name]
    rows = {(PREDICTION, 0, "", 0): prediction[samples]}
    for node, delay in enumerate(delays.tolist()):
        if delay:
            late = delayed(run.time, prediction, delay)
            rows[PREDICTION, 0, "delay", node] = late[samples]
    return rows


def inputs_at(inputs: CarrierInputs, samples: IntArray) -> CarrierInputs:
    """What acts on the carrier at some samples of a run."""
    names = ("time", "carrier_angle", "torque", "ntl_y", "ntl_z")
    return replace(inputs, **{name: getattr(inputs, name)[samples] for name in names})
