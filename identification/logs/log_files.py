"""Files of loggers by their suffix."""

from collections.abc import Callable
from pathlib import Path

from carrierflex.identification.logs.binary_logs import (
    hdf5_log,
    mat5_log,
    parquet_log,
    tdms_log,
)
from carrierflex.identification.logs.log_table import LogTable
from carrierflex.identification.logs.text_logs import text_log

_HDF5_MARK = b"\x89HDF\r\n\x1a\n"
#: Where an HDF5 file may begin: MAT 7.3 has 512 bytes of its own before it.
_HDF5_PLACES = (0, 512, 1024, 2048)

_BINARY: dict[str, Callable[[Path], tuple[LogTable, ...]]] = {
    ".parquet": parquet_log,
    ".h5": hdf5_log,
    ".hdf5": hdf5_log,
    ".tdms": tdms_log,
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
    if suffix in _BINARY:
        return _BINARY[suffix](path)
    if suffix == ".mat":
        return hdf5_log(path) if _is_hdf5(path) else mat5_log(path)
    table, _ = text_log(path)
    return (table,)


def _is_hdf5(path: Path) -> bool:
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(_HDF5_PLACES[-1] + len(_HDF5_MARK))
    return any(head[place:].startswith(_HDF5_MARK) for place in _HDF5_PLACES)


def words_of(path: Path) -> str:
    """How a file was understood, for the comments of a map."""
    if path.suffix.lower() in (*_BINARY, ".mat"):
        return path.suffix[1:].upper()
    return text_log(path)[1].words
