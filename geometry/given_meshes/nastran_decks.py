"""Entries of Nastran bulk data, and the solids and facets among them.

gmsh takes continuation lines that begin with blanks for further entries, and pyyeti drops what goes
on in another width; grids in other coordinate systems are placed by pyyeti.
"""

import io
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import shown

if TYPE_CHECKING:
    import pandas as pd

#: Kind of element by name of the card and number of nodes.
_KINDS = {
    ("CTETRA", 4): "tetra", ("CTETRA", 10): "tetra10",
    ("CHEXA", 8): "hexahedron", ("CHEXA", 20): "hexahedron20",
    ("CPENTA", 6): "wedge", ("CPENTA", 15): "wedge15",
    ("CPYRA", 5): "pyramid", ("CPYRA", 13): "pyramid13",
    ("CPYRAM", 5): "pyramid", ("CPYRAM", 13): "pyramid13",
    ("CTRIA3", 3): "triangle", ("CTRIAR", 3): "triangle", ("CTRIA6", 6): "triangle6",
    ("CQUAD4", 4): "quad", ("CQUADR", 4): "quad", ("CQUAD8", 8): "quad8",
}  # fmt: skip
_NAMES = {name for name, _ in _KINDS}
_MOST_NODES = {name: max(m for other, m in _KINDS if other == name) for name in _NAMES}
#: Fields of a line behind the first one, by their width.
_SMALL, _LARGE = 8, 4
_WIDTH = 8
#: Nastran numbers the edges along a hexahedron before those of its far end.
_FROM_NASTRAN = {"hexahedron20": [*range(12), *range(16, 20), *range(12, 16)]}
#: Begins a text that Windows wrote in UTF-8.
BYTE_ORDER_MARK = b"\xef\xbb\xbf"

Block = tuple[str, str, NDArray[np.int64]]


@dataclass(frozen=True)
class Entry:
    """An entry of bulk data.

    Parameters
    ----------
    name : str
        In capitals, without a star.
    words : list of str
        Its fields, eight of every line whatever their width; blank ones are empty.
    """

    name: str
    words: list[str]

    @property
    def fields(self) -> list[int | float | str]:
        """Numbers, and words that are none."""
        return [_value(word) for word in self.words]

    def field(self, at: int) -> int | float | str:
        """One of :attr:`fields`; an empty text behind the last one."""
        return _value(self.words[at]) if at < len(self.words) else ""


def bulk_entries(content: bytes) -> Iterator[Entry]:
    """Entries of a deck up to ENDDATA, whatever the format of their lines.

    Fields of eight or sixteen characters or between commas, also within one entry.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    ValueError
        Where an entry would be lost or joined wrongly; the message names the line.
    """
    text = content.removeprefix(BYTE_ORDER_MARK).decode("latin-1")
    text = re.sub(r"\$.*", "", text)
    text = re.split(r"(?im)^[ \t]*ENDDATA\b", text, maxsplit=1)[0]
    text = re.split(r"(?im)^[ \t]*BEGIN[ \t]+BULK.*$", text, maxsplit=1)[-1]
    entry: Entry | None = None
    half, label = False, ""
    for raw in io.StringIO(text, newline=None):
        if not (line := raw.rstrip()):
            continue
        _refuse_unread(line)
        line = line.expandtabs(_WIDTH)
        name, words, next_label = _cut(line)
        wide = len(words) == _LARGE
        if name and name[0] not in "+*":
            if entry is not None:
                yield entry
            entry, half = Entry(name.rstrip("*").strip().upper(), []), False
        elif label and name[1:] and label != name[1:]:
            raise ValueError(
                f"the line {shown(line)} follows one that goes on in {shown(label)}; expected the "
                "lines of an entry one below the other"
            )
        elif half and not wide:
            raise ValueError(
                f"the line {shown(line)} has fields of 8 characters behind half an entry of 16; "
                "expected lines of 16 in pairs: write the entry in one format"
            )
        if entry is not None:
            entry.words.extend(words)
        half, label = wide and not half, next_label
    if entry is not None:
        yield entry


def _refuse_unread(line: str) -> None:
    # From column 9 on a word is a field of a continuation.
    if re.match(r" {1,7}[A-Za-z]", line):
        raise ValueError(
            f"the line {shown(line)} begins with blanks; expected the names of entries from "
            "column 1 on: delete the blanks before them"
        )
    if any(word.strip() and len(word) % _WIDTH == 0 for word in line.split("\t")[:-1]):
        raise ValueError(
            f"the line {shown(line)} has a tab behind a full field of 8 characters, where it may "
            "end the field or skip one; expected blanks or commas in its place"
        )
    if line[0] == "=":
        raise ValueError(f"the line {shown(line)} repeats an entry; expected every one in full")
    if re.match(r"INCLUDE\b", line, re.IGNORECASE):
        raise ValueError(
            f"{shown(line)}: other files are not read; expected all entries in one file: put the "
            "lines of that file in its place, or delete the line where it has no part in the mesh"
        )


def _cut(line: str) -> tuple[str, list[str], str]:
    """First field, the fields behind it (four of sixteen characters or eight), and the last one."""
    if "," in line:
        name, *cells = (cell.strip() for cell in line.split(","))
        count = _LARGE if "*" in name else _SMALL
        words, rest = cells[:count], cells[count:]
    else:
        name = line[:8].strip()
        count = _LARGE if "*" in name else _SMALL
        width = 64 // count
        words = [line[at : at + width].strip() for at in range(8, 72, width)]
        rest = [line[72:80].strip()]
    if any(rest[1:]):
        raise ValueError(
            f"the line {shown(line)} has {len(rest) + count} fields behind the name; expected at "
            f"most {count} and a mark of the next line: go on in a line that begins with a comma"
        )
    return name, [*words, *[""] * (count - len(words))], (rest or [""])[0].lstrip("+*")


def _value(word: str) -> int | float | str:
    """Number of a field; Nastran lets an exponent stand without its letter, or with D."""
    if re.fullmatch(r"[-+]?\d{1,18}", word):
        return int(word)
    number = re.fullmatch(r"([-+]?(?:\d+\.?\d*|\.\d+))(?:[EeDd]?([-+]?\d{1,4}))?", word)
    if number is None or word.isdigit():
        return word
    return float(f"{number[1]}e{number[2] or 0}")


def bulk_text(entries: Iterable[Entry], names: str) -> str:
    """Entries whose names match, as pyyeti reads them."""
    lines = []
    for entry in entries:
        if re.fullmatch(names, entry.name):
            words = [entry.name, *entry.words]
            while not words[-1]:
                words.pop()
            rows = [words[at : at + _SMALL] for at in range(1, len(words), _SMALL)]
            lines += [",".join(["" if i else entry.name, *row]) for i, row in enumerate(rows)]
    return "\n".join([*lines, ""])


def refuse_default_systems(entry: Entry, *field_numbers: int) -> None:
    """Refuse a GRDSET that gives grids a coordinate system."""
    systems = [entry.field(at) for at in field_numbers if entry.field(at)]
    if systems:
        raise ValueError(
            f"GRDSET gives coordinate system {systems[0]} to grids that name none; expected the "
            "system in every GRID"
        )


def nastran_mesh(path: Path) -> tuple[NDArray[np.int64], NDArray[np.float64], list[Block]]:
    """Numbers (n,), coordinates (n, 3) and elements of a deck: kind, property, node rows (k, m).

    Nodes of solids stand in the order of the reference nodes of
    :mod:`carrierflex.geometry.given_meshes.solid_files`.

    Raises
    ------
    ValueError
        Where an element has a number of nodes that its kind has not, names a node that is not
        there, or is defined twice.
    """
    entries = list(bulk_entries(path.read_bytes()))
    grids: dict[int, list[float]] = {}
    elements: dict[tuple[str, str], list[list[int]]] = {}
    element_numbers: set[int] = set()
    in_frames = False
    for entry in entries:
        if entry.name == "GRID":
            number, xyz = grid_of(entry)
            if grids.setdefault(number, xyz) != xyz:
                raise ValueError(
                    f"GRID {number} is defined twice, at two positions; expected it once"
                )
            in_frames |= entry.field(1) not in ("", 0)
        elif entry.name == "GRDSET":
            refuse_default_systems(entry, 1)
        elif entry.name in _NAMES:
            kind, number, nodes = _element(entry)
            if number in element_numbers:
                raise ValueError(
                    f"{entry.name} {number} has the number of another element; expected every one "
                    "once"
                )
            element_numbers.add(number)
            elements.setdefault((kind, entry.words[1]), []).append(nodes)
    numbers = np.array(sorted(grids), dtype=np.int64)
    if in_frames:
        rows = grids_in_frames(entries).xs(1, level="dof").loc[numbers]
        points = np.asarray(rows[["x", "y", "z"]], dtype=np.float64)
    else:
        points = np.array([grids[number] for number in numbers.tolist()], dtype=np.float64)
    return numbers, points.reshape(-1, 3), list(_blocks(elements, numbers))


def grid_of(entry: Entry) -> tuple[int, list[float]]:
    """Number of a grid and its coordinates; blank ones are zero."""
    number, _, *xyz = [*entry.fields, 0, 0, 0, 0][:5]
    coordinates = [0.0 if value == "" else value for value in xyz]
    if not isinstance(number, int) or not all(isinstance(x, (int, float)) for x in coordinates):
        raise ValueError(
            f"GRID {shown(', '.join(entry.words[:5]))}; expected a whole number, a coordinate "
            "system and three numbers"
        )
    return number, [float(x) for x in coordinates]


def _element(entry: Entry) -> tuple[str, int, list[int]]:
    """Kind, number and nodes of an element."""
    number, _, *nodes = entry.fields[: 2 + _MOST_NODES[entry.name]]
    while nodes and nodes[-1] in ("", 0):
        nodes.pop()
    kind = _KINDS.get((entry.name, len(nodes)))
    node_numbers = [node for node in nodes if isinstance(node, int) and node != 0]
    if kind is None or not isinstance(number, int) or len(node_numbers) < len(nodes):
        counts = " or ".join(str(m) for other, m in _KINDS if other == entry.name)
        raise ValueError(
            f"{entry.name} {entry.words[0]} has {len(node_numbers)} nodes; expected {counts}, all "
            "mid-side nodes or none"
        )
    return kind, number, node_numbers


def _blocks(
    elements: dict[tuple[str, str], list[list[int]]], numbers: NDArray[np.int64]
) -> Iterator[Block]:
    """Blocks of one kind and property with the rows of their nodes."""
    for (kind, group), listed in elements.items():
        nodes = np.array(listed, dtype=np.int64)
        rows = np.searchsorted(numbers, nodes)
        absent = ~np.isin(nodes, numbers)
        if absent.any():
            raise ValueError(
                f"an element of property {group or 'none'} names node {nodes[absent][0]}, which no "
                "GRID of this file has; expected all of them in one file"
            )
        yield kind, group, rows[:, _FROM_NASTRAN[kind]] if kind in _FROM_NASTRAN else rows


def grids_in_frames(entries: Iterable[Entry]) -> "pd.DataFrame":
    """Table of the grids by pyyeti, six rows each; coordinates in the basic system.

    Raises
    ------
    ValueError
        Where a grid names a system that the deck has not, or one by grids (CORD1R).
    """
    # Half of the imports of all that may read a mesh: pandas and matplotlib come with it.
    from carrierflex.files.pyyeti_modules import bulk

    try:
        return bulk.bulk2uset(io.StringIO(bulk_text(entries, r"GRID|CORD2[RCS]")))[0]
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"a GRID names a coordinate system that is not there ({error.args[0]}); expected its "
            "CORD2R, CORD2C or CORD2S in this file"
        ) from error
