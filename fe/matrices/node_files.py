"""Nodes of other programs' models: numbers, coordinates, sets, and the order of matrix rows."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from carrierflex.fe.matrices.stored_matrix import SCALAR, DofNames
from carrierflex.fe.matrices.text_numbers import number_table, numbers, whole_numbers
from carrierflex.files.child_process import in_child, limited
from carrierflex.files.plain_files import check_plain_file, plain_content
from carrierflex.files.pyyeti_modules import bulk
from carrierflex.files.shown_values import shown
from carrierflex.geometry.given_meshes.abaqus_decks import deck_blocks, full_rows
from carrierflex.geometry.given_meshes.ansys_archives import read_archive
from carrierflex.geometry.given_meshes.nastran_decks import (
    Entry,
    bulk_entries,
    grid_of,
    grids_in_frames,
    refuse_default_systems,
)
from carrierflex.geometry.given_meshes.other_entries import refuse_made_nodes

_MOST_BYTES = 8_000_000_000
_EXPECTED = "a file with nodes (.inp, .bdf, .dat, .nas, .blk, .asm, .cdb)"
#: Suffix of the assembly file of a Nastran superelement.
ASSEMBLY = ".asm"
_NASTRAN = (".bdf", ".dat", ".nas", ".blk", ".asm", ".pch")
_DIRECTIONS = {"UX": 0, "UY": 1, "UZ": 2, "ROTX": 3, "ROTY": 4, "ROTZ": 5}
#: Nodes that one line of a generated set may name.
_MOST_GENERATED = 30_000_000
#: A coordinate system of Nastran that is rectangular.
_RECTANGULAR = 1


@dataclass(frozen=True, eq=False)
class NodeTable:
    """Nodes of a model.

    Parameters
    ----------
    numbers : ndarray of int, shape (n,)
        Numbers that the program gives them, ascending.
    points : ndarray, shape (n, 3)
        Coordinates, in the file's unit.
    sets : mapping of str to ndarray of int
        Numbers of the nodes of every named set.
    dofs : DofNames or None
        Order of the rows of the model's matrices, where the file says.
    frames : mapping of int to ndarray, shape (3, 3)
        Nodes whose displacements have directions of their own, the columns of the matrix.
    """

    numbers: NDArray[np.int64]
    points: NDArray[np.float64]
    sets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    dofs: DofNames | None = None
    frames: Mapping[int, NDArray[np.float64]] = field(default_factory=dict)


def read_nodes(path: Path) -> NodeTable:
    """Nodes of an Abaqus or CalculiX deck (.inp), of Nastran bulk data or an Ansys archive (.cdb).

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is of another kind, holds no nodes, or a node twice.
    """
    suffix = path.suffix.lower()
    if suffix == ".cdb":
        return _archive_nodes(path)
    if suffix not in (".inp", *_NASTRAN):
        check_plain_file(path, _EXPECTED, _MOST_BYTES)
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected {_EXPECTED}")
    if suffix == ASSEMBLY and not punch_of(path).is_file():
        raise FileNotFoundError(
            f"{punch_of(path)}: no such file; expected the punch file of {path.name} in its "
            "folder: its EXTRN entry says which components of every grid the matrices have"
        )
    if suffix == ".inp":
        content = plain_content(path, _EXPECTED, _MOST_BYTES)
        nodes = _nodes_of_deck(path, content)
        _refuse_turned_nodes(path, content)
        return nodes
    size = check_plain_file(path, _EXPECTED, _MOST_BYTES, text=True)
    return in_child(_nastran_nodes, path, size, about=path, what="pyyeti")


def deck_nodes(path: Path) -> NodeTable:
    """Nodes and sets of an Abaqus or CalculiX deck, whatever the directions of its matrices.

    Raises
    ------
    FileNotFoundError, ValueError
        As :func:`read_nodes`.
    """
    return _nodes_of_deck(path, plain_content(path, _EXPECTED, _MOST_BYTES))


def _nodes_of_deck(path: Path, content: bytes) -> NodeTable:
    try:
        return _deck_nodes(content)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _refuse_turned_nodes(path: Path, content: bytes) -> None:
    # Abaqus keeps the rows of such nodes in their own directions, CalculiX does not.
    line = re.search(rb"(?im)^[ \t]*\*[ \t]*TRANSFORM\b.*", content)
    if line is not None:
        raise ValueError(
            f"{path}: {shown(line[0].decode('latin-1').strip())} gives nodes directions of their "
            "own; expected those of the model: delete it and compute the matrices again "
            "(CalculiX: delete it here alone)"
        )


def numbers_in_turn(path: Path) -> NDArray[np.int64]:
    """Numbers of the nodes of a deck in the order in which they stand there."""
    content = plain_content(path, _EXPECTED, _MOST_BYTES)
    tables = [
        number_table(full_rows(block.data), 4, "the nodes")
        for block in deck_blocks(content)
        if block.name == "*NODE"
    ]
    return whole_numbers(
        np.concatenate([np.zeros(0), *(table[:, 0] for table in tables)]), "node numbers"
    )


def node_table(
    numbers_of_nodes: NDArray[np.int64],
    points: NDArray[np.float64],
    sets: Mapping[str, NDArray[np.int64]] | None = None,
) -> NodeTable:
    """Table of nodes in ascending order.

    Raises
    ------
    ValueError
        Where a node stands twice with other coordinates, or a coordinate is not finite.
    """
    order = np.argsort(numbers_of_nodes, kind="stable")
    ordered, coordinates = numbers_of_nodes[order], points[order]
    if not np.isfinite(coordinates).all():
        raise ValueError("a coordinate is not finite; expected finite numbers")
    again = np.flatnonzero(np.diff(ordered) == 0)
    if (coordinates[again] != coordinates[again + 1]).any():
        raise ValueError(f"node {ordered[again[0]]} occurs twice; expected every node once")
    first = np.append(True, np.diff(ordered) > 0)
    return NodeTable(ordered[first], coordinates[first], sets or {})


def _archive_nodes(path: Path) -> NodeTable:
    """Nodes and node components of an Ansys archive."""
    archive = read_archive(path)
    if archive.turned:
        raise ValueError(
            f"{path}: node {archive.turned[0]} has directions of its own (NROTAT); expected those "
            "of the model: turn the nodes back before the matrices and CDWRITE"
        )
    try:
        return node_table(archive.numbers, archive.points, archive.node_sets)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _deck_nodes(content: bytes) -> NodeTable:
    refuse_made_nodes(content)
    tables: list[NDArray[np.float64]] = []
    sets: dict[str, list[NDArray[np.int64]]] = {}
    for block in deck_blocks(content):
        name = block.settings.get("NSET", "").replace(" ", "").upper()
        if block.name == "*NODE":
            tables.append(number_table(full_rows(block.data), 4, "the nodes"))
            if name:
                sets.setdefault(name, []).append(whole_numbers(tables[-1][:, 0], "node numbers"))
        elif block.name == "*NSET" and name:
            members = _members(block.data, "GENERATE" in block.settings, sets)
            sets.setdefault(name, []).append(members)
    if not sum(map(len, tables)):
        raise ValueError("no *NODE with coordinates; expected the file that holds the nodes")
    table = np.concatenate(tables)
    joined = {name: np.unique(np.concatenate(blocks)) for name, blocks in sets.items()}
    return node_table(whole_numbers(table[:, 0], "node numbers"), table[:, 1:], sets=joined)


def _members(
    data: bytes, generate: bool, sets: Mapping[str, list[NDArray[np.int64]]]
) -> NDArray[np.int64]:
    """Numbers of the nodes of a set: listed, by names of sets, or as first, last and step."""
    if generate:
        members: list[NDArray[np.int64]] = []
        for line in data.split(b"\n"):
            if line.strip():
                limits = whole_numbers(numbers(line, "a set"), "a set").tolist()
                first, last, step = (*limits, 1, 1)[:3] if len(limits) in (2, 3) else (1, 0, 1)
                if not 0 <= last - first < _MOST_GENERATED or step < 1:
                    raise ValueError(f"a set from {limits}; expected first, last and step")
                members.append(np.arange(first, last + 1, step))
        return np.concatenate([np.zeros(0, dtype=np.int64), *members])
    words = data.decode("latin-1").replace(",", " ").split()
    listed = [word for word in words if word.upper() not in sets]
    named = [member for word in words for member in sets.get(word.upper(), [])]
    numbered = whole_numbers(numbers(" ".join(listed).encode("latin-1"), "a set"), "a set")
    return np.concatenate([numbered, *named])


def _nastran_nodes(path: Path, size: int) -> NodeTable:
    try:
        with limited(60 + size // 20_000, 1_000_000_000 + 400 * size):
            if path.suffix.lower() == ASSEMBLY:
                return _assembly_nodes(path)
            return _bulk_nodes(list(bulk_entries(path.read_bytes())))
    except _NamedError:
        raise
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    except Exception as error:
        # pyyeti's errors are of every kind: a damaged file meets its code unchecked.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{path}: no sound bulk data with GRID entries ({reason})") from error


def _bulk_nodes(entries: list[Entry]) -> NodeTable:
    in_frames = False
    grids = []
    for entry in entries:
        if entry.name == "GRID":
            grids.append(grid_of(entry))
            in_frames |= any(entry.field(at) not in ("", 0) for at in (1, 5))
        elif entry.name == "GRDSET":
            refuse_default_systems(entry, 1, 5)
    if not grids:
        raise ValueError("no GRID entries; expected the file that holds the nodes")
    if in_frames:
        return _of_uset(grids_in_frames(entries))
    numbers_of_grids, coordinates = zip(*grids, strict=True)
    return node_table(np.array(numbers_of_grids, dtype=np.int64), np.array(coordinates))


class _NamedError(ValueError):
    """An error that names its file and its cause."""


def punch_of(path: Path) -> Path:
    """The punch file that belongs to an assembly file: of the same stem."""
    return path.with_suffix(".pch" if path.suffix == ".asm" else ".PCH")


def _assembly_nodes(path: Path) -> NodeTable:
    """Nodes of an assembly file; components of every grid and their order from EXTRN."""
    uset = bulk.asm2uset(str(path), try_rdextrn=False, follow_includes=False)[0]
    punch = punch_of(path)
    try:
        if bulk.rdcards(str(punch), "extrn", follow_includes=False) is None:
            raise ValueError("no EXTRN entry; expected the one of its superelement")
        dofs = bulk.rdextrn(str(punch), follow_includes=False)
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise _NamedError(f"{punch}: no sound bulk data with EXTRN ({reason})") from error
    names = DofNames(dofs[:, 0], np.where(dofs[:, 1] == 0, SCALAR, dofs[:, 1] - 1))
    return replace(_of_uset(uset), dofs=names)


def _of_uset(uset: pd.DataFrame) -> NodeTable:
    """Nodes and directions from pyyeti's table of degrees of freedom.

    Six rows a grid: place; number and type of the directions' system; its origin; its axes.
    """
    index = np.array(uset.index.tolist(), dtype=np.int64)
    values = uset.iloc[:, 1:].to_numpy(dtype=np.float64)
    first = np.flatnonzero(index[:, 1] == 1)
    kinds = values[first + 1, 1]
    if (kinds != _RECTANGULAR).any():
        odd = int(index[first[kinds != _RECTANGULAR][0], 0])
        raise ValueError(
            f"grid {odd} has displacements in a cylindrical or spherical system; expected "
            "rectangular ones"
        )
    frames = {
        int(index[row, 0]): values[row + 3 : row + 6]
        for row in first
        if not np.array_equal(values[row + 3 : row + 6], np.eye(3))
    }
    return replace(node_table(index[first, 0], values[first]), frames=frames)


def read_dofs(path: Path) -> DofNames:
    """Names of the rows of a matrix: CalculiX .dof (node.direction), Ansys .mapping.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where a line is no name of a degree of freedom, or one stands twice.
    """
    content = plain_content(path, "names of degrees of freedom (.dof, .mapping)", _MOST_BYTES)
    try:
        names = _mapping(content) if path.suffix.lower() == ".mapping" else _dotted(content)
        if not len(names) or len(np.unique(names.keys)) != len(names):
            raise ValueError(f"{len(names)} names, not all different; expected one a row")
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return names


def _dotted(content: bytes) -> DofNames:
    if content.count(b".") != len(content.split()):
        raise ValueError("not every word is node.direction; expected as in 17.2")
    table = whole_numbers(number_table(content.replace(b".", b" "), 2, "the names"), "the names")
    return _names(table[:, 0], table[:, 1] - 1)


def _mapping(content: bytes) -> DofNames:
    rows = re.findall(rb"^\s*(\d{1,12})\s+(\d{1,12})\s+([A-Z]+)\s*$", content, re.MULTILINE)
    odd = [word.decode() for _, _, word in rows if word.decode() not in _DIRECTIONS]
    if odd or not rows:
        what = f"direction {shown(odd[0])}" if odd else "no lines of equation, node, direction"
        raise ValueError(f"{what}; expected {', '.join(_DIRECTIONS)}")
    equations = np.array([int(number) for number, _, _ in rows])
    if not np.array_equal(np.sort(equations), np.arange(1, len(rows) + 1)):
        raise ValueError("the equations are not numbered from 1 on; expected every one once")
    order = np.argsort(equations)
    nodes = np.array([int(node) for _, node, _ in rows], dtype=np.int64)[order]
    directions = np.array([_DIRECTIONS[word.decode()] for _, _, word in rows])[order]
    return _names(nodes, directions)


def _names(nodes: NDArray[np.int64], components: NDArray[np.int64]) -> DofNames:
    if len(components) and not (0 <= components.min() and components.max() < 6):
        raise ValueError("a direction is none of 1 to 6; expected displacements and rotations")
    return DofNames(nodes, components)
