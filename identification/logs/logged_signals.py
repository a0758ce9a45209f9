"""One column of a logger in the unit of the contract, its dropouts missing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import shortened
from carrierflex.identification.campaign.campaign_kinds import CampaignKind
from carrierflex.identification.campaign_check.sample_statistics import (
    expected_zeros,
    repeats,
)
from carrierflex.identification.logs.angles import (
    angle_of_pulses,
    is_pulse_train,
    unwrapped_angle,
)
from carrierflex.identification.logs.clocks import seconds_of_dates
from carrierflex.identification.logs.log_table import LogTable
from carrierflex.identification.logs.logged_units import PULSES, dimension_of, factor_to
from carrierflex.identification.logs.map_tables import (
    MapCarrierInputTable,
    MapInputTable,
    MapPredictionTable,
    MapTimeTable,
)

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
InputRow = MapInputTable | MapCarrierInputTable

_MECHANICAL = ("m", "N", "m/s", "m/s^2")
_INTEGRALS = {"m/s": "a velocity", "m/s^2": "an acceleration"}
_WHY_NOT = {
    "carrier": "offset, tilt and deflection at rest would be lost",
    "mounting": "every channel is relative to its zero at rest, which would be lost",
    "element": "the drift of its integral cannot be distinguished from stiffness and friction; an "
    "acceleration is read as the input base_acceleration of drive = 'base'",
}
#: Distance of a zero from the line between its neighbours over the median step of the signal.
_FAR = 8.0
#: Numbers that loggers write where there is nothing.
_MARKS = (-9999.0, -999.0, 9999.0, 99999.0, -99999.0, 32767.0, -32768.0, 1e30, -1e30)


@dataclass(frozen=True)
class Count:
    """How many rows of a column something was found in.

    Parameters
    ----------
    run, column : str
        Where.
    what : str
        What was found.
    rows : int
        In so many rows.
    """

    run: str
    column: str
    what: str
    rows: int


def time_of(table: LogTable, clock: MapTimeTable) -> FloatArray:
    """Time of a table's rows [s]; of dates, seconds since 1970.

    Raises
    ------
    ValueError
        Where the table has neither the column nor a clock of its own.
    """
    if clock.column is not None and clock.column in table.texts:
        return seconds_of_dates(table.texts[clock.column], clock.format or "", table.file)
    if clock.column is not None and clock.column in table.columns:
        if clock.unit == "date":
            raise ValueError(
                f"[time]: unit is 'date' and column '{clock.column}' of {table.file} holds "
                "numbers; expected their unit, as 's' or 'ms'"
            )
        return table.columns[clock.column] * factor_to(clock.unit, "s")
    rows = np.arange(table.n_rows, dtype=np.float64)
    if table.step is not None:
        return table.start + table.step * rows
    if clock.column is None and clock.rate_hz is not None:
        return rows / clock.rate_hz
    known = shortened(", ".join(table.names), 400)
    raise ValueError(
        f"{table.file}: no column '{clock.column or 'time'}' of [time]; found {known}; expected "
        "[time] column, or rate_hz without a column"
    )


def contract_unit(unit: str, expected: str, quantity: str, kind: CampaignKind) -> tuple[float, str]:
    """Factor to the unit that the campaign declares, and that unit.

    Raises
    ------
    ValueError
        Where the unit measures something else.
    """
    dimension = dimension_of(unit)
    wanted = dimension_of(expected)
    mechanical = [dimension_of(known) for known in _MECHANICAL]
    if kind.any_unit and dimension and dimension not in mechanical and dimension != wanted:
        # A voltage analogue keeps its unit.
        return 1.0, unit
    integrals = {dimension_of(known): what for known, what in _INTEGRALS.items()}
    if expected == "m" and (dimension in integrals or quantity in ("velocity", "acceleration")):
        what = integrals.get(dimension, f"a {quantity}")
        raise ValueError(
            f"unit '{unit}' is that of {what}; expected a displacement: {_WHY_NOT[kind.name]}"
        )
    return factor_to(unit, expected), expected


def input_values(
    row: InputRow, values: FloatArray, time: FloatArray, kind: CampaignKind
) -> FloatArray:
    """An input in the unit of the contract; angles go on where the logger begins anew.

    Parameters
    ----------
    row : MapInputTable
        What the column is.
    values, time : ndarray, shape (n,)
        Column as it stands in the file, and instants [s].
    kind : CampaignKind
        What the kind of campaign holds.
    """
    values = np.where(marked(values), np.nan, values)
    expected = kind.inputs[row.name]
    if row.name != "carrier_angle":
        factor, _ = contract_unit(row.unit, expected, row.name, kind)
        return (row.factor * values + row.offset) * factor
    if row.unit.lower() == PULSES:
        return row.factor * _counted(row, values, time) + row.offset
    factor = factor_to(row.unit, expected)
    angle = unwrapped_angle(row.factor * values, time, 2.0 * np.pi / factor)
    return (angle + row.offset) * factor


def _counted(row: InputRow, values: FloatArray, time: FloatArray) -> FloatArray:
    """Angle [rad] of a counter, or of a train of pulses."""
    if row.pulses_per_turn is None:
        raise ValueError(
            "missing key 'pulses_per_turn'; expected a positive number, required for pulses"
        )
    if is_pulse_train(values):
        return angle_of_pulses(values, time, row.pulses_per_turn)
    if row.wraps_at is not None:
        values = unwrapped_angle(values, time, row.wraps_at)
    return 2.0 * np.pi * values / row.pulses_per_turn


def channel_values(
    values: FloatArray, moves: BoolArray, about: tuple[str, str]
) -> tuple[FloatArray, list[Count]]:
    """A channel whose dropouts are missing, and how many of each kind there were.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Column of the file.
    moves : ndarray, shape (n,)
        Rows in which the machine moves.
    about : tuple of str
        Run and channel, for the counts.
    """
    run, channel = about
    counts = [Count(run, channel, "empty cells", int(np.isnan(values).sum()))]
    result = values.copy()
    for what, rows in (
        ("marks of nothing", marked(values)),
        ("zeros in place of nothing", zeroed(values, moves)),
        ("rows that repeat the one before", stuck(values, moves)),
    ):
        new = rows & np.isfinite(result) if what != "marks of nothing" else rows
        counts.append(Count(run, channel, what, int(new.sum())))
        result[rows] = np.nan
    return result, [count for count in counts if count.rows]


def prediction_values(row: MapPredictionTable, table: LogTable, expected: str) -> FloatArray:
    """A prediction in the unit of its channel."""
    return (row.factor * table.columns[row.column] + row.offset) * factor_to(row.unit, expected)


def stuck(values: FloatArray, moves: BoolArray) -> BoolArray:
    """Rows in which a channel repeats the row before while the machine moves.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Channel, missing samples NaN.
    moves : ndarray, shape (n,)
        Rows in which an input changes.

    Returns
    -------
    ndarray, shape (n,)
        The first row of a stretch still counts as measured. Plateaus at the signal's ends are a
        range that is too small, and stay.
    """
    result = np.zeros(values.size, dtype=bool)
    all_stretches, length = repeats(values, moves)
    for first, end in all_stretches:
        if end - first + 1 >= length:
            result[first:end] = True
    return result


def zeroed(values: FloatArray, moves: BoolArray) -> BoolArray:
    """Exact zeros that are none of the signal's own, shape (n,).

    All of them where chance makes none while the machine moves; else those far from the samples
    beside them.
    """
    zero_rows = (values == 0.0) & moves
    if np.count_nonzero(zero_rows) >= 2.0 + 4.0 * expected_zeros(values):
        return zero_rows
    present = np.flatnonzero(np.isfinite(values) & (values != 0.0))
    zero = np.flatnonzero(zero_rows)
    result = np.zeros(values.size, dtype=bool)
    if zero.size == 0 or present.size < 10:
        return result
    step = float(np.median(np.abs(np.diff(values[present]))))
    interpolated = np.interp(zero, present, values[present])
    # A signal that passes through zero has small values on both sides.
    result[zero[np.abs(interpolated) > _FAR * step]] = True
    return result if step > 0.0 else np.zeros(values.size, dtype=bool)


def marked(values: FloatArray) -> BoolArray:
    """Infinite values, and marks as -9999 that lie outside of all else, shape (n,)."""
    result = np.isinf(values)
    for mark in _MARKS:
        rows = values == mark
        others = np.abs(values[~rows & np.isfinite(values)])
        if rows.any() and others.size and abs(mark) > 2.0 * float(others.max()):
            result |= rows
    return result
