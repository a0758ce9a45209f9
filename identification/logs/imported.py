"""A campaign from a logger's files and the map of their columns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.problems import Problems, refuse
from carrierflex.files.whole_files import file_digest
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.campaign_kinds import CampaignKind, campaign_kind
from carrierflex.identification.campaign.campaign_tables import baseline_of
from carrierflex.identification.campaign.declarations import (
    Baseline,
    Channel,
    InputSignal,
    KnownValue,
)
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signal_tables import channel_of, input_of
from carrierflex.identification.campaign_check.releases import cut_at_releases
from carrierflex.identification.logs.clock_shift import ClockShift, clock_shift
from carrierflex.identification.logs.clocks import (
    even_step,
    grid_with_gaps,
    on_clock,
    rows_in_order,
)
from carrierflex.identification.logs.log_files import read_log
from carrierflex.identification.logs.log_table import (
    LogTable,
    run_tables,
    table_with,
    tables_of_group,
)
from carrierflex.identification.logs.logged_signals import (
    Count,
    channel_values,
    contract_unit,
    input_values,
    prediction_values,
    time_of,
)
from carrierflex.identification.logs.map_tables import (
    MapDocument,
    MapPredictionTable,
    MapRunTable,
    MapSimulatedTable,
    refuse_other_inputs,
)

Signal = TypeVar("Signal", Channel, InputSignal)
_FloatArray = NDArray[np.float64]
#: Fewest samples of a run.
_FEWEST = 10
#: Clocks that differ by less than this share of a step are one.
_SAME = 1e-3


@dataclass(frozen=True, eq=False)
class Imported:
    """What an import made.

    Parameters
    ----------
    campaign : Campaign
        Everything in the units of the contract, on one clock.
    counts : tuple of Count
        Samples that are missing, by run and column.
    shifts : mapping of str to ClockShift
        By run, of another simulator's clock.
    sha256 : mapping of str to str
        Digest of every file that was read, by its name.
    notes : tuple of str
        What was left out.
    """

    campaign: Campaign
    counts: tuple[Count, ...]
    shifts: Mapping[str, ClockShift]
    sha256: Mapping[str, str]
    notes: tuple[str, ...]


def imported_campaign(
    document: MapDocument, files: Sequence[Path], simulated: Sequence[Path] = ()
) -> Imported:
    """Campaign from a logger's files.

    Parameters
    ----------
    document : MapDocument
        What the columns are.
    files : sequence of Path
        The files that the map's runs name.
    simulated : sequence of Path
        Another simulator's files, one for each run in the map's order.

    Raises
    ------
    ValueError
        Where map and files do not go together, or a file is refused; all of it at once.
    """
    refuse_other_inputs(document)
    kind = campaign_kind(
        document.kind, document.rig.given(), [table.name for table in document.inputs]
    )
    by_name = {path.name: path for path in files}
    _refuse_other_files(document, files, simulated)
    problems = Problems()
    runs: list[Run] = []
    counts: list[Count] = []
    notes: list[str] = []
    # Runs of one file follow one another.
    read = lru_cache(maxsize=1)(read_log)
    for entry in document.runs:
        with problems.at(f"run {entry.name}"):
            tables = [_tables(read(by_name[name]), entry.group) for name in entry.files]
            run, counts_of_run, notes_of_run = _logged_run(entry, document, kind, tables)
            runs.append(run)
            counts += counts_of_run
            notes += notes_of_run
    refuse(problems.messages)
    channels, inputs = _declared(document, kind)
    if not kind.inputs and not simulated:
        cut = [cut_at_releases(run) if not run.use else (run,) for run in runs]
        notes += [
            f"run {run.name}: cut at its releases, {len(decays)} from {decays[0].time[0]:.2f} s on"
            for run, decays in zip(runs, cut, strict=True)
            if decays != (run,)
        ]
        runs = [decay for decays in cut for decay in decays]
    shifts: dict[str, ClockShift] = {}
    if simulated:
        for number, path in enumerate(simulated):
            with problems.at(f"{path}"):
                run, shift = _predicted(runs[number], path, document, channels)
                runs[number] = run
                if shift is not None:
                    shifts[run.name] = shift
        refuse(problems.messages)
    campaign = Campaign(
        document.kind,
        document.name,
        _baseline(document, shifts, bool(simulated)),
        document.rig.given(),
        channels,
        tuple(runs),
        inputs,
    )
    return Imported(
        campaign,
        tuple(counts),
        shifts,
        {path.name: file_digest(path) for path in (*files, *simulated)},
        tuple(notes),
    )


def _refuse_other_files(
    document: MapDocument, files: Sequence[Path], simulated: Sequence[Path]
) -> None:
    """Refuse files that no run names, and runs without theirs."""
    names = [path.name for path in files]
    wanted = [name for entry in document.runs for name in entry.files]
    problems = [f"file '{name}' is given twice" for name in names if names.count(name) > 1]
    problems += [
        f"{path}: no run of the map names it; expected one of {', '.join(wanted)}"
        for path in files
        if path.name not in wanted
    ]
    problems += [
        f"[[runs]] {entry.name}: file '{name}' is not among those given"
        for entry in document.runs
        for name in entry.files
        if name not in names
    ]
    if simulated and len(simulated) != len(document.runs):
        problems.append(
            f"--simulated has {len(simulated)} files and the map {len(document.runs)} runs; "
            "expected one for each run, in the map's order"
        )
    refuse(problems)


def _declared(
    document: MapDocument, kind: CampaignKind
) -> tuple[tuple[Channel, ...], tuple[InputSignal, ...]]:
    """Channels and inputs with their errors in the units of the contract."""
    channels = []
    for row in document.channels:
        expected = kind.quantities.get(row.quantity, "m")
        factor, unit = contract_unit(row.unit, expected, row.quantity, kind)
        channel = channel_of(row)
        if document.kind == "carrier" and channel.radius is None:
            channel = replace(channel, radius=document.rig.sensor_radius)
        channels.append(_in_unit(channel, unit, abs(factor * row.factor)))
    inputs = []
    for declared in document.inputs:
        if declared.name == "carrier_angle":
            inputs.append(_in_unit(input_of(declared), kind.inputs[declared.name], 1.0))
            continue
        factor, unit = contract_unit(declared.unit, kind.inputs[declared.name], declared.name, kind)
        inputs.append(_in_unit(input_of(declared), unit, abs(factor * declared.factor)))
    return tuple(channels), tuple(inputs)


def _in_unit(signal: Signal, unit: str, factor: float) -> Signal:
    errors = {
        name: factor * value
        for name in ("noise_std", "zero_std")
        if (value := getattr(signal, name)) is not None
    }
    return replace(signal, unit=unit, **errors)


def _predicted(
    run: Run, path: Path, document: MapDocument, channels: Sequence[Channel]
) -> tuple[Run, ClockShift | None]:
    """Run with another simulator's prediction on its clock, and how far that was moved."""
    table = document.simulated or MapSimulatedTable()
    rows = table.channels or [
        MapPredictionTable(channel=channel.name, column=channel.name, unit=channel.unit)
        for channel in channels
    ]
    tables = read_log(path)
    by_channel = {channel.name: channel for channel in channels}
    missing = sorted(set(by_channel) - {row.channel for row in rows})
    if missing:
        raise ValueError(
            f"no [[simulated.channels]] for {', '.join(missing)}; expected one for each channel"
        )
    problems = Problems()
    predicted: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]] = {}
    for row in rows:
        with problems.at(f"[[simulated.channels]] {row.channel}"):
            if row.channel not in by_channel:
                raise ValueError(f"no such channel; expected one of {', '.join(by_channel)}")
            holding = table_with(tables, row.column)
            time = time_of(holding, table.time)
            order = rows_in_order(time, holding.file)
            values = prediction_values(row, holding, by_channel[row.channel].unit)
            predicted[row.channel] = time[order], values[order]
    refuse(problems.messages)
    shift = None
    seconds = table.shift
    names = [channel.name for channel in channels]
    if seconds is None:
        shift = clock_shift(
            run.time,
            [run.signals[name] for name in names],
            predicted[names[0]][0],
            [predicted[name][1] for name in names],
        )
        seconds = shift.seconds
    columns = {
        name: on_clock(values, time + seconds, run.time)
        for name, (time, values) in predicted.items()
    }
    return replace(run, predictions=columns), shift


def _baseline(
    document: MapDocument, shifts: Mapping[str, ClockShift], has_predictions: bool
) -> Baseline:
    baseline = baseline_of(document.baseline)
    if not has_predictions:
        return baseline
    moved = {name: KnownValue(shift.seconds, shift.std) for name, shift in shifts.items()}
    return replace(baseline, source="columns", effects=(), clock_shift=moved)


@dataclass(frozen=True, eq=False)
class _Timed:
    """A table in order."""

    table: LogTable
    instants: _FloatArray
    time: _FloatArray
    rows: NDArray[np.int64]
    indices: NDArray[np.int64]

    def spread(self, values: _FloatArray) -> _FloatArray:
        """Values of the rows in order at their places, missing elsewhere."""
        result = np.full(self.time.size, np.nan)
        result[self.indices] = values
        return result


def _tables(tables: Sequence[LogTable], group: str | None) -> Sequence[LogTable]:
    return tables if group is None else tables_of_group(tables, group)


def _logged_run(
    entry: MapRunTable,
    document: MapDocument,
    kind: CampaignKind,
    files: Sequence[Sequence[LogTable]],
) -> tuple[Run, list[Count], list[str]]:
    """Run of a map, and what was found in its files."""
    tables = run_tables(files, document.time.column)
    timed = _timed_tables(tables, entry, document)
    signals, counts = _signals(tables, timed, entry, document, kind)
    counts += [
        Count(entry.name, clocked.table.file, "missing rows", clocked.time.size - clocked.rows.size)
        for clocked in timed
        if clocked.time.size > clocked.rows.size
    ]
    counts += [
        Count(
            entry.name,
            clocked.table.file,
            "rows out of order",
            clocked.table.n_rows - clocked.rows.size,
        )
        for clocked in timed
        if clocked.table.n_rows > clocked.rows.size
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
    return run, counts, notes


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
        full, indices = grid_with_gaps(shifted[rows])
        timed.append(_Timed(table, shifted, full, rows, indices))
    return timed


def _signals(
    tables: Sequence[LogTable],
    timed: Sequence[_Timed],
    entry: MapRunTable,
    document: MapDocument,
    kind: CampaignKind,
) -> tuple[dict[str, tuple[_FloatArray, _FloatArray]], list[Count]]:
    """Time and values of every input and channel, by name."""
    problems = Problems()
    signals: dict[str, tuple[_FloatArray, _FloatArray]] = {}
    counts: list[Count] = []
    by_table = {id(clocked.table): clocked for clocked in timed}
    for row in document.inputs:
        with problems.at(f"[[inputs]] {row.name}"):
            clocked = by_table[id(table_with(tables, row.column))]
            values = clocked.table.columns[row.column][clocked.rows]
            values = input_values(row, values, clocked.instants[clocked.rows], kind)
            signals[row.name] = clocked.time, clocked.spread(values)
    for channel in document.channels:
        with problems.at(f"[[channels]] {channel.name}"):
            clocked = by_table[id(table_with(tables, channel.column))]
            expected = kind.quantities.get(channel.quantity, "m")
            factor, _ = contract_unit(channel.unit, expected, channel.quantity, kind)
            inputs = [signals[row.name] for row in document.inputs if row.name in signals]
            moves = _moves(inputs, clocked)
            values, conversion = channel_values(
                clocked.table.columns[channel.column][clocked.rows],
                moves,
                (entry.name, channel.name),
            )
            counts += conversion
            values = (channel.factor * values + channel.offset) * factor
            signals[channel.name] = clocked.time, clocked.spread(values)
    refuse(problems.messages)
    return signals, counts


def _moves(inputs: Sequence[tuple[_FloatArray, _FloatArray]], clocked: _Timed) -> NDArray[np.bool_]:
    """Rows of a table in which an input changes; all where there is none."""
    at = clocked.time[clocked.indices]
    changes = np.full(at.size, not inputs)
    for time, values in inputs:
        present = np.isfinite(values)
        moved = np.diff(np.interp(at, time[present], values[present])) != 0.0
        changes[1:] |= moved
    return changes


def _on_one_clock(
    signals: Mapping[str, tuple[_FloatArray, _FloatArray]], document: MapDocument
) -> tuple[_FloatArray, dict[str, _FloatArray]]:
    """All signals at the instants of one clock."""
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


def _filled(values: _FloatArray, time: _FloatArray, name: str) -> _FloatArray:
    present = np.isfinite(values)
    if not present.any():
        raise ValueError(f"[[inputs]] {name}: no number in its column; expected an input")
    return np.interp(time, time[present], values[present])


def _from_other_periods(values: _FloatArray, period: int) -> _FloatArray:
    """Input with its missing rows from the nearest period that has them."""
    result = values.copy()
    for turn in range(1, values.size // period + 1):
        for shift in (-turn * period, turn * period):
            rows = np.flatnonzero(np.isnan(result))
            others = rows + shift
            rows = rows[(others >= 0) & (others < values.size)]
            result[rows] = values[rows + shift]
    return result
