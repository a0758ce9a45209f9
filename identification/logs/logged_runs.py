"""One run from the tables of its files: every signal in its unit, all on one clock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.problems import Problems, refuse
from carrierflex.identification.campaign.campaign_kinds import CampaignKind
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.logs.clocks import (
    even_step,
    grid_with_gaps,
    on_clock,
    rows_in_order,
)
from carrierflex.identification.logs.log_files import read_log
from carrierflex.identification.logs.log_table import LogTable, run_tables, table_with
from carrierflex.identification.logs.logged_signals import (
    Count,
    channel_values,
    contract_unit,
    input_values,
    time_of,
)
from carrierflex.identification.logs.map_tables import MapDocument, MapRunTable

FloatArray = NDArray[np.float64]

#: Fewest samples of a run.
_FEWEST = 10
#: Clocks that differ by less than this share of a step are one.
_SAME = 1e-3


@dataclass(frozen=True, eq=False)
class _Timed:
    """A table in order.

    `instants` of its rows [s] as they stand; `time` [s] with a row for every sample that is
    missing; `rows` that are in order, and their `places` in `time`.
    """

    table: LogTable
    instants: FloatArray
    time: FloatArray
    rows: NDArray[np.int64]
    places: NDArray[np.int64]

    def spread(self, values: FloatArray) -> FloatArray:
        """Values of the rows in order at their places, missing elsewhere."""
        result = np.full(self.time.size, np.nan)
        result[self.places] = values
        return result


@dataclass(frozen=True, eq=False)
class LoggedRun:
    """A run, and what was found in its files."""

    run: Run
    counts: tuple[Count, ...] = ()
    notes: tuple[str, ...] = field(default=())


def logged_run(
    entry: MapRunTable, document: MapDocument, kind: CampaignKind, files: Mapping[str, Path]
) -> LoggedRun:
    """Run of a map.

    Parameters
    ----------
    entry : MapRunTable
        Its name and files.
    document : MapDocument
        The map.
    kind : CampaignKind
        What its kind of campaign holds.
    files : mapping of str to Path
        Files by name.

    Raises
    ------
    ValueError
        Where a file is refused, a column is missing or has a wrong unit: all of it at once.
    """
    tables = run_tables([read_log(files[name]) for name in entry.files], document.time.column)
    timed = _timed_tables(tables, entry, document)
    signals, counts = _signals(timed, entry, document, kind)
    counts += [
        Count(entry.name, own.table.file, "missing rows", own.time.size - own.rows.size)
        for own in timed
        if own.time.size > own.rows.size
    ]
    counts += [
        Count(entry.name, own.table.file, "rows out of order", own.table.n_rows - own.rows.size)
        for own in timed
        if own.table.n_rows > own.rows.size
    ]
    time, columns = _on_one_clock(signals, document)
    inputs = {name: columns[name] for name in kind.inputs}
    channels = {table.name: columns[table.name] for table in document.channels}
    lost = ~np.all([np.isfinite(values) for values in inputs.values()], axis=0) if inputs else None
    if lost is not None and lost.any():
        counts.append(Count(entry.name, "inputs", "rows without an input", int(lost.sum())))
        rig = document.rig.given()
        period = rig["period_samples"] if rig.get("periodic") else None
        if period is not None:
            inputs = {name: _from_other_periods(values, period) for name, values in inputs.items()}
        # What an unknown input did rings on as long as what was before the record.
        after = 0 if period is not None else rig.get("settle_samples") or 0
        inputs = {name: _filled(values, time, name) for name, values in inputs.items()}
        lost = np.convolve(lost, np.ones(after + 1))[: lost.size] > 0.0
        channels = {name: np.where(lost, np.nan, values) for name, values in channels.items()}
    run = Run(
        entry.name,
        f"{entry.name}.parquet",
        entry.condition,
        time,
        inputs,
        channels,
        use=tuple(entry.use or ()),
    )
    notes = [f"{table.file}: {note}" for table in tables for note in table.notes]
    return LoggedRun(run, tuple(counts), tuple(notes))


def _timed_tables(
    tables: Sequence[LogTable], entry: MapRunTable, document: MapDocument
) -> list[_Timed]:
    """Tables that hold a column of the map, in the order of time."""
    wanted = {table.column for table in (*document.channels, *document.inputs)}
    used = [table for table in tables if wanted & set(table.names)]
    times = [time_of(table, document.time) for table in used]
    dates = [time for table, time in zip(used, times, strict=True) if table.texts]
    # Dates count from the first of the run; other clocks keep their own zero.
    origin = min((float(np.nanmin(time)) for time in dates), default=0.0)
    timed = []
    for table, time in zip(used, times, strict=True):
        shifted = time - (origin if table.texts else 0.0) + entry.starts.get(table.file, 0.0)
        rows = np.flatnonzero(rows_in_order(shifted, table.file))
        full, places = grid_with_gaps(shifted[rows])
        timed.append(_Timed(table, shifted, full, rows, places))
    return timed


def _signals(
    timed: Sequence[_Timed], entry: MapRunTable, document: MapDocument, kind: CampaignKind
) -> tuple[dict[str, tuple[FloatArray, FloatArray]], list[Count]]:
    """Time and values of every input and channel, by name."""
    problems = Problems()
    signals: dict[str, tuple[FloatArray, FloatArray]] = {}
    counts: list[Count] = []
    by_table = {id(own.table): own for own in timed}
    tables = [own.table for own in timed]
    for row in document.inputs:
        with problems.at(f"[[inputs]] {row.name}"):
            own = by_table[id(table_with(tables, row.column))]
            values = own.table.columns[row.column][own.rows]
            values = input_values(row, values, own.instants[own.rows], kind)
            signals[row.name] = own.time, own.spread(values)
    for channel in document.channels:
        with problems.at(f"[[channels]] {channel.name}"):
            own = by_table[id(table_with(tables, channel.column))]
            expected = kind.quantities.get(channel.quantity, "m")
            factor, _ = contract_unit(channel.unit, expected, channel.quantity, kind)
            inputs = [signals[row.name] for row in document.inputs if row.name in signals]
            moves = _moves(inputs, own)
            values, found = channel_values(
                own.table.columns[channel.column][own.rows], moves, (entry.name, channel.name)
            )
            counts += found
            values = (channel.factor * values + channel.offset) * factor
            signals[channel.name] = own.time, own.spread(values)
    refuse(problems.messages)
    return signals, counts


def _moves(inputs: Sequence[tuple[FloatArray, FloatArray]], own: _Timed) -> NDArray[np.bool_]:
    """Rows of a table in which an input changes; all where there is none."""
    at = own.time[own.places]
    changes = np.full(at.size, not inputs)
    for time, values in inputs:
        present = np.isfinite(values)
        moved = np.diff(np.interp(at, time[present], values[present])) != 0.0
        changes[1:] |= moved
    return changes


def _on_one_clock(
    signals: Mapping[str, tuple[FloatArray, FloatArray]], document: MapDocument
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """All signals at the instants of one clock.

    Records of one clock stay as they are; others are sampled anew over the time that all have.
    """
    times = list({id(time): time for time, _ in signals.values()}.values())
    rate = document.time.rate_hz if document.time.column is not None else None
    first = times[0]
    step = even_step(first)
    same = all(
        time.size == first.size and float(np.abs(time - first).max()) < _SAME * step
        for time in times
    )
    if same and (rate is None or abs(rate * step - 1.0) < _SAME):
        return first, {name: values for name, (_, values) in signals.items()}
    slowest = max(even_step(signals[table.name][0]) for table in document.channels)
    wanted = 1.0 / rate if rate is not None else slowest
    start, end = max(float(time[0]) for time in times), min(float(time[-1]) for time in times)
    n = int(np.floor((end - start) / wanted * (1.0 + 1e-12))) + 1
    if n < _FEWEST:
        raise ValueError(
            f"files have {max(end - start, 0.0):.4g} s in common; expected records of one time: "
            "give what a file lacks in 'starts' of the run"
        )
    clock = start + wanted * np.arange(n, dtype=np.float64)
    return clock, {name: on_clock(values, time, clock) for name, (time, values) in signals.items()}


def _filled(values: FloatArray, time: FloatArray, name: str) -> FloatArray:
    present = np.isfinite(values)
    if not present.any():
        raise ValueError(f"[[inputs]] {name}: no number in its column; expected an input")
    return np.interp(time, time[present], values[present])


def _from_other_periods(values: FloatArray, period: int) -> FloatArray:
    """Input with its missing rows from the nearest period that has them."""
    result = values.copy()
    for turn in range(1, values.size // period + 1):
        for shift in (-turn * period, turn * period):
            rows = np.flatnonzero(np.isnan(result))
            others = rows + shift
            rows = rows[(others >= 0) & (others < values.size)]
            result[rows] = values[rows + shift]
    return result
