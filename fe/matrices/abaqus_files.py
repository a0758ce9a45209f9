"""Matrix files (.mtx) of Abaqus, and of CalculiX in the same form.

Three layouts: entries by node and direction (``FORMAT=MATRIX INPUT``, assembled), entries by row
and column (``FORMAT=COORDINATE``), and the lower triangle of one element (``*USER ELEMENT``, as a
substructure or an element matrix output writes it), which may hold stiffness and mass together.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.matrices.stored_matrix import (
    DofNames,
    StoredMatrix,
    from_entries,
    names_of_keys,
)
from carrierflex.fe.matrices.text_numbers import number_table, numbers, whole
from carrierflex.files.shown_values import shown

_KEYWORD = re.compile(rb"^[ \t]*\*(?!\*)[ \t]*([^\r\n]*)", re.MULTILINE)
_COMMENT = re.compile(rb"^[ \t]*\*\*[^\r\n]*", re.MULTILINE)
_COMPONENTS = 6


class _Block(NamedTuple):
    """Data lines below one keyword."""

    keyword: str
    data: bytes


def read_abaqus_matrix(path: Path, content: bytes, quantity: str) -> StoredMatrix:
    """Matrix of a .mtx file in any of the three layouts.

    Parameters
    ----------
    path : Path
        The file, for messages.
    content : bytes
        Its content.
    quantity : str
        ``stiffness`` or ``mass``: which of the matrices of an element.

    Raises
    ------
    ValueError
        Where the layout is none of them, or a part is cut short.
    """
    try:
        plain, *blocks = _blocks(content)
        if any(block.keyword.startswith("USER ELEMENT") for block in blocks):
            return _element_matrix(content, blocks, quantity)
        data = b"\n".join([plain.data, *(b.data for b in blocks if "MATRIX" in b.keyword)])
        return _listed_entries(data)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _blocks(content: bytes) -> list[_Block]:
    """What stands before the first keyword, then the data lines of every keyword."""
    text = _COMMENT.sub(b"", content)
    marks = list(_KEYWORD.finditer(text))
    ends = [*(mark.start() for mark in marks), len(text)]
    blocks = [_Block("", text[: ends[0]])]
    for mark, end in zip(marks, ends[1:], strict=True):
        keyword = re.sub(r"\s+", " ", mark[1].decode("latin-1")).strip().upper()
        blocks.append(_Block(keyword, text[mark.end() : end]))
    return blocks


def _listed_entries(data: bytes) -> StoredMatrix:
    first = next((line for line in data.split(b"\n") if line.strip()), b"")
    n_columns = len(first.replace(b",", b" ").split())
    if n_columns not in (3, 5):
        raise ValueError(
            f"the first data line is {shown(first.decode('latin-1')[:60])}; expected row, column, "
            "value, or node, direction, node, direction, value, or *USER ELEMENT"
        )
    table = number_table(data, n_columns, "the entries")
    if n_columns == 3:
        index = whole(table[:, :2], "rows and columns") - 1
        n = int(index.max(initial=-1)) + 1
        return StoredMatrix(from_entries(index[:, 0], index[:, 1], table[:, 2], n))
    # Nodes of negative number are internal degrees of freedom: Lagrange multipliers, tied contact.
    if (table[:, [0, 2]] < 1.0).any():
        odd = float(table[:, [0, 2]].min())
        raise ValueError(f"node {odd:g} is an internal variable; expected nodes of the model only")
    index = whole(table[:, :4], "nodes and directions")
    _refuse_other_directions(index[:, [1, 3]])
    keys = np.stack([_keys(index[:, 0], index[:, 1]), _keys(index[:, 2], index[:, 3])])
    found, place = np.unique(keys, return_inverse=True)
    rows, columns = place.reshape(2, -1)
    A = from_entries(rows, columns, table[:, 4], len(found))
    return StoredMatrix(A, names_of_keys(found))


def _keys(nodes: NDArray[np.int64], directions: NDArray[np.int64]) -> NDArray[np.int64]:
    return DofNames(nodes, directions - 1).keys


def _element_matrix(content: bytes, blocks: list[_Block], quantity: str) -> StoredMatrix:
    names = _element_dofs(content, blocks)
    wanted = f"TYPE={quantity.upper()}"
    found = [
        block.data
        for block in blocks
        if block.keyword.startswith("MATRIX") and wanted in block.keyword.replace(" ", "")
    ]
    if len(found) != 1:
        raise ValueError(f"{len(found)} blocks *MATRIX, {wanted}; expected one")
    values = numbers(found[0], f"the {quantity} matrix")
    n = len(names)
    rows, columns = np.tril_indices(n)
    if len(values) != len(rows):
        raise ValueError(
            f"the {quantity} matrix holds {len(values)} numbers; expected {len(rows)}, the lower "
            f"triangle of {n} degrees of freedom"
        )
    return StoredMatrix(from_entries(rows, columns, values, n), names)


def _element_dofs(content: bytes, blocks: list[_Block]) -> DofNames:
    """Nodes from the comment ``** ELEMENT NODES``, directions from the lines of *USER ELEMENT.

    The first line gives the directions of the first node; every further one a position in the list
    of nodes, from which on its directions hold.
    """
    comment = re.search(
        rb"\*\*[ \t]*ELEMENT NODES[^\r\n]*\r?\n((?:[ \t]*\*\*[^\r\n]*\r?\n)+)", content, re.I
    )
    if comment is None:
        raise ValueError("no comment ** ELEMENT NODES; expected the nodes of the element there")
    nodes = whole(numbers(comment[1].replace(b"*", b" "), "the element's nodes"), "nodes")
    block = next(block for block in blocks if block.keyword.startswith("USER ELEMENT"))
    lines = [line for line in block.data.split(b"\n") if line.strip()]
    # Positions at which a list of directions begins to hold; the first line has none.
    directions: dict[int, list[int]] = {}
    for number, line in enumerate(lines):
        entries = whole(numbers(line, "the directions"), "directions").tolist()
        position, listed = (1, entries) if number == 0 else (entries[0], entries[1:])
        directions[position] = listed
    if not directions or max(directions) > len(nodes) or min(directions) < 1:
        raise ValueError(
            f"directions of {len(directions)} positions for {len(nodes)} nodes; expected lists of "
            "directions below *USER ELEMENT"
        )
    found_nodes: list[int] = []
    found_directions: list[int] = []
    listed = []
    for position, node in enumerate(nodes.tolist(), start=1):
        listed = directions.get(position, listed)
        found_nodes += [node] * len(listed)
        found_directions += listed
    chosen = np.array(found_directions, dtype=np.int64)
    _refuse_other_directions(chosen)
    names = DofNames(np.array(found_nodes, dtype=np.int64), chosen - 1)
    if len(np.unique(names.keys)) != len(names):
        raise ValueError("a direction of a node stands twice; expected every one once")
    return names


def _refuse_other_directions(directions: NDArray[np.int64]) -> None:
    if directions.size and not (1 <= directions.min() and directions.max() <= _COMPONENTS):
        odd = int(directions[(directions < 1) | (directions > _COMPONENTS)].flat[0])
        raise ValueError(f"direction {odd}; expected 1 to 6, displacements and rotations only")
