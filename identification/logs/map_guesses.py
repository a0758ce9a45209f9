"""What the columns of a logger's files may be: guesses from names, units and values."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.campaign.campaign_kinds import campaign_kind
from carrierflex.identification.logs.angles import is_pulse_train
from carrierflex.identification.logs.clocks import date_format, even_step
from carrierflex.identification.logs.log_files import read_log, words_of
from carrierflex.identification.logs.log_table import (
    LogTable,
    is_clock,
    run_groups,
    run_tables,
    table_with,
    tables_of_group,
)
from carrierflex.identification.logs.logged_units import (
    PULSES,
    dimension_of,
    factor_to,
    unit_behind,
)
from carrierflex.identification.logs.map_tables import OPEN
from carrierflex.simulation.mounting.rig import SENSORS

#: Words in the names of columns, in the languages of those who wrote such loggers.
_WORDS = {
    "carrier_angle": r"angle|winkel|azimuth|theta|encoder|rotor.?pos|drehgeber|pulse|puls|count",
    "torque": r"torque|moment|drehm|trq|\bmd\b|\bmx\b",
    "speed": r"speed|rpm|drehzahl|omega|\bn\b",
    "ntl_y": r"ntl.?y|f.?y\b|force.?y|kraft.?y|radial.?y|load.?y|last.?y",
    "ntl_z": r"ntl.?z|f.?z\b|force.?z|kraft.?z|radial.?z|load.?z|last.?z",
    "force": r"force|kraft|load|last|\bf\b",
    "displacement": r"disp|weg|deflec|stroke|position|pos|hub|^[xsy]( ?\d+)?$",
    "base_displacement": r"base|floor|foot|table|boden|fuss",
    "base_acceleration": r"base|acc|beschl|\ba\b",
}
_SET_POINT = r"target|soll|set.?point|\bset\b|command|\bcmd\b|demand|\bref\b|reference"
#: What a file of one column may be called after.
_MEASURED = ("force", "displacement", "base_displacement", "base_acceleration")
#: A range of values beyond this many radians is one of degrees.
_RADIANS = 7.0
_TIME_UNITS = (1e-9, 1e-6, 1e-3, 1.0, 60.0, 3600.0)
#: Seconds since 1970 of the years from 2001 to 2033.
_EPOCHS = (1e9, 2e9)
#: Steps of a time without a unit: seconds from the first to the second, then milliseconds. Beside
#: them it may be anything: days of a table, microseconds, dates as one number.
_STEPS, _LONGEST = (1e-5, 0.9, 1e3), 1e13
#: Units of time over one another; share of a record by which its clocks may drift apart.
_TIME_SCALES = sorted({a / b for a in _TIME_UNITS for b in _TIME_UNITS})
_SAME_SPAN = 0.01


@dataclass(frozen=True)
class Guess:
    """What a column may be.

    Parameters
    ----------
    column, unit : str
        As in the file; ``?`` where nothing tells.
    why : str
        Why, for the comment beside it.
    """

    column: str
    unit: str
    why: str = ""


@dataclass(frozen=True)
class RunGuess:
    """A run: its name, its files, and the group in them that holds it."""

    name: str
    files: tuple[str, ...]
    group: str = ""


@dataclass(frozen=True, eq=False)
class MapGuess:
    """Everything that a new map states.

    Parameters
    ----------
    kind : str
        Kind of campaign.
    rig : mapping
        Keys of the rig that are known; ``?`` where the user has to tell.
    time : Guess
        Column of time; `date_format` and `rate_hz` [Hz] of the clock where they are known.
    inputs : mapping of str to Guess
        By name of the contract.
    channels : sequence of (name, Guess, facts)
        Facts are further keys, as the angle of a sensor.
    runs : sequence of RunGuess
        Records.
    others : sequence of str
        Columns that were not taken.
    dialects : mapping of str to str
        How each file was understood, by name.
    """

    kind: str
    rig: Mapping[str, Any]
    time: Guess
    date_format: str
    rate_hz: float | None
    inputs: Mapping[str, Guess]
    channels: Sequence[tuple[str, Guess, Mapping[str, Any]]]
    runs: Sequence[RunGuess]
    others: Sequence[str]
    dialects: Mapping[str, str] = field(default_factory=dict)


def map_guess(kind: str, files: Sequence[Path], drive: str | None = None) -> MapGuess:
    """Guesses for the files of a campaign.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.
    files : sequence of Path
        Files of the same columns are runs, files of other columns, or of one column each by other
        names, parts of a run.
    drive : str, optional
        Of an element; guessed from the columns.

    Raises
    ------
    ValueError
        Where a file is refused.
    """
    logs = {path: read_log(path) for path in files}
    runs = _runs_in_groups(logs) or _runs(logs)
    first, group = [logs[path] for path in files if path.name in runs[0].files], runs[0].group
    first = [tables_of_group(tables, group) for tables in first] if group else first
    time = _time([table for tables in first for table in tables])
    tables = run_tables(first, time.column)
    free = [name for table in tables for name in table.columns if name != time.column]
    units = {name: _unit(table_with(tables, name), name) for name in free}
    rig: dict[str, Any] = {"drive": drive or _drive(units)} if kind == "element" else {}
    contract = campaign_kind(kind, rig, _accelerated(rig, units))
    inputs: dict[str, Guess] = {}
    for name, unit in contract.inputs.items():
        unassigned = [column for column in free if column not in _taken(inputs)]
        inputs[name] = _input(name, unit, unassigned, tables, units)
    if kind == "carrier" and inputs["ntl_y"].column == OPEN and inputs["ntl_z"].column == OPEN:
        rig["radial_load"] = "none"
        del inputs["ntl_y"], inputs["ntl_z"]
    rest = [name for name in free if name not in _taken(inputs)]
    channels = _channels(kind, contract.quantities, rest, units)
    taken = {guess.column for _, guess, _ in channels}
    return MapGuess(
        kind,
        rig,
        time,
        _format(tables, time),
        _rate(tables, time),
        inputs,
        channels,
        runs,
        [name for name in rest if name not in taken],
        {path.name: words_of(path) for path in files},
    )


def _taken(inputs: Mapping[str, Guess]) -> set[str]:
    return {guess.column for guess in inputs.values()}


def _runs_in_groups(logs: Mapping[Path, tuple[LogTable, ...]]) -> list[RunGuess]:
    """Every group of every file, where all of them hold the same columns; none otherwise."""
    groups = {path: run_groups(tables) for path, tables in logs.items()}
    columns = {
        tuple(sorted(name for table in tables_of_group(logs[path], group) for name in table.names))
        for path, names in groups.items()
        for group in names
    }
    if not all(groups.values()) or len(columns) != 1:
        return []
    of_file = {path: f"{path.stem}_" if len(logs) > 1 else "" for path in logs}
    return [
        RunGuess(_run_name(of_file[path] + group), (path.name,), group)
        for path, names in groups.items()
        for group in names
    ]


def _runs(logs: Mapping[Path, tuple[LogTable, ...]]) -> list[RunGuess]:
    """Files of the same columns are runs; several such groups of one size go together in order."""
    # Files of one column are told apart by what their names call it.
    groups: dict[tuple[str, ...], list[str]] = {}
    for path, tables in logs.items():
        names = tuple(name for table in tables for name in table.names)
        if sum(len(table.columns) for table in tables) == 1:
            names += tuple(role for role in _MEASURED if _is_called(path.stem, role))[:1]
        groups.setdefault(names, []).append(path.name)
    if len({len(group) for group in groups.values()}) > 1:
        return [RunGuess("run1", tuple(path.name for path in logs))]
    runs = list(zip(*groups.values(), strict=True))
    stems = [_run_name(Path(files[0]).stem) for files in runs]
    if len(set(stems)) < len(stems):
        stems = [f"run{number}" for number in range(1, len(runs) + 1)]
    return [RunGuess(stem, tuple(files)) for stem, files in zip(stems, runs, strict=True)]


def _run_name(text: str) -> str:
    return re.sub(r"[^\w.-]+", "_", text).strip("._-") or "run1"


def _time(tables: Sequence[LogTable]) -> Guess:
    for table in tables:
        # Of a date and a time of day in two columns the latter goes on from row to row.
        for name, cells in table.texts.items():
            if any(":" in (cell or "") for cell in cells[:1]):
                return Guess(name, "date", "holds dates")
    for table in tables:
        for name, values in table.columns.items():
            unit = table.units.get(name) or unit_behind(name)
            in_seconds = dimension_of(unit) == dimension_of("s")
            if is_clock(name, unit) and bool(np.all(np.diff(values) > 0.0)):
                if rival := _rival(table, name):
                    why = f"'{name}' and '{rival}' differ; one clock serves all columns of a table"
                    return Guess(OPEN, "s", why)
                if in_seconds:
                    return Guess(name, unit, "grows, and its unit is stated")
                return Guess(name, *_time_unit(values))
    if all(table.step is not None for table in tables):
        return Guess("", "s", "the files state their clock")
    even = [
        (name, values)
        for table in tables
        for name, values in table.columns.items()
        if not dimension_of(table.units.get(name) or unit_behind(name))
        and _is_even(values)
        and not _is_count(values)
    ]
    if len(even) > 1:
        # At one speed it grows so too.
        even = [one for one in even if not _is_called(one[0], "carrier_angle")]
    if len(even) == 1:
        return Guess(even[0][0], *_time_unit(even[0][1]))
    if even:
        names = ", ".join(f"'{name}'" for name, _ in even[:4])
        return Guess(OPEN, "s", f"{names} grow evenly: name the one that is time")
    return Guess(OPEN, "s", "no column grows evenly: name it, or give rate_hz in its place")


def _is_even(values: NDArray[np.float64]) -> bool:
    steps = np.diff(values)
    return steps.size > 0 and bool(np.ptp(steps) < 1e-6 * abs(float(steps.mean())) < np.inf)


def _is_count(values: NDArray[np.float64]) -> bool:
    """Whether a column counts rows, which says nothing of time."""
    return bool(np.all(np.diff(values) == 1.0))


def _rival(table: LogTable, clock: str) -> str:
    """Another column of time in the table, by which its rows stand at other instants; or none."""
    first = table.columns[clock]
    for name, values in table.columns.items():
        rows = np.flatnonzero(np.isfinite(values))
        if name == clock or rows.size < 3 or not is_clock(name, table.units.get(name, "")):
            continue
        spans = np.ptp(first[rows]), np.ptp(values[rows])
        if not all(spans) or np.any(np.diff(values[rows]) < 0.0):
            continue
        # Where a unit is not stated, it is the one that suits best.
        ratio = spans[1] / spans[0]
        scale = min(_TIME_SCALES, key=lambda scale: abs(np.log(ratio / scale)))
        late = float(values[rows[0]] / scale - first[rows[0]])
        # A clock that counts from a zero of its own, as the time of day does, shares no instant.
        overlaps = even_step(first) < abs(late) < spans[0]
        if overlaps or abs(ratio / scale - 1.0) > _SAME_SPAN:
            return name
    return ""


def _time_unit(values: NDArray[np.float64]) -> tuple[str, str]:
    """Unit of a time without one: of the clock of a computer by its size, else by its steps."""
    step, end = even_step(values), float(np.nanmax(values))
    for unit in ("s", "ms", "us", "ns"):
        if _EPOCHS[0] < end * factor_to(unit, "s") < _EPOCHS[1]:
            return unit, "counts from 1970"
    if not _STEPS[0] <= step < _STEPS[2] or end > _LONGEST:
        return OPEN, f"steps of {step:.4g} up to {end:.6g} without a unit"
    unit = "ms" if step >= _STEPS[1] else "s"
    return unit, f"steps of {step:.4g} without a unit: a guess"


def _format(tables: Sequence[LogTable], time: Guess) -> str:
    for table in tables:
        if time.column in table.texts:
            return date_format(table.texts[time.column], table.file)
    return ""


def _rate(tables: Sequence[LogTable], time: Guess) -> float | None:
    """Rate of the clock [Hz], for the comment; None where it is not known."""
    for table in tables:
        if time.column in table.columns and table.n_rows > 2 and time.unit != OPEN:
            step = even_step(table.columns[time.column]) * factor_to(time.unit, "s")
            return 1.0 / step if step > 0.0 else None
    return None


def _unit(table: LogTable, name: str) -> str:
    unit = table.units.get(name, "")
    if dimension_of(unit) or unit == PULSES:
        return unit
    # A file of one column may be called after it: "load_kN.txt".
    of_file = unit_behind(Path(table.file).stem) if len(table.columns) == 1 else ""
    return unit_behind(name) or of_file or unit or OPEN


def _bare(name: str) -> str:
    """Name in lower case without the unit behind it."""
    return re.sub(r"[\[(<].*$", "", name).strip().lower().replace("_", " ")


def _is_called(name: str, role: str) -> bool:
    return re.search(_WORDS[role], _bare(name)) is not None


def _drive(units: Mapping[str, str]) -> str:
    """Drive of an element: what is measured tells most of it."""
    dimensions = [dimension_of(unit) for unit in units.values()]
    has_force = dimension_of("N") in dimensions or any(_is_called(name, "force") for name in units)
    if has_force:
        return "displacement"
    if any(_is_called(name, "base_displacement") for name in units):
        return "base"
    return "base" if dimension_of("m/s^2") in dimensions else "free_decay"


def _accelerated(rig: Mapping[str, Any], units: Mapping[str, str]) -> tuple[str, ...]:
    if rig.get("drive") != "base":
        return ()
    accelerations = [u for u in units.values() if dimension_of(u) == dimension_of("m/s^2")]
    return ("base_acceleration",) if accelerations else ()


def _input(
    role: str,
    expected: str,
    free: Sequence[str],
    tables: Sequence[LogTable],
    units: Mapping[str, str],
) -> Guess:
    """Column of an input: by unit and name, by name, by unit where only one column has it."""
    fits = [
        name
        for name in free
        if dimension_of(units[name]) == dimension_of(expected)
        or (expected == "rad" and units[name].lower() == PULSES)
    ]
    # A set point is called as the signal that follows it.
    called = sorted(
        (name for name in free if _is_called(name, role)),
        key=lambda name: re.search(_SET_POINT, _bare(name)) is not None,
    )
    both = [name for name in called if name in fits]
    unknown = [name for name in called if units[name] == OPEN or not dimension_of(units[name])]
    if both:
        name, why = both[0], "by its name and unit"
    elif len(fits) == 1 and role not in ("ntl_y", "ntl_z"):
        name, why = fits[0], "the only one of such a unit"
    elif unknown:
        name, why = unknown[0], "by its name"
    else:
        return Guess(OPEN, OPEN, "no column is called so or has such a unit")
    if role == "carrier_angle":
        return _angle(name, units[name], table_with(tables, name), why)
    return Guess(name, units[name], why)


def _angle(name: str, unit: str, table: LogTable, why: str) -> Guess:
    """Unit of an angle from its values: degrees, radians or pulses; the direction it turns in."""
    values = table.columns[name]
    present = values[np.isfinite(values)]
    steps = np.diff(present)
    turns = "backwards" if steps.size and float(np.median(steps)) < 0.0 else "forwards"
    wraps = steps.size > 0 and float(np.abs(steps).max()) > 0.5 * float(np.ptp(present)) > 0.0
    why += f"; mostly {turns}" + (", begins anew each turn" if wraps else "")
    if unit != OPEN:
        return Guess(name, unit, why)
    if is_pulse_train(present) or (bool(np.all(present == np.rint(present))) and np.ptp(present)):
        return Guess(name, PULSES, why + "; whole numbers")
    largest = float(np.abs(present).max()) if present.size else 0.0
    guessed = "deg" if largest > _RADIANS and (largest < 361.0 or not wraps) else "rad"
    return Guess(name, guessed, f"{why}; reaches {largest:.4g}: {guessed} is a guess")


def _channels(
    kind: str, quantities: Mapping[str, str], free: Sequence[str], units: Mapping[str, str]
) -> list[tuple[str, Guess, dict[str, Any]]]:
    """Channels among the columns that are left."""
    expected = next(iter(quantities.values()))
    fits = [
        name for name in free if dimension_of(units[name]) in (dimension_of(expected), "", "number")
    ]
    if kind == "element":
        role = next(iter(quantities))
        exact = [name for name in fits if dimension_of(units[name]) == dimension_of(expected)]
        named = [name for name in fits if _is_called(name, role)]
        chosen = ([name for name in exact if name in named] or exact or named)[:1]
        column = chosen[0] if chosen else OPEN
        guess = Guess(column, units.get(column, OPEN))
        return [(f"measured_{role}", guess, {"quantity": role})]
    result = []
    for number, column in enumerate(fits, start=1):
        facts = _sensor_facts(kind, column, next(iter(quantities)))
        guess = Guess(column, units[column])
        result.append((_channel_name(column, number), guess, facts))
    return result


def _sensor_facts(kind: str, column: str, quantity: str) -> dict[str, Any]:
    """Further keys of a channel, from its name."""
    if kind == "mounting":
        known = [sensor for sensor in SENSORS if sensor in column.lower()]
        return {"quantity": quantity, "sensor": known[0] if known else OPEN}
    # The last number counts, of two digits at least: "Probe 3 at 227".
    angles = [int(digits) for digits in re.findall(r"\d{2,3}", re.sub(r"[\[(<].*$", "", column))]
    fits = [angle for angle in angles if angle <= 360]
    angle: Any = float(fits[-1]) if fits else OPEN
    if re.search(r"rad(ial)?\b", _bare(column)):
        quantity = "radial_displacement"
    return {"quantity": quantity, "angle_deg": angle}


def _channel_name(column: str, number: int) -> str:
    return re.sub(r"\W+", "_", re.sub(r"[\[(<].*$", "", column)).strip("_") or f"channel{number}"
