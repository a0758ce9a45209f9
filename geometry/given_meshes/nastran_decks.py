"""Solids and facets of Nastran bulk data, read by pyyeti.

Fields of eight or sixteen characters or between commas, continuation lines of every form, grids in
other coordinate systems. gmsh takes continuation lines that begin with blanks for further cards,
and knows no elements in fields of sixteen.
"""

import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.shown_values import shown

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
_CARDS = rf"(GRID|GRDSET|{'|'.join(sorted(_NAMES))})[*\s,]"
#: Nastran numbers the edges along a hexahedron before those of its far end.
_FROM_NASTRAN = {"hexahedron20": [*range(12), *range(16, 20), *range(12, 16)]}
#: Begins a text that Windows wrote in UTF-8.
BYTE_ORDER_MARK = b"\xef\xbb\xbf"

Block = tuple[str, str, NDArray[np.int64]]


def bulk_data(content: bytes) -> str:
    """Lines of a deck up to ENDDATA, as pyyeti reads them: without comments and blank lines.

    pyyeti ends a card at a comment between its lines and reads on behind ENDDATA.

    Parameters
    ----------
    content : bytes
        The file.

    Raises
    ------
    ValueError
        Where pyyeti would drop a card or its continuation: the name does not begin in column 1, or
        a card in fields of sixteen has commas.
    """
    text = content.removeprefix(BYTE_ORDER_MARK).decode("latin-1")
    lines = io.StringIO(text, newline=None)
    text = "".join(line for line in lines if line.strip() and not line.lstrip().startswith("$"))
    text = re.split(r"(?im)^[ \t]*ENDDATA\b", text, maxsplit=1)[0]
    cards = re.split(r"(?im)^[ \t]*BEGIN[ \t]+BULK.*$", text, maxsplit=1)[-1]
    # From column 9 on a word is a field of a continuation.
    if indented := re.search(r"(?m)^ {1,7}[A-Za-z].*$", cards):
        raise ValueError(
            f"the line {shown(indented[0])} begins with blanks; expected the names of entries from "
            "column 1 on: delete the blanks before them"
        )
    if wide := re.search(r"(?im)^(?!DMIG)[A-Z]\w*\*[ \t]*,.*$", cards):
        raise ValueError(
            f"the line {shown(wide[0])} is a large entry (*) with commas; expected commas in "
            "entries without * alone: write it in fields of 8 or of 16 characters"
        )
    return text


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
    # Half of the imports of all that may read a mesh: pandas and matplotlib come with it.
    from pyyeti.nastran import bulk

    text = bulk_data(path.read_bytes())
    cards = bulk.rdcards(
        io.StringIO(text), _CARDS, regex=True, return_var="list", keep_name=True, no_data_return=[]
    )
    grids: dict[int, list[float]] = {}
    elements: dict[tuple[str, str], list[list[int]]] = {}
    element_numbers: set[int] = set()
    in_frames = False
    for card in cards:
        name = card[0].rstrip("*").upper()
        fields = [0 if value == "" else value for value in card[1:]]
        if name == "GRID":
            number, frame, *xyz = [*fields, 0, 0, 0, 0][:5]
            if grids.setdefault(number, xyz) != xyz:
                raise ValueError(
                    f"GRID {number} is defined twice, at two positions; expected it once"
                )
            in_frames |= frame != 0
        elif name == "GRDSET":
            if any(fields[1:2]):
                raise ValueError(
                    f"GRDSET gives coordinate system {fields[1]} to grids that name none; expected "
                    "the system in every GRID"
                )
        else:
            kind, nodes = _element(name, fields)
            if fields[0] in element_numbers:
                raise ValueError(
                    f"{name} {fields[0]} has the number of another element; expected every one once"
                )
            element_numbers.add(fields[0])
            elements.setdefault((kind, str(fields[1] or "")), []).append(nodes)
    numbers = np.array(sorted(grids), dtype=np.int64)
    if in_frames:
        points = _points_of_frames(text, numbers)
    else:
        points = np.array([grids[number] for number in numbers.tolist()], dtype=np.float64)
    return numbers, points.reshape(-1, 3), list(_blocks(elements, numbers))


def _element(name: str, fields: list[int]) -> tuple[str, list[int]]:
    """Kind and node numbers of an element from its number, property and nodes."""
    nodes = fields[2 : 2 + _MOST_NODES[name]]
    while nodes and nodes[-1] == 0:
        nodes.pop()
    kind = _KINDS.get((name, len(nodes)))
    if kind is None or 0 in nodes or not all(isinstance(node, int) for node in nodes):
        counts = " or ".join(str(m) for other, m in _KINDS if other == name)
        raise ValueError(
            f"{name} {fields[0]} has {len(nodes) - nodes.count(0)} nodes; expected {counts}, all "
            "mid-side nodes or none"
        )
    return kind, nodes


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
                "GRID of this file has; expected all of them in one file (INCLUDE is not followed)"
            )
        yield kind, group, rows[:, _FROM_NASTRAN[kind]] if kind in _FROM_NASTRAN else rows


def _points_of_frames(text: str, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
    """Coordinates in the basic system of grids that are given in others."""
    from pyyeti.nastran import bulk

    try:
        uset = bulk.bulk2uset(io.StringIO(text))[0]
    except (KeyError, ValueError) as error:
        raise ValueError(
            f"a GRID names a coordinate system that is not there ({error}); expected its CORD2R, "
            "CORD2C or CORD2S in this file"
        ) from error
    rows = uset.xs(1, level="dof").loc[numbers]
    return np.asarray(rows[["x", "y", "z"]], dtype=np.float64)
