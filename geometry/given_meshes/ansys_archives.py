"""Nodes, node components and solids of an Ansys archive (``.cdb``), as ``CDWRITE`` writes it.

Blocked form: ``NBLOCK``, ``EBLOCK`` with ``SOLID``, ``CMBLOCK``, each with a line of its format in
Fortran's words. Entries: Ansys Mechanical APDL 2021, Command Reference and Programmer's Reference.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.plain_files import plain_content
from carrierflex.files.shown_values import shown

_EXPECTED = "an Ansys archive (.cdb)"
_MOST_BYTES = 4_000_000_000
#: Solids by number of the element type; of eight, ten, twenty nodes, with their degenerate forms.
_SOLIDS = {45: 8, 185: 8, 285: 4, 92: 10, 187: 10, 95: 20, 186: 20}
#: Types that have neither stiffness nor mass of the body: meshing facets, contact pairs, loads.
_BESIDE_SOLIDS = (200, 154, 152, *range(169, 178))
#: Fields of an element before its nodes.
_MATERIAL, _TYPE, _N_NODES, _NUMBER, _FIELDS = 0, 1, 8, 10, 11
_INTEGER_FORMAT = re.compile(r"\((\d+)i(\d+)(?:,(\d+)e(\d+)\.\d+(?:e\d+)?)?\)", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class AnsysArchive:
    """What an archive holds.

    Parameters
    ----------
    numbers : ndarray of int, shape (n,)
        Numbers of the nodes.
    points : ndarray, shape (n, 3)
        Their coordinates in the file's unit.
    node_sets : dict of str to ndarray of int
        Numbers of the nodes of every node component.
    turned : tuple of int
        Nodes whose displacements have directions of their own.
    solids : dict of (str, str) to list of list of int
        Kind and number of the material of elements; their nodes, corners first, in the order of
        Abaqus.
    others : dict of str to int
        Counts of other elements that have stiffness or mass, by name of the type.
    """

    numbers: NDArray[np.int64]
    points: NDArray[np.float64]
    node_sets: dict[str, NDArray[np.int64]]
    turned: tuple[int, ...]
    solids: dict[tuple[str, str], list[list[int]]]
    others: dict[str, int]


def read_archive(path: Path) -> AnsysArchive:
    """Read an archive.

    Raises
    ------
    FileNotFoundError, ValueError
        Where there is no such file, or a block is damaged or of another form; one line that names
        the file and the line.
    """
    content = plain_content(path, _EXPECTED, _MOST_BYTES)
    try:
        return _archive(content.decode("latin-1").splitlines())
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _archive(lines: list[str]) -> AnsysArchive:
    nodes: dict[int, tuple[float, float, float]] = {}
    turned: list[int] = []
    kinds: dict[int, int] = {}
    sets: dict[str, NDArray[np.int64]] = {}
    elements: list[list[int]] = []
    at = 0
    while at < len(lines):
        words = [word.strip() for word in lines[at].split("!", 1)[0].split(",")]
        name = words[0].upper()
        if name == "ET" and len(words) > 2:
            kinds[_integer(words[1], at)] = _integer(words[2], at)
        elif name == "ETBLOCK":
            raise ValueError(
                f"line {at + 1}: ETBLOCK; expected ET entries: write the archive by CDWRITE,DB"
            )
        elif name == "NBLOCK":
            at = _read_nodes(lines, at, nodes, turned)
        elif name == "EBLOCK":
            if len(words) < 3 or words[2].upper() != "SOLID":
                raise ValueError(f"line {at + 1}: EBLOCK without SOLID; expected EBLOCK,19,SOLID")
            at = _read_elements(lines, at, elements)
        elif name == "CMBLOCK" and len(words) > 3 and words[2].upper().startswith("NODE"):
            at, sets[words[1]] = _read_set(lines, at, _integer(words[3], at))
        at += 1
    if not nodes:
        raise ValueError("no NBLOCK with nodes; expected an archive of CDWRITE in blocked form")
    solids, others = _sorted_elements(elements, kinds)
    numbers = np.array(list(nodes), dtype=np.int64)
    return AnsysArchive(
        numbers, np.array(list(nodes.values())), sets, tuple(turned), solids, others
    )


def _read_nodes(
    lines: list[str],
    at: int,
    nodes: dict[int, tuple[float, float, float]],
    turned: list[int],
) -> int:
    """Nodes of a block; the last line that belongs to it. What a line leaves out is zero."""
    count, width, n_real, real_width = _format(lines, at + 1)
    begin = count * width
    if n_real < 3:
        raise ValueError(
            f"line {at + 2}: {shown(lines[at + 1])}; expected a format as (3i9,6e21.13)"
        )
    for row in range(at + 2, len(lines)):
        line = lines[row]
        if line[:2] == "N," or line.strip() == "-1":
            return row
        values = [
            _real(line[begin + real_width * i : begin + real_width * (i + 1)], row)
            for i in range(n_real)
        ]
        number = _integer(line[:width], row)
        nodes[number] = (values[0], values[1], values[2])
        if any(values[3:]):
            turned.append(number)
    raise ValueError("the block of nodes has no end; the file is cut short")


def _read_elements(lines: list[str], at: int, elements: list[list[int]]) -> int:
    """Fields and nodes of every element of a block; the last line that belongs to it."""
    _, width, _, _ = _format(lines, at + 1)
    row = at + 2
    while row < len(lines):
        if lines[row].strip() == "-1":
            return row
        fields = _fields(lines[row], width, row)
        if len(fields) < _FIELDS or not 0 < fields[_N_NODES] <= 20:
            raise ValueError(
                f"line {row + 1}: {len(fields)} fields; expected eleven and up to 20 nodes, as "
                "EBLOCK,19,SOLID has them"
            )
        while len(fields) < _FIELDS + fields[_N_NODES] and row + 1 < len(lines):
            row += 1
            fields += _fields(lines[row], width, row)
        elements.append(fields)
        row += 1
    raise ValueError("the block of elements has no end (-1); the file is cut short")


def _read_set(lines: list[str], at: int, count: int) -> tuple[int, NDArray[np.int64]]:
    """Numbers of a component: listed, a negative one ends a range."""
    _, width, _, _ = _format(lines, at + 1)
    listed: list[int] = []
    row = at + 1
    while len(listed) < count and row + 1 < len(lines):
        row += 1
        listed += _fields(lines[row], width, row)
    if len(listed) != count:
        raise ValueError(f"line {at + 1}: {len(listed)} of {count} numbers; the file is cut short")
    ranges = []
    for before, number in zip([0, *listed], listed, strict=False):
        first = number if number > 0 else before + 1
        if not 0 < first <= abs(number) < first + 30_000_000:
            raise ValueError(f"line {at + 1}: {before}, {number}; expected ascending ranges")
        ranges.append(np.arange(first, abs(number) + 1))
    return row, np.concatenate([np.zeros(0, dtype=np.int64), *ranges])


def _sorted_elements(
    elements: list[list[int]], kinds: dict[int, int]
) -> tuple[dict[tuple[str, str], list[list[int]]], dict[str, int]]:
    """Solids by kind and material, and how many others there are of each type."""
    solids: dict[tuple[str, str], list[list[int]]] = {}
    others: Counter[str] = Counter()
    for fields in elements:
        kind = kinds.get(fields[_TYPE], 0)
        nodes = fields[_FIELDS : _FIELDS + fields[_N_NODES]]
        if kind in _BESIDE_SOLIDS:
            continue
        if kind not in _SOLIDS:
            others[f"type {kind or 'that no ET states'}"] += 1
            continue
        name, corners = _shape(nodes, _SOLIDS[kind], fields[_NUMBER])
        solids.setdefault((name, str(fields[_MATERIAL])), []).append(corners)
    return solids, dict(others)


def _shape(nodes: list[int], most: int, element: int) -> tuple[str, list[int]]:
    """Kind of an element and its nodes: degenerate forms repeat corners of the hexahedron."""
    n = len(nodes)
    if most in (4, 10):
        if n in (4, 10):
            return ("tetra" if n == 4 else "tetra10"), nodes
    elif n in (4, 8, 10, 20):
        if n in (4, 10):
            return ("tetra" if n == 4 else "tetra10"), nodes
        quadratic = n == 20
        i, j, k, m_4, m, n_6, o, p = nodes[:8]
        if len({i, j, k, m_4, m, n_6, o, p}) == 8:
            return ("hexahedron20" if quadratic else "hexahedron"), nodes
        if k == m_4 and m == n_6 == o == p:
            middles = [nodes[row] for row in (8, 9, 11, 16, 17, 18)] if quadratic else []
            return ("tetra10" if quadratic else "tetra"), [i, j, k, m, *middles]
        if m == n_6 == o == p:
            return ("pyramid13" if quadratic else "pyramid"), nodes
        if k == m_4 and o == p:
            return ("wedge15" if quadratic else "wedge"), [i, j, k, m, n_6, o]
    raise ValueError(
        f"element {element} has {n} nodes; expected a tetrahedron, hexahedron or wedge"
    )


def _format(lines: list[str], at: int) -> tuple[int, int, int, int]:
    """Count and width of whole numbers, then of reals, of a format line."""
    words = _INTEGER_FORMAT.fullmatch(lines[at].strip()) if at < len(lines) else None
    numbers = [int(word or 0) for word in words.groups()] if words else [0, 0, 0, 0]
    if not 0 < numbers[1] <= 40 or not 0 < numbers[0] <= 40 or numbers[3] > 60:
        raise ValueError(
            f"line {at + 1}: {shown(lines[at] if at < len(lines) else '')}; expected a format as "
            "(3i9,6e21.13e3) or (19i10)"
        )
    return numbers[0], numbers[1], numbers[2], numbers[3]


def _fields(line: str, width: int, row: int) -> list[int]:
    stripped = line.rstrip()
    starts = range(0, len(stripped), width)
    return [_integer(stripped[start : start + width], row) for start in starts]


def _integer(word: str, row: int) -> int:
    text = word.strip()
    if not re.fullmatch(r"-?\d{1,12}", text):
        raise ValueError(f"line {row + 1}: {shown(text)}; expected a whole number")
    return int(text)


def _real(word: str, row: int) -> float:
    text = word.strip()
    if not text:
        return 0.0
    if not re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([EeDd]?[-+]?\d{1,3})?", text):
        raise ValueError(f"line {row + 1}: {shown(text)}; expected a number")
    value = float(re.sub(r"[Dd]", "E", text))
    if abs(value) > 1e100:
        raise ValueError(f"line {row + 1}: {shown(text)}; expected a coordinate")
    return value


def blocks_of(
    archive: AnsysArchive,
) -> Iterator[tuple[str, str, NDArray[np.int64]]]:
    """Kind, material and node rows of the solids, rows counting as :attr:`AnsysArchive.numbers`.

    Raises
    ------
    ValueError
        Where an element names a node that the archive has not.
    """
    order = np.argsort(archive.numbers)
    for (kind, material), listed in archive.solids.items():
        nodes = np.array(listed, dtype=np.int64)
        at = np.searchsorted(archive.numbers, nodes, sorter=order).clip(max=len(order) - 1)
        rows = order[at]
        absent = archive.numbers[rows] != nodes
        if absent.any():
            raise ValueError(
                f"an element of material {material} names node {nodes[absent][0]}, which is not in "
                "NBLOCK; expected all of them"
            )
        yield kind, material, rows
