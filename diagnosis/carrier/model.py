"""The carrier's signals as weights of columns, with derivatives, and the rows that they make.

The measurement model of :mod:`carrierflex.simulation.sensing` on columns: the reading of channel c
is ``(1 + g_c) (prediction + sum_k w_k X_k(v + dv_c, theta(t - tau))) + z_c``.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import (
    ANGLE,
    DELAY,
    ONE,
    PLAIN,
    PREDICTION,
    SHAPE,
    BlockColumns,
    ColumnIndex,
    ColumnSource,
    angle_nodes,
    blocks_of_runs,
    delay_nodes,
)
from carrierflex.diagnosis.comparison.known_physics import NOTHING_KNOWN, KnownPhysics
from carrierflex.diagnosis.comparison.problem import (
    Effects,
    FloatArray,
    IntArray,
    Parameter,
    bounds_of,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.drawing import ALLOWED_BY_DRAWING, CURVE_ERROR
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.measurement import Measurement

#: Channel of every effect of one sensor.
Choice = Mapping[str, int]

#: Prior of a candidate's parameter, in its scales.
_PRIOR = 30.0

#: Shares of a rigid pin fit at which the table has the derivatives of the curve: the fit moves as a
#: cause is put in.
_WEIGHTS = (0.0, 0.5, 1.0)


@dataclass(frozen=True, eq=False)
class _WeightedColumn:
    """Weight of one column, of all runs or by run."""

    owner: str  # effect, or the prediction of another simulator
    parameter: int  # number of the owner's parameter
    column: int  # number of the column
    weight: FloatArray | float  # factor of the column
    slopes: Mapping[int, FloatArray | float]  # its derivatives by unknowns of the run


@dataclass(frozen=True, eq=False)
class WeightTable:
    """Weights of the columns in use, summed up term by term; u columns, q unknowns of a run.

    Unknowns that are another run's are omitted: with hundreds of runs they are nearly all.
    """

    columns: IntArray  # Numbers of the columns, ascending, the target first, shape (u,)
    unknowns: IntArray  # Numbers of the unknowns that act in every run, shape (n_runs, q)
    values: FloatArray  # Weights, shape (n_runs, n_channels, u)
    #: Their derivatives by the unknowns of the run, shape (n_runs, n_channels, q, u)
    slopes: FloatArray

    @property
    def residual(self) -> FloatArray:
        """Weights of the target less the signals, shape (n_runs, n_channels, u)."""
        residual = -self.values
        residual[..., 0] += 1.0
        return residual

    def add(self, terms: Iterable[_WeightedColumn], channels: int | slice) -> None:
        """Add terms to some channels."""
        positions = {column: k for k, column in enumerate(self.columns.tolist())}
        for term in terms:
            position = positions[term.column]
            values = self.values[:, channels, position].T
            values += term.weight
            for unknown, slope in term.slopes.items():
                slopes = self.slopes[:, channels, unknown, position].T
                slopes += slope

    def amplify(self, channel: int, gain: float, unknown: int) -> None:
        """Read a channel ``1 + gain`` times as large; `unknown` is the number of the gain."""
        self.slopes[:, channel] *= 1.0 + gain
        self.slopes[:, channel, unknown] = self.values[:, channel]
        self.values[:, channel] *= 1.0 + gain


@dataclass(frozen=True, eq=False)
class CarrierModel:
    """Parameters and weights of any set of effects."""

    source: ColumnSource  # Columns, with all effects
    index: ColumnIndex  # Their numbers
    contained: Effects  # Effects of the baseline
    #: runs, channels: names
    runs: tuple[str, ...]
    channels: tuple[str, ...]
    known: KnownPhysics = NOTHING_KNOWN  # Known values and declared errors of the sensors
    #: Frame and pattern of effects that are measured laws of files
    class_of_measured: Mapping[str, str] = field(default_factory=dict)

    @property
    def effects(self) -> Mapping[str, Effect]:
        """All effects by id."""
        return self.source.effects

    def of_set(self, effects: Effects) -> "CarrierModel":
        """Model of a set alone, its columns moved and late only where the set moves or delays."""
        fitted = {name: self.effects[name] for name in (*self.contained, *effects)}
        quantities = {one.measurement for one in fitted.values()}
        of_set = {
            name: replace(
                one,
                follows_sensor=one.follows_sensor and Measurement.ANGLE in quantities,
                follows_delay=one.follows_delay and Measurement.DELAY in quantities,
            )
            for name, one in fitted.items()
        }
        return replace(self, source=replace(self.source, effects=of_set))

    def blocks(
        self, campaign: Campaign, effects: Effects, choice: Choice, *thetas: FloatArray
    ) -> Iterator[tuple[int, BlockColumns, list["WeightTable"]]]:
        """Blocks of the records at every sensor, with weights in the run at some parameters.

        They are as long as memory holds.
        """
        runs, source = campaign.within_use().runs, self.source
        tables: dict[int, list[WeightTable]] = {}
        every = blocks_of_runs(runs, campaign.channels, source, None, source.effects)
        for c, blocks in every:
            if c == 0:
                model = replace(self, index=blocks[0].index)
                tables = {
                    r: [model.weights(effects, choice, one, slice(r, r + 1)) for one in thetas]
                    for r in range(blocks[0].run, blocks[-1].run + 1)
                }
            yield from ((c, block, tables[block.run]) for block in blocks)

    def parameters(self, effects: Effects, choice: Choice) -> tuple[Parameter, ...]:
        """Unknowns of baseline + effects; those of an effect with values by run, run by run."""
        return tuple(
            self._parameter(self.effects[name], parameter, run, choice)
            for name in (*self.contained, *effects)
            for run in self._runs_of(name)
            for parameter in self.effects[name].parameters
        )

    def _runs_of(self, effect: str) -> tuple[str | None, ...]:
        return self.runs if self.effects[effect].per_run else (None,)

    def _parameter(
        self, effect: Effect, parameter: EffectParameter, run: str | None, choice: Choice
    ) -> Parameter:
        lower, upper = self._bounds(effect, parameter)
        name = parameter.name
        if effect.id in choice:
            name = f"{name}_{self.channels[choice[effect.id]]}"
        is_free = parameter.shape or effect.id in self.contained
        unknown = Parameter(
            name,
            parameter.unit,
            lower,
            upper,
            parameter.scale,
            effect=effect.id,
            prior_std=np.inf if is_free else _PRIOR * parameter.scale,
            run=run,
            shape=parameter.shape,
            pair=parameter.pair,
            may_reach_lower=parameter.may_reach_lower,
        )
        unknown = self.known.sensor_prior(unknown, effect.measurement, choice.get(effect.id))
        return self.known.prior(unknown, parameter.name)

    def _bounds(self, effect: Effect, parameter: EffectParameter) -> tuple[float, float]:
        """Bounds of the effect, or those within which its columns are interpolated."""
        if parameter.shape:
            nodes = self.source.shape_nodes(effect)
            return float(nodes[0]), float(nodes[-1])
        if effect.measurement not in (Measurement.DELAY, Measurement.ANGLE):
            return parameter.lower, parameter.upper
        is_delay = effect.measurement is Measurement.DELAY
        nodes = (delay_nodes if is_delay else angle_nodes)(self.source.rig.n_planets)
        # Columns carry a third of a step beyond the last node: 20 deg of delay, 7 of angle.
        largest = float(nodes[-1] + (nodes[-1] - nodes[-2]) / 3.0)
        largest /= self.source.speed if is_delay else 1.0
        return -largest, largest

    def weights(
        self, effects: Effects, choice: Choice, theta: FloatArray, runs: slice = slice(None)
    ) -> WeightTable:
        """Weights of every column with a weight or a derivative anywhere, and their derivatives.

        `choice` is the channel of every effect of one sensor among all effects; `runs` are those
        that are wanted.
        """
        first, unknowns = self.unknowns(effects)
        unknowns = unknowns[runs]
        ideal = self._without_sensor_errors(first, theta[unknowns])
        errors = {self.effects[name].measurement: name for name in first}

        def value(name: str) -> float:
            """Value of an error of the sensors, which all runs share."""
            return float(theta[unknowns[0, first[name]]])

        groups: list[tuple[list[_WeightedColumn], int | slice]] = [(ideal, slice(None))]
        # Delay and angle shift what the effects make; gain and zero act on the shifted signal.
        for quantity in (Measurement.DELAY, Measurement.ANGLE):
            if quantity in errors:
                name = errors[quantity]
                shifted = self._shifted_terms(ideal, quantity, value(name), first[name])
                groups.append((shifted, choice.get(name, slice(None))))
        zeros: list[_WeightedColumn] = []
        if Measurement.ZERO in errors:
            name, one = errors[Measurement.ZERO], self.index.of(ONE)
            slopes_of_zero = {first[name]: 1.0}
            zeros = [_WeightedColumn(name, 0, one, value(name), slopes_of_zero)]
        groups = [(list(filter(_acts, terms)), channels) for terms, channels in groups]
        terms = [*(term for terms, _ in groups for term in terms), *zeros]
        columns = np.array(sorted({0, *(term.column for term in terms)}))
        shape = (len(unknowns), len(self.channels))
        slopes = np.zeros((*shape, unknowns.shape[1], columns.size))
        table = WeightTable(columns, unknowns, np.zeros((*shape, columns.size)), slopes)
        for terms, channels in groups:
            table.add(terms, channels)
        if Measurement.GAIN in errors:
            name = errors[Measurement.GAIN]
            table.amplify(choice[name], value(name), first[name])
        table.add(zeros, choice[errors[Measurement.ZERO]] if zeros else slice(None))
        return table

    def unknowns(self, effects: Effects) -> tuple[dict[str, int], IntArray]:
        """Number of every effect's first unknown among those of a run, and their numbers by run."""
        first_of_run: dict[str, int] = {}
        numbers: list[int] = []  # Of the first run's unknowns
        steps: list[int] = []  # From one run to the next
        first = 0
        for name in (*self.contained, *effects):
            first_of_run[name] = len(numbers)
            n = len(self.effects[name].parameters)
            numbers += range(first, first + n)
            steps += [n if self.effects[name].per_run else 0] * n
            first += len(self._runs_of(name)) * n
        runs = np.arange(len(self.runs))[:, None]
        return first_of_run, np.array(numbers, np.int64) + runs * np.array(steps, np.int64)

    def _without_sensor_errors(
        self, first: Mapping[str, int], theta: FloatArray
    ) -> list[_WeightedColumn]:
        """Terms of the prediction of another simulator and of every effect that adds a signal."""
        terms = []
        if (PREDICTION, 0, PLAIN, 0) in self.index:
            terms.append(_WeightedColumn(PREDICTION, 0, self.index.of(PREDICTION), 1.0, {}))
        for name, unknown in first.items():
            effect = self.effects[name]
            if effect.pattern is None:
                continue
            if effect.weighed_by:
                terms += self._weighed_terms(effect, theta, unknown, first.get(effect.weighed_by))
            elif effect.n_shapes:
                terms += self._shape_terms(effect, theta[0], unknown)
            else:
                numbers = range(unknown, unknown + len(effect.parameters))
                terms += [
                    _WeightedColumn(name, k, self.index.of(name, k), theta[:, one], {one: 1.0})
                    for k, one in enumerate(numbers)
                ]
        return terms

    def _weighed_terms(
        self, effect: Effect, theta: FloatArray, unknown: int, weight: int | None
    ) -> list[_WeightedColumn]:
        """Terms ``p (a + w b)`` of an effect; w is another unknown, 0 without one."""
        p = theta[:, unknown]
        columns = [self.index.of(effect.id, row) for row in (0, 1)]
        terms = [_WeightedColumn(effect.id, 0, columns[0], p, {unknown: 1.0})]
        if weight is not None:
            w = theta[:, weight]
            terms.append(_WeightedColumn(effect.id, 1, columns[1], p * w, {unknown: w, weight: p}))
        return terms

    def _shape_terms(self, effect: Effect, theta: FloatArray, first: int) -> list[_WeightedColumn]:
        """Terms of an effect whose last parameters are shapes: linear between their nodes."""
        nodes = self.source.shape_nodes(effect)
        values = theta[first : first + len(effect.parameters)]
        n_sizes = len(values) - effect.n_shapes
        terms = []
        for i, shape in enumerate(values[n_sizes:].tolist()):
            hats, slopes = _hats(nodes, shape)
            near = np.flatnonzero((hats != 0.0) | (slopes != 0.0)).tolist()
            for k, size in enumerate(values[:n_sizes].tolist()):
                for node in near:
                    column = self.index.of(effect.id, k, SHAPE, i * nodes.size + node)
                    by_unknown = {first + k: hats[node], first + n_sizes + i: size * slopes[node]}
                    weight = size * hats[node]
                    terms.append(_WeightedColumn(effect.id, k, column, weight, by_unknown))
        return terms

    def _shifted_terms(
        self, terms: Iterable[_WeightedColumn], quantity: Measurement, value: float, unknown: int
    ) -> list[_WeightedColumn]:
        """What signals `value` [s] later, or a sensor `value` [rad] further on, add to terms."""
        is_delay = quantity is Measurement.DELAY
        rate = self.source.speed if is_delay else 1.0
        changes = []
        for term in terms:
            effect = self.effects.get(term.owner)
            # Waves of a prediction turn with the carrier: a sensor further on reads them later.
            family = DELAY if is_delay or effect is None else ANGLE
            if effect is None or (effect.follows_delay if is_delay else effect.follows_sensor):
                changes += self._shifted(term, family, value * rate, unknown, rate)
        return changes

    def _shifted(
        self, term: _WeightedColumn, family: str, shift: float, unknown: int, rate: float
    ) -> list[_WeightedColumn]:
        """What a shift [rad] adds to a term."""
        nodes = (delay_nodes if family == DELAY else angle_nodes)(self.source.rig.n_planets)
        values, slopes = _lagrange(nodes, shift)
        values[nodes == 0.0] -= 1.0
        changes = []
        for node, (value, slope) in enumerate(zip(values.tolist(), slopes.tolist(), strict=True)):
            key = (PLAIN, 0) if nodes[node] == 0.0 else (family, node)
            by_unknown = {k: value * derivative for k, derivative in term.slopes.items()}
            by_unknown[unknown] = slope * rate * term.weight
            column = self.index.of(term.owner, term.parameter, *key)
            weight = value * term.weight
            changes.append(replace(term, column=column, weight=weight, slopes=by_unknown))
        return changes

    def variants(self, effect: str) -> list[tuple[float, ...]]:
        """Channels of an effect of one sensor, or values of the shapes, among which a fit starts.

        One empty variant otherwise. Of two shapes every other node. Of an effect that another one
        weighs, values of the weight.
        """
        if self.effects[effect].is_of_one_channel:
            return [(float(c),) for c in range(len(self.channels))]
        if self.effects[effect].weighed_by in self.contained:
            return [(weight,) for weight in _WEIGHTS]
        n_shapes = self.effects[effect].n_shapes
        if not n_shapes:
            return [()]
        nodes = self.source.shape_nodes(self.effects[effect])[:-1:n_shapes].tolist()
        return list(product(nodes, repeat=n_shapes))


def _hats(nodes: FloatArray, value: float) -> tuple[FloatArray, FloatArray]:
    """Piecewise linear interpolation: weights of the nodes at a value, and their derivatives."""
    cell = int(np.clip(np.searchsorted(nodes, value) - 1, 0, nodes.size - 2))
    width = nodes[cell + 1] - nodes[cell]
    hat, slope = np.zeros(nodes.size), np.zeros(nodes.size)
    hat[cell] = (nodes[cell + 1] - value) / width
    hat[cell + 1] = (value - nodes[cell]) / width
    slope[cell] = -1.0 / width
    slope[cell + 1] = 1.0 / width
    return hat, slope


def _lagrange(nodes: FloatArray, value: float) -> tuple[FloatArray, FloatArray]:
    """Interpolation through all nodes: weights of the nodes at a value, and their derivatives."""
    polynomials, slopes = _node_polynomials(tuple(nodes.tolist()))
    powers = value ** np.arange(nodes.size)
    return polynomials @ powers, slopes @ powers[:-1]


@lru_cache(maxsize=8)
def _node_polynomials(nodes: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Polynomials that are one at one node and zero at the others, and their derivatives."""
    positions = np.array(nodes)
    rows = []
    for k in range(positions.size):
        others = np.delete(positions, k)
        rows.append(np.poly(others)[::-1] / np.prod(positions[k] - others))
    polynomials = np.array(rows)
    return polynomials, polynomials[:, 1:] * np.arange(1, positions.size)


def _acts(term: _WeightedColumn) -> bool:
    """Whether a term has a weight or a derivative."""
    return bool(np.any(term.weight)) or any(map(np.any, term.slopes.values()))


@dataclass(frozen=True, eq=False)
class _RowTable:
    """Rows that one table of weights makes."""

    numbers: IntArray  # (n_runs, q) number of each row among all, by run
    columns: IntArray  # (u,) columns that they are made of
    weights: FloatArray  # (n_runs, n_channels or 1, q, u) their weights
    channel: int | None = None  # the only channel that they act on


@dataclass(frozen=True, eq=False)
class EffectRows:
    """Rows of target, baseline and effects."""

    #: The target and the baseline's regressors, then each effect at each of its variants
    groups: tuple[_RowTable, ...]
    n_base: int  # Regressors of the baseline
    #: Numbers of the rows of each effect at each of its variants: a channel or its shapes
    variants: Mapping[tuple[str, tuple[float, ...]], IntArray]

    @property
    def size(self) -> int:
        """Number of rows."""
        return 1 + self.n_base + sum(rows.size for rows in self.variants.values())

    def of(self, *effects: str) -> IntArray:
        """Numbers of the rows of some effects."""
        rows = [rows for (name, _), rows in self.variants.items() if name in effects]
        return np.concatenate([np.empty(0, dtype=np.int64), *rows])


def effect_rows(model: CarrierModel, candidates: Effects, base: FloatArray) -> EffectRows:
    """Rows of target, baseline and candidates.

    `base` are the parameters of the fitted baseline, at which effects of a sensor are linearised,
    shape (p,).
    """
    contained = contained_channels(model)
    parameters = model.parameters((), contained)
    expected = _expected_values(parameters, base)
    groups = [_base_rows(model.weights((), contained, base), base, expected)]
    variants: dict[tuple[str, tuple[float, ...]], IntArray] = {}
    first = 1 + base.size
    for effect in candidates:
        for variant in model.variants(effect):
            rows = _rows_of_effect(model, effect, variant, base, contained, first)
            groups.append(rows)
            variants[effect, variant] = np.unique(rows.numbers)
            first += variants[effect, variant].size
    return EffectRows(tuple(groups), base.size, variants)


def _expected_values(parameters: Sequence[Parameter], base: FloatArray) -> FloatArray:
    """What is known of the baseline's parameters beforehand; 0 where nothing is, shape (p,).

    Products alone know no bounds: what the drawing allows of the curves would take up any gap. The
    table holds errors of the curves at their bounded fit, at zero where one of them meets its
    bound: it stands for a cause then, and so do the others.
    """
    known = np.array([p.prior_mean if np.isfinite(p.prior_std) else 0.0 for p in parameters])
    is_fixed = np.array([is_held(p, value) for p, value in zip(parameters, base, strict=True)])
    errors = np.array([p.effect == CURVE_ERROR for p in parameters], dtype=bool)
    lower, upper = bounds_of(parameters)
    if ((base <= lower) | (base >= upper))[errors].any():
        base = np.where(errors, 0.0, base)
    return np.where(is_fixed, base, known)


def is_held(parameter: Parameter, value: float) -> bool:
    """Whether the table holds a parameter of the baseline."""
    at_bound = parameter.effect in ALLOWED_BY_DRAWING and not 0.0 < value < 1.0
    return at_bound or parameter.effect == CURVE_ERROR or not parameter.is_free


def contained_channels(model: CarrierModel) -> dict[str, int]:
    """First channel for every effect of one sensor in the baseline."""
    return {name: 0 for name in model.contained if model.effects[name].is_of_one_channel}


def rows_at(
    groups: Sequence[_RowTable], run: int, channel: int, n_columns: int
) -> tuple[IntArray, FloatArray]:
    """Numbers of the rows that act in a channel of a run, and their weights, shape (m, k)."""
    numbers, tables = [], []
    for rows in groups:
        if rows.channel not in (None, channel):
            continue
        weights = rows.weights[run, channel if rows.channel is None else 0]
        table = np.zeros((len(weights), n_columns))
        table[:, rows.columns] = weights
        numbers.append(rows.numbers[run])
        tables.append(table)
    return np.concatenate(numbers), np.concatenate(tables)


def _base_rows(table: WeightTable, base: FloatArray, expected: FloatArray) -> _RowTable:
    """The target less the parts that are no parameter's (another simulator's prediction)."""
    linear = np.einsum("rcqk,rq->rck", table.slopes, (base - expected)[table.unknowns])
    target = -(table.values - linear)
    target[..., 0] += 1.0
    weights = np.concatenate([target[:, :, None], table.slopes], axis=2)
    zero = np.zeros((len(weights), 1), dtype=np.int64)
    numbers = np.concatenate([zero, 1 + table.unknowns], axis=1)
    return _RowTable(numbers, table.columns, weights)


def _rows_of_effect(
    model: CarrierModel,
    effect: str,
    variant: tuple[float, ...],
    base: FloatArray,
    contained: dict[str, int],
    first: int,
) -> _RowTable:
    """Derivatives of the signals by an effect's amplitudes, whose rows begin at `first`."""
    is_of_one_channel = model.effects[effect].is_of_one_channel
    choice = {**contained, effect: int(variant[0])} if is_of_one_channel else contained
    parameters = model.parameters((effect,), choice)
    parameters_of_base, parameters = parameters[: base.size], parameters[base.size :]
    weighed_by = model.effects[effect].weighed_by
    if weighed_by in model.contained:
        names = [parameter.effect for parameter in parameters_of_base]
        base = base.copy()
        base[names.index(weighed_by)] = variant[0]
    shapes = iter(() if is_of_one_channel or weighed_by else variant)
    value = [next(shapes) if parameter.shape else 0.0 for parameter in parameters]
    table = model.weights((effect,), choice, np.concatenate([base, value]))
    is_amplitude = np.array([not parameter.shape for parameter in parameters], dtype=bool)
    rank = np.cumsum(is_amplitude) - 1
    chosen = table.unknowns[0] >= base.size
    chosen[chosen] = is_amplitude[table.unknowns[0, chosen] - base.size]
    numbers = first + rank[table.unknowns[:, chosen] - base.size]
    weights = table.slopes[:, :, chosen]
    if not is_of_one_channel:
        return _RowTable(numbers, table.columns, _of_all_runs(weights))
    channel = int(variant[0])
    return _RowTable(numbers, table.columns, _of_all_runs(weights[:, [channel]]), channel)


def _of_all_runs(weights: FloatArray) -> FloatArray:
    """Weights by run, those that all runs share held once: of 500 runs of 64 channels 0.3 GB."""
    first = weights[:1]
    if not (weights == first).all():
        return weights
    return np.broadcast_to(first.copy(), weights.shape)
