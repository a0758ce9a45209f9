"""Rows of the classes of a carrier: weights of the flexible model's columns by run and sensor."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from carrierflex.diagnosis.carrier.classes.catalogue import OFFSET, TIME, shapes
from carrierflex.diagnosis.carrier.classes.dependence import (
    LoadFunctions,
    LoadWeights,
    load_functions,
    load_weights,
)
from carrierflex.diagnosis.carrier.classes.pin_weights import pin_weights
from carrierflex.diagnosis.carrier.records.columns import (
    CONSTANT,
    N_TIME_COLUMNS,
    flexible_terms,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.simulation.carrier.measured_laws.rim_patterns import Columns, PatternColumn
from carrierflex.simulation.carrier.rim import CarrierRig

#: Number of a wave times a load among the columns of the flexible model.
Numbers = Mapping[tuple[int, bool, str], int]
#: Penalty of amplitudes that do not turn with the load, beside that of a bend: as much. A third of
#: it and three times as much name the same classes of development cases; at a tenth and at ten
#: times a tilt that begins late is a tie with planet loads under six loads.
_LESS_SIMPLE = 1.0


@dataclass(frozen=True, eq=False)
class SensorColumn:
    """Column of a pattern at the sensors of a campaign.

    Parameters
    ----------
    order : int
        Order of the carrier angle.
    cosine, sine : ndarray, shape (n_channels,)
        Weights of its cosine and sine; zero at sensors of another quantity.
    """

    order: int
    cosine: FloatArray
    sine: FloatArray


@dataclass(frozen=True, eq=False)
class RowGroup:
    """Rows of one shape that follow the loads in one way: every function with every column.

    Parameters
    ----------
    columns : sequence of SensorColumn
        Columns of the pattern.
    loads : sequence of LoadWeights
        Functions of the loads.
    penalty : ndarray, shape (n, n)
        Penalty of the amplitudes, those of a function together.
    weights : ndarray, shape (n_patterns, n_columns)
        Sums of columns that the amplitudes are of; ones on its diagonal where every column has a
        size of its own.
    """

    columns: Sequence[SensorColumn]
    loads: Sequence[LoadWeights]
    penalty: FloatArray
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class ClassRows:
    """Rows of all classes, group by group; the last ones are the offset that changes in time.

    Parameters
    ----------
    groups : mapping of str to RowGroup
        By ``frame/pattern:dependence``.
    n_channels : int
        Channels.
    offset : ndarray, shape (n_channels,)
        One where an offset of the run shows.
    numbers : mapping of tuple to int
        Number of a wave times a load among the columns of the flexible model.
    """

    groups: Mapping[str, RowGroup]
    n_channels: int
    offset: FloatArray
    numbers: Numbers

    @property
    def places(self) -> dict[str, tuple[slice, FloatArray]]:
        """Rows of every group, and their penalty."""
        found = {}
        first = 0
        for name, group in self.groups.items():
            found[name] = (slice(first, first + len(group.penalty)), group.penalty)
            first += len(group.penalty)
        warming = slice(first, first + N_TIME_COLUMNS)
        found[f"{OFFSET}:{TIME}"] = (warming, np.eye(N_TIME_COLUMNS))
        return found

    @property
    def size(self) -> int:
        """Number of rows."""
        return N_TIME_COLUMNS + sum(len(group.penalty) for group in self.groups.values())

    @property
    def n_features(self) -> int:
        """Columns of the flexible model."""
        return N_TIME_COLUMNS + len(self.numbers)

    def of_run(self, run: int) -> FloatArray:
        """Weights of the flexible columns in a run, shape (n_rows + 1, n_channels, n_features).

        The last row is the offset of the run.
        """
        rows = []
        for group in self.groups.values():
            for loads in group.loads:
                own = np.array([_row(column, loads, run, self.numbers) for column in group.columns])
                rows.append(np.tensordot(group.weights, own, 1))
        warming = np.zeros((N_TIME_COLUMNS, self.n_channels, self.n_features))
        for k in range(N_TIME_COLUMNS):
            warming[k, :, k] = 1.0
        return np.concatenate([*rows, warming, self._offset_row])

    @property
    def _offset_row(self) -> FloatArray:
        """Offset of the run, shape (1, n_channels, n_features)."""
        row = np.zeros((1, self.n_channels, self.n_features))
        row[0, :, self.numbers[0, False, CONSTANT]] = self.offset
        return row


def class_rows(
    channels: Sequence[Channel], rig: CarrierRig, means: FloatArray, n_torques: int
) -> ClassRows:
    """Rows of every shape.

    Parameters
    ----------
    channels : sequence of Channel
        Sensors.
    rig : CarrierRig
        Planets, and the curve of one pin where it is known.
    means : ndarray, shape (n_runs, 3)
        Mean torque and radial load of each run, over nominal and over the largest.
    n_torques : int
        Torques that differ.
    """
    functions = load_functions(n_torques)
    quantities = [channel.quantity for channel in channels]
    groups = {}
    for shape in shapes():
        for dependence in shape.columns:
            loads = functions[dependence]
            columns = shape.columns[dependence](quantities, rig.n_planets)
            in_proportion = pin_weights(shape.id, columns, rig)
            weights = np.eye(len(columns)) if in_proportion is None else in_proportion
            groups[f"{shape.id}:{dependence}"] = RowGroup(
                [_at_sensors(column, channels) for column in columns],
                [load_weights(load, means) for load in loads.functions],
                _penalty(loads, columns, weights),
                weights,
            )
    is_axial = [float(channel.quantity == "axial_displacement") for channel in channels]
    numbers = {
        (term.order, term.is_sine, term.load): N_TIME_COLUMNS + k
        for k, term in enumerate(flexible_terms(rig.n_planets))
    }
    return ClassRows(groups, len(channels), np.array(is_axial), numbers)


def _penalty(loads: LoadFunctions, columns: Columns, weights: FloatArray) -> FloatArray:
    """Penalty of the amplitudes of every function with every sum of columns.

    A pattern that turns with the radial load as a whole is the simplest that follows it: the
    housing is then alike in all directions. How far the amplitudes along y and z are from that is
    penalised beside how far each is from a straight line. With the load ``F (sin d, cos d)`` along
    y and z, a wave ``cos(h v - k theta - a)`` turns with it as ``cos(h v - k theta - a + (h - k)
    d)`` where ``h - k`` is one or minus one.
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
            turning += _LESS_SIMPLE * np.outer(difference, difference)
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


def _at_sensors(column: PatternColumn, channels: Sequence[Channel]) -> SensorColumn:
    """Column of a pattern at every sensor."""
    angle = np.array([channel.angle for channel in channels], dtype=np.float64)
    shows = np.array(
        [channel.quantity == column.quantity for channel in channels], dtype=np.float64
    )
    cosine, sine = column.over(angle)
    return SensorColumn(column.order, shows * cosine, shows * sine)


def _row(column: SensorColumn, loads: LoadWeights, run: int, numbers: Numbers) -> FloatArray:
    """Weights of the flexible columns for one row in a run, shape (n_channels, n_features)."""
    row = np.zeros((column.cosine.size, N_TIME_COLUMNS + len(numbers)))
    for is_sine, over_channels in ((False, column.cosine), (True, column.sine)):
        if not over_channels.any():
            continue
        plain = numbers[column.order, is_sine, CONSTANT]
        for load, factor in loads.by_load.items():
            number = numbers.get((column.order, is_sine, load))
            if number is None:
                # No column of this order follows the load within a run: its mean stands for it.
                row[:, plain] += factor[run] * loads.means[load][run] * over_channels
            else:
                row[:, number] += factor[run] * over_channels
    return row
