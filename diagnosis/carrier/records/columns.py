"""Columns of the carrier's signals: every basis function an effect can ask for, by run and sensor.

Effects that move a sensor or delay a signal are polynomials through the exact columns at a few
shifts: with nodes 3 deg (sensor, up to 6) and 6 deg (delay, up to 18) apart the interpolation
misses order 6, the second of three planets, by less than half a per cent of its amplitude. More
planets have as many more nodes. A shape is linear between its nodes; several shapes share no part
of the signal. No more columns are in memory at once than a chunk holds.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import count, product

import numpy as np

from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    ComplexArray,
    FloatArray,
    IntArray,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import OrderFit, highest_order
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
#: Samples of a turn on which effects are evaluated where there is no record.
SAMPLES_A_TURN = 144
#: Samples whose columns are in memory at once.
_CHUNK = 20_000


#: One column of the flexible residual model: cosine or, if that is true, sine of an order, times a
#: load. Torque is over the nominal torque, radial loads over the largest radial load.
FlexibleTerm = tuple[int, bool, str]


class ColumnIndex(dict[Key, int]):
    """Number of each column by ``(effect, number of its parameter, node family, node)``."""

    def of(self, effect: str, parameter: int = 0, family: str = PLAIN, node: int = 0) -> int:
        """Number of one column."""
        return self[effect, parameter, family, node]

    @property
    def flexible(self) -> slice:
        """Numbers of the features of the flexible residual model."""
        return slice(self.of(FLEXIBLE), len(self))


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
            for order, is_sine in dict.fromkeys(term[:2] for term in terms)
        }
        rows = [u, u**2, *(waves[term[:2]] * quantity[term[2]] for term in terms)]
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
        terms += [(order, is_sine, load) for is_sine in waves for load in loads]
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


def mean_speed(run: Run) -> float:
    """Mean speed of the carrier over a run [rad/s]."""
    angle = run.inputs["carrier_angle"]
    return float((angle[-1] - angle[0]) / (run.time[-1] - run.time[0]))


def mean_load(run: Run, name: str) -> float:
    """Mean of a load over a run; zero where the rig has none."""
    return float(np.mean(run.inputs[name])) if name in run.inputs else 0.0


@dataclass(frozen=True, eq=False)
class RunColumns:
    """What the columns of one run are computed from."""

    run: Run  # Record within its windows of use
    source: ColumnSource  # Effects, rig and typical speed

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
        """Target and another simulator's prediction, at the nodes of a delay, at some samples."""
        rows: dict[Key, FloatArray] = {(TARGET, 0, PLAIN, 0): self.run.signals[channel.name]}
        if channel.name in self.run.predictions:
            prediction = self.run.predictions[channel.name]
            rows[PREDICTION, 0, PLAIN, 0] = prediction
            delays = delay_nodes(self.source.rig.n_planets) / self.source.speed
            for node in np.flatnonzero(delays).tolist():
                late = delayed(self.run.time, prediction, float(delays[node]))
                rows[PREDICTION, 0, DELAY, node] = late
        return {key: values[samples] for key, values in rows.items()}


@dataclass(frozen=True, eq=False)
class SampleColumns:
    """Columns at some samples of some runs, one after the other: they cost little more than one."""

    runs: Sequence[tuple[RunColumns, IntArray]]  # Runs with the numbers of their samples, ascending
    #: Effects whose columns are made beside target and prediction; None: all, and the flexible
    #: model's
    owners: Collection[str] | None = None

    @cached_property
    def inputs(self) -> CarrierInputs:
        """Inputs at the samples."""
        return in_a_row([inputs_at(run.inputs, samples) for run, samples in self.runs])

    @cached_property
    def _late(self) -> list[CarrierInputs]:
        """The same, their carrier angle at the nodes of the delay; none where no effect is late."""
        effects = self.runs[0][0].source.effects
        names = effects.keys() if self.owners is None else effects.keys() & set(self.owners)
        if not any(effects[name].follows_delay for name in names):
            return []
        angles = [[angle[samples] for angle in run.delayed_angles] for run, samples in self.runs]
        return [
            replace(self.inputs, carrier_angle=np.concatenate(of_node))
            for of_node in zip(*angles, strict=True)
        ]

    def rows(self, channel: Channel) -> dict[Key, FloatArray]:
        """Columns at a sensor by key, the target first."""
        targets = [run.target(channel, samples) for run, samples in self.runs]
        rows = {key: np.concatenate([of_run[key] for of_run in targets]) for key in targets[0]}
        source = self.runs[0][0].source
        return rows | source.rows(rim_sensor(channel), self.inputs, self._late, self.owners)


@dataclass(frozen=True, eq=False)
class BlockColumns:
    """Columns of one sensor in one block of a run."""

    run: int  # Number of the run
    number: int  # Number of the block among those of all runs
    turns: slice  # Numbers of its revolutions among those of all runs
    index: ColumnIndex  # Numbers of the columns
    rows: FloatArray  # Columns at the samples of the run that were made, target first, (k, n)
    revolutions: Sequence[IntArray]  # Numbers in `rows` of the samples of every revolution
    is_complete: BoolArray  # Whether no column is missing, shape (n,)
    made_inputs: CarrierInputs  # Inputs at the samples
    fits: dict[int, OrderFit]  # Those of the last sensor: sensors that miss no sample share them

    @property
    def present(self) -> FloatArray:
        """Columns at the samples of all revolutions at which none is missing."""
        samples = self._present
        first, n = int(samples[0]) if samples.size else 0, samples.size
        if n and samples[-1] - first == n - 1:
            return self.rows[:, first : first + n]
        return np.asarray(self.rows[:, samples])

    @property
    def inputs(self) -> CarrierInputs:
        """Inputs at these samples."""
        return inputs_at(self.made_inputs, self._present)

    @property
    def _present(self) -> IntArray:
        samples = np.concatenate(self.revolutions)
        return samples[self.is_complete[samples]]

    def orders(self, signal: FloatArray, highest: int) -> tuple[ComplexArray, FloatArray]:
        """Order amplitudes of a signal by revolution, NaN where too sparse, and what is off them.

        That is the sum of its squares and their degrees of freedom, shape (R, 2).
        """
        orders = np.full((len(self.revolutions), highest + 1), np.nan, dtype=np.complex128)
        off = np.zeros((len(self.revolutions), 2))
        for r, revolution in enumerate(self.revolutions):
            present = revolution[self.is_complete[revolution]]
            theta = self.made_inputs.carrier_angle[present]
            if r not in self.fits or not np.array_equal(self.fits[r].theta, theta):
                self.fits[r] = OrderFit(theta, highest)
            if not self.fits[r].is_too_sparse:
                of_turn, off[r] = self.fits[r].amplitudes(signal[None, present])
                orders[r] = of_turn[:, 0]
        return orders, off


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
    runs: Sequence[Run],
    channels: Sequence[Channel],
    source: ColumnSource,
    most_blocks: int | None,
    owners: Collection[str] | None = None,
) -> Iterator[tuple[int, list[BlockColumns]]]:
    """Columns of the blocks of every run, as many blocks as are in memory at once.

    Of those at each sensor in turn, whose number is given. `most_blocks` are those of a run, None:
    as few as are in memory at once. The target, and another simulator's
    prediction, are always among the columns; beside them those of `owners` alone; default: of all
    effects, and of the flexible model.
    """
    number = turn = 0
    for group in groups_within([run.time.size for run in runs], _CHUNK):
        columns = {r: RunColumns(runs[r], source) for r in group}
        blocks = []
        for r, run in columns.items():
            samples = whole_revolutions(run.run).samples
            n = len(samples)
            n_blocks = most_blocks or -(-run.run.time.size // _CHUNK)
            for turns in np.array_split(np.arange(n), min(n_blocks, n)):
                revolutions = [samples[k] for k in turns]
                blocks.append((r, number, slice(turn, turn + turns.size), revolutions))
                number += 1
                turn += turns.size
        sizes = [sum(rows.size for rows in revolutions) for *_, revolutions in blocks]
        for piece in groups_within(sizes, _CHUNK):
            yield from _made_together(columns, [blocks[b] for b in piece], channels, owners)


def _made_together(
    columns: Mapping[int, RunColumns],
    blocks: Sequence[tuple[int, int, slice, Sequence[IntArray]]],
    channels: Sequence[Channel],
    owners: Collection[str] | None,
) -> Iterator[tuple[int, list[BlockColumns]]]:
    """Columns of some blocks of some runs at every sensor."""
    rows_of: dict[int, list[IntArray]] = {}
    for r, *_, revolutions in blocks:
        rows_of.setdefault(r, []).extend(revolutions)
    samples = {r: np.sort(np.concatenate(rows)) for r, rows in rows_of.items()}
    made = SampleColumns([(columns[r], some) for r, some in samples.items()], owners)
    of_run, first = {}, 0
    for r, some in samples.items():
        of_run[r] = slice(first, first + some.size)
        first += some.size
    inputs = {r: inputs_at(columns[r].inputs, some) for r, some in samples.items()}
    fits: list[dict[int, OrderFit]] = [{} for _ in blocks]
    for c, channel in enumerate(channels):
        rows = made.rows(channel)
        index = ColumnIndex(zip(rows, count(), strict=False))
        table = np.array(list(rows.values()))
        del rows  # as large as the table
        is_complete = np.isfinite(table).all(axis=0)
        yield (
            c,
            [
                BlockColumns(
                    r,
                    number,
                    turns,
                    index,
                    table[:, of_run[r]],
                    [np.searchsorted(samples[r], one) for one in revolutions],
                    is_complete[of_run[r]],
                    inputs[r],
                    fit,
                )
                for (r, number, turns, revolutions), fit in zip(blocks, fits, strict=True)
            ],
        )


def some_samples(runs: Sequence[Run], source: ColumnSource, n_samples: int) -> SampleColumns:
    """All columns at some samples of all runs.

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
    return SampleColumns(by_run)


def in_a_row(inputs_of_runs: Sequence[CarrierInputs]) -> CarrierInputs:
    """Inputs of several runs one after the other."""
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
    rows = SampleColumns([(RunColumns(run, source), np.arange(1))]).rows(channel)
    return ColumnIndex(zip(rows, count(), strict=False))


def inputs_at(inputs: CarrierInputs, samples: IntArray) -> CarrierInputs:
    """What acts on the carrier at some samples of a run."""
    return replace(inputs, **{name: getattr(inputs, name)[samples] for name in _INPUTS})
