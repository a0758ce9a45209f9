"""What a logger's file holds: tables of columns that share one clock."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import shortened

FloatArray = NDArray[np.float64]
#: Name, values and unit of a column.
NamedColumn = tuple[str, NDArray[np.generic], str]
#: Numbers of one file: 4 GB of them.
MOST_NUMBERS = 500_000_000


@dataclass(frozen=True, eq=False)
class LogTable:
    """Columns of one clock.

    Parameters
    ----------
    file : str
        Name of the file, for messages.
    columns : mapping of str to ndarray, shape (n,)
        Numbers as they stand in the file, NaN where a cell is empty.
    units : mapping of str to str
        Units that the file states, by column.
    texts : mapping of str to sequence of str
        Columns of dates, as they stand in the file.
    step, start : float, optional
        Interval and first instant [s] of the logger's own clock, where the file states it in place
        of a column.
    notes : tuple of str
        What was left out while reading.
    """

    file: str
    columns: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    step: float | None = None
    start: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns, dates first."""
        return (*self.texts, *self.columns)

    @property
    def n_rows(self) -> int:
        """Number of samples."""
        sizes = [
            *(len(cells) for cells in self.texts.values()),
            *(c.size for c in self.columns.values()),
        ]
        return sizes[0] if sizes else 0


def table_of_columns(
    path: Path, columns: Sequence[NamedColumn], *, step: float | None = None, start: float = 0.0
) -> LogTable:
    """Table of columns; of a name with a path, the last member where it occurs once.

    Parameters
    ----------
    path : Path
        File.
    columns : sequence of (name, ndarray, unit)
        Columns of one length.
    step, start : float, optional
        Clock of the file [s], as of :class:`LogTable`.
    """
    short = _short_names([name for name, _, _ in columns])
    return LogTable(
        path.name,
        {short[name]: np.asarray(values, dtype=np.float64) for name, values, _ in columns},
        {short[name]: unit for name, _, unit in columns if unit},
        step=step,
        start=start,
    )


def _short_names(names: Sequence[str]) -> dict[str, str]:
    """Last member of every path where it occurs once in the table, else the path."""
    last = [name.rpartition("/")[2] for name in names]
    return {
        name: short if last.count(short) == 1 else name
        for name, short in zip(names, last, strict=True)
    }


def run_tables(files: Sequence[Sequence[LogTable]], time: str | None) -> list[LogTable]:
    """Tables of a run's files; a column that several files hold is called ``file 1: name``.

    Parameters
    ----------
    files : sequence of sequence of LogTable
        Of every file, in the order in which the run lists them.
    time : str or None
        Column of time, which every file may have.
    """
    counts = Counter(
        name for tables in files for name in {n for table in tables for n in table.columns}
    )

    def called(name: str, number: int) -> str:
        return f"file {number}: {name}" if counts[name] > 1 and name != time else name

    return [
        replace(
            table,
            columns={called(name, i): values for name, values in table.columns.items()},
            units={called(name, i): unit for name, unit in table.units.items()},
        )
        for i, tables in enumerate(files, start=1)
        for table in tables
    ]


def table_with(tables: Sequence[LogTable], column: str) -> LogTable:
    """The one table that holds a column.

    Raises
    ------
    ValueError
        Where none does, or several do; the message names files and columns.
    """
    holding = [table for table in tables if column in table.names]
    if len(holding) == 1:
        return holding[0]
    files = ", ".join(dict.fromkeys(table.file for table in tables))
    if holding:
        raise ValueError(
            f"column '{shortened(column)}' occurs {len(holding)} times in {files}; expected one: "
            "rename it, or leave a file out of the run"
        )
    in_files = [name for table in tables for name in table.names if name.endswith(f": {column}")]
    if in_files:
        raise ValueError(
            f"column '{shortened(column)}' stands in several of {files}; expected one of "
            f"{', '.join(repr(name) for name in in_files)}"
        )
    known = shortened(", ".join(name for table in tables for name in table.names), 400)
    raise ValueError(f"{files}: no column '{shortened(column)}'; found {known}")
