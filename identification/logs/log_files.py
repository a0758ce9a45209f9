"""Files of loggers by their suffix."""

import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
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
from carrierflex.identification.logs.log_formats import FORMAT_OF_SUFFIX, format_of
from carrierflex.identification.logs.log_table import (
    MOST_NUMBERS,
    LogTable,
    NamedColumn,
    grouped_tables,
)
from carrierflex.identification.logs.optional_readers import (
    mdf_log,
    openfast_log,
    tdms_log,
    uff_log,
    workbook_log,
)
from carrierflex.identification.logs.text_logs import text_log

_HDF5_MARK = b"\x89HDF\r\n\x1a\n"
#: Where an HDF5 file may begin: MAT 7.3 has 512 bytes of its own before it.
_HDF5_PLACES = (0, 512, 1024, 2048)
#: Columns that a matrix may hold; parts of a file.
_MOST_COLUMNS = 64
_MOST_PARTS = 10_000
_MOST_BYTES = 8 * MOST_NUMBERS
#: Tag of a compressed element in a MAT 5 file, whose header has 128 bytes.
_COMPRESSED = 15
_MAT_HEADER = 128
_BLOCK = 1 << 20


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
    clocks: dict[str, str] = {}
    for name in table.column_names:
        kind = table[name].type
        if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
            micro = pa.timestamp("us") if pa.types.is_timestamp(kind) else pa.duration("us")
            seconds = table[name].cast(micro, safe=False).cast(pa.int64()).to_numpy() * 1e-6
            columns[name] = np.array(seconds, dtype=np.float64)
            clocks[name] = "s"
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
    return (LogTable(path.name, columns, clocks | stated, texts),)


def _hdf5_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of an HDF5 file (a MAT 7.3 file is one): datasets of one length and clock."""
    try:
        with h5py.File(path, "r") as file:
            objects = _hdf5_objects(file)
            return _by_length(path, _named(path, _hdf5_columns(file, objects)), objects)
    except PartError as error:
        raise ValueError(f"{path}: {error}") from error
    except (OSError, RuntimeError, KeyError, TypeError, UnicodeError) as error:
        # Damaged names and types of numbers come as errors of text and type.
        raise ValueError(f"{path}: not an HDF5 file: {' '.join(str(error).split())}") from error


def _hdf5_members(file: h5py.File) -> list[str]:
    """Datasets; what the file keeps for itself (MATLAB's references) begins with #."""
    members: list[str] = []
    # It goes to each object once, and to none by a link out of the file.
    file.visit(members.append)
    return [
        name
        for name in members
        if isinstance(file[name], h5py.Dataset) and not name.startswith("#")
    ]


def _hdf5_objects(file: h5py.File) -> dict[str, str]:
    """Classes of MATLAB's objects by their names: their datasets hold no samples."""
    return {
        name: _text_of(file[name].attrs.get("MATLAB_class", b"object"))
        for name in _hdf5_members(file)
        if "MATLAB_object_decode" in file[name].attrs
    }


def _hdf5_columns(file: h5py.File, objects: Mapping[str, str]) -> Iterator[NamedColumn]:
    for name in _hdf5_members(file):
        if name not in objects:
            yield from _dataset_columns(file, name, file[name])


def _dataset_columns(group: h5py.Group, name: str, entry: h5py.Dataset) -> Iterator[NamedColumn]:
    path = entry.name.strip("/")
    unit = _text_of(entry.attrs.get("unit", entry.attrs.get("units", "")))
    if entry.dtype.names:
        values = samples(group, name)
        for field in entry.dtype.names:
            if values[field].ndim == 1 and values[field].dtype.kind in "fiub":
                yield f"{path}/{field}", values[field], ""
    elif entry.dtype.kind in "fiub" and entry.ndim in (1, 2):
        yield path, samples(group, name), unit


def _text_of(value: Any) -> str:
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return value if isinstance(value, str) else ""


def _named(path: Path, vectors: Iterable[NamedColumn]) -> list[NamedColumn]:
    """Columns of all vectors; a matrix gives one for each of its columns."""
    columns: list[NamedColumn] = []
    total = 0
    for name, values, unit in vectors:
        total += values.size
        if total > MOST_NUMBERS or len(columns) > _MOST_PARTS:
            raise ValueError(f"{path}: more than {MOST_NUMBERS} numbers; expected less")
        vectors = values.reshape(-1) if 1 in values.shape or values.ndim == 1 else values
        if vectors.ndim == 1:
            columns.append((name, vectors, unit))
            continue
        # Samples run along the longer side.
        tall = vectors if vectors.shape[0] >= vectors.shape[1] else vectors.T
        if tall.shape[1] <= _MOST_COLUMNS:
            columns += [(f"{name} {k + 1}", tall[:, k], unit) for k in range(tall.shape[1])]
    return [column for column in columns if column[1].size > 1]


def _by_length(
    path: Path, columns: list[NamedColumn], objects: Mapping[str, str]
) -> tuple[LogTable, ...]:
    ignored = tuple(
        f"'{name}' is a MATLAB object of class {kind}, which is not read: in MATLAB, s.time = "
        f"{name}.Time; s.data = {name}.Data; save('run.mat', '-struct', 's')"
        for name, kind in objects.items()
    )
    lengths = dict.fromkeys(values.size for _, values, _ in columns)
    tables = grouped_tables(
        path,
        [
            ([entry for entry in columns if entry[1].size == length], None, 0.0)
            for length in lengths
        ],
    )
    if not tables:
        what = "; ".join(ignored) or "expected columns of samples"
        raise ValueError(f"{path}: no list of numbers; {what}")
    return (replace(tables[0], notes=ignored), *tables[1:])


_SECONDS = 10  # of processor time, for a small file


def read_log(path: Path) -> tuple[LogTable, ...]:
    """Tables of a logger's or a simulator's file.

    Parameters
    ----------
    path : Path
        A format of `log_formats` by its suffix; anything else is text.

    Returns
    -------
    tuple of LogTable
        One for each clock in the file.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is not what its suffix says, or the package that reads it is not installed; the
        message names the file.
    """
    log_format = format_of(path)
    if log_format is None:
        return (text_log(path)[0],)
    if path.suffix.lower() == ".parquet":
        return _parquet_log(path)
    # A damaged file can bring these libraries down or keep them for ever: a process of their own.
    size = check_plain_file(path, log_format.words, LARGEST_FILE)
    seconds = _SECONDS + size // 500_000
    return in_child(_limited_log, path, size, seconds, about=path, what="the reader")


def _limited_log(path: Path, size: int, seconds: int) -> tuple[LogTable, ...]:
    with limited(seconds, 500_000_000 + 100 * size):
        return _READERS[path.suffix.lower()](path)


def _mat_log(path: Path) -> tuple[LogTable, ...]:
    return _hdf5_log(path) if _is_hdf5(path) else _mat5_log(path)


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(_HDF5_PLACES[-1] + len(_HDF5_MARK))
    return any(head[offset:].startswith(_HDF5_MARK) for offset in _HDF5_PLACES)


def words_of(path: Path) -> str:
    """How a file was understood, for the comments of a map."""
    if format_of(path) is not None:
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
    return _by_length(path, _named(path, _mat_parts("", content)), _mat_objects(content))


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


def _mat_objects(content: Mapping[str, Any]) -> dict[str, str]:
    """Classes of MATLAB's objects by their names; scipy has all of them under the key None."""
    from scipy.io.matlab import MatlabOpaque

    return {
        row["s0"].decode("utf-8", "replace"): row["s2"].decode("utf-8", "replace")
        for value in content.values()
        if isinstance(value, MatlabOpaque)
        for row in value.ravel()
        if isinstance(row["s0"], bytes) and isinstance(row["s2"], bytes)
    }


def _mat_parts(before: str, value: Any, deep: int = 0) -> Iterator[NamedColumn]:
    if isinstance(value, dict) and deep < 8:
        for name, entry in value.items():
            if name is not None and not name.startswith("__"):
                yield from _mat_parts(f"{before}/{name}" if before else name, entry, deep + 1)
    elif isinstance(value, list) and deep < 8:
        # Structures in a row, as Simulink's `signals`: `values` is called after its label.
        for number, entry in enumerate(value, start=1):
            if isinstance(entry, dict):
                label = entry.get("label")
                name = label if isinstance(label, str) and label else f"{before} {number}"
                yield from _mat_parts(name, entry.get("values", entry), deep + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim in (1, 2):
        yield before, value, ""


_READERS: dict[str, Callable[[Path], tuple[LogTable, ...]]] = {
    ".h5": _hdf5_log,
    ".hdf5": _hdf5_log,
    ".mat": _mat_log,
    ".tdms": tdms_log,
    ".uff": uff_log,
    ".unv": uff_log,
    ".mf4": mdf_log,
    ".mdf": mdf_log,
    ".xlsx": workbook_log,
    ".xlsm": workbook_log,
    ".outb": openfast_log,
}
assert {".parquet", *_READERS} == set(FORMAT_OF_SUFFIX)
