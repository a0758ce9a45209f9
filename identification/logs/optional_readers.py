"""Files that a package of an extra reads.

TDMS, universal files, MDF, Excel workbooks, OpenFAST's binary output. These libraries meet damage
with errors of every class, and some with a crash: all of them are called in the limited child.
"""

import datetime
import logging
import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.identification.logs.log_formats import format_of
from carrierflex.identification.logs.log_table import (
    MOST_NUMBERS,
    LogTable,
    NamedColumn,
    different_names,
    grouped_tables,
    table_of_columns,
)
from carrierflex.identification.logs.logged_units import dimension_of, factor_to
from carrierflex.identification.logs.text_logs import text_table

#: Column of time in files whose groups have a clock of their own.
TIME = "time"
#: Zero of the clocks of TDMS files.
_TDMS_FIRST = np.datetime64("1904-01-01T00:00:00")
#: Function types of data set 58: general, time response; its specific data types of abscissae.
_GENERAL, _TIME_RESPONSE, _OVER_TIME = 0, 1, 17
_REAL = (2, 4)
_FUNCTIONS = {
    2: "auto spectra",
    3: "cross spectra",
    4: "frequency responses",
    6: "coherences",
    9: "power spectral densities",
    12: "spectra",
}
#: Words of data set 58 for what an ordinate is.
_ORDINATES = {
    2: "stress",
    3: "strain",
    5: "temperature",
    8: "displacement",
    9: "force",
    11: "velocity",
    12: "acceleration",
    13: "force",
    15: "pressure",
    19: "speed",
}
_DIRECTIONS = ("", "X", "Y", "Z", "RX", "RY", "RZ")


def library(path: Path) -> Any:
    """Module that reads a file, imported.

    Raises
    ------
    ValueError
        Where it is not installed; the message names the extra.
    """
    entry = format_of(path)
    assert entry is not None
    try:
        return import_module(entry.module)
    except ImportError as error:
        package = entry.module.partition(".")[0].replace("_", "-")
        raise ValueError(
            f"{path}: {entry.words} needs the package {package}; install it with pip install "
            f"'carrierflex[{entry.extra}]', or export the file as CSV"
        ) from error


@contextmanager
def _library_errors(path: Path) -> Iterator[None]:
    """Turn whatever a library raises into one line that names the file; its log is not shown."""
    entry = format_of(path)
    assert entry is not None
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    except MemoryError:
        raise
    except Exception as error:
        # An error of a library may come without a word, or with the key of a table of its own.
        said = " ".join(str(error).split())
        why = said if re.search(r"[^\W\d]{2}", said) else "damaged"
        raise ValueError(f"{path}: not {entry.words}: {why}; export it again, or as CSV") from error
    finally:
        logging.disable(before)


def tdms_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of a TDMS file: channels of one length and clock belong together."""
    nptdms = library(path)
    size = path.stat().st_size
    # The library leaves a file open that it refuses: this one is closed here.
    with _library_errors(path), path.open("rb") as stream, nptdms.TdmsFile.open(stream) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        stated = sum(len(channel) for channel in channels)
        # A sample takes a byte at least, and none is packed.
        if stated > min(size, MOST_NUMBERS):
            raise ValueError(f"{stated} samples in {size} bytes; expected what is stored")
        is_cut_short = file.file_status.incomplete_final_segment
        tables = () if is_cut_short else _tdms_tables(path, channels)
    if is_cut_short:
        raise ValueError(
            f"{path}: ends within its last segment; expected a whole file: "
            "copy it again, or export what it holds as CSV"
        )
    return tables


def _tdms_tables(path: Path, channels: Sequence[Any]) -> tuple[LogTable, ...]:
    """Tables of channels of numbers; clocks of the file count from the first instant in it."""
    contents = [(channel, np.asarray(channel[:])) for channel in channels]
    begins = {
        channel.path: begin
        for channel, values in contents
        if (begin := _tdms_begin(channel, values)) is not None
    }
    origin = min(begins.values(), default=None)
    clocks: dict[tuple[int, float, float], list[NamedColumn]] = {}
    for channel, values in contents:
        facts = channel.properties
        step = float(facts.get("wf_increment", 0.0) or 0.0)
        start = float(facts.get("wf_start_offset", 0.0) or 0.0)
        if values.dtype.kind == "M":
            values = (values - origin) / np.timedelta64(1, "s")
        elif step and channel.path in begins:
            start += float((begins[channel.path] - origin) / np.timedelta64(1, "s"))
        if values.dtype.kind in "fiub" and values.size:
            unit = facts.get("unit_string", "")
            name = f"{channel.group_name}/{channel.name}"
            column = (name, values, unit if isinstance(unit, str) else "")
            clocks.setdefault((values.size, step, start), []).append(column)
    if not clocks:
        raise ValueError("no channel of numbers")
    return grouped_tables(
        path, [(columns, step or None, start) for (_, step, start), columns in clocks.items()]
    )


def _tdms_begin(channel: Any, values: NDArray[np.generic]) -> Any:
    """First instant of a channel; None where none is stated."""
    if values.dtype.kind == "M":
        return values[0] if values.size else None
    begin = channel.properties.get("wf_start_time")
    # What was never set is the first instant that a TDMS file can hold.
    is_stated = isinstance(begin, np.datetime64) and begin > _TDMS_FIRST
    return begin if is_stated and channel.properties.get("wf_increment") else None


def uff_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of a universal file: time responses of data set 58 that share a clock.

    References
    ----------
    Universal file formats, Structural Dynamics Research Laboratory, University of Cincinnati: data
    set 58, function at nodal degree of freedom; 58b, its binary form.
    """
    pyuff = library(path)
    with _library_errors(path):
        file = pyuff.UFF(str(path))
        types = [int(number) for number in file.get_set_types()]
        sets = [file.read_sets(index) for index, number in enumerate(types) if number == 58]
    records = [entry for entry in sets if _is_record(entry)]
    if not records:
        functions = sorted({_FUNCTIONS.get(entry["func_type"], "functions") for entry in sets})
        what = ", ".join(functions) if functions else f"data sets {sorted(set(types))}"
        raise ValueError(
            f"{path}: a universal file of {what}; expected data set 58 with time responses "
            "(function type 1): export the records of time, not what was computed from them"
        )
    clocks: dict[tuple[object, ...], list[NamedColumn]] = {}
    names = _record_names(records)
    for entry, name in zip(records, names, strict=True):
        n = int(entry["num_pts"])
        values, instants = (np.asarray(entry[key], dtype=np.float64)[:n] for key in ("data", "x"))
        if values.size < n or instants.size < n:
            raise ValueError(
                f"{path}: {name} states {n} values and holds {values.size}; expected all of them: "
                "export it again"
            )
        seconds = _seconds(entry["abscissa_axis_units_lab"])
        unit = _label(entry["ordinate_axis_units_lab"])
        even = entry["abscissa_spacing"] == 1
        clock = (entry["abscissa_inc"], entry["abscissa_min"]) if even else (instants.tobytes(),)
        columns = clocks.setdefault((n, seconds, *clock), [])
        if not even and not columns:
            columns.append((TIME, instants * seconds, "s"))
        columns.append((name, values, unit))
    return tuple(_uff_table(path, key, columns) for key, columns in clocks.items())


def _uff_table(path: Path, clock: tuple[Any, ...], columns: list[NamedColumn]) -> LogTable:
    _, seconds, *even = clock
    if len(even) == 1:
        return table_of_columns(path, columns)
    step, start = even
    return table_of_columns(path, columns, step=step * seconds or None, start=start * seconds)


def _is_record(entry: Mapping[str, Any]) -> bool:
    over_time = entry["abscissa_spec_data_type"] == _OVER_TIME
    kinds = entry["func_type"] == _TIME_RESPONSE or (entry["func_type"] == _GENERAL and over_time)
    return bool(kinds and entry["ord_data_type"] in _REAL)


def _record_names(records: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of records: the first line where it differs, else quantity, node and direction."""
    lines = [" ".join(_label(entry["id1"]).split()) for entry in records]
    if all(lines) and len(set(lines)) == len(lines):
        return lines
    names = []
    for entry in records:
        direction = int(entry["rsp_dir"])
        sign = "-" if direction < 0 else "+"
        axis = _DIRECTIONS[abs(direction)] if abs(direction) < len(_DIRECTIONS) else ""
        quantity = _ORDINATES.get(entry["ordinate_spec_data_type"], "signal")
        names.append(f"{quantity} {entry['rsp_node']}{sign + axis if axis else ''}")
    return different_names(names)


def _label(text: object) -> str:
    """A label; empty where it says that there is none."""
    words = str(text).strip()
    return "" if words.upper() == "NONE" else words


def _seconds(unit: object) -> float:
    """Seconds of the abscissa's unit; 1 where its label is no unit of time."""
    label = _label(unit)
    return factor_to(label, "s") if dimension_of(label) == dimension_of("s") else 1.0


def mdf_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of an MDF file: every channel group over its master channel."""
    asammdf = library(path)
    groups: dict[int, list[Any]] = {}
    with _library_errors(path), asammdf.MDF(path) as file:
        stated = sum(int(group.channel_group.cycles_nr) for group in file.groups)
        if stated > MOST_NUMBERS:
            raise ValueError(f"{stated} samples; expected at most {MOST_NUMBERS}")
        for signal in file.iter_channels(skip_master=True):
            if signal.samples.dtype.kind in "fiub" and signal.samples.ndim == 1:
                groups.setdefault(signal.group_index, []).append(signal)
    tables = []
    for number, signals in groups.items():
        time = np.asarray(signals[0].timestamps, dtype=np.float64)
        if time.size < 2:
            continue
        names = different_names([TIME, *(signal.name for signal in signals)])
        columns = [
            (f"group {number + 1}/{name}", signal.samples, signal.unit or "")
            for name, signal in zip(names[1:], signals, strict=True)
        ]
        tables.append(([(f"group {number + 1}/{TIME}", time, "s"), *columns], None, 0.0))
    if not tables:
        raise ValueError(
            f"{path}: no channel of numbers; expected measured signals: decode the bus traffic "
            "to signals first"
        )
    return grouped_tables(path, tables)


def workbook_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of an Excel workbook: the sheets that hold one, read as the text that they show."""
    calamine = library(path)
    with _library_errors(path):
        book = calamine.CalamineWorkbook.from_path(str(path))
        sheets = {name: book.get_sheet_by_name(name).to_python() for name in book.sheet_names}
    tables, refusals = [], []
    for name, rows in sheets.items():
        text = "\n".join("\t".join(_cell_text(cell) for cell in row) for row in rows)
        try:
            tables.append(text_table(text, path, "workbook")[0])
        except ValueError as error:
            refusals.append(f"sheet '{name}': {str(error).removeprefix(f'{path}: ')}")
    if not tables:
        raise ValueError(f"{path}: no sheet holds a table of samples; {'; '.join(refusals)}")
    return tuple(tables)


def _cell_text(cell: object) -> str:
    if isinstance(cell, datetime.datetime):
        return cell.isoformat(sep=" ", timespec="microseconds")
    if isinstance(cell, datetime.timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, bool):
        return str(int(cell))
    return re.sub(r'[\s"]+', " ", str(cell))


def openfast_log(path: Path) -> tuple[LogTable, ...]:
    """Table of OpenFAST's binary output: every channel over `Time`."""
    reader = library(path)
    _refuse_unstored(path)
    with _library_errors(path):
        values, facts, _ = reader.load_binary_output(str(path))
        names = different_names(
            [name or f"channel {k}" for k, name in enumerate(facts["attribute_names"])]
        )
        units = facts["attribute_units"]
    return (
        table_of_columns(
            path,
            [
                (name, values[:, k], unit)
                for k, (name, unit) in enumerate(zip(names, units, strict=True))
            ],
        ),
    )


def _refuse_unstored(path: Path) -> None:
    """Refuse an output that states more values than its bytes can hold, two at least for each.

    References
    ----------
    ReadFASTbinary.m of OpenFAST's MATLAB toolbox: INT(2) format, of format 4 INT(2) length of a
    name, INT(4) channels, INT(4) time steps.
    """
    with path.open("rb") as file:
        head = file.read(12)
    if len(head) < 12:
        raise ValueError(f"{path}: {len(head)} bytes; expected OpenFAST's binary output")
    (kind,) = struct.unpack_from("<h", head)
    channels, steps = struct.unpack_from("<ii", head, 4 if kind == 4 else 2)
    if kind not in (1, 2, 3, 4) or channels < 1 or steps < 1:
        raise ValueError(
            f"{path}: format {kind}, {channels} channels, {steps} time steps; expected OpenFAST's "
            "binary output of format 1 to 4"
        )
    size = path.stat().st_size
    if 2 * channels * steps > size:
        raise ValueError(
            f"{path}: states {channels} channels of {steps} values in {size} bytes; expected all "
            "of them: the simulation may have been stopped, run it again"
        )
