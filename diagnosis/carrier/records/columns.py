"""Columns of the carrier's signals: every basis function an effect can ask for, by run and sensor.

Effects that move a sensor or delay a signal are polynomials through the exact columns at a few
shifts: with nodes 3 deg (sensor, up to 6) and 6 deg (delay, up to 18) apart the interpolation
misses order 6, the second of three planets, by less than half a per cent of its amplitude. More
planets have as many more nodes. A shape is linear between its nodes; several shapes share no part
of the signal. No more columns are in memory at once than a chunk holds.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray, IntArray
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.revolutions import whole_revolutions
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.rim import (
    CarrierInputs,
    CarrierRig,
    RimSensor,
    inputs_of_columns,
)
from carrierflex.simulation.sensing import delayed, delayed_angle

#: Largest shift of a sensor, and of the angle behind a delay, at which columns are computed.
_FARTHEST_MOVE_DEG, _FARTHEST_DELAY_DEG = 6.0, 18.0
#: Values between the bounds of a shape that names no nodes.
_SHAPE_NODES = 11
#: Orders of the flexible residual model up to which it follows the radial load.
_FORCED_ORDERS = 2
TARGET = "target"
PREDICTION = "prediction"
ONE = "one"
#: Owner of the features of the flexible residual model, the last columns.
FLEXIBLE = "flexible"
#: Families of nodes; plain columns have none.
PLAIN = ""
SHAPE = "threshold"
ANGLE = "angle"
DELAY = "delay"
Key = tuple[str, int, str, int]
#: Loads by which a wave of the flexible model is multiplied.
CONSTANT = "1"
TORQUE = "torque"
FORCE_Y = "ntl_y"
FORCE_Z = "ntl_z"
#: Columns of time before those of the flexible residual model: u and u squared.
N_TIME_COLUMNS = 2
_INPUTS = ("time", "carrier_angle", "torque", "ntl_y", "ntl_z")
#: Samples whose columns are in memory at once.
_CHUNK = 20_000


@dataclass(frozen=True)
class FlexibleTerm:
    """One column of the flexible residual model: cosine or sine of an order, times a load.

    Torque is over the nominal torque, radial loads over the largest radial load.
    """

    order: int
    is_sine: bool
    load: str


@dataclass(frozen=True, eq=False)
class ColumnIndex:
    """Numbers of the columns."""

    #: Number of each column by ``(effect, number of its parameter, node family, node)``
    numbers: Mapping[Key, int]

    def of(self, effect: str, parameter: int = 0, family: str = PLAIN, node: int = 0) -> int:
        """Number of one column."""
        return self.numbers[effect, parameter, family, node]

    @property
    def has_prediction(self) -> bool:
        """Whether the record holds another simulator's prediction."""
        return (PREDICTION, 0, PLAIN, 0) in self.numbers

    @property
    def flexible(self) -> slice:
        """Numbers of the features of the flexible residual model."""
        return slice(self.numbers[FLEXIBLE, 0, PLAIN, 0], self.size)

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.numbers)


@dataclass(frozen=True, eq=False)
class ColumnSource:
    """What columns are computed from."""

    rig: CarrierRig  # Rig and curves
    effects: Mapping[str, Effect]  # All effects, contained ones among them
    speed: float  # Typical speed of the carrier [rad/s]
    largest_load: float  # Largest radial load [N]; 1 where there is none

    def rows(
        self,
        sensor: RimSensor,
        inputs: CarrierInputs,
        delayed: Sequence[CarrierInputs],
        owners: Collection[str] | None = None,
    ) -> dict[Key, FloatArray]:
        """Columns of effects and of the flexible model by key [m per unit of the parameter].

        `delayed` are the same inputs at the nodes of the delay, `owners` the effects whose columns
        are wanted; default: all, and those of the flexible model.
        """
        rows: dict[Key, FloatArray] = {(ONE, 0, PLAIN, 0): np.ones(inputs.time.size)}
        for effect in self.effects.values():
            if effect.pattern is None or (owners is not None and effect.id not in owners):
                continue
            if effect.n_shapes:
                # An effect with one shape is its only pattern.
                patterns = effect.shape_parts or (effect.signals,)
                nodes = self.shape_nodes(effect).tolist()
                for node, (pattern, value) in enumerate(product(patterns, nodes)):
                    signals = pattern(sensor, inputs, self.rig, value)
                    rows.update(_keyed(effect.id, SHAPE, node, signals))
                continue
            rows.update(_keyed(effect.id, PLAIN, 0, effect.signals(sensor, inputs, self.rig)))
            if effect.follows_sensor:
                moves = angle_nodes(self.rig.n_planets)
                for node in np.flatnonzero(moves).tolist():
                    moved = replace(sensor, angle=sensor.angle + moves[node])
                    signals = effect.signals(moved, inputs, self.rig)
                    rows.update(_keyed(effect.id, ANGLE, node, signals))
            if effect.follows_delay:
                for node in np.flatnonzero(delay_nodes(self.rig.n_planets)).tolist():
                    signals = effect.signals(sensor, delayed[node], self.rig)
                    rows.update(_keyed(effect.id, DELAY, node, signals))
        if owners is None:
            rows.update(_keyed(FLEXIBLE, PLAIN, 0, self._flexible_rows(inputs)))
        return rows

    def shape_nodes(self, effect: Effect) -> FloatArray:
        """Values between which an effect's signals are interpolated, of each of its shapes."""
        if effect.shape_nodes is not None:
            return effect.shape_nodes(self.rig, self.largest_load)
        shape = effect.parameters[-1]
        return np.linspace(shape.lower, shape.upper, _SHAPE_NODES)

    def _flexible_rows(self, inputs: CarrierInputs) -> FloatArray:
        """Features of the flexible residual model, the same at every sensor, shape (k, n)."""
        quantity = {
            CONSTANT: np.ones_like(inputs.torque),
            TORQUE: inputs.torque / self.rig.nominal_torque,
            FORCE_Y: inputs.ntl_y / self.largest_load,
            FORCE_Z: inputs.ntl_z / self.largest_load,
        }
        lasts = np.maximum(inputs.end - inputs.start, np.finfo(float).tiny)
        u = (2.0 * inputs.time - inputs.start - inputs.end) / lasts
        terms = flexible_terms(self.rig.n_planets)
        waves = {
            (order, is_sine): (np.sin if is_sine else np.cos)(order * inputs.carrier_angle)
            for order, is_sine in {(term.order, term.is_sine): None for term in terms}
        }
        rows = [u, u**2]
        rows += [waves[term.order, term.is_sine] * quantity[term.load] for term in terms]
        return np.array(rows)


def angle_nodes(n_planets: int) -> FloatArray:
    """Shifts of a sensor at which columns are computed [rad]: five of three planets."""
    n_nodes = 2 * (-(-2 * n_planets // 3)) + 1
    return np.deg2rad(np.linspace(-_FARTHEST_MOVE_DEG, _FARTHEST_MOVE_DEG, n_nodes))


def delay_nodes(n_planets: int) -> FloatArray:
    """Shifts of the angle behind a delay at which columns are computed [rad]: 7 of 3 planets."""
    n_nodes = 2 * n_planets + 1
    return np.deg2rad(np.linspace(-_FARTHEST_DELAY_DEG, _FARTHEST_DELAY_DEG, n_nodes))


@lru_cache
def flexible_terms(n_planets: int) -> tuple[FlexibleTerm, ...]:
    """Columns of the flexible residual model after its two of time, in their order."""
    terms = []
    for order in range(highest_order(n_planets) + 1):
        loads = [CONSTANT]
        if order <= 2 * n_planets + 2:
            loads.append(TORQUE)
        if order <= _FORCED_ORDERS:
            loads += [FORCE_Y, FORCE_Z]
        waves = (False, True) if order else (False,)
        terms += [FlexibleTerm(order, is_sine, load) for is_sine in waves for load in loads]
    return tuple(terms)


def _keyed(effect: str, family: str, node: int, rows: FloatArray) -> dict[Key, FloatArray]:
    return {(effect, number, family, node): row for number, row in enumerate(rows)}


def typical_speed(campaign: Campaign) -> float:
    """Typical speed of the carrier [rad/s]."""
    turned = [
        abs(float(run.inputs["carrier_angle"][-1] - run.inputs["carrier_angle"][0]))
        for run in campaign.runs
    ]
    lasted = [float(run.time[-1] - run.time[0]) for run in campaign.runs]
    return max(sum(turned) / max(sum(lasted), np.finfo(float).tiny), np.finfo(float).tiny)


def largest_load(campaign: Campaign) -> float:
    """Largest radial load [N]; 1 where there is none."""
    if "ntl_y" not in campaign.contract.inputs:
        return 1.0
    largest = max(
        float(np.hypot(run.inputs["ntl_y"], run.inputs["ntl_z"]).max()) for run in campaign.runs
    )
    return largest or 1.0


#: Difference of loads, or of speed, over the largest, that is the same condition.
SAME_CONDITION = 0.05


def mean_load(run: Run, name: str) -> float:
    """Mean of a load over a run; zero where the rig has none."""
    return float(np.mean(run.inputs[name])) if name in run.inputs else 0.0


@dataclass(frozen=True, eq=False)
class BlockColumns:
    """Columns of one sensor in one block of a run."""

    index: ColumnIndex  # Numbers of the columns
    #: Columns at the samples of a piece that holds the block, the target first, shape (k, n)
    rows: FloatArray
    samples: IntArray  # Numbers of these samples in the run, ascending, shape (n,)
    is_complete: BoolArray  # Whether no column is missing, shape (n,)
    inputs: CarrierInputs  # Inputs at these samples
    revolutions: Sequence[IntArray]  # Numbers of the samples of every revolution of the block

    @property
    def all_present(self) -> IntArray:
        """The same of all revolutions."""
        return self.present(np.concatenate(self.revolutions))

    def present(self, revolution: IntArray) -> IntArray:
        """Numbers in `samples` of those of a revolution in which no column is missing."""
        numbers = np.searchsorted(self.samples, revolution)
        return numbers[self.is_complete[numbers]]


@dataclass(frozen=True, eq=False)
class RunColumns:
    """What the columns of one run are computed from."""

    run: Run  # Record within its windows of use
    source: ColumnSource  # Effects, rig and typical speed

    @cached_property
    def revolutions(self) -> tuple[IntArray, ...]:
        """Samples of every whole revolution."""
        return whole_revolutions(self.run).samples

    @cached_property
    def inputs(self) -> CarrierInputs:
        """Inputs of the whole run."""
        return inputs_of(self.run)

    @cached_property
    def delayed_angles(self) -> list[FloatArray]:
        """Carrier angle of some time ago [rad], at the nodes of the delay."""
        return [
            delayed_angle(self.run.time, self.inputs.carrier_angle, shift / self.source.speed)
            for shift in delay_nodes(self.source.rig.n_planets).tolist()
        ]

    def target(self, channel: Channel, samples: IntArray) -> dict[Key, FloatArray]:
        """Target and another simulator's prediction at some samples."""
        rows = {(TARGET, 0, PLAIN, 0): self.run.signals[channel.name]}
        delays = delay_nodes(self.source.rig.n_planets) / self.source.speed
        rows |= _predictions_of(self.run, channel, delays)
        return {key: values[samples] for key, values in rows.items()}

    def blocks(self, most_blocks: int) -> list[IntArray]:
        """Numbers of the revolutions of at most `most_blocks` blocks."""
        n = len(self.revolutions)
        return np.array_split(np.arange(n), min(most_blocks, n))


def groups_of_runs(runs: Sequence[Run]) -> Iterator[range]:
    """Numbers of neighbouring runs whose columns are in memory at once."""
    return groups_within([run.time.size for run in runs], _CHUNK)


def groups_within(sizes: Sequence[int], most: int) -> Iterator[range]:
    """Numbers of neighbours whose sizes add up to no more than a limit; one at least."""
    first, n_samples = 0, 0
    for k, size in enumerate(sizes):
        if n_samples and n_samples + size > most:
            yield range(first, k)
            first, n_samples = k, 0
        n_samples += size
    yield range(first, len(sizes))


def blocks_of_runs(
    runs: Sequence[RunColumns],
    channel: Channel,
    blocks: Sequence[Sequence[IntArray]],
    owners: Collection[str] | None = None,
    source: ColumnSource | None = None,
) -> Iterator[Iterable[BlockColumns]]:
    """Columns of some blocks of every run of a group at a sensor, those of short runs at once.

    `blocks` are the numbers of the revolutions of each block of each run. The target, and another
    simulator's prediction, are always among the columns; beside them effects of `owners` alone,
    computed by `source`; default: all, and those of the flexible model, by that of the run.
    """
    if len(runs) > 1:
        yield from _made_together(runs, channel, blocks, owners, source)
    else:
        sizes = [sum(runs[0].revolutions[r].size for r in block) for block in blocks[0]]
        chunks = ([[blocks[0][k] for k in group]] for group in groups_within(sizes, _CHUNK))
        made = (_made_together(runs, channel, chunk, owners, source) for chunk in chunks)
        yield (block for (of_chunk,) in made for block in of_chunk)


def _made_together(
    runs: Sequence[RunColumns],
    channel: Channel,
    blocks: Sequence[Sequence[IntArray]],
    owners: Collection[str] | None,
    source: ColumnSource | None,
) -> Iterator[list[BlockColumns]]:
    """Columns of some blocks of every run, all of them in memory at once."""
    source = source or runs[0].source
    samples = [
        np.sort(np.concatenate([run.revolutions[r] for block in of_run for r in block]))
        for run, of_run in zip(runs, blocks, strict=True)
    ]
    by_run = list(zip(runs, samples, strict=True))
    inputs = [inputs_at(run.inputs, some) for run, some in by_run]
    every = in_a_row(inputs) if len(runs) > 1 else inputs[0]
    follows_delay = any(
        effect.follows_delay
        for effect in source.effects.values()
        if owners is None or effect.id in owners
    )
    late = _late(every, by_run) if follows_delay else []
    targets = [run.target(channel, some) for run, some in by_run]
    rows = {key: np.concatenate([of_run[key] for of_run in targets]) for key in targets[0]}
    rows |= source.rows(rim_sensor(channel), every, late, owners)
    index = ColumnIndex({key: number for number, key in enumerate(rows)})
    table = np.array(list(rows.values()))
    del rows  # as large as the table
    is_complete = np.isfinite(table).all(axis=0)
    first = 0
    for (run, some), of_run, at in zip(by_run, blocks, inputs, strict=True):
        segment = slice(first, first + some.size)
        first = segment.stop
        yield [
            BlockColumns(
                index,
                table[:, segment],
                some,
                is_complete[segment],
                at,
                [run.revolutions[r] for r in block],
            )
            for block in of_run
        ]


def some_samples(
    runs: Sequence[Run], source: ColumnSource, n_samples: int
) -> Callable[[Channel], FloatArray]:
    """All columns at a sensor but the target, shape (k - 1, m), at m samples of all runs.

    With `n_samples` evenly spaced ones of every run stand some close to both ends, where a delayed
    angle is not known and what is a combination elsewhere is none.
    """
    by_run = []
    for run in runs:
        last = run.time.size - 1
        even = np.linspace(0, last, min(n_samples, last + 1)).astype(np.int64)
        close = 2 ** np.arange(max(last, 1).bit_length()) - 1
        samples = np.unique(np.concatenate([even, close, last - close]))
        by_run.append((RunColumns(run, source), samples))
    inputs = in_a_row([inputs_at(columns.inputs, samples) for columns, samples in by_run])
    late = _late(inputs, by_run)
    delays = delay_nodes(source.rig.n_planets) / source.speed
    chosen = [(columns.run, samples) for columns, samples in by_run]

    def rows(channel: Channel) -> FloatArray:
        # Another simulator's prediction is each run's own.
        predicted = [
            np.reshape(
                [values[some] for values in _predictions_of(run, channel, delays).values()],
                (-1, some.size),
            )
            for run, some in chosen
        ]
        others = source.rows(rim_sensor(channel), inputs, late)
        return np.concatenate([np.concatenate(predicted, axis=1), list(others.values())])

    return rows


def _late(
    inputs: CarrierInputs, by_run: Sequence[tuple[RunColumns, IntArray]]
) -> list[CarrierInputs]:
    """Inputs at some samples of every run, their carrier angle at the nodes of the delay."""
    angles = [[angle[samples] for angle in run.delayed_angles] for run, samples in by_run]
    return [
        replace(inputs, carrier_angle=np.concatenate(of_node))
        for of_node in zip(*angles, strict=True)
    ]


def in_a_row(inputs_of_runs: Sequence[CarrierInputs]) -> CarrierInputs:
    """Inputs of several runs one after the other: their columns cost little more than of one."""
    rows = {
        name: np.concatenate([getattr(inputs, name) for inputs in inputs_of_runs])
        for name in _INPUTS
    }
    sizes = [inputs.time.size for inputs in inputs_of_runs]
    start = np.repeat([inputs.start for inputs in inputs_of_runs], sizes)
    end = np.repeat([inputs.end for inputs in inputs_of_runs], sizes)
    return CarrierInputs(**rows, start=start, end=end)


def inputs_of(run: Run) -> CarrierInputs:
    """Inputs of a whole run."""
    zero = np.zeros(run.time.size)
    # A rig without radial load has no columns of it.
    return inputs_of_columns({"ntl_y": zero, "ntl_z": zero, **run.inputs, "time": run.time})


def columns_of_campaign(run: Run, channel: Channel, source: ColumnSource) -> ColumnIndex:
    """Numbers of the columns, from one sample of a run."""
    columns, one = RunColumns(run, source), np.arange(1)
    first = inputs_at(columns.inputs, one)
    late = [first] * delay_nodes(source.rig.n_planets).size
    rows = columns.target(channel, one) | source.rows(rim_sensor(channel), first, late)
    return ColumnIndex({key: number for number, key in enumerate(rows)})


def _predictions_of(run: Run, channel: Channel, delays: FloatArray) -> dict[Key, FloatArray]:
    """Another simulator's prediction, at the nodes of a delay too; empty where there is none."""
    if channel.name not in run.predictions:
        return {}
    prediction = run.predictions[channel.name]
    rows: dict[Key, FloatArray] = {(PREDICTION, 0, PLAIN, 0): prediction}
    for node in np.flatnonzero(delays).tolist():
        rows[PREDICTION, 0, DELAY, node] = delayed(run.time, prediction, float(delays[node]))
    return rows


def inputs_at(inputs: CarrierInputs, samples: IntArray) -> CarrierInputs:
    """What acts on the carrier at some samples of a run."""
    return replace(inputs, **{name: getattr(inputs, name)[samples] for name in _INPUTS})
