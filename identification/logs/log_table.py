"""What a logger's file holds: tables of columns that share one clock."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import shortened
from carrierflex.identification.logs.logged_units import dimension_of, unit_behind

FloatArray = NDArray[np.float64]
#: Name, values and unit of a column.
NamedColumn = tuple[str, NDArray[np.generic], str]
#: Numbers of one file: 4 GB of them.
MOST_NUMBERS = 500_000_000
#: Words in the names of columns of time, in the languages of those who wrote such loggers.
_TIME = r"\b(time|zeit|t|timestamp|datum|date|tid|temps|clock)\b|^zeit|^time|zeitstempel"


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
    paths : mapping of str to str
        Of a file with groups, names of the columns with those of their groups: ``run1/force``.
    """

    file: str
    columns: Mapping[str, FloatArray]
    units: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, Sequence[str]] = field(default_factory=dict)
    step: float | None = None
    start: float = 0.0
    notes: tuple[str, ...] = ()
    paths: Mapping[str, str] = field(default_factory=dict)

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


def different_names(names: Sequence[str]) -> list[str]:
    """Names, those that occur before with their number."""
    result: list[str] = []
    for number, name in enumerate(names, start=1):
        result.append(name if name not in result else f"{name} ({number})")
    return result


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
    return replace(_table(path.name, columns, Counter(), (step, start)), paths={})


def _table(
    file: str,
    columns: Sequence[NamedColumn],
    others: Mapping[str, int],
    clock: tuple[float | None, float],
) -> LogTable:
    """Table whose columns have short names where they are clear: `others` are of other tables."""
    within = Counter(_last(name) for name, *_ in columns)

    def called(name: str, unit: str) -> str:
        short = _last(name)
        clear = within[short] == 1 and (not others.get(short) or is_clock(name, unit))
        return short if clear else name

    return LogTable(
        file,
        {called(name, unit): np.asarray(values, np.float64) for name, values, unit in columns},
        {called(name, unit): unit for name, _, unit in columns if unit},
        step=clock[0],
        start=clock[1],
        paths={called(name, unit): name for name, _, unit in columns},
    )


def grouped_tables(
    path: Path, clocks: Iterable[tuple[Sequence[NamedColumn], float | None, float]]
) -> tuple[LogTable, ...]:
    """Tables of a file whose columns are called after their paths.

    Groups of one length whose columns of time differ become tables of their own. A column is
    called by the last member of its path where no other table holds such a one; a column of time
    is where its table holds no other.

    Parameters
    ----------
    path : Path
        File.
    clocks : iterable of (sequence of (name, ndarray, unit), step, start)
        Columns of one length, and the clock [s] that the file states for them, as of
        :class:`LogTable`.
    """
    groups = [
        (of_clock, step, start)
        for columns, step, start in clocks
        for of_clock in _by_clock(columns)
    ]
    return _tables(path.name, groups)


def _tables(
    file: str, groups: Sequence[tuple[Sequence[NamedColumn], float | None, float]]
) -> tuple[LogTable, ...]:
    counts = Counter(_last(name) for columns, *_ in groups for name, *_ in columns)
    return tuple(
        _table(file, columns, counts - Counter(_last(name) for name, *_ in columns), (step, start))
        for columns, step, start in groups
    )


def _last(name: str) -> str:
    return name.rpartition("/")[2]


def is_clock(name: str, unit: str) -> bool:
    """Whether a column is one of time, by its name or its unit."""
    if re.search(_TIME, _last(name).lower()):
        return True
    return dimension_of(unit or unit_behind(name)) == dimension_of("s")


def _by_clock(columns: Sequence[NamedColumn]) -> list[Sequence[NamedColumn]]:
    """Columns of one length, apart where their groups have columns of time that differ.

    A column follows the time of its group, or of the nearest group above it.
    """
    groups = {name.rpartition("/")[0] for name, *_ in columns}
    if len(groups) == 1:
        return [columns]
    clocks: dict[str, NDArray[np.generic]] = {}
    for name, values, unit in columns:
        if is_clock(name, unit):
            clocks.setdefault(name.rpartition("/")[0], values)
    first = next(iter(clocks.values()), None)
    if first is None or all(
        np.array_equal(values, first, equal_nan=True) for values in clocks.values()
    ):
        return [columns]
    of_group: dict[str, list[NamedColumn]] = {}
    for column in columns:
        group = column[0].rpartition("/")[0]
        while group and group not in clocks:
            group = group.rpartition("/")[0]
        of_group.setdefault(group, []).append(column)
    return list(of_group.values())


def run_groups(tables: Sequence[LogTable]) -> tuple[str, ...]:
    """Groups of a file that hold the same columns, as those of several runs; none where one alone.

    A group that holds one signal and its time is a channel, no run.
    """
    members: dict[str, set[str]] = {}
    for table in tables:
        for name, path in table.paths.items():
            group, _, last = path.rpartition("/")
            if group and not is_clock(last, table.units.get(name, "")):
                members.setdefault(group, set()).add(last)
    alike = len(members) > 1 and len({frozenset(names) for names in members.values()}) == 1
    return tuple(members) if alike and len(next(iter(members.values()))) > 1 else ()


def tables_of_group(tables: Sequence[LogTable], group: str) -> tuple[LogTable, ...]:
    """Columns of one group, called by their names in it, and those of the groups above it.

    Raises
    ------
    ValueError
        Where there is no such group; the message names those of the file.
    """
    above = {""} | {group[:at] for at, sign in enumerate(group) if sign == "/"}
    on_clocks = []
    inside = False
    for table in tables:
        columns: list[NamedColumn] = []
        for name, path in table.paths.items():
            is_member = path.startswith(f"{group}/")
            inside |= is_member
            if is_member or path.rpartition("/")[0] in above:
                unit = table.units.get(name, "")
                columns.append((path.removeprefix(f"{group}/"), table.columns[name], unit))
        if columns:
            on_clocks.append((columns, table.step, table.start))
    if not inside:
        groups = {path.rpartition("/")[0] for table in tables for path in table.paths.values()}
        known = shortened(", ".join(sorted(groups - {""})), 400) or "none"
        raise ValueError(
            f"{tables[0].file}: no group '{shortened(group)}' with columns; expected one of the "
            f"file's: {known}"
        )
    notes = tuple(note for table in tables for note in table.notes)
    first, *others = _tables(tables[0].file, on_clocks)
    return (replace(first, notes=notes), *others)


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
            "rename it, leave a file out of the run, or give each sheet a file of its own"
        )
    in_files = [name for table in tables for name in table.names if name.endswith(f": {column}")]
    if in_files:
        raise ValueError(
            f"column '{shortened(column)}' stands in several of {files}; expected one of "
            f"{', '.join(repr(name) for name in in_files)}"
        )
    known = shortened(", ".join(name for table in tables for name in table.names), 400)
    raise ValueError(f"{files}: no column '{shortened(column)}'; found {known}")
