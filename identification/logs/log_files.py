"""Files of loggers by their suffix."""

import logging
import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray

from carrierflex.files.child_process import in_child, limited
from carrierflex.files.hdf5_datasets import PartError, samples
from carrierflex.files.plain_files import check_plain_file
from carrierflex.identification.campaign.document_files import LARGEST_FILE
from carrierflex.identification.campaign.run_files import check_cells
from carrierflex.identification.logs.log_table import LogTable
from carrierflex.identification.logs.text_logs import text_log

_HDF5_MARK = b"\x89HDF\r\n\x1a\n"
#: Where an HDF5 file may begin: MAT 7.3 has 512 bytes of its own before it.
_HDF5_PLACES = (0, 512, 1024, 2048)


#: Numbers of one file: 4 GB of them; columns that a matrix may hold; parts of a file.
_MOST_NUMBERS = 500_000_000
_MOST_COLUMNS = 64
_MOST_PARTS = 10_000
_MOST_BYTES = 8 * _MOST_NUMBERS
#: Tag of a compressed element in a MAT 5 file, whose header has 128 bytes.
_COMPRESSED = 15
_MAT_HEADER = 128
_BLOCK = 1 << 20
_Named = tuple[str, NDArray[np.generic], str]


def _parquet_log(path: Path) -> tuple[LogTable, ...]:
    """Table of a Parquet file."""
    check_plain_file(path, "a Parquet file", LARGEST_FILE)
    try:
        file = pa_parquet.ParquetFile(path)
        check_cells(file, path, len(file.schema_arrow.names))
        table = file.read()
    except (pa.ArrowInvalid, OSError) as error:
        raise ValueError(f"{path}: not a Parquet file: {str(error).splitlines()[0]}") from error
    columns: dict[str, NDArray[np.float64]] = {}
    texts: dict[str, list[str]] = {}
    for name in table.column_names:
        kind = table[name].type
        if pa.types.is_timestamp(kind):
            seconds = table[name].cast(pa.timestamp("us")).cast(pa.int64()).to_numpy() * 1e-6
            columns[name] = np.array(seconds, dtype=np.float64)
        elif pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_boolean(kind):
            values = table[name].cast(pa.float64(), safe=False)
            columns[name] = np.array(values.to_numpy(zero_copy_only=False), dtype=np.float64)
        elif pa.types.is_string(kind):
            texts[name] = table[name].to_pylist()
    units = {
        field.name: (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
        for field in table.schema
    }
    stated = {name: unit for name, unit in units.items() if unit}
    return (LogTable(path.name, columns, stated, texts),)


def _hdf5_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of an HDF5 file (a MAT 7.3 file is one): datasets of one length belong together."""
    try:
        with h5py.File(path, "r") as file:
            return _by_length(path, _named(path, _hdf5_columns(file)))
    except PartError as error:
        raise ValueError(f"{path}: {error}") from error
    except (OSError, RuntimeError, KeyError, TypeError, UnicodeError) as error:
        # Damaged names and types of numbers come as errors of text and type.
        raise ValueError(f"{path}: not an HDF5 file: {' '.join(str(error).split())}") from error


def _hdf5_columns(file: h5py.File) -> Iterator[_Named]:
    members: list[str] = []
    # It goes to each object once, and to none by a link out of the file.
    file.visit(members.append)
    for name in members:
        # What the file keeps for itself (MATLAB's references) begins with #.
        if isinstance(file[name], h5py.Dataset) and not name.startswith("#"):
            yield from _dataset_columns(file, name, file[name])


def _dataset_columns(group: h5py.Group, name: str, part: h5py.Dataset) -> Iterator[_Named]:
    path = part.name.strip("/")
    unit = _text_of(part.attrs.get("unit", part.attrs.get("units", "")))
    if part.dtype.names:
        values = samples(group, name)
        for field in part.dtype.names:
            if values[field].ndim == 1 and values[field].dtype.kind in "fiub":
                yield f"{path}/{field}", values[field], ""
    elif part.dtype.kind in "fiub" and part.ndim in (1, 2):
        yield path, samples(group, name), unit


def _text_of(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""


def _tdms_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of a TDMS file: channels of one length and clock belong together."""
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise ValueError(
            f"{path}: TDMS files need the package nptdms; install it with pip install "
            "'carrierflex[tdms]', or export the file as CSV"
        ) from error
    size = path.stat().st_size
    try:
        # It leaves a file open that it refuses: this one is closed here.
        with _without_logs(), path.open("rb") as stream, TdmsFile.open(stream) as file:
            channels = [channel for group in file.groups() for channel in group.channels()]
            stated = sum(len(channel) for channel in channels)
            # A sample takes a byte at least, and none is packed.
            if stated > min(size, _MOST_NUMBERS):
                raise ValueError(f"{stated} samples in {size} bytes; expected what is stored")
            return _tdms_tables(path, channels)
    except (
        ValueError,
        KeyError,
        TypeError,
        OSError,
        AttributeError,
        IndexError,
        EOFError,
        struct.error,
        ArithmeticError,
        RuntimeError,
        MemoryError,
    ) as error:
        # An error of the library may come without a word.
        why = " ".join(str(error).split()) or "damaged"
        raise ValueError(f"{path}: not a TDMS file: {why}") from error


@contextmanager
def _without_logs() -> Iterator[None]:
    """Keep a library's own log from the terminal: what is wrong is told in one line."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


def _tdms_tables(path: Path, channels: Iterable[Any]) -> tuple[LogTable, ...]:
    clocks: dict[tuple[int, float, float], list[_Named]] = {}
    for channel in channels:
        facts = channel.properties
        step = float(facts.get("wf_increment", 0.0) or 0.0)
        start = float(facts.get("wf_start_offset", 0.0) or 0.0)
        values = np.asarray(channel[:])
        if values.dtype.kind == "M":
            values = (values - values[0]) / np.timedelta64(1, "s")
        if values.dtype.kind in "fiub" and values.size:
            unit = _text_of(facts.get("unit_string", ""))
            name = f"{channel.group_name}/{channel.name}"
            clocks.setdefault((values.size, step, start), []).append((name, values, unit))
    if not clocks:
        raise ValueError("no channel of numbers")
    return tuple(
        _table(path, parts, step=step or None, start=start)
        for (_, step, start), parts in clocks.items()
    )


def _table(
    path: Path, parts: list[_Named], *, step: float | None = None, start: float = 0.0
) -> LogTable:
    short = _short_names([name for name, _, _ in parts])
    return LogTable(
        path.name,
        {short[name]: np.asarray(values, dtype=np.float64) for name, values, _ in parts},
        {short[name]: unit for name, _, unit in parts if unit},
        step=step,
        start=start,
    )


def _named(path: Path, parts: Iterable[_Named]) -> list[_Named]:
    """Vectors of all parts; a matrix gives one for each of its columns."""
    columns: list[_Named] = []
    total = 0
    for name, values, unit in parts:
        total += values.size
        if total > _MOST_NUMBERS or len(columns) > _MOST_PARTS:
            raise ValueError(f"{path}: more than {_MOST_NUMBERS} numbers; expected less")
        vectors = values.reshape(-1) if 1 in values.shape or values.ndim == 1 else values
        if vectors.ndim == 1:
            columns.append((name, vectors, unit))
            continue
        # Samples run along the longer side.
        tall = vectors if vectors.shape[0] >= vectors.shape[1] else vectors.T
        if tall.shape[1] <= _MOST_COLUMNS:
            columns += [(f"{name} {k + 1}", tall[:, k], unit) for k in range(tall.shape[1])]
    return [column for column in columns if column[1].size > 1]


def _by_length(path: Path, columns: list[_Named]) -> tuple[LogTable, ...]:
    lengths = dict.fromkeys(values.size for _, values, _ in columns)
    tables = tuple(
        _table(path, [part for part in columns if part[1].size == length]) for length in lengths
    )
    if not tables:
        raise ValueError(f"{path}: no list of numbers; expected columns of samples")
    return tables


def _short_names(names: list[str]) -> dict[str, str]:
    """Last part of every path where it stands once in the table, else the whole path."""
    last = [name.rpartition("/")[2] for name in names]
    return {
        name: short if last.count(short) == 1 else name
        for name, short in zip(names, last, strict=True)
    }


#: Kinds whose libraries a damaged file can bring down or keep for ever: a process of their own.
_SECONDS = 10  # of processor time, for a small file
_IN_CHILD = {
    ".h5": "an HDF5 file",
    ".hdf5": "an HDF5 file",
    ".mat": "a MAT file",
    ".tdms": "a TDMS file",
}


def read_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of a logger's file.

    Parameters
    ----------
    path : Path
        ``.parquet``, ``.h5``, ``.hdf5``, ``.mat`` (5 and 7.3) or ``.tdms``; anything else is text.

    Returns
    -------
    tuple of LogTable
        One for each clock in the file.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is not what its suffix says; the message names it.
    """
    suffix = path.suffix.lower()
    if suffix == ".parquet":
        return _parquet_log(path)
    if suffix in _IN_CHILD:
        size = check_plain_file(path, _IN_CHILD[suffix], LARGEST_FILE)
        seconds = _SECONDS + size // 500_000
        return in_child(_limited_log, path, size, seconds, about=path, what="the reader")
    table, _ = text_log(path)
    return (table,)


def _limited_log(path: Path, size: int, seconds: int) -> tuple[LogTable, ...]:
    with limited(seconds, 500_000_000 + 100 * size):
        if path.suffix.lower() == ".tdms":
            return _tdms_log(path)
        return _mat5_log(path) if not _is_hdf5(path) else _hdf5_log(path)


def _is_hdf5(path: Path) -> bool:
    if path.suffix.lower() != ".mat":
        return True
    with path.open("rb") as file:
        head = file.read(_HDF5_PLACES[-1] + len(_HDF5_MARK))
    return any(head[place:].startswith(_HDF5_MARK) for place in _HDF5_PLACES)


def words_of(path: Path) -> str:
    """How a file was understood, for the comments of a map."""
    if path.suffix.lower() in (*_IN_CHILD, ".parquet"):
        return path.suffix[1:].upper()
    return text_log(path)[1].words


def _mat5_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of a MAT 5 file: vectors of one length belong together, fields of structures too."""
    from scipy.io import loadmat

    try:
        _refuse_bomb(path)
        content = loadmat(path, simplify_cells=True)
    except MemoryError:
        raise
    except Exception as error:
        # It meets damage with errors of every class.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(
            f"{path}: not a complete MAT file ({reason}); expected variables as MATLAB's save "
            "writes them: save it again, or export it as CSV"
        ) from error
    return _by_length(path, _named(path, _mat_parts("", content)))


def _refuse_bomb(path: Path) -> None:
    """Refuse a file whose compressed parts unpack to more than can be meant."""
    unpacked = 0
    with path.open("rb") as file:
        file.seek(_MAT_HEADER)
        while len(tag := file.read(8)) == 8:
            kind, size = struct.unpack("<II", tag)
            if kind != _COMPRESSED:
                file.seek(size + (-size) % 8, 1)
                continue
            unpacked += _unpacked_bytes(file.read(size), _MOST_BYTES - unpacked)
            if unpacked >= _MOST_BYTES:
                raise ValueError(f"unpacks to more than {_MOST_BYTES} bytes; expected less")


def _unpacked_bytes(packed: bytes, most: int) -> int:
    """Size of what compressed bytes hold, counted until `most`; nothing of it is kept."""
    machine, count = zlib.decompressobj(), 0
    rest = packed
    try:
        while count < most and (block := machine.decompress(rest, _BLOCK)):
            count += len(block)
            rest = machine.unconsumed_tail
    except zlib.error:
        # The reader tells what is wrong with it.
        return count
    return count


def _mat_parts(before: str, value: Any, deep: int = 0) -> Iterator[_Named]:
    if isinstance(value, dict) and deep < 8:
        for name, part in value.items():
            if not name.startswith("__"):
                yield from _mat_parts(f"{before}/{name}" if before else name, part, deep + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim in (1, 2):
        yield before, value, ""
