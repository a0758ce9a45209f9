"""Classes of a carrier, frame and pattern: weights of the flexible columns by run and sensor.

A class follows the loads by smooth functions of torque and radial load, or not at all. A function
is linear within a run about the run's mean loads, and as curved as it is from run to run: the
columns of the flexible model, each times a constant of the run, carry it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, product

import numpy as np

from carrierflex.diagnosis.carrier.records.columns import (
    CONSTANT,
    FORCE_Y,
    FORCE_Z,
    N_TIME_COLUMNS,
    SAME_CONDITION,
    TORQUE,
    FlexibleTerm,
    flexible_terms,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.fe.deflection_curves import order_amplitudes
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    BY_BOTH,
    BY_RADIAL_LOAD,
    BY_TORQUE,
    MODULATED,
    NONE,
    OFFSET,
    PLANET_PASS,
    SADDLE,
    TILT,
    TIME,
    TURNING_TILT,
    UNEVEN,
    WAVES,
    Columns,
    PatternColumn,
    modulated_waves,
    offset,
    planet_pass,
    saddle,
    tilt,
    turning_tilt,
    turning_waves,
    uneven_waves,
)
from carrierflex.simulation.carrier.rim import CarrierRig

#: Torque over nominal, radial load over the largest, along y and z; shape (n,) each.
LoadFunction = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
#: Radial load, over the largest, at which a saturating function bends.
_BENDS = (0.15, 0.45)
_STEP = 1e-4
_AXIAL = "axial_displacement"
#: Number of a wave times a load among the columns of the flexible model.
_Numbers = Mapping[FlexibleTerm, int]
UNDETERMINED = "undetermined"
#: Columns of a pattern from the quantities of the sensors and the number of planets.
_ColumnsOf = Callable[[Sequence[str], int], Columns]


@dataclass(frozen=True, eq=False)
class _Shape:
    """Frame and pattern of a class."""

    id: str  # frame/pattern
    columns: Mapping[str, _ColumnsOf]  # columns by dependence, the simplest first

    @property
    def sets(self) -> list[tuple[str, ...]]:
        """Ways to follow the loads, the simplest first."""
        sets: list[tuple[str, ...]] = [()]
        for one in self.columns:
            sets += [(*others, one) for others in sets]
        return sets[1:]


def _alone(pattern: Callable[[Sequence[str]], Columns]) -> _ColumnsOf:
    """Pattern that does not depend on the number of planets."""
    return lambda quantities, n_planets: pattern(quantities)


def shapes() -> tuple[_Shape, ...]:
    """Every frame and pattern whose columns are waves."""
    still = {OFFSET: offset, TILT: tilt, SADDLE: saddle}
    housing = tuple(
        _Shape(name, dict.fromkeys((NONE, BY_TORQUE, BY_RADIAL_LOAD), _alone(pattern)))
        for name, pattern in still.items()
    )
    turning = _alone(turning_tilt)
    return (
        *housing,
        _Shape(PLANET_PASS, {NONE: planet_pass, BY_TORQUE: planet_pass}),
        _Shape(MODULATED, {BY_BOTH: modulated_waves}),
        _Shape(TURNING_TILT, {NONE: turning, BY_TORQUE: turning}),
        _Shape(
            WAVES,
            {
                # On the carrier's face whatever their order; as many lobes as planets, and
                # multiples, by equal loads of all planets.
                NONE: lambda quantities, n: turning_waves(
                    quantities, range(2, highest_order(n) + 1)
                ),
                BY_TORQUE: lambda quantities, n: turning_waves(
                    quantities, range(n, highest_order(n) + 1, n)
                ),
            },
        ),
        _Shape(UNEVEN, {BY_TORQUE: uneven_waves}),
    )


@dataclass(frozen=True, eq=False)
class _LoadFunctions:
    """Functions of one dependence."""

    functions: tuple[LoadFunction, ...]  # functions of the loads, those of a vector first
    penalty: FloatArray  # (n,) how much each is penalised
    n_vectors: int = 0  # pairs of functions along y and z


def _load_weights(function: LoadFunction, means: FloatArray) -> dict[str, FloatArray]:
    """Factor of the columns times each load by run, linear about the mean loads of each run."""
    t, y, z = means.T
    slopes = {
        TORQUE: (function(t + _STEP, y, z) - function(t - _STEP, y, z)) / (2.0 * _STEP),
        FORCE_Y: (function(t, y + _STEP, z) - function(t, y - _STEP, z)) / (2.0 * _STEP),
        FORCE_Z: (function(t, y, z + _STEP) - function(t, y, z - _STEP)) / (2.0 * _STEP),
    }
    constant = function(t, y, z) - sum(
        slope * mean for slope, mean in zip(slopes.values(), means.T, strict=True)
    )
    return {CONSTANT: constant, **slopes}


def torque_levels(torque: FloatArray) -> int:
    """Torques over nominal that differ by more than a twentieth."""
    levels: list[float] = []
    for value in sorted(torque.tolist()):
        if not levels or value - levels[-1] > SAME_CONDITION:
            levels.append(value)
    return len(levels)


def load_functions(n_torques: int) -> dict[str, _LoadFunctions]:
    """Functions of each dependence, and how much each is penalised.

    The constant for what follows nothing; powers of the torque, zero without torque, as many as the
    torques can tell; the radial load as a vector, linear, saturating and even in its direction.
    """
    powers = tuple(_power(k) for k in range(1, max(min(n_torques - 1, 3), 1) + 1))
    bends = tuple(_saturating(component, bend) for bend in _BENDS for component in (0, 1))
    linear = (lambda t, y, z: y, lambda t, y, z: z)
    even = (lambda t, y, z: y * z, lambda t, y, z: z * z, lambda t, y, z: y * y)
    return {
        NONE: _LoadFunctions((lambda t, y, z: np.ones_like(t),), np.zeros(1)),
        BY_TORQUE: _LoadFunctions(powers, np.array([0.0, *[1.0] * (len(powers) - 1)])),
        BY_RADIAL_LOAD: _LoadFunctions(
            (*linear, *bends, *even), np.array([0.0] * 2 + [1.0] * 7), n_vectors=3
        ),
        BY_BOTH: _LoadFunctions(
            tuple(_times_torque(function) for function in (*linear, *bends, *even)),
            np.array([0.0] * 2 + [1.0] * 7),
            n_vectors=3,
        ),
    }


def _power(k: int) -> LoadFunction:
    return lambda t, y, z: np.asarray(np.sign(t) * np.abs(t) ** k)


def _times_torque(function: LoadFunction) -> LoadFunction:
    return lambda t, y, z: t * function(t, y, z)


def _saturating(component: int, bend: float) -> LoadFunction:
    def function(t: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
        """Component of a vector along the load, as long as ``tanh(|F| / bend)``."""
        size = np.hypot(y, z)
        along = (y, z)[component] / np.maximum(size, np.finfo(float).tiny)
        return np.asarray(np.where(size > 0.0, along * np.tanh(size / bend), 0.0))

    return function


def _pin_weights(pattern: str, columns: Columns, rig: CarrierRig) -> FloatArray:
    """Weights of the columns of a pattern in what unequal pin loads can make of it.

    Shape (n_patterns, n_columns), the largest weight at the sensors of a quantity one. In a pattern
    that unequal pin loads do not make, and without the curve ``g_f`` of one pin, every wave has a
    size of its own.

    References
    ----------
    .. [1] 2012 paper, section 2: superposition of the single-pin curves.
    """
    if pattern not in (UNEVEN, MODULATED) or "g_f" not in rig.curves:
        return np.eye(len(columns))
    lobes = np.array([column.waves[0].lobes for column in columns])
    order = np.array([column.order for column in columns])
    cosine = np.array([column.waves[0].cosine for column in columns])
    sine = np.array([column.waves[0].sine for column in columns])
    if pattern == UNEVEN:
        factors = _of_excesses(lobes, rig.n_planets)
    else:
        # Shares ``cos(beta_i)`` and ``sin(beta_i)`` of the housing angle of a pin change once a
        # turn: ``2/n sum_i e_i exp(-j (h - n) beta_i)``.
        factors = np.array([np.ones(lobes.size, dtype=complex), -1j * (lobes - order)])
    rows = []
    for quantity in dict.fromkeys(column.quantity for column in columns):
        shows = np.array([column.quantity == quantity for column in columns])
        curve = rig.curves["g_f"]
        G = order_amplitudes(curve.axial if quantity == _AXIAL else curve.radial)
        G = np.pad(G, (0, lobes.max()))[lobes]
        amplitudes = shows * factors * G * np.exp(-1j * order * rig.pin_angle)
        # Of Re(A exp(j (h v - n theta))).
        weights = cosine * amplitudes.real - sine * amplitudes.imag
        # A file of curves without the radial ones: such a sensor reads nothing of it.
        rows.append(weights / (np.abs(weights).max() or 1.0))
    return np.concatenate(rows)


def _of_excesses(lobes: np.ndarray, n_planets: int) -> np.ndarray:
    """Sums ``2/n sum_i e_i exp(-j h alpha_i)`` of excesses that add up to nothing.

    Shape (n_planets - 1, n_columns): ``e_i = cos(m alpha_i)`` and ``sin(m alpha_i)``.
    """
    rows = []
    for m in range(1, n_planets // 2 + 1):
        is_same, is_other = lobes % n_planets == m, lobes % n_planets == n_planets - m
        rows.append((is_same | is_other).astype(complex))
        if 2 * m < n_planets:
            rows.append(-1j * is_same + 1j * is_other)
    return np.array(rows)


#: Column of a pattern at the sensors of a campaign: order of the carrier angle, and weights of its
#: cosine and of its sine at every sensor.
_SensorColumn = tuple[int, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class _RowGroup:
    """Rows of one shape that follow the loads in one way: every function with every column."""

    columns: Sequence[_SensorColumn]  # columns of the pattern
    loads: Sequence[Mapping[str, FloatArray]]  # functions of the loads: factors by load and run
    penalty: FloatArray  # (n, n) penalty of the amplitudes, those of a function together
    weights: FloatArray  # (n_patterns, n_columns) sums of columns that the amplitudes are of


@dataclass(frozen=True, eq=False)
class ClassRows:
    """Rows of all classes, group by group; the last ones are the offset that changes in time."""

    groups: Mapping[str, _RowGroup]  # By ``frame/pattern:dependence``
    offset: FloatArray  # One where an offset of the run shows, shape (n_channels,)
    numbers: _Numbers  # Number of a wave times a load among the columns of the flexible model
    means: FloatArray  # Mean of each load in each run, over nominal and largest, shape (n_runs, 3)

    @property
    def rows_of_groups(self) -> dict[str, tuple[slice, FloatArray]]:
        """Rows of every group, and their penalty."""
        rows = {}
        first = 0
        for name, group in self.groups.items():
            rows[name] = (slice(first, first + len(group.penalty)), group.penalty)
            first += len(group.penalty)
        warming = slice(first, first + N_TIME_COLUMNS)
        rows[f"{OFFSET}:{TIME}"] = (warming, np.eye(N_TIME_COLUMNS))
        return rows

    @property
    def size(self) -> int:
        """Number of rows."""
        return N_TIME_COLUMNS + sum(len(group.penalty) for group in self.groups.values())

    def of_run(self, run: int) -> FloatArray:
        """Weights of the flexible columns in a run, shape (n_rows + 1, n_channels, n_features).

        The last row is the offset of the run.
        """
        means = dict(
            zip((CONSTANT, TORQUE, FORCE_Y, FORCE_Z), (1.0, *self.means[run]), strict=True)
        )
        rows = []
        for group in self.groups.values():
            for loads in group.loads:
                factors = {load: factor[run] for load, factor in loads.items()}
                of_columns = np.array(
                    [_row(column, factors, means, self.numbers) for column in group.columns]
                )
                rows.append(np.tensordot(group.weights, of_columns, 1))
        in_time = np.zeros((N_TIME_COLUMNS + 1, *rows[0].shape[1:]))
        for k in range(N_TIME_COLUMNS):
            in_time[k, :, k] = 1.0
        in_time[-1, :, self.numbers[0, False, CONSTANT]] = self.offset
        return np.concatenate([*rows, in_time])


def class_rows(
    channels: Sequence[Channel], rig: CarrierRig, means: FloatArray, n_torques: int
) -> ClassRows:
    """Rows of every shape; `n_torques` are the torques that differ.

    `means` are mean torque and radial load of each run, over nominal and over the largest, shape
    (n_runs, 3).
    """
    functions = load_functions(n_torques)
    quantities = [channel.quantity for channel in channels]
    groups = {}
    for shape in shapes():
        for dependence in shape.columns:
            loads = functions[dependence]
            columns = shape.columns[dependence](quantities, rig.n_planets)
            weights = _pin_weights(shape.id, columns, rig)
            groups[f"{shape.id}:{dependence}"] = _RowGroup(
                [_at_sensors(column, channels) for column in columns],
                [_load_weights(load, means) for load in loads.functions],
                _penalty(loads, columns, weights),
                weights,
            )
    is_axial = [float(channel.quantity == _AXIAL) for channel in channels]
    terms = flexible_terms(rig.n_planets)
    numbers = dict(zip(terms, count(N_TIME_COLUMNS), strict=False))
    return ClassRows(groups, np.array(is_axial), numbers, means)


def _penalty(loads: _LoadFunctions, columns: Columns, weights: FloatArray) -> FloatArray:
    """Penalty of the amplitudes of every function with every sum of columns.

    A pattern that turns with the radial load as a whole is the simplest that follows it: the
    housing is then alike in all directions. How far the amplitudes along y and z are from that is
    penalised as much as how far each is from a straight line (a third of it and three times as much
    name the same classes of development cases; at a tenth and at ten times a tilt that begins late
    is a tie with planet loads under six loads). With the load ``F (sin d, cos d)`` along y and z, a
    wave ``cos(h v - k theta - a)`` turns with it as ``cos(h v - k theta - a + (h - k) d)`` where
    ``h - k`` is one or minus one.
    """
    n = len(columns)
    size = len(loads.penalty) * n
    turning = np.zeros((size, size))
    for vector, c in product(range(loads.n_vectors), _turning_pairs(columns)):
        wave = columns[c].waves[0]
        turns = float(wave.lobes - columns[c].order)
        y, z = 2 * vector * n, (2 * vector + 1) * n
        for along_z, along_y, sign in ((z + c, y + c + 1, turns), (z + c + 1, y + c, -turns)):
            difference = np.zeros(size)
            difference[[along_z, along_y]] = 1.0, sign
            turning += np.outer(difference, difference)
    of_columns = np.kron(np.eye(len(loads.penalty)), weights)
    bends = np.kron(np.diag(loads.penalty), np.eye(len(weights)))
    return np.asarray(bends + of_columns @ turning @ of_columns.T)


def _turning_pairs(columns: Columns) -> list[int]:
    """Columns that are the cosine of a wave which turns with a load, the sine behind it."""
    return [
        number
        for number, column in enumerate(columns)
        if len(column.waves) == 1
        and abs(column.waves[0].lobes - column.order) == 1
        and column.waves[0].cosine == 1.0
    ]


def _at_sensors(column: PatternColumn, channels: Sequence[Channel]) -> _SensorColumn:
    """Column of a pattern at every sensor."""
    angle = np.array([channel.angle for channel in channels], dtype=np.float64)
    shows = np.array([float(channel.quantity == column.quantity) for channel in channels])
    cosine, sine = column.over(angle)
    return column.order, shows * cosine, shows * sine


def _row(
    column: _SensorColumn,
    factors: Mapping[str, float],
    means: Mapping[str, float],
    numbers: _Numbers,
) -> FloatArray:
    """Weights of the flexible columns for one row in a run, shape (n_channels, n_features)."""
    order, cosine, sine = column
    row = np.zeros((cosine.size, N_TIME_COLUMNS + len(numbers)))
    for is_sine, over_channels in ((False, cosine), (True, sine)):
        if not over_channels.any():
            continue
        plain = numbers[order, is_sine, CONSTANT]
        for load, factor in factors.items():
            number = numbers.get((order, is_sine, load))
            if number is None:
                # No column of this order follows the load within a run: its mean stands for it.
                row[:, plain] += factor * means[load] * over_channels
            else:
                row[:, number] += factor * over_channels
    return row
