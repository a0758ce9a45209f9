"""Parts of a mesh file of another program: nodes, elements and groups, as the file names them.

Abaqus ``.inp`` by meshio, Nastran ``.bdf`` by pyyeti, I-deas ``.unv`` and Salome ``.med`` by gmsh:
of the readers at hand those that keep the groups (gmsh reads no ``.inp``; meshio no ``.unv``, and
of ``.med`` no names).
"""

import io
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import gmsh
import meshio
import meshio.abaqus
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.child_process import in_child, limited
from carrierflex.files.shown_values import shortened
from carrierflex.geometry.given_meshes.abaqus_decks import deck_blocks, full_rows
from carrierflex.geometry.given_meshes.nastran_decks import nastran_mesh
from carrierflex.geometry.half_sector import quiet_geometry

#: Suffixes that are read here, and what the files are.
FORMATS = {
    ".inp": "an Abaqus mesh (.inp)",
    ".bdf": "a Nastran mesh (.bdf)",
    ".nas": "a Nastran mesh (.nas)",
    ".unv": "an I-deas universal file (.unv)",
    ".med": "a Salome mesh (.med)",
}
#: gmsh's element types that can be computed with, and their name in meshio.
_KINDS = {2: "triangle", 4: "tetra", 9: "triangle6", 11: "tetra10"}
#: Kinds that meshio has no name for, or a wrong one, for its own table: surfaces as gmsh writes
#: them, hybrid tetrahedra. Decks are read in a process of their own, so that nothing else sees them
#: there.
_MORE_KINDS = {"CPS6": "triangle6", "CPS8": "quad8", "CPS9": "quad9", "C3D4H": "tetra"}
#: A kind that meshio can read and then trips over, so that it is refused by its name.
_MORE_DIMENSIONS = {"wedge15": 3}
_KINDS_OF_DECKS = meshio.abaqus._abaqus.abaqus_to_meshio_type
#: Members that one line of a generated set may name.
_MOST_GENERATED = 30_000_000
_NOTHING = np.zeros(0, dtype=np.int64)
Mesh = TypeVar("Mesh")
_GMSH_TET10 = 11
#: Version of .msh from which groups belong to entities, no longer to elements.
_ENTITIES_SINCE = 4
#: gmsh numbers the last two mid-side nodes of a quadratic tetrahedron the other way round.
_FROM_GMSH_TET10 = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]


@dataclass(frozen=True, eq=False)
class ForeignMesh:
    """What a file holds.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes in the file's unit.
    blocks : list of tuple
        Element type, name of the group (empty for none) and node numbers from 0, shape (k, m).
    node_sets : dict of str to ndarray of int
        Groups of nodes.
    """

    points: NDArray[np.float64]
    blocks: list[tuple[str, str, NDArray[np.int64]]]
    node_sets: dict[str, NDArray[np.int64]]


def read_foreign_mesh(path: Path, size: int) -> ForeignMesh:
    """Read a file of `size` bytes.

    Raises
    ------
    ValueError
        Where it cannot be read, or holds elements that are neither tetrahedra nor on a surface.
    """
    return read_in_child(
        path,
        size,
        f"{FORMATS[path.suffix.lower()]} of tetrahedra, whole",
        abaqus=abaqus_mesh,
        nastran=_by_pyyeti,
        others=_by_gmsh,
    )


def read_in_child(
    path: Path,
    size: int,
    expected: str,
    *,
    abaqus: Callable[[Path], Mesh],
    nastran: Callable[[Path], Mesh],
    others: Callable[[Path], Mesh],
) -> Mesh:
    """Read a mesh file of `size` bytes in a process of its own, with limits.

    Parameters
    ----------
    path, size : Path, int
        File and its bytes.
    expected : str
        What the file should be, for the error.
    abaqus, nastran, others : callable
        ``(path) -> mesh`` by meshio, by pyyeti and by gmsh.

    Raises
    ------
    ValueError
        With the reader's reason, where it cannot be read.
    """
    reader, who = {
        ".inp": (abaqus, "meshio"),
        ".bdf": (nastran, "pyyeti"),
        ".nas": (nastran, "pyyeti"),
    }.get(path.suffix.lower(), (others, "gmsh"))
    return in_child(_read, reader, path, size, expected, about=path, what=who)


def _read(reader: Callable[[Path], Mesh], path: Path, size: int, expected: str) -> Mesh:
    try:
        with limited(60 + size // 200_000, 500_000_000 + 100 * size):
            return reader(path)
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        # Messages of this program say what is expected; those of libraries are of any length.
        message = reason if "; expected " in reason else f"{shortened(reason)}; expected {expected}"
        raise ValueError(f"{path}: {message}") from error


def abaqus_mesh(path: Path) -> ForeignMesh:
    """Mesh of a deck; an element belongs to the smallest set that it is in."""
    _KINDS_OF_DECKS.update(_MORE_KINDS)
    meshio._mesh.topological_dimension.update(_MORE_DIMENSIONS)
    deck = io.StringIO(_plain_deck(path.read_bytes()))
    deck.name = str(path)  # where *INCLUDE looks
    try:
        mesh = meshio.abaqus._abaqus.read_buffer(deck)
    except KeyError as error:
        raise ValueError(
            f"an element or a set names number {error.args[0]}, which nothing of this file has; "
            "expected all nodes and elements in *NODE and *ELEMENT"
        ) from error
    members: dict[str, list[NDArray[np.int64]]] = {}
    for name, of_blocks in mesh.cell_sets.items():
        joined = members.setdefault(name.partition("#")[2], [_NOTHING] * len(mesh.cells))
        for number, rows in enumerate(of_blocks):
            joined[number] = np.append(joined[number], np.asarray(rows, dtype=np.int64))
    # The smallest set that an element is in names its body: a set of all of them says nothing. Of
    # two alike that of *ELSET, which meshio lists first: *ELEMENT has the preprocessor's name.
    listed = reversed(members.items())
    sets = sorted(listed, key=lambda item: -sum(map(len, item[1])))
    blocks = []
    for number, block in enumerate(mesh.cells):
        names = np.full(len(block.data), "", dtype=object)
        for name, of_blocks in sets:
            names[of_blocks[number]] = name
        for name in np.unique(names):
            nodes = block.data[names == name].astype(np.int64)
            blocks.append((block.type, str(name), nodes))
    node_sets = {name: np.asarray(nodes, np.int64) for name, nodes in mesh.point_sets.items()}
    return ForeignMesh(np.asarray(mesh.points, np.float64), blocks, node_sets)


def _plain_deck(content: bytes) -> str:
    """The deck without what meshio trips over; sets of elements are called ``number#name``.

    It takes nodes in one block before all elements, generated sets in one line of three numbers
    only, and sets for those of other blocks where a name stands twice or a block of elements has
    none.
    """
    nodes: list[str] = []
    elements: list[str] = []
    sets: list[str] = []
    element_numbers: set[int] = set()
    for number, block in enumerate(deck_blocks(content)):
        data = block.data.decode("latin-1").lstrip("\r\n")
        name = block.settings.get("ELSET", "")
        if block.name == "*NODE":
            # Exponents of Fortran's double precision.
            nodes.append(re.sub("[Dd]", "E", full_rows(block.data).decode("latin-1")))
        elif block.name == "*ELEMENT":
            kind = block.settings.get("TYPE", "").upper()
            _refuse_repeated(kind, data, element_numbers)
            elements.append(f"*ELEMENT, TYPE={kind}, ELSET={number}#{name}\n{data}")
        elif block.name in ("*ELSET", "*NSET"):
            if "GENERATE" in block.settings:
                data = _listed_members(data, block.name)
            if block.name == "*NSET":
                sets.append(f"*NSET, NSET={block.settings.get('NSET', '')}\n{data}")
            elif data.strip()[:1].isdigit():
                # A set of sets is never the smallest one.
                sets.append(f"*ELSET, ELSET={number}#{name}\n{data}")
    rows = "\n".join(filter(None, nodes))
    numbers = Counter(row.partition(",")[0].strip() for row in rows.splitlines())
    if again := [number for number, count in numbers.items() if count > 1]:
        raise ValueError(f"node {again[0]} occurs twice; expected every node once")
    return "\n".join([f"*NODE\n{rows}", *elements, *sets, ""]) if rows else ""


def _refuse_repeated(kind: str, data: str, numbers: set[int]) -> None:
    """Add the numbers of a block's elements to `numbers`; refuse one that is there."""
    if kind not in _KINDS_OF_DECKS:
        return
    n_nodes = meshio._common.num_nodes_per_cell[_KINDS_OF_DECKS[kind]]
    for number in map(int, data.replace(",", " ").split()[:: n_nodes + 1]):
        if number in numbers:
            raise ValueError(
                f"*ELEMENT, TYPE={kind}: element {number} occurs twice; expected every one once"
            )
        numbers.add(number)


def _listed_members(data: str, keyword: str) -> str:
    """Members of a generated set in full."""
    lines = []
    for line in filter(str.strip, data.splitlines()):
        limits = [int(word) for word in line.split(",") if word.strip()]
        first, last, step = (*limits, 1)[:3] if len(limits) in (2, 3) else (1, 0, 0)
        if not 0 <= last - first < _MOST_GENERATED or step < 1:
            raise ValueError(
                f"{keyword}, GENERATE with {line!r}; expected first, last and step, ascending"
            )
        lines.append(", ".join(map(str, range(first, last + 1, step))))
    return "\n".join([*lines, ""])


def _by_pyyeti(path: Path) -> ForeignMesh:
    _, points, blocks = nastran_mesh(path)
    return ForeignMesh(points, blocks, {})


def _by_gmsh(path: Path) -> ForeignMesh:
    with quiet_geometry():
        gmsh.merge(str(path))
        _, points, row = gmsh_nodes()
        return ForeignMesh(points, list(_gmsh_blocks(row)), {})


def _gmsh_blocks(row: NDArray[np.int64]) -> Iterator[tuple[str, str, NDArray[np.int64]]]:
    for dimension in (2, 3):
        for block in gmsh_elements(dimension, row):
            rows = block.rows[:, _FROM_GMSH_TET10] if block.kind == _GMSH_TET10 else block.rows
            yield _KINDS.get(block.kind, block.words), block.group, rows


def refuse_lost_groups(path: Path) -> None:
    """Raise ValueError where a .msh file names groups and does not say whose they are."""
    content = path.read_bytes()
    version = re.search(rb"\$MeshFormat\s+(\d+)", content)
    newer = version is not None and int(version[1]) >= _ENTITIES_SINCE
    if newer and b"$PhysicalNames" in content and b"$Entities" not in content:
        raise ValueError(
            "no section $Entities, which says in which physical group an element is; write it "
            "whole, or as version 2.2"
        )


def gmsh_nodes() -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Numbers (n,) and places (n, 3) of the nodes of gmsh's model, and the row of each number."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    row = np.zeros(int(tags.max(initial=0)) + 1, dtype=np.int64)
    row[tags] = np.arange(len(tags))
    return tags.astype(np.int64), coordinates.reshape(-1, 3), row


@dataclass(frozen=True, eq=False)
class GmshElements:
    """Elements of one kind and group in gmsh's model.

    Parameters
    ----------
    kind : int
        gmsh's number of the kind.
    words : str
        gmsh's name of it.
    unit_nodes : ndarray, shape (m, d)
        Nodes on gmsh's unit element.
    group : str
        Name of the group; the entity's number where it has none.
    rows : ndarray of int, shape (k, m)
        Rows of the nodes.
    """

    kind: int
    words: str
    unit_nodes: NDArray[np.float64]
    group: str
    rows: NDArray[np.int64]


def gmsh_elements(dimension: int, row: NDArray[np.int64]) -> Iterator[GmshElements]:
    """Elements of a dimension in gmsh's model, `row` the rows of its numbers of nodes."""
    for _, entity in gmsh.model.getEntities(dimension):
        group = _group_of_entity(dimension, entity)
        kinds, _, nodes = gmsh.model.mesh.getElements(dimension, entity)
        for kind, numbers in zip(kinds, nodes, strict=True):
            words, _, _, n_nodes, coordinates, _ = gmsh.model.mesh.getElementProperties(kind)
            rows = row[numbers.astype(np.int64)].reshape(-1, n_nodes)
            on_unit = np.reshape(np.asarray(coordinates, dtype=np.float64), (n_nodes, -1))
            yield GmshElements(int(kind), words, on_unit, group, rows)


def _group_of_entity(dimension: int, entity: int) -> str:
    """Name of the smallest physical group of an entity; its number where there is none."""
    groups = gmsh.model.getPhysicalGroupsForEntity(dimension, entity)
    names = [gmsh.model.getPhysicalName(dimension, group).strip() for group in groups]
    named = [name for name in names if name]
    return named[0] if named else str(entity)
