"""In which dialect a text file of a logger is written: encoding, separator, comma, header.

Nothing of it is asked of the user: the last lines of the file's beginning are surely samples, and
only one way to cut them gives numbers in every cell.
"""

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass

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


def dialect_of(text: str, encoding: str, file: str) -> Dialect:
    """Dialect of a text.

    Parameters
    ----------
    text : str
        Whole lines from the beginning of the file.
    encoding : str
        Its encoding.
    file : str
        Name of the file, for the message.

    Raises
    ------
    ValueError
        Where no way to cut the lines gives numbers.
    """
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
