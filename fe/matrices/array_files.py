"""Sparse matrices in the formats of numerics: MatrixMarket, and scipy's npz."""

import io
import re
import struct
import zipfile
import zlib
from pathlib import Path
from typing import IO

import numpy as np
import scipy.io
import scipy.sparse as sp

from carrierflex.fe.matrices.stored_matrix import (
    MOST_DOFS,
    StoredMatrix,
    from_entries,
)
from carrierflex.files.shown_values import shown

_BANNER = re.compile(rb"%%MatrixMarket\s+matrix\s+(\w+)\s+(\w+)\s+(\w+)", re.I)
#: Arrays of a sparse matrix in npz, as scipy.sparse.save_npz names them.
_PARTS = {
    "csr": ("data", "indices", "indptr"),
    "csc": ("data", "indices", "indptr"),
    "coo": ("data", "row", "col"),
}
#: An array may be this many times as large as what is stored of it, and this large whatever is
#: stored [bytes].
_PACKED, _SMALL = 1000, 100_000
#: What zip and numpy raise of damaged files, besides ValueError.
_DAMAGED = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    KeyError,
    IndexError,
    TypeError,
    OSError,
    EOFError,
    OverflowError,
    SyntaxError,
    MemoryError,
)


def read_matrix_market(path: Path, content: bytes) -> StoredMatrix:
    """Real matrix of a MatrixMarket file: coordinate, symmetric or general.

    Raises
    ------
    ValueError
        Where it is none, of another field, or cut short.
    """
    banner = _BANNER.match(content)
    if banner is None:
        raise ValueError(f"{path}: no %%MatrixMarket banner; expected one in the first line")
    layout, field, symmetry = (word.decode("latin-1").lower() for word in banner.groups())
    if layout != "coordinate" or field not in ("real", "integer", "double"):
        raise ValueError(
            f"{path}: MatrixMarket {layout} {field}; expected a coordinate matrix of real numbers"
        )
    if symmetry not in ("symmetric", "general"):
        raise ValueError(f"{path}: MatrixMarket {shown(symmetry)}; expected symmetric or general")
    sizes = _market_sizes(path, content)
    try:
        entries = sp.coo_array(scipy.io.mmread(io.BytesIO(content), spmatrix=False))
        rows, columns = (np.asarray(index, dtype=np.int64) for index in entries.coords)
        A = from_entries(rows, columns, entries.data.astype(np.float64), sizes[0])
    except (ValueError, TypeError, OverflowError, RuntimeError, IndexError) as error:
        reason = " ".join(str(error).split())
        raise ValueError(f"{path}: not a complete MatrixMarket file ({reason})") from error
    return StoredMatrix(A)


def _market_sizes(path: Path, content: bytes) -> tuple[int, int, int]:
    """Rows, columns and entries that the file states, checked against its length."""
    sizes = re.search(
        rb"^[ \t]*(\d{1,12})[ \t]+(\d{1,12})[ \t]+(\d{1,12})[ \t]*\r?$", content, re.M
    )
    if sizes is None:
        raise ValueError(f"{path}: no line of sizes; expected rows, columns and entries")
    n, m, entries = (int(word) for word in sizes.groups())
    # An entry takes "1 1 1" and a line end at least.
    if n != m or not 0 < n <= MOST_DOFS or 6 * entries > len(content) + 6:
        raise ValueError(
            f"{path}: states {n} rows, {m} columns and {entries} entries in {len(content)} bytes; "
            "expected a square matrix and a line an entry"
        )
    return n, m, entries


def read_npz(path: Path, content: bytes) -> StoredMatrix:
    """Matrix that scipy.sparse.save_npz wrote.

    Raises
    ------
    ValueError
        Where it is none, holds objects, or states more than it stores.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _refuse_unstored(path, archive)
        with np.load(io.BytesIO(content), allow_pickle=False) as parts:
            return StoredMatrix(_sparse(path, parts))
    except _DAMAGED as error:
        raise ValueError(f"{path}: not a whole npz file ({_reason(error)})") from error
    except (ValueError, NotImplementedError, RuntimeError) as error:
        if str(error).startswith(str(path)):
            raise
        raise ValueError(
            f"{path}: not a sparse matrix of scipy.sparse.save_npz ({_reason(error)})"
        ) from error


def _refuse_unstored(path: Path, archive: zipfile.ZipFile) -> None:
    for entry in archive.infolist():
        if entry.file_size > _PACKED * entry.compress_size + _SMALL:
            raise ValueError(
                f"{path}: {shown(entry.filename)} states {entry.file_size} bytes and stores "
                f"{entry.compress_size}; expected what is stored"
            )
        with archive.open(entry) as part:
            _refuse_other_shape(path, entry.filename, entry.file_size, part)


def _refuse_other_shape(path: Path, name: str, size: int, part: IO[bytes]) -> None:
    """Refuse an array whose header states more than the bytes behind it."""
    version = np.lib.format.read_magic(part)
    reader = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, _, dtype = reader(part)
    if dtype.hasobject or int(np.prod(shape, dtype=object)) * dtype.itemsize > size:
        raise ValueError(
            f"{path}: {shown(name)} states the shape {shown(shape)} of {shown(dtype)} in {size} "
            "bytes; expected as many"
        )


def _sparse(path: Path, parts: "np.lib.npyio.NpzFile") -> sp.csr_array:
    layout = bytes(np.asarray(parts["format"])).decode("latin-1").strip("\0")
    if layout not in _PARTS:
        raise ValueError(f"{path}: format {shown(layout)}; expected {', '.join(_PARTS)}")
    shape = np.asarray(parts["shape"]).ravel().tolist()
    data, first, second = (np.asarray(parts[name]) for name in _PARTS[layout])
    kinds = (data.dtype.kind, first.dtype.kind, second.dtype.kind)
    if len(shape) != 2 or kinds[0] not in "fiu" or set(kinds[1:]) - set("iu"):
        raise ValueError(f"{path}: shape {shown(shape)} and types {kinds}; expected real numbers")
    if shape[0] != shape[1] or not 0 < shape[0] <= MOST_DOFS:
        raise ValueError(
            f"{path}: {shape[0]} rows and {shape[1]} columns; expected a square matrix"
        )
    data = data.astype(np.float64, copy=False)
    if layout == "coo":
        indices = (first.astype(np.int64), second.astype(np.int64))
        return from_entries(*indices, data, int(shape[0]))
    kind = sp.csr_array if layout == "csr" else sp.csc_array
    A = kind((data, first, second), shape=(int(shape[0]), int(shape[1])))
    A.check_format(full_check=True)
    coo = A.tocoo()
    rows, columns = (index.astype(np.int64) for index in coo.coords)
    return from_entries(rows, columns, coo.data, int(shape[0]))


def _reason(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
