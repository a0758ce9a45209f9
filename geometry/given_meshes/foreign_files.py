"""Parts of a mesh file of another program: nodes, elements and groups, as the file names them.

Abaqus ``.inp`` by meshio, Nastran ``.bdf``, I-deas ``.unv`` and Salome ``.med`` by gmsh: of the
readers at hand those that keep the groups (gmsh reads no ``.inp``; meshio no ``.unv``, and of
``.bdf`` and ``.med`` no names).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import gmsh
import meshio
import meshio.abaqus
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.child_process import in_child, limited
from carrierflex.files.shown_values import shortened
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
_GMSH_TET10 = 11
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
    reader = abaqus_mesh if path.suffix.lower() == ".inp" else _by_gmsh
    who = "meshio" if reader is abaqus_mesh else "gmsh"
    return in_child(_read, reader, path, size, about=path, what=who)


def _read(reader: Callable[[Path], ForeignMesh], path: Path, size: int) -> ForeignMesh:
    try:
        with limited(60 + size // 200_000, 500_000_000 + 100 * size):
            return reader(path)
    except Exception as error:
        reason = shortened(" ".join(str(error).split())) or type(error).__name__
        raise ValueError(
            f"{path}: {reason}; expected {FORMATS[path.suffix.lower()]} of tetrahedra, whole"
        ) from error


def abaqus_mesh(path: Path) -> ForeignMesh:
    """Mesh of a deck; an element belongs to the smallest set that it is in."""
    _KINDS_OF_DECKS.update(_MORE_KINDS)
    meshio._mesh.topological_dimension.update(_MORE_DIMENSIONS)
    mesh = meshio.abaqus.read(path)
    # The smallest set that an element is in names its body: a set of all of them says nothing. Of
    # two alike that of *ELSET, which meshio lists first: *ELEMENT has the preprocessor's name.
    listed = reversed(mesh.cell_sets.items())
    sets = sorted(listed, key=lambda item: -sum(len(part) for part in item[1]))
    blocks = []
    for number, block in enumerate(mesh.cells):
        names = np.full(len(block.data), "", dtype=object)
        for name, members in sets:
            names[np.asarray(members[number], dtype=np.int64)] = name
        for name in np.unique(names):
            nodes = block.data[names == name].astype(np.int64)
            blocks.append((block.type, str(name), nodes))
    node_sets = {name: np.asarray(nodes, np.int64) for name, nodes in mesh.point_sets.items()}
    return ForeignMesh(np.asarray(mesh.points, np.float64), blocks, node_sets)


def _by_gmsh(path: Path) -> ForeignMesh:
    with quiet_geometry():
        gmsh.merge(str(path))
        _, points, row = gmsh_nodes()
        return ForeignMesh(points, list(_gmsh_blocks(row)), {})


def _gmsh_blocks(row: NDArray[np.int64]) -> Iterator[tuple[str, str, NDArray[np.int64]]]:
    for dimension in (2, 3):
        for part in gmsh_elements(dimension, row):
            rows = part.rows[:, _FROM_GMSH_TET10] if part.kind == _GMSH_TET10 else part.rows
            yield _KINDS.get(part.kind, part.words), part.group, rows


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
    places : ndarray, shape (m, d)
        Nodes on gmsh's unit element.
    group : str
        Name of the group; the entity's number where it has none.
    rows : ndarray of int, shape (k, m)
        Rows of the nodes.
    """

    kind: int
    words: str
    places: NDArray[np.float64]
    group: str
    rows: NDArray[np.int64]


def gmsh_elements(dimension: int, row: NDArray[np.int64]) -> Iterator[GmshElements]:
    """Elements of a dimension in gmsh's model, `row` the rows of its numbers of nodes."""
    for _, entity in gmsh.model.getEntities(dimension):
        group = _group_of_entity(dimension, entity)
        kinds, _, nodes = gmsh.model.mesh.getElements(dimension, entity)
        for kind, numbers in zip(kinds, nodes, strict=True):
            words, _, _, n_nodes, places, _ = gmsh.model.mesh.getElementProperties(kind)
            rows = row[numbers.astype(np.int64)].reshape(-1, n_nodes)
            on_unit = np.reshape(np.asarray(places, dtype=np.float64), (n_nodes, -1))
            yield GmshElements(int(kind), words, on_unit, group, rows)


def _group_of_entity(dimension: int, entity: int) -> str:
    """Name of the smallest physical group of an entity; its number where there is none."""
    groups = gmsh.model.getPhysicalGroupsForEntity(dimension, entity)
    names = [gmsh.model.getPhysicalName(dimension, group).strip() for group in groups]
    named = [name for name in names if name]
    return named[0] if named else str(entity)
