"""A campaign from a logger's files and the map of their columns."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.problems import Problems, refuse
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
from carrierflex.identification.logs.clock_shift import ClockShift, clock_shift
from carrierflex.identification.logs.clocks import on_clock, rows_in_order
from carrierflex.identification.logs.log_files import read_log
from carrierflex.identification.logs.log_table import table_with
from carrierflex.identification.logs.logged_runs import logged_run
from carrierflex.identification.logs.logged_signals import (
    Count,
    contract_unit,
    prediction_values,
    time_of,
)
from carrierflex.identification.logs.map_tables import (
    MapDocument,
    MapPredictionTable,
    MapSimulatedTable,
    refuse_other_inputs,
)

Signal = TypeVar("Signal", Channel, InputSignal)


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
    logged = []
    for entry in document.runs:
        with problems.at(f"run {entry.name}"):
            logged.append(logged_run(entry, document, kind, by_name))
    refuse(problems.messages)
    channels, inputs = _declared(document, kind)
    runs = [own.run for own in logged]
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
        tuple(count for own in logged for count in own.counts),
        shifts,
        {path.name: _digest(path) for path in (*files, *simulated)},
        tuple(note for own in logged for note in own.notes),
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
    for own in document.inputs:
        if own.name == "carrier_angle":
            inputs.append(_in_unit(input_of(own), kind.inputs[own.name], 1.0))
            continue
        factor, unit = contract_unit(own.unit, kind.inputs[own.name], own.name, kind)
        inputs.append(_in_unit(input_of(own), unit, abs(factor * own.factor)))
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


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
