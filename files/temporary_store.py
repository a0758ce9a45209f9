"""Arrays in a file of the temporary folder, read where they are asked for.

A mapped file counts to the memory of a process as far as it was looked at; what is read and let go
does not. The file has no name: nothing of it is left behind, however the process ends.
"""

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from threading import Lock
from typing import IO, Any
from weakref import finalize

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_ITEM = np.dtype(np.float64).itemsize


@dataclass(frozen=True, eq=False)
class TemporaryStore:
    """A file that arrays are added to; it is closed with the last of them.

    Parameters
    ----------
    file : binary file
        Open for reading and writing, without a name.
    """

    file: IO[bytes] = field(default_factory=tempfile.TemporaryFile)
    _lock: Any = field(default_factory=Lock)

    def __post_init__(self) -> None:
        # Closed with the last array that reads from it: nobody else knows when that is.
        finalize(self, self.file.close)

    @staticmethod
    def has_room(n_bytes: int) -> bool:
        """Whether there is a temporary folder with room for so many bytes, and as many again."""
        try:
            return shutil.disk_usage(tempfile.gettempdir()).free > 2 * n_bytes
        except OSError:
            return False

    def added(self, n_values: int) -> int:
        """Make room for values, zero before they are written.

        Parameters
        ----------
        n_values : int
            Number of values.

        Returns
        -------
        int
            Place of the first byte.
        """
        with self._lock:
            first = self.file.seek(0, 2)
            self.file.truncate(first + n_values * _ITEM)
        return first

    def write(self, first: int, values: FloatArray) -> None:
        """Write values from a byte on.

        Raises
        ------
        OSError
            Where the temporary folder is full; the message names it.
        """
        try:
            with self._lock:
                self.file.seek(first)
                self.file.write(np.ascontiguousarray(values, dtype=np.float64).data)
                self.file.flush()
        except OSError as error:
            raise OSError(
                f"{tempfile.gettempdir()}: cannot hold the records of a large campaign "
                f"({error.strerror}); expected room there, or another folder in TMPDIR"
            ) from error

    def read(self, first: int, shape: tuple[int, ...]) -> FloatArray:
        """Array of a shape whose values begin at a byte."""
        values = np.empty(shape)
        with self._lock:
            self.file.seek(first)
            self.file.readinto(values.reshape(-1).view(np.uint8).data)  # type: ignore[attr-defined]
        return values


@dataclass(frozen=True, eq=False)
class StoredRows:
    """An array of which slices of rows are read and written.

    Parameters
    ----------
    store : TemporaryStore
        Where it is.
    first : int
        Place of its first byte.
    shape : tuple of int
        Its shape.
    """

    store: TemporaryStore
    first: int
    shape: tuple[int, ...]

    def __getitem__(self, rows: slice) -> FloatArray:
        start, stop, _ = rows.indices(self.shape[0])
        return self.store.read(self._offset(start), (max(stop - start, 0), *self.shape[1:]))

    def __setitem__(self, rows: slice, values: FloatArray) -> None:
        self.store.write(self._offset(rows.indices(self.shape[0])[0]), values)

    def __reduce__(self) -> tuple[Any, ...]:
        return stored_rows, (self[:],)

    @property
    def nbytes(self) -> int:
        """Bytes in the file."""
        return int(np.prod(self.shape)) * _ITEM

    def _offset(self, row: int) -> int:
        return self.first + row * int(np.prod(self.shape[1:])) * _ITEM


#: An array in memory, or one of which rows are read.
Rows = FloatArray | StoredRows


def zero_rows(shape: tuple[int, ...], most_in_memory: int) -> Rows:
    """Rows of zeros: in memory, or where they are larger in a file.

    Parameters
    ----------
    shape : tuple of int
        Their shape.
    most_in_memory : int
        Bytes up to which they are kept in memory; a temporary folder without room for more keeps
        them there too.
    """
    n_values = int(np.prod(shape))
    n_bytes = n_values * _ITEM
    if n_bytes <= most_in_memory or not TemporaryStore.has_room(n_bytes):
        return np.zeros(shape)
    store = TemporaryStore()
    return StoredRows(store, store.added(n_values), shape)


def stored_rows(values: FloatArray) -> StoredRows:
    """Rows of an array in a file of their own."""
    store = TemporaryStore()
    rows = StoredRows(store, store.added(values.size), values.shape)
    rows[:] = values
    return rows


@dataclass(frozen=True, eq=False)
class StoredColumns(Mapping[str, FloatArray]):
    """Columns of one length by name, each read when it is asked for.

    Parameters
    ----------
    store : TemporaryStore
        Where they are.
    offsets : mapping of str to int
        Offset of the first byte of every column.
    size : int
        Values of a column.
    """

    store: TemporaryStore
    offsets: Mapping[str, int]
    size: int

    def __getitem__(self, name: str) -> FloatArray:
        return self.store.read(self.offsets[name], (self.size,))

    def __iter__(self) -> Iterator[str]:
        return iter(self.offsets)

    def __len__(self) -> int:
        return len(self.offsets)

    def __reduce__(self) -> tuple[Any, ...]:
        return dict, (dict(self),)


def stored_columns(columns: Mapping[str, FloatArray], store: TemporaryStore) -> StoredColumns:
    """Columns of one length, written to a store.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        Columns.
    store : TemporaryStore
        Where they are put.

    Returns
    -------
    StoredColumns
        The same values, none of them in memory.
    """
    offsets = {}
    size = 0
    for name, values in columns.items():
        size = values.size
        offsets[name] = store.added(size)
        store.write(offsets[name], values)
    return StoredColumns(store, offsets, size)
