"""Text files of loggers as tables: any separator, decimal comma, preamble, encoding, dates."""

import codecs
import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv

from carrierflex.files.plain_files import plain_content
from carrierflex.files.shown_values import shortened
from carrierflex.identification.logs.log_table import FloatArray, LogTable, different_names

#: Bytes at the beginning of the file that are looked at.
HEAD = 65_536
#: Lines at its end that are surely samples, and lines a preamble may have.
_SAMPLE_LINES, _LONGEST_PREAMBLE = 12, 500
#: Between columns; blanks only where nothing else does.
_SEPARATORS = ("\t", ";", "|", ",")
BLANKS = " "
#: How a missing sample may be written.
MISSING = frozenset(
    "nan na n/a #n/a null none - -- --- inf -inf 1.#qnan 1.#ind -1.#ind ovr over overload "
    "overflow error invalid".split()
) | {""}
_NUMBER = {
    decimal: re.compile(rf"[+-]?(\d+{decimal}?\d*|{decimal}\d+)([eEdD][+-]?\d+)?\Z")
    for decimal in (r"\.", ",")
}
_DATE = re.compile(
    r"(\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[T ]\s*)?\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?( ?[AaPp][Mm])?Z?\Z"
    r"|\d{1,4}[-./]\d{1,2}[-./]\d{1,4}\Z"
)


@dataclass(frozen=True)
class Dialect:
    """How a text file is to be cut.

    Parameters
    ----------
    encoding : str
        Of Python's codecs.
    separator : str
        Between cells; a blank stands for any number of them.
    decimal : str
        Full stop or comma.
    header, units : int or None
        Lines (counted from 0) of the columns' names and units.
    first : int
        First line of samples.
    """

    encoding: str
    separator: str
    decimal: str
    header: int | None
    units: int | None
    first: int

    @property
    def words(self) -> str:
        """The dialect in words, for the comments of a map."""
        names = {"\t": "tab", BLANKS: "blanks"}
        header = f"names in line {self.header + 1}" if self.header is not None else "no names"
        units = f", units in line {self.units + 1}" if self.units is not None else ""
        return (
            f"{self.encoding}, separator {names.get(self.separator, self.separator)}, decimal "
            f"{'comma' if self.decimal == ',' else 'point'}, {header}{units}"
        )


def encoding_of(head: bytes) -> str:
    """Encoding of a text file from its first bytes.

    A mark tells; without one, zeros in every other byte are UTF-16, and what is no UTF-8 is the
    code page of Western Windows.
    """
    for mark, name in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if head.startswith(mark):
            return name
    zeros = head[0:200:2].count(0), head[1:200:2].count(0)
    if max(zeros) > 20:
        return "utf-16-le" if zeros[1] > zeros[0] else "utf-16-be"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def _dialect_of(text: str, encoding: str, file: str) -> Dialect:
    """Dialect of a text."""
    lines = text.splitlines()
    filled = [number for number, line in enumerate(lines) if line.strip()]
    # Half of a short file may be its preamble.
    count = min(_SAMPLE_LINES, max(len(filled) // 2, 1))
    samples = [lines[number] for number in filled[-count:]]
    cuts = [
        (len(cells_of(samples[-1], separator)), separator, decimal)
        for separator in _SEPARATORS
        for decimal in (".", ",")
        if separator != decimal and _all_samples(samples, separator, decimal)
    ]
    if not cuts or max(cuts)[0] == 1:
        cuts += [
            (len(cells_of(samples[-1], BLANKS)), BLANKS, decimal)
            for decimal in (".", ",")
            if _all_samples(samples, BLANKS, decimal)
        ]
    if not cuts:
        last = samples[-1] if samples else ""
        raise ValueError(
            f"{file}: no separator and decimal sign make numbers of its lines, the last one looked "
            f"at is '{last[:80]}'; expected a table of samples as text"
        )
    most = max(cuts, key=lambda cut: cut[0])
    return _with_header(lines, filled, most[1], most[2], encoding)


def cells_of(line: str, separator: str) -> list[str]:
    """Cells of a line without blanks and quotes around them."""
    if separator == BLANKS:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]


def is_date(cell: str) -> bool:
    """Whether a cell is a date or a time of day."""
    return _DATE.match(cell) is not None


def _is_sample(cell: str, decimal: str) -> bool:
    number = _NUMBER["," if decimal == "," else r"\."]
    return number.match(cell) is not None or cell.lower() in MISSING or is_date(cell)


def _all_samples(lines: Sequence[str], separator: str, decimal: str) -> bool:
    """Whether every cell of the lines is a sample, and as many stand in each."""
    rows = [cells_of(line, separator) for line in lines]
    if not rows or len({len(row) for row in rows}) > 1:
        return False
    return bool(rows[0]) and all(_is_sample(cell, decimal) for row in rows for cell in row)


def _with_header(
    lines: Sequence[str], filled: Sequence[int], separator: str, decimal: str, encoding: str
) -> Dialect:
    """The dialect with the place of the first sample, and what stands above it."""
    width = len(cells_of(lines[filled[-1]], separator))

    def has_samples(number: int) -> bool:
        row = cells_of(lines[number], separator)
        return len(row) == width and all(_is_sample(cell, decimal) for cell in row)

    # A wrong cell further down is no header: it is told with its line when it is read.
    index = next(k for k, number in enumerate(filled) if has_samples(number))
    first = filled[index]
    above = [
        number
        for number in filled[max(index - 2, 0) : index]
        # Samples may end with a separator that the names do not have.
        if len(cells_of(lines[number].lstrip("#% "), separator)) in (width, width - 1) and width > 1
    ]
    if index > _LONGEST_PREAMBLE or not above or above[-1] != filled[index - 1]:
        return Dialect(encoding, separator, decimal, None, None, first)
    last = cells_of(lines[above[-1]].lstrip("#% "), separator)
    if len(above) > 1 and all(_looks_like_unit(cell) for cell in last):
        return Dialect(encoding, separator, decimal, above[-2], above[-1], first)
    return Dialect(encoding, separator, decimal, above[-1], None, first)


def _looks_like_unit(cell: str) -> bool:
    """Whether a cell of the line below the names is a unit, or empty."""
    from carrierflex.identification.logs.logged_units import is_unit

    bare = cell.strip("[]() ")
    return not bare or bare in ("-", "date", "dd.mm.yyyy") or is_unit(bare)


#: A larger text [bytes] is not read: its numbers take a fifth of it in a binary format.
LARGEST_TEXT = 2 * 1024**3
_MOST_COLUMNS = 4_000
#: What files that are no text begin with, and what to do with them.
_NO_TEXT = {
    b"PK\x03\x04": "an Excel workbook or another zip archive; expected the suffix .xlsx, or text: "
    "unpack the archive",
    b"\xd0\xcf\x11\xe0": "an Excel workbook (.xls); expected text or .xlsx: save it so",
    b"\x1f\x8b": "packed by gzip; expected text: unpack it",
    b"PAR1": "a Parquet file; expected the suffix .parquet",
    b"TDSm": "a TDMS file of LabVIEW; expected the suffix .tdms",
    b"\x89HDF": "an HDF5 file; expected the suffix .h5",
    b"MDF     ": "an MDF file; expected the suffix .mf4 or .mdf",
}
#: A universal file begins with its separator and the number of a data set: 58 for records.
_UNIVERSAL = re.compile(rb"\s*-1[ \t]*\r?\n[ \t]*(\d+)b?\b[^\r\n]*\r?\n")


def text_log(path: Path) -> tuple[LogTable, Dialect]:
    """Table of a text file, and its dialect.

    Parameters
    ----------
    path : Path
        File.

    Returns
    -------
    tuple of LogTable and Dialect
        Columns as they stand in the file.

    Raises
    ------
    ValueError
        Where it is no table of samples; the message names the file, and the line of a cell that is
        no number.
    """
    content = plain_content(path, "a logger's text file", LARGEST_TEXT)
    for mark, what in _NO_TEXT.items():
        if content.startswith(mark):
            raise ValueError(f"{path}: {what}")
    if universal := _UNIVERSAL.match(content):
        number = universal[1].decode("ascii")
        raise ValueError(
            f"{path}: a universal file (UFF) of data set {number}; expected the suffix .uff or "
            ".unv, or a table of samples"
        )
    encoding = encoding_of(content[:HEAD])
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: byte {error.start} is no text in {encoding}") from error
    return text_table(text, path, encoding)


def text_table(text: str, path: Path, encoding: str) -> tuple[LogTable, Dialect]:
    """Table of a text, and its dialect; errors as of :func:`text_log`.

    Parameters
    ----------
    text : str
        Content of the file, or of a sheet of it.
    path : Path
        File, for messages.
    encoding : str
        Of the file, for the dialect.
    """
    head = text[:HEAD]
    # The last line may be cut, by this limit or by the end of the logger's battery.
    complete_lines = head[: head.rfind("\n") + 1] or head
    dialect = _dialect_of(complete_lines, encoding, str(path))
    lines = complete_lines.splitlines()
    names, units = _names_and_units(lines, dialect)
    if len(names) > _MOST_COLUMNS:
        raise ValueError(f"{path}: {len(names)} columns; expected at most {_MOST_COLUMNS}")
    return _table(text, lines, names, units, dialect, path), dialect


def _names_and_units(lines: list[str], dialect: Dialect) -> tuple[list[str], dict[str, str]]:
    width = len(cells_of(lines[dialect.first], dialect.separator))
    if dialect.header is None:
        return [f"column {number + 1}" for number in range(width)], {}
    names = cells_of(lines[dialect.header].lstrip("#% "), dialect.separator)
    names += [""] * (width - len(names))
    different = different_names(
        [" ".join(name.split()) or f"column {k}" for k, name in enumerate(names, start=1)]
    )
    if dialect.units is None:
        return different, {}
    units = cells_of(lines[dialect.units].lstrip("#% "), dialect.separator)
    bare = [unit.strip("[]() ") for unit in units]
    return different, {name: unit for name, unit in zip(different, bare, strict=False) if unit}


def _table(
    text: str,
    lines: list[str],
    names: list[str],
    units: dict[str, str],
    dialect: Dialect,
    path: Path,
) -> LogTable:
    body = text[_offset(text, dialect.first) :]
    if dialect.separator == BLANKS:
        body = re.sub(r"^[ \t]+|[ \t]+$", "", body, flags=re.MULTILINE)
        body = re.sub(r"[ \t]+", " ", body)
    first = cells_of(lines[dialect.first], dialect.separator)
    dates = [name for name, cell in zip(names, first, strict=True) if is_date(cell)]
    cut: list[int] = []

    def left_out(row: pa_csv.InvalidRow) -> str:
        cut.append(row.number or 0)
        return "skip"

    types = {name: pa.string() if name in dates else pa.float64() for name in names}
    try:
        table = pa_csv.read_csv(
            io.BytesIO(body.encode()),
            read_options=pa_csv.ReadOptions(column_names=names, use_threads=False),
            parse_options=pa_csv.ParseOptions(
                delimiter=dialect.separator, invalid_row_handler=left_out
            ),
            convert_options=pa_csv.ConvertOptions(
                column_types=types,
                decimal_point=dialect.decimal,
                null_values=_missing_words(),
                quoted_strings_can_be_null=True,
            ),
        )
    except pa.ArrowInvalid as error:
        raise ValueError(_first_wrong_cell(body, names, dates, dialect, path, error)) from error
    notes = (f"{len(cut)} lines of another number of cells were left out",) if cut else ()
    numbers = {name: _numbers(table[name]) for name in names if name not in dates}
    return LogTable(
        path.name,
        # A separator at the end of every line makes a column of nothing.
        {name: values for name, values in numbers.items() if np.isfinite(values).any()},
        units,
        {name: table[name].to_pylist() for name in dates},
        notes=notes,
    )


def _offset(text: str, line: int) -> int:
    """Where a line begins."""
    position = 0
    for _ in range(line):
        ends = [end for end in (text.find("\n", position), text.find("\r", position)) if end >= 0]
        position = min(ends) + 1
        if text[position - 1 : position + 1] == "\r\n":
            position += 1
    return position


def _missing_words() -> list[str]:
    shapes = (str.lower, str.upper, str.title)
    return sorted({shape(word) for word in MISSING for shape in shapes} | {"NaN", "1.#QNAN"})


def _numbers(column: pa.ChunkedArray) -> FloatArray:
    return np.array(column.to_numpy(zero_copy_only=False), dtype=np.float64)


def _first_wrong_cell(
    body: str,
    names: list[str],
    dates: list[str],
    dialect: Dialect,
    path: Path,
    error: Exception,
) -> str:
    """Message about the first cell that is no number, by its line."""
    missing = set(_missing_words())
    for number, line in enumerate(body.splitlines(), start=dialect.first + 1):
        for name, cell in zip(names, cells_of(line, dialect.separator), strict=False):
            if name in dates or cell in missing:
                continue
            try:
                float(cell.replace(dialect.decimal, "."))
            except ValueError:
                return (
                    f"{path}: line {number}, column '{shortened(name)}' is '{shortened(cell)}'; "
                    "expected a number, or nothing where the sample is missing"
                )
    reason = str(error).splitlines()[0]
    return f"{path}: {reason}; expected numbers in every column"
