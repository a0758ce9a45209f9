"""Matrices of Nastran's output4 files, text or binary, dense or sparse.

What large models write, binary with 32-bit words, is taken by a compiled loop; pyyeti, which reads
number by number, takes text files and binary ones of other words.
"""

import struct
import warnings
from pathlib import Path
from typing import NamedTuple

import numba
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.matrices.dmig_input_files import chosen_name
from carrierflex.fe.matrices.stored_matrix import MOST_DOFS, StoredMatrix, from_entries
from carrierflex.files.child_process import in_child, limited
from carrierflex.files.pyyeti_modules import op4

#: Real numbers of one word, and of two.
_SINGLE, _DOUBLE = 1, 2
#: Bytes of a matrix's header record, and words of it with both record lengths.
_HEADER_BYTES, _HEADER_WORDS = 24, 8
_NO_ROWS = np.zeros(0, dtype=np.int64)
_NO_WORDS = np.zeros((0, 2), dtype=np.int32)


class _Listed(NamedTuple):
    """A matrix of a binary file."""

    name: str
    n_rows: int
    n_columns: int
    big: bool
    kind: int
    start: int
    n_entries: int


def read_op4(path: Path, content: bytes, quantity: str) -> StoredMatrix:
    """Matrix of an output4 file.

    Where there are several square ones, that whose name begins with K (stiffness) or M (mass).

    Parameters
    ----------
    path : Path
        The file.
    content : bytes
        Its content.
    quantity : str
        ``stiffness`` or ``mass``.

    Raises
    ------
    ValueError
        Where there is no such matrix, it is not real, or the file is damaged.
    """
    if content[:4] != struct.pack("<i", _HEADER_BYTES):
        return in_child(_by_pyyeti, path, quantity, len(content), about=path, what="pyyeti")
    try:
        return _binary(content, quantity)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _binary(content: bytes, quantity: str) -> StoredMatrix:
    words = np.frombuffer(content, dtype="<i4", count=len(content) // 4)
    listed = [each for each in _listed(content, words) if each.n_rows == each.n_columns > 1]
    name = chosen_name([each.name for each in listed], quantity)
    matrix = next(each for each in listed if each.name == name)
    if matrix.kind not in (_SINGLE, _DOUBLE):
        raise ValueError(f"matrix {name} is of type {matrix.kind}; expected real numbers")
    rows, columns = np.zeros((2, matrix.n_entries), dtype=np.int64)
    values = np.zeros((matrix.n_entries, 2), dtype=np.int32)
    _columns(words, matrix, rows, columns, values)
    if matrix.kind == _DOUBLE:
        numbers = values.view("<f8")[:, 0]
    else:
        numbers = values[:, :1].copy().view("<f4")[:, 0].astype(np.float64)
    stored = numbers != 0.0
    return StoredMatrix(from_entries(rows[stored], columns[stored], numbers[stored], matrix.n_rows))


def _listed(content: bytes, words: NDArray[np.int32]) -> list[_Listed]:
    """The matrices of a binary file, one after the other."""
    matrices: list[_Listed] = []
    at = 0
    while at + _HEADER_WORDS <= len(words):
        n_columns, n_rows, _, kind = words[at + 1 : at + 5].tolist()
        name = content[4 * at + 20 : 4 * at + 28].decode("latin-1").strip().lower()
        if words[at] != _HEADER_BYTES or not 0 < abs(n_rows) <= MOST_DOFS or n_columns < 0:
            raise ValueError(f"matrix {len(matrices) + 1} has no sound header; the file is damaged")
        matrix = _Listed(name, abs(n_rows), n_columns, n_rows < 0, kind, at + _HEADER_WORDS, 0)
        count, at = _columns(words, matrix, _NO_ROWS, _NO_ROWS, _NO_WORDS)
        matrices.append(matrix._replace(n_entries=count))
    return matrices


def _columns(
    words: NDArray[np.int32],
    matrix: _Listed,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    values: NDArray[np.int32],
) -> tuple[int, int]:
    """Number of a matrix's entries and the word behind it; rows, columns, values where they fit."""
    per_number = {1: 1, 2: 2, 3: 2, 4: 4}.get(matrix.kind, 0)
    if not per_number:
        raise ValueError(f"matrix {matrix.name} is of type {matrix.kind}; expected 1 to 4")
    count, end = _scan(
        words, matrix.start, matrix.n_columns, matrix.n_rows, matrix.big, per_number, rows,
        columns, values,
    )  # fmt: skip
    if count < 0:
        raise ValueError(f"matrix {matrix.name} is damaged or cut short at byte {4 * end}")
    return count, end


@numba.njit(cache=True)
def _scan(
    words: NDArray[np.int32],
    start: int,
    n_columns: int,
    n_rows: int,
    big: bool,
    per_number: int,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    values: NDArray[np.int32],
) -> tuple[int, int]:
    """Walk over the records of one matrix; -1 and the place where they contradict each other.

    A record is its length in bytes, column, first row (0: strings with row numbers of their own),
    number of words, the words, and the length again. The last one belongs to the column behind the
    matrix.
    """
    at = start
    count = 0
    fill = len(rows) > 0
    while True:
        if at + 5 > len(words):
            return -1, at
        length = words[at]
        end = at + 1 + length // 4
        if length < 12 or length % 4 or end >= len(words) or words[end] != length:
            return -1, at
        column = words[at + 1]
        first = words[at + 2]
        n_words = words[at + 3]
        if column > n_columns:
            return count, end + 1
        offset = at + 4
        stop = offset + n_words
        if column < 1 or first < 0 or n_words < 0 or stop > end:
            return -1, at
        while offset < stop:
            row, size = first - 1, n_words
            if first == 0 and big:
                if offset + 2 > stop:
                    return -1, at
                size, row = words[offset] - 1, words[offset + 1] - 1
                offset += 2
            elif first == 0:
                size, row = (words[offset] >> 16) - 1, (words[offset] & 0xFFFF) - 1
                offset += 1
            n = size // per_number
            if size < 1 or row < 0 or row + n > n_rows or offset + size > stop:
                return -1, at
            if fill and per_number <= 2:
                for i in range(n):
                    rows[count + i], columns[count + i] = row + i, column - 1
                    for word in range(per_number):
                        values[count + i, word] = words[offset + i * per_number + word]
            count += n
            offset += size
        at = end + 1


def _by_pyyeti(path: Path, quantity: str, size: int) -> StoredMatrix:
    try:
        with limited(60 + size // 50_000, 1_000_000_000 + 200 * size), warnings.catch_warnings():
            warnings.simplefilter("error")
            names, matrices, _, kinds = op4.load(
                str(path), into="list", sparse=(True, sp.coo_matrix.tocoo)
            )
            square = {
                name: matrix
                for name, matrix, kind in zip(names, matrices, kinds, strict=True)
                if matrix.shape[0] == matrix.shape[1] > 1 and kind in (_SINGLE, _DOUBLE)
            }
            matrix = square[chosen_name(list(square), quantity)]
            rows, columns = (np.asarray(i, dtype=np.int64) for i in (matrix.row, matrix.col))
            values = np.asarray(matrix.data, dtype=np.float64)
            return StoredMatrix(from_entries(rows, columns, values, matrix.shape[0]))
    except Exception as error:
        # Its errors are of every kind: a damaged file meets its code unchecked.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(
            f"{path}: not a complete output4 file with one square real {quantity} matrix ({reason})"
        ) from error
