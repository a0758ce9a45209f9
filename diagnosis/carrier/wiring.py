"""Errors of the wiring of a carrier's rim sensors as rivals of what the library names.

The baseline is linear in its parameters, so that a campaign with a corrected wiring is a
least-squares problem in sums of products, of every signal with the columns of every sensor.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import permutations

import numpy as np

from carrierflex.diagnosis.carrier.model import CarrierModel
from carrierflex.diagnosis.carrier.records.columns import groups_within, in_a_row, inputs_of
from carrierflex.diagnosis.carrier.records.sums import IN_MEMORY
from carrierflex.diagnosis.comparison.problem import (
    Effects,
    FloatArray,
    IntArray,
    bounds_of,
)
from carrierflex.diagnosis.wiring.linear_records import LinearRecord
from carrierflex.diagnosis.wiring.refits import Fault, PredictedRecord, WiringChecks, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.campaign_warning import key_of
from carrierflex.identification.carrier.models import rim_sensor
from carrierflex.identification.estimation.gauss_newton import Bounds, CostSums, bounded_step
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.laws import Law

#: Sensors whose order is tried in full; of more only neighbours and orders moved on.
_ALL_ORDERS = 4
_RIDGE = 1e-12


@dataclass(frozen=True, eq=False)
class _Products:
    """Products of the baseline's p columns where signal i is of sensor order[i]."""

    matrix: FloatArray  # (n_orders, p, p) columns with each other, over the samples of the signals
    right: FloatArray  # (n_orders, p) columns with the signals
    square: float  # sum of squares of all signals
    count: float  # samples of all signals


@dataclass(frozen=True, eq=False)
class LinearBaseline:
    """Effects of the baseline that add a signal linear in their parameters, p of all runs."""

    model: CarrierModel  # Effects, contained ones among them
    campaign: Campaign  # Records
    laws: Effects = ()  # Laws beside the baseline, linear at the shapes with which they were fitted
    values: Mapping[tuple[str, str], float] = field(default_factory=dict)  # Those of their fit

    @cached_property
    def effects(self) -> list[Effect]:
        """Effects of the baseline that are linear, then the laws."""
        contained = [self.model.effects[name] for name in self.model.contained]
        linear = [one for one in contained if one.pattern is not None and not one.n_shapes]
        return linear + [self.model.effects[law] for law in self.laws]

    @property
    def is_of_model(self) -> bool:
        """Whether there are any, of the project's model and not of another simulator."""
        return bool(self.effects) and self.campaign.baseline.source == "model"

    def by_run(self, runs: Sequence[Run]) -> Iterator[FloatArray]:
        """Columns of every run, shape (C, q, n), without those of other runs' values."""
        sensors = [rim_sensor(channel) for channel in self.campaign.channels]
        n_columns = sum(map(_n_columns, self.effects))
        most = IN_MEMORY // (8 * n_columns * len(self.campaign.channels))
        for group in groups_within([run.time.size for run in runs], most):
            some = runs[group.start : group.stop]
            inputs = in_a_row([inputs_of(run) for run in some])
            rows = [signals for one in sensors for signals in self._of_sensor(one, inputs)]
            columns = np.concatenate(rows).reshape(len(sensors), n_columns, -1)
            ends = np.cumsum([run.time.size for run in some])
            yield from np.split(columns, ends[:-1], axis=2)

    def _of_sensor(self, sensor: RimSensor, inputs: CarrierInputs) -> Iterator[FloatArray]:
        """Signals of every effect at the shapes, and with the weights, of the fit."""
        weights = {effect: value for (effect, _), value in self.values.items()}
        for effect in self.effects:
            shapes = [self.values[effect.id, p.name] for p in effect.parameters if p.shape]
            signals = effect.signals(sensor, inputs, self.model.source.rig, *shapes)
            if effect.weighed_by:
                signals = signals[:1] + weights.get(effect.weighed_by, 0.0) * signals[1:]
            yield signals

    @cached_property
    def unknowns(self) -> tuple[list[IntArray], tuple[FloatArray, FloatArray]]:
        """Numbers of the columns of every run among the p of all runs, and the bounds of these."""
        # A value that the baseline fixes stays where it is.
        model = replace(self.model, contained=tuple(effect.id for effect in self.effects))
        parameters, (_, of_runs) = model.parameters((), {}), model.unknowns(())
        is_column = np.array([not parameter.shape for parameter in parameters], dtype=bool)
        number = np.cumsum(is_column) - 1
        lower, upper = bounds_of(parameters)
        numbers = [number[of_run[is_column[of_run]]] for of_run in of_runs]
        return numbers, (lower[is_column], upper[is_column])

    def products(self, orders: Sequence[Sequence[int]]) -> _Products:
        """Products for every order of the sensors, summed run by run."""
        channels = self.campaign.channels
        numbers, (lower, _) = self.unknowns
        p = lower.size
        matrix, right = np.zeros((len(orders), p, p)), np.zeros((len(orders), p))
        square = count = 0.0
        runs = self.campaign.runs
        for number, (run, columns) in enumerate(zip(runs, self.by_run(runs), strict=True)):
            signals = _signals(run, channels)
            known = np.isfinite(signals)
            signals = np.where(known, signals, 0.0)
            of_run = numbers[number]
            # Where no sample is missing the products of a sensor are the same for every signal.
            complete = columns @ np.swapaxes(columns, 1, 2)
            partial = {
                i: (columns * known[i]) @ np.swapaxes(columns, 1, 2)
                for i in range(len(channels))
                if not known[i].all()
            }
            mixed = columns @ signals.T
            for k, order in enumerate(orders):
                pairs = list(enumerate(order))
                matrix[k][np.ix_(of_run, of_run)] += sum(
                    partial.get(i, complete)[j] for i, j in pairs
                )
                right[k, of_run] += sum(mixed[j, :, i] for i, j in pairs)
            square += float(np.sum(signals**2))
            count += float(known.sum())
        return _Products(matrix, right, square, count)

    def solved(self, products: _Products, order: int = 0) -> tuple[FloatArray, float]:
        """Bounded least squares for one of the orders; parameters and mean square."""
        matrix, right = products.matrix[order], products.right[order]
        bounds = Bounds(*self.unknowns[1])
        start = bounds.clipped(np.zeros(right.size))
        sums = CostSums(products.square, matrix, right - matrix @ start, None)
        is_free = np.ones(right.size, dtype=bool)
        theta = bounded_step(sums, start, bounds=bounds, free=is_free, damping=_RIDGE)
        residual = products.square - float(theta @ (2.0 * right - matrix @ theta))
        return theta, max(residual, 0.0) / products.count

    def as_declared(self) -> tuple[FloatArray, float]:
        """The same with every sensor where it is declared."""
        return self.solved(self.products([range(len(self.campaign.channels))]))

    def rivals(self) -> tuple[WiringRival, ...]:
        """Baseline refitted with the order of sensors that leaves least; none unless linear."""
        orders = list(_orders(self.campaign.channels)) if self.is_of_model else []
        if not orders:
            return ()
        products = self.products(orders)
        squares = [self.solved(products, k)[1] for k in range(len(orders))]
        best, names = int(np.argmin(squares)), [one.name for one in self.campaign.channels]
        moved = {names[k]: names[sensor] for k, sensor in enumerate(orders[best]) if k != sensor}
        signals = ", ".join(f"{signal} at the angle of {other}" for signal, other in moved.items())
        text, line = f"the signal of {signals}", key_of("[[channels]]", "angle_deg")
        return (WiringRival(Fault.SENSOR_ORDER, ", ".join(moved), text, squares[best], line),)

    @property
    def unchecked(self) -> str:
        """Why no record is beside its prediction (both would fill the memory), or empty."""
        channels, runs = self.campaign.channels, self.campaign.runs
        size = 16 * len(channels) * sum(run.time.size for run in runs)
        if self.campaign.baseline.source != "model" or size <= 2 * IN_MEMORY:
            return ""
        most = f"{2 * IN_MEMORY / 1e6:.0f} MB"
        return f"records and prediction take {size / 1e6:.0f} MB, at most {most}"

    def predictions(self) -> tuple[PredictedRecord, ...]:
        """Every run with the baseline fitted to all; none where they are unchecked."""
        if not self.is_of_model or self.unchecked:
            return ()
        (theta, _), runs, channels = self.as_declared(), self.campaign.runs, self.campaign.channels
        return tuple(
            PredictedRecord(run.name, run.time, _signals(run, channels).T, (theta[of] @ columns).T)
            for run, columns, of in zip(runs, self.by_run(runs), self.unknowns[0], strict=True)
        )

    def records(self) -> Iterator[LinearRecord]:
        """Every run with its baseline and its columns; none unless all effects are linear."""
        effects, channels = self.effects, self.campaign.channels
        n_linear = len(effects) - len(self.laws)
        if not self.is_of_model or n_linear != len(self.model.contained):
            return
        theta, _ = self.as_declared()
        # Columns of the run itself first.
        is_of_run = np.concatenate([[effect.per_run] * _n_columns(effect) for effect in effects])
        order = np.argsort(~is_of_run, kind="stable")
        most = IN_MEMORY // (8 * is_of_run.size * len(channels))
        # Delay and gain are of all samples: every second one of a long run tells them too.
        runs = [
            record.thinned(-(-record.time.size // max(most, 1)))
            for record in self.campaign.within_use().runs
        ]
        for run, of_sensors, numbers in zip(runs, self.by_run(runs), self.unknowns[0], strict=True):
            columns = np.ascontiguousarray(of_sensors[:, order].transpose(1, 2, 0))
            predicted = np.einsum("p,pnc->nc", theta[numbers[order]], columns)
            residual = _signals(run, channels).T - predicted
            n_of_run = int(is_of_run.sum())
            yield LinearRecord(run.name, run.time, residual, predicted, columns, n_of_run)

    def mean_square(self, campaign: Campaign) -> float:
        """Mean square that it leaves once it is fitted to another campaign."""
        return replace(self, campaign=campaign).as_declared()[1]

    def checks(self) -> WiringChecks:
        """What can be tried of the wiring."""

        def with_laws(
            laws: Effects, values: Mapping[tuple[str, str], float], shapes: Sequence[Law]
        ) -> WiringChecks:
            """Checks with laws beside the baseline; none of a law that adds no signal."""
            if any(self.model.effects[law].pattern is None for law in laws):
                return WiringChecks()
            return replace(self, laws=laws, values=values).checks()

        return WiringChecks(
            self.rivals,
            lambda theta: self.predictions(),
            self.mean_square,
            lambda theta: self.records(),
            with_laws=with_laws,
            has_cheap_refits=True,
            takes_shapes=False,
            unchecked=self.unchecked,
        )


def _n_columns(effect: Effect) -> int:
    """Parameters that a signal is linear in."""
    return len(effect.parameters) - effect.n_shapes


def _signals(run: Run, channels: Sequence[Channel]) -> FloatArray:
    """Signals of a run, shape (C, n)."""
    return np.array([run.signals[channel.name] for channel in channels])


def _orders(channels: Sequence[Channel]) -> Iterator[tuple[int, ...]]:
    """Other orders of the sensors of each quantity."""
    same = list(range(len(channels)))
    for quantity in {channel.quantity: None for channel in channels}:
        members = [k for k in same if channels[k].quantity == quantity]
        tried = (
            permutations(members)
            if len(members) <= _ALL_ORDERS
            else iter([tuple(members[k:] + members[:k]) for k in range(len(members))])
        )
        for exchanged in tried:
            order = same.copy()
            for member, sensor in zip(members, exchanged, strict=True):
                order[member] = sensor
            if order != same:
                yield tuple(order)
