"""Standard input data of flexible bodies (SID_FEM, ASCII), as Simpack's and Modelica's tools write.

Description: Wallrapp (1994), Mechanics of Structures and Machines 22(3), 315-337, in the ASCII form
of 1994 that PY_SID and this program write. Orders of entries as in
:mod:`carrierflex.reduction.exports.sid_files`. Inertia to first order in the coordinates gives the
integrals of :class:`carrierflex.reduction.ffrf_data.FfrfData` back:

    S = tr(J) 1 / 2 - J,    P + Pᵀ from J1,  P - Pᵀ from Cr,    Q from Me, Oe1 and Cr1
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.plain_files import plain_content
from carrierflex.files.shown_values import shown
from carrierflex.reduction.ffrf_data import FfrfData
from carrierflex.reduction.imports.floating_frame import (
    FrameBody,
    free_body,
    without_invariants,
)
from carrierflex.reduction.imports.imported_body import ImportedBody

_EXPECTED = "standard input data of a flexible body (.SID_FEM)"
_MOST_BYTES = 1_000_000_000
_MOST_MODES, _MOST_NODES, _MOST_ENTRIES = 1_000, 20_000, 40_000_000
_ZERO, _DIAGONAL, _SYMMETRIC, _FULL, _IDENTITY = range(5)
_COUNTS = ("order", "nrow", "ncol", "nq", "nqn", "structure")
_ENTRY = re.compile(r"\s*(.+?)\s*=\s*(.*?)\s*")
_INDEX = re.compile(r"m([01n])\s*\(([\s\d,]{3,60})\)")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([EDed][-+]?\d{1,3})?")
#: Blocks of the inertia integrals and of stiffness; others are said to be left out.
_KNOWN = ("mdCM", "J", "Ct", "Cr", "Me", "Gr", "Ge", "Oe", "ksigma", "Ke", "De")
_OUR_PILOTS = re.compile(r"; nodes (\d+ .+?); no geometric stiffening")
#: Share of the mass that files of twelve digits leave of a sum.
_ROUNDING = 1e-6
#: Rows of J: xx yy zz xy xz yz.
_J_PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_EPSILON = np.zeros((3, 3, 3))
_EPSILON[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
_EPSILON[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


@dataclass
class _Block:
    """A matrix expanded in the coordinates: sizes, then the entries by index from 1."""

    counts: dict[str, int] = field(default_factory=dict)
    entries: dict[str, dict[tuple[int, ...], float]] = field(
        default_factory=lambda: {"0": {}, "1": {}, "n": {}}
    )


@dataclass
class _Node:
    name: str
    frame: str = "body ref"
    blocks: dict[str, _Block] = field(default_factory=dict)


@dataclass
class _File:
    header: str
    plain: dict[str, str] = field(default_factory=dict)
    nodes: list[_Node] = field(default_factory=list)
    blocks: dict[str, _Block] = field(default_factory=dict)


def read_sid(path: Path) -> ImportedBody:
    """Free body of standard input data.

    Pilots are the nodes that move independently, in the order of the file. Geometric stiffening and
    shapes of second order are left out and reported.

    Raises
    ------
    FileNotFoundError, ValueError
        Where there is no such file, it is cut short, states sizes that contradict each other, or
        has no node that could be a pilot; one line that names the file.
    """
    content = plain_content(path, _EXPECTED, _MOST_BYTES)
    try:
        return _body(_parsed(content.decode("latin-1")), path)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _parsed(text: str) -> _File:
    lines = iter(text.splitlines())
    file = _File(next(lines, ""))
    node: _Node | None = None
    block: tuple[str, _Block] | None = None
    ended = False
    for number, line in enumerate(lines, start=2):
        words = line.split()
        entry = _ENTRY.fullmatch(line)
        if not words:
            continue
        if entry is not None and words[:2] != ["new", "modal"]:
            key, value = entry.groups()
            if key == "new node":
                node = _Node(value)
                file.nodes.append(node)
            elif block is not None:
                _add(block[1], key, value, f"line {number}, {block[0]}")
            elif node is not None and key == "rframe":
                node.frame = value
            else:
                file.plain[key] = value
        elif words[0] == "end":
            ended = ended or words[1:] == ["part"]
            node = None if words[1:] == ["node"] else node
            block = None
        elif words[0] not in ("part", "new", "refmod", "frame"):
            block = (words[0], _Block())
            (file.blocks if node is None else node.blocks)[words[0]] = block[1]
        if len(file.nodes) > _MOST_NODES:
            raise ValueError(f"more than {_MOST_NODES} nodes; expected the interface nodes alone")
    if not ended:
        raise ValueError(
            "no line 'end part': the file is cut short or of another kind; expected the ASCII form "
            "of standard input data (binary .fbi files are read by Simpack alone: export SID_FEM)"
        )
    return file


def _add(block: _Block, key: str, value: str, where: str) -> None:
    index = _INDEX.fullmatch(key)
    if index is None:
        if not re.fullmatch(r"\d{1,9}", value):
            raise ValueError(f"{where}: {shown(key)} is {shown(value)}; expected a whole number")
        block.counts[key] = int(value)
        return
    if not _NUMBER.fullmatch(value):
        raise ValueError(f"{where}: {shown(key)} is {shown(value)}; expected a number")
    index_of_entry = tuple(int(word) for word in index[2].split(",") if word.strip().isdigit())
    if len(index_of_entry) != (2 if index[1] == "0" else 3):
        raise ValueError(
            f"{where}: index {shown(index[2])}; expected row, column or row, mode, column"
        )
    block.entries[index[1]][index_of_entry] = float(value.upper().replace("D", "E"))


def _body(file: _File, path: Path) -> ImportedBody:
    r = _count(file.plain.get("nelastq", ""), "nelastq", _MOST_MODES)
    mass = file.plain.get("mass", "")
    if not _NUMBER.fullmatch(mass) or not 0.0 < float(mass.upper().replace("D", "E")) < 1e300:
        raise ValueError(f"mass is {shown(mass)}; expected a positive number in refmod")
    if len(file.nodes) * r * 6 > _MOST_ENTRIES:
        raise ValueError(
            f"{len(file.nodes)} nodes with {r} modes; expected the interface nodes alone"
        )
    data, is_complete = _invariants(file.blocks, float(mass.upper().replace("D", "E")), r)
    named = _pilot_names(file.header)
    frames = {node.frame for node in file.nodes} - {"body ref"}
    if frames:
        raise ValueError(
            f"a node's rframe is {shown(frames.pop())}; expected body ref: write nodes in the "
            "body's frame"
        )
    names = tuple(named.get(node.name, f"node_{node.name}") for node in file.nodes)
    if len(set(names)) < len(names):
        raise ValueError("a node is given twice; expected every number once")
    body = FrameBody(
        name=_name(file.header, path),
        Ke=_matrix(file.blocks, "Ke", (r, r), r),
        De=_matrix(file.blocks, "De", (r, r), r),
        data=data,
        nodes=names,
        points=np.array([_matrix(n.blocks, "origin", (3, 1), r)[:, 0] for n in file.nodes]),
        motion=np.array(
            [
                np.concatenate([_matrix(n.blocks, key, (3, r), r) for key in ("phi", "psi")])
                for n in file.nodes
            ]
        ),
    )
    imported = free_body(body, path.name, "sid", tuple(_losses(file)))
    if is_complete:
        return imported
    return without_invariants(
        imported,
        "the first order of Cr or Oe is not there, or holds more than inertia: no inertia "
        "invariants, so that mbdyn and sid cannot be written of it",
    )


def _invariants(blocks: Mapping[str, _Block], mass: float, r: int) -> tuple[FfrfData, bool]:
    """Integrals of the file's inertia about its origin; whether those of second order are there."""
    J = _inertia(_matrix(blocks, "J", (6, 1), r)[:, 0])
    J1 = _inertia(_first_order(blocks, "J", (6, 1), r)[:, :, 0])
    N = _matrix(blocks, "Ct", (r, 3), r).T
    Cr, Cr1 = _matrix(blocks, "Cr", (r, 3), r), _first_order(blocks, "Cr", (r, 3), r)
    Me, Oe1 = _matrix(blocks, "Me", (r, r), r), _first_order(blocks, "Oe", (r, 6), r)
    first = _matrix(blocks, "mdCM", (3, 1), r)[:, 0]
    P = (_second(J1) + np.einsum("abc,ja->bcj", _EPSILON, Cr)) / 2.0
    # Σ_a Oe1_aa = -2 Me of inertia alone: some programs add centrifugal stiffening.
    rest = np.abs(Oe1[:, :, :3].sum(axis=2) + 2.0 * Me).max() / np.abs(Me).max()
    if blocks["Cr"].counts.get("order", 0) < 1 or rest > _ROUNDING:
        Q = np.array([*[Me / 3.0] * 3, *[np.zeros((r, r))] * 3])
        return FfrfData(mass, first, _second(J), N, P, Q), False
    # Oe1[i, k] and Cr1[j, k]: the second index is the coordinate of the deformation.
    products = Oe1.transpose(2, 1, 0)
    turning = Cr1.transpose(2, 1, 0)
    Q = np.array(
        [
            *(products[axis] + Me for axis in range(3)),
            (products[3] + turning[2]) / 2.0,
            (products[4] + turning[0]) / 2.0,
            (products[5] - turning[1]) / 2.0,
        ]
    )
    return FfrfData(mass, first, _second(J), N, P, Q), True


def _inertia(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Symmetric tensor from its six rows, further axes carried along."""
    J = np.zeros((3, 3, *rows.shape[1:]))
    for (a, b), row in zip(_J_PLACES, rows, strict=True):
        J[a, b] = J[b, a] = row
    return J


def _second(J: NDArray[np.float64]) -> NDArray[np.float64]:
    """Second moments S of an inertia ``J = tr(S) 1 - S``."""
    identity = np.eye(3).reshape(3, 3, *(1,) * (J.ndim - 2))
    return identity * np.trace(J) / 2.0 - J


def _matrix(
    blocks: Mapping[str, _Block], name: str, shape: tuple[int, int], r: int
) -> NDArray[np.float64]:
    """Zeroth order of a block, shape (rows, columns)."""
    block = _checked(blocks, name, shape, r)
    structure = block.counts["structure"]
    if structure == _IDENTITY:
        return np.eye(*shape)
    matrix = _filled(block.entries["0"], shape, name)
    if structure == _SYMMETRIC:
        diagonal = np.diag(matrix.diagonal())
        matrix = (
            np.where(matrix.T != 0.0, matrix.T, matrix)
            if np.tril(matrix, -1).any() and np.triu(matrix, 1).any()
            else matrix + matrix.T - diagonal
        )
    return matrix


def _first_order(
    blocks: Mapping[str, _Block], name: str, shape: tuple[int, int], r: int
) -> NDArray[np.float64]:
    """First order of a block, shape (rows, coordinates, columns); zero where it has none."""
    block = _checked(blocks, name, shape, r)
    return _filled(block.entries["1"], (shape[0], r, shape[1]), name)


def _filled(
    entries: Mapping[tuple[int, ...], float], shape: tuple[int, ...], name: str
) -> NDArray[np.float64]:
    matrix = np.zeros(shape)
    if not entries:
        return matrix
    index = np.array(list(entries)) - 1
    outside = (index < 0) | (index >= np.array(shape))
    if outside.any():
        wrong = index[outside.any(axis=1)][0] + 1
        raise ValueError(
            f"{name} has an entry at {', '.join(map(str, wrong))}; expected at most "
            f"{' x '.join(map(str, shape))}"
        )
    matrix[tuple(index.T)] = list(entries.values())
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name} holds a number that is not finite; expected finite ones")
    return matrix


def _checked(blocks: Mapping[str, _Block], name: str, shape: tuple[int, int], r: int) -> _Block:
    block = blocks.get(name)
    if block is None:
        raise ValueError(f"no block {name}; expected standard input data with it")
    missing = [key for key in ("nrow", "ncol", "structure") if key not in block.counts]
    if missing:
        raise ValueError(f"{name} does not state {', '.join(missing)}; expected {_COUNTS}")
    counts = block.counts
    stated = (counts["nrow"], counts["ncol"])
    if stated != shape or counts.get("nq", r) != r or counts["structure"] > _IDENTITY:
        raise ValueError(
            f"{name} states {stated[0]} x {stated[1]}, nq {counts.get('nq')} and structure "
            f"{counts['structure']}; expected {shape[0]} x {shape[1]}, {r} as nelastq says, and a "
            "structure from 0 to 4"
        )
    return block


def _count(word: str, name: str, most: int) -> int:
    if not word.isdigit() or not 0 < int(word[:9]) <= most:
        raise ValueError(f"{name} is {shown(word)}; expected a whole number from 1 to {most}")
    return int(word[:9])


def _losses(file: _File) -> Iterator[str]:
    others = [name for name in file.blocks if name not in _KNOWN]
    if others:
        yield f"left out: {', '.join(map(shown, others[:9]))}, which a body here does not have"
    stress = file.blocks.get("ksigma")
    if stress is not None and any(stress.entries["0"].values()):
        yield "left out: ksigma, the stress of the undeformed body"
    if any(block.entries["1"] for name in ("Ke", "De") if (block := file.blocks.get(name))):
        yield "left out: the first order of Ke or De, the geometric stiffening"
    if any(node.blocks[key].entries["1"] for node in file.nodes for key in ("phi", "psi")):
        yield "left out: shapes of second order of nodes"


def _pilot_names(header: str) -> dict[str, str]:
    """Names of the pilots by number in a header that this program wrote."""
    listed = _OUR_PILOTS.search(header) if "written by carrierflex" in header else None
    if listed is None:
        return {}
    pairs = (pair.strip().partition(" ") for pair in listed[1].split(","))
    return {number: name for number, _, name in pairs if name.isprintable() and len(name) < 200}


def _name(header: str, path: Path) -> str:
    ours = re.search(r":(.{1,200}?), written by carrierflex", header)
    return ours[1] if ours and ours[1].isprintable() else path.stem
