"""Samples as they come: files that are added to a folder, or CSV rows from standard input."""

import io
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray

from carrierflex.identification.campaign.document_files import run_file_header
from carrierflex.identification.campaign.file_names import RUN_SUFFIXES
from carrierflex.identification.campaign.run_files import ExpectedColumns, column_pieces

Columns = dict[str, NDArray[np.float64]]

#: Bytes of standard input that are taken at once at most.
_BLOCK = 1 << 18
_STANDARD_INPUT = "standard input"


@dataclass(frozen=True)
class Position:
    """Where a stream is: name of the file, empty of standard input, and time [s] of a sample."""

    file: str = ""
    time: float = -np.inf


@dataclass(frozen=True, eq=False)
class Piece:
    """Consecutive samples of one file; none where there is nothing new."""

    file: str
    columns: Columns


def folder_samples(
    folder: Path, expected: ExpectedColumns, after: Position, *, follow: float | None
) -> Iterator[Piece]:
    """Samples of the files of a folder in the order of their names, and of those that come.

    Parameters
    ----------
    folder : Path
        Folder with Parquet or CSV files. Names that begin with "." or "_", and files without a
        column time, are passed over.
    expected : ExpectedColumns
        Columns.
    after : Position
        Last sample that is not wanted any more.
    follow : float, optional
        Seconds between two looks for further files; without it the stream ends with the last file.

    Yields
    ------
    Piece
        Samples in their order. Every file may have a clock of its own.

    Raises
    ------
    ValueError
        Where a file is refused, or time goes back in it.
    """
    last = ""
    while True:
        names = sorted(
            path.name
            for path in folder.iterdir()
            if path.suffix.lower() in RUN_SUFFIXES
            and not path.name.startswith((".", "_"))
            and path.name > last
            and path.name >= after.file
        )
        for name in names:
            path = folder / name
            if follow is not None and name == names[-1] and not _is_complete(path):
                break
            last = name
            if "time" not in run_file_header(path):
                continue
            begin = after.time if name == after.file else -np.inf
            yield from _checked(column_pieces(path, expected), begin, name)
        if follow is None:
            return
        yield Piece(last, {})
        time.sleep(follow)


def stream_samples(stream: BinaryIO, expected: ExpectedColumns, after: Position) -> Iterator[Piece]:
    """Samples of CSV rows below one header line.

    Parameters
    ----------
    stream : binary file
        Standard input.
    expected, after
        As of :func:`folder_samples`.

    Yields
    ------
    Piece
        Samples as they come.

    Raises
    ------
    ValueError
        Where the header does not match, a row is no row of numbers, or time goes back.
    """
    yield from _checked(_rows(stream, expected), after.time, "")


def _rows(stream: BinaryIO, expected: ExpectedColumns) -> Iterator[Columns]:
    """Rows of a CSV stream in the pieces in which they come."""
    header = stream.readline()
    names = [name.strip().strip('"') for name in header.decode("utf-8", "replace").split(",")]
    columns = expected.columns_to_read(names, _STANDARD_INPUT)
    convert = pa_csv.ConvertOptions(
        column_types=dict.fromkeys(columns, "float64"),
        include_columns=columns,
        null_values=["", "nan", "NaN", "NAN", "NA"],
    )
    read = pa_csv.ReadOptions(column_names=names)
    read1 = getattr(stream, "read1", stream.read)
    begun = b""
    while block := read1(_BLOCK):
        text, newline, begun = (begun + block).rpartition(b"\n")
        if not text.strip():
            continue
        try:
            rows = io.BytesIO(text + newline)
            table = pa_csv.read_csv(rows, read_options=read, convert_options=convert)
        except ValueError as error:
            reason = str(error).splitlines()[0]
            raise ValueError(f"{_STANDARD_INPUT}: {reason}; expected rows of numbers") from error
        yield {
            name: np.array(table[name].to_numpy(zero_copy_only=False), dtype=np.float64)
            for name in columns
        }


def _is_complete(path: Path) -> bool:
    """Whether a Parquet file has its end, which one that is being written has not."""
    if path.suffix.lower() != ".parquet":
        return True
    try:
        with path.open("rb") as opened:
            pa_parquet.ParquetFile(opened)
    except (OSError, ValueError):
        return False
    return True


def _checked(pieces: Iterator[Columns], after: float, file: str) -> Iterator[Piece]:
    """Samples of one file after a time; time increases, inputs are there."""
    where = file or _STANDARD_INPUT
    last = -np.inf
    for piece in pieces:
        times = piece["time"]
        for name in ("time", "carrier_angle", "torque", "ntl_y", "ntl_z"):
            if name in piece and not np.isfinite(piece[name]).all():
                raise ValueError(
                    f"{where}: column '{name}' has a missing value; expected a finite number in "
                    "every row"
                )
        goes_back = np.diff(np.concatenate([[last], times])) <= 0.0
        if goes_back.any():
            raise ValueError(
                f"{where}: column 'time' goes back to {times[int(np.argmax(goes_back))]:g} s; "
                "expected time that increases"
            )
        last = float(times[-1]) if times.size else last
        wanted = times > after
        yield Piece(file, {name: values[wanted] for name, values in piece.items()})
