"""Run files of a campaign: columns of CSV or Parquet files, whole or in pieces.

Arrow gets opened files: it takes names in UTF-8 only.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pa_parquet
from numpy.typing import NDArray

from carrierflex.files.problems import refuse
from carrierflex.identification.campaign.declarations import column_conflicts
from carrierflex.identification.campaign.document_files import run_file_header
from carrierflex.identification.campaign.file_names import DOCUMENT_NAME

#: Sanity limits, checked before anything is allocated.
LARGEST_TABLE = 1_000_000_000  # cells of a Parquet file: 8 GB of numbers
#: Cells that a Parquet file may hold for each byte of it, and whatever its size.
CELLS_OF_A_BYTE = 10
CELLS_OF_A_SMALL_FILE = 1_000_000

#: Samples of one piece: a dozen columns of it take some 20 MB.
PIECE = 200_000
#: Bytes of CSV text read at a time.
_CSV_BLOCK = 32_000_000
#: How a missing sample may be written.
_MISSING = ["", "nan", "NaN", "NAN", "NA"]


@dataclass(frozen=True, eq=False)
class ExpectedColumns:
    """Columns that a run file must have after ``time``.

    Parameters
    ----------
    kinds : mapping of str to str
        What each one is, by its name
        (:func:`carrierflex.identification.campaign.campaign.expected_columns`).
    others_allowed : bool
        Whether other columns are left out instead of refused.
    """

    kinds: Mapping[str, str]
    others_allowed: bool = False

    def columns_to_read(self, columns: list[str], file: str) -> list[str]:
        """Columns of a file that are read, in its order.

        Raises
        ------
        ValueError
            Where the header does not match; the message names the file.
        """
        refuse(
            column_conflicts(
                columns,
                self.kinds,
                file,
                others_allowed=self.others_allowed,
                said_in=DOCUMENT_NAME,
            )
        )
        return [name for name in columns if name == "time" or name in self.kinds]


def left_out_columns(path: Path, expected: ExpectedColumns) -> list[str]:
    """Columns of a run file that are neither input nor channel, in its order."""
    names = run_file_header(path)
    return [name for name in names if name != "time" and name not in expected.kinds]


def run_columns(path: Path, expected: ExpectedColumns) -> dict[str, NDArray[np.float64]]:
    """Columns of a whole run file, ``time`` first; missing samples NaN.

    Raises
    ------
    ValueError
        Where the file is too large, its header does not match or it holds something else than
        numbers; the message names the file.
    """
    table = (
        _read_parquet(path, expected)
        if path.suffix.lower() == ".parquet"
        else _read_csv(path, expected)
    )
    return _floats(table, path)


def column_pieces(
    path: Path, expected: ExpectedColumns
) -> Iterator[dict[str, NDArray[np.float64]]]:
    """Columns of a run file in consecutive pieces, whatever its length.

    Raises
    ------
    ValueError
        As :func:`run_columns`.
    """
    try:
        for table in _tables(path, expected):
            yield _floats(table, path)
    except (pa.ArrowInvalid, OSError) as error:
        raise ValueError(
            f"{path.name}: {_one_line(error)}; expected numbers in every column"
        ) from error


def _tables(path: Path, expected: ExpectedColumns) -> Iterator[pa.Table]:
    columns = run_file_header(path)
    wanted = expected.columns_to_read(columns, path.name)
    if path.suffix.lower() == ".parquet":
        with path.open("rb") as opened, pa_parquet.ParquetFile(opened, pre_buffer=False) as file:
            check_cells(file, path, len(wanted))
            for batch in file.iter_batches(batch_size=PIECE, columns=wanted):
                yield pa.Table.from_batches([batch])
        return
    read = pa_csv.ReadOptions(column_names=columns, skip_rows=1, block_size=_CSV_BLOCK)
    with (
        path.open("rb") as opened,
        pa_csv.open_csv(opened, read_options=read, convert_options=_convert(wanted)) as reader,
    ):
        for batch in reader:
            yield pa.Table.from_batches([batch])


def _convert(columns: list[str]) -> pa_csv.ConvertOptions:
    return pa_csv.ConvertOptions(
        column_types=dict.fromkeys(columns, pa.float64()),
        include_columns=columns,
        null_values=_MISSING,
        quoted_strings_can_be_null=True,
    )


def _read_csv(path: Path, expected: ExpectedColumns) -> pa.Table:
    columns = run_file_header(path)
    wanted = expected.columns_to_read(columns, path.name)
    read = pa_csv.ReadOptions(column_names=columns, skip_rows=1)
    try:
        with path.open("rb") as file:
            return pa_csv.read_csv(file, read_options=read, convert_options=_convert(wanted))
    except pa.ArrowInvalid as error:
        if "Empty CSV" in str(error):
            raise ValueError(
                f"{path.name}: no samples below the header; expected at least one"
            ) from error
        raise ValueError(
            f"{path.name}: {_one_line(error)}; expected numbers in every column"
        ) from error


def _read_parquet(path: Path, expected: ExpectedColumns) -> pa.Table:
    wanted = expected.columns_to_read(run_file_header(path), path.name)
    try:
        with path.open("rb") as opened:
            file = pa_parquet.ParquetFile(opened)
            check_cells(file, path, len(wanted))
            return file.read(columns=wanted)
    except (pa.ArrowInvalid, OSError) as error:
        raise ValueError(f"{path.name}: not a Parquet file: {_one_line(error)}") from error


def check_cells(file: pa_parquet.ParquetFile, path: Path, n_columns: int) -> None:
    """Refuse a Parquet file that would fill the memory.

    Too many cells in all, or for the bytes that are stored: time increases, and cannot be packed as
    tightly as columns of one value.
    """
    cells, stored = file.metadata.num_rows * n_columns, path.stat().st_size
    most = min(LARGEST_TABLE, CELLS_OF_A_SMALL_FILE + CELLS_OF_A_BYTE * stored)
    if cells > most:
        raise ValueError(
            f"{path.name}: {cells} cells in {stored} bytes; expected at most {most} cells"
        )


def _floats(table: pa.Table, path: Path) -> dict[str, NDArray[np.float64]]:
    return {
        name: _as_floats(table[name], f"{path.name}: column '{name}'")
        for name in table.column_names
    }


def _as_floats(column: pa.ChunkedArray, where: str) -> NDArray[np.float64]:
    """Numbers of a column, missing ones NaN, in an array that can be written to."""
    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        raise ValueError(f"{where}: holds {column.type}; expected numbers")
    if column.type != pa.float64():
        column = column.cast(pa.float64(), safe=False)
    # pyarrow's conversion of missing numbers imports pandas, a quarter of a second.
    chunks = [
        chunk.to_numpy(zero_copy_only=False) if chunk.null_count else np.from_dlpack(chunk)
        for chunk in column.chunks
    ]
    return np.concatenate([np.empty(0), *chunks])


def _one_line(error: Exception) -> str:
    """First line of an exception's message."""
    return str(error).splitlines()[0].rstrip(".") if str(error) else type(error).__name__
