"""Harwell-Boeing files as finite element programs write them: symmetric, the lower triangle.

scipy's reader refuses them. A header of four lines (five with right-hand sides) states the number
of lines and the Fortran format of column starts, row numbers and values, all in columns of fixed
width; two numbers may stand without a blank between them.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.matrices.stored_matrix import (
    MOST_DOFS,
    MOST_ENTRIES,
    StoredMatrix,
    from_entries,
)
from carrierflex.fe.matrices.text_numbers import fixed_fields, numbers, whole
from carrierflex.files.shown_values import shown

#: ``(1P,3E26.18)``, ``(8I10)``, ``(4D20.12)``: repeat count, kind and width.
_FORMAT = re.compile(r"\(\s*(?:\d*P\s*,?)?\s*(\d*)\s*([IEDFG])\s*(\d+)(?:\.\d+(?:E\d+)?)?\s*\)")
#: Real, symmetric or general, assembled.
_KINDS = ("RSA", "RUA")
_WIDEST = 200


@dataclass(frozen=True)
class _Header:
    kind: str
    n_rows: int
    n_columns: int
    n_entries: int
    lines: tuple[int, int, int]
    fields: tuple[tuple[int, int], tuple[int, int], tuple[int, int]]


def read_harwell_boeing(path: Path, content: bytes) -> StoredMatrix:
    """Matrix of a Harwell-Boeing file of type RSA, or RUA with both triangles.

    Raises
    ------
    ValueError
        Where the header is no such header, the type is another, or parts are cut short.
    """
    lines = content.split(b"\n", 5)
    if len(lines) < 5:
        raise ValueError(f"{path}: {len(lines)} lines; expected a Harwell-Boeing header of four")
    header = _header(path, [line.decode("latin-1") for line in lines[:4]])
    has_right_side = _count(lines[1].decode("latin-1")[56:70]) > 0
    body = content.split(b"\n", 5 if has_right_side else 4)[-1]
    starts_at, rows_at, values_at = np.cumsum([0, *header.lines])[:3]
    parts = body.split(b"\n")
    n = header.n_columns
    counts = (n + 1, header.n_entries, header.n_entries)
    names = ("column starts", "row numbers", "values")
    read = []
    for first, n_lines, (per_line, width), count, name in zip(
        (starts_at, rows_at, values_at), header.lines, header.fields, counts, names, strict=True
    ):
        text = b"\n".join(parts[first : first + n_lines])
        read.append(_numbers(text, width, per_line, count, f"{path}: the {name}"))
    starts, rows = (
        whole(part, f"{path}: the {name}") - 1
        for part, name in zip(read[:2], names[:2], strict=True)
    )
    if starts[0] != 0 or starts[-1] != header.n_entries or (np.diff(starts) < 0).any():
        raise ValueError(
            f"{path}: column starts go from {starts[0] + 1} to {starts[-1] + 1}; expected "
            f"ascending ones from 1 to {header.n_entries + 1}"
        )
    columns = np.repeat(np.arange(n), np.diff(starts))
    try:
        return StoredMatrix(from_entries(rows, columns, read[2], n))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _numbers(text: bytes, width: int, per_line: int, count: int, what: str) -> NDArray[np.float64]:
    """Numbers in columns of fixed width, or between blanks where the header's width is not kept.

    scipy states wider columns than it writes.
    """
    try:
        found = numbers(fixed_fields(text, width, per_line, count, what), what)
    except ValueError:
        found = np.zeros(0)
    if len(found) != count:
        found = numbers(text, what)
    if len(found) != count:
        raise ValueError(f"{what} are {len(found)}; the header states {count}: cut short")
    return found


def _header(path: Path, lines: list[str]) -> _Header:
    words = lines[2].split()
    kind = words[0].upper() if words else ""
    if kind not in _KINDS:
        raise ValueError(
            f"{path}: Harwell-Boeing type {shown(kind)}; expected RSA (real, symmetric, assembled)"
        )
    sizes = [_count(lines[2][start : start + 14]) for start in (14, 28, 42)]
    n_lines = tuple(_count(lines[1][start : start + 14]) for start in (14, 28, 42))
    if min(*sizes, *n_lines) < 1 or sizes[0] != sizes[1]:
        raise ValueError(
            f"{path}: the header states {sizes[0]} rows, {sizes[1]} columns, {sizes[2]} entries on "
            f"{n_lines[0]}, {n_lines[1]} and {n_lines[2]} lines; expected a square matrix of whole "
            "numbers in columns of 14"
        )
    if sizes[0] > MOST_DOFS or sizes[2] > MOST_ENTRIES:
        raise ValueError(f"{path}: states {sizes[0]} rows and {sizes[2]} entries; too many")
    fields = []
    for text in (lines[3][:16], lines[3][16:32], lines[3][32:52]):
        found = _FORMAT.fullmatch(text.strip().upper())
        if found is None:
            raise ValueError(
                f"{path}: the header's format is {shown(text.strip())}; expected one as (10I8) or "
                "(3E26.18)"
            )
        per_line, width = int(found[1] or 1), int(found[3])
        if not (0 < per_line <= _WIDEST and 0 < width <= _WIDEST):
            raise ValueError(f"{path}: the header's format {shown(text.strip())} has no such line")
        fields.append((per_line, width))
    return _Header(
        kind,
        *(sizes[0], sizes[1], sizes[2]),
        (n_lines[0], n_lines[1], n_lines[2]),
        (fields[0], fields[1], fields[2]),
    )


def _count(text: str) -> int:
    """Whole number of a field of the header; 0 where it is none."""
    word = text.strip()
    return int(word) if word.isascii() and word.isdigit() and len(word) <= 14 else 0
