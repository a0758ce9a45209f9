"""Solid elements of any kind from a mesh file, with groups, node sets and the file's node numbers.

Abaqus and CalculiX ``.inp`` by meshio, Nastran ``.bdf`` by pyyeti, Ansys ``.cdb`` here, gmsh
``.msh``, I-deas ``.unv`` and Salome ``.med`` by gmsh. Nodes of an element stand in the order of its
:data:`REFERENCE_NODES`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

import gmsh
import numpy as np
from numpy.typing import NDArray

from carrierflex.files.plain_files import check_plain_file
from carrierflex.geometry.given_meshes.ansys_archives import blocks_of, read_archive
from carrierflex.geometry.given_meshes.foreign_files import (
    abaqus_mesh,
    gmsh_elements,
    gmsh_nodes,
    read_in_child,
    refuse_lost_groups,
)
from carrierflex.geometry.given_meshes.nastran_decks import nastran_mesh
from carrierflex.geometry.given_meshes.other_entries import left_out
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.tet_mesh import TET_EDGES

SUFFIXES = (".inp", ".msh", ".bdf", ".nas", ".unv", ".med", ".cdb")
_MOST_BYTES = 4_000_000_000
_TET = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
_WEDGE = [(x, y, z) for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))]
_HEX = [(x, y, z) for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))]
_HEX_EDGES = (
    *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)),
    *((0, 4), (1, 5), (2, 6), (3, 7)),
)


def _with_middles(
    corners: Sequence[tuple[float, float, float]], edges: Sequence[tuple[int, int]]
) -> NDArray[np.float64]:
    points = np.array(corners)
    return np.concatenate([points, [(points[a] + points[b]) / 2.0 for a, b in edges]])


_HEX_20 = _with_middles(_HEX, _HEX_EDGES)
_HALVES = np.array(list(product((0.0, 0.5, 1.0), repeat=3)))
#: Nodes of the elements that can be computed with, on the unit element: corners, mid-sides, then
#: (27 nodes) the middles of faces and element in the order of their coordinates.
REFERENCE_NODES: Mapping[str, NDArray[np.float64]] = {
    "tetra": np.array(_TET),
    "tetra10": _with_middles(_TET, TET_EDGES),
    "hexahedron": np.array(_HEX),
    "hexahedron20": _HEX_20,
    "hexahedron27": np.concatenate(
        [_HEX_20, [p for p in _HALVES if np.count_nonzero(p == 0.5) > 1]]
    ),
    "wedge": np.array(_WEDGE),
}
_SOLID = 3
_OF_GMSH = {
    4: "tetra", 11: "tetra10", 5: "hexahedron", 17: "hexahedron20", 12: "hexahedron27", 6: "wedge",
}  # fmt: skip
#: Kinds whose nodes Abaqus numbers in the order of the reference nodes.
_OF_ABAQUS = ("tetra", "tetra10", "hexahedron", "hexahedron20", "wedge")
_SURFACE_KINDS = ("triangle", "triangle6", "quad", "quad8", "quad9", "line", "line3", "vertex")


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """Solid elements of a file.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes in the file's unit.
    numbers : ndarray of int, shape (n,)
        Their numbers in the file.
    blocks : list of tuple
        Kind of the elements, name of their group (empty for none), node rows, shape (k, m).
    node_sets : mapping of str to ndarray of int
        Rows of the nodes of named groups of nodes, edges and faces.
    left_out : tuple of str
        What the file holds beside them and is not computed with, one line each.
    """

    points: NDArray[np.float64]
    numbers: NDArray[np.int64]
    blocks: list[tuple[str, str, NDArray[np.int64]]]
    node_sets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    def without_unused_nodes(self) -> "SolidMesh":
        """Copy with the nodes of solids alone: reference points and nodes of shells left out."""
        used = np.unique(np.concatenate([nodes.ravel() for _, _, nodes in self.blocks]))
        row = np.full(len(self.points), -1, dtype=np.int64)
        row[used] = np.arange(len(used))
        blocks = [(kind, group, row[nodes]) for kind, group, nodes in self.blocks]
        sets = {name: row[nodes][row[nodes] >= 0] for name, nodes in self.node_sets.items()}
        points, numbers = self.points[used], self.numbers[used]
        return replace(self, points=points, numbers=numbers, blocks=blocks, node_sets=sets)


def read_solid_mesh(
    path: Path, numbers: Callable[[Path], NDArray[np.int64]] | None = None
) -> SolidMesh:
    """Read the solids of a mesh file.

    Parameters
    ----------
    path : Path
        Mesh file.
    numbers : callable, optional
        Gives the numbers of the nodes of an ``.inp`` in the order in which they stand there; they
        count from 1 without.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no mesh of these formats, or holds solids that cannot be computed with, shells,
        masses or springs; the message names kind and count.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(
            f"{path}: suffix {path.suffix!r}; expected a mesh, one of {', '.join(SUFFIXES)}"
        )
    if suffix == ".cdb":
        archived = _of_archive(path)
        _refuse_other_solids(archived, path)
        return archived
    size = check_plain_file(path, f"a mesh ({suffix})", _MOST_BYTES, text=suffix == ".inp")
    ignored = left_out(path)
    mesh = read_in_child(
        path,
        size,
        "a mesh of solids, whole",
        abaqus=_by_meshio,
        nastran=_by_pyyeti,
        others=_by_gmsh,
    )
    _refuse_other_solids(mesh, path)
    if suffix == ".inp":
        node_numbers = np.arange(1, len(mesh.points) + 1) if numbers is None else numbers(path)
        mesh = replace(mesh, numbers=node_numbers)
    if len(mesh.numbers) != len(mesh.points):
        raise ValueError(
            f"{path}: {len(mesh.numbers)} numbers of nodes, {len(mesh.points)} places; expected "
            "every node once in *NODE of this file"
        )
    return replace(mesh, left_out=ignored)


def _of_archive(path: Path) -> SolidMesh:
    """Solids of an Ansys archive; groups are the numbers of materials."""
    archive = read_archive(path)
    if archive.others:
        listed = ", ".join(f"{count} of {kind}" for kind, count in archive.others.items())
        raise ValueError(
            f"{path}: elements beside solids: {listed}; expected solids alone, since nothing else "
            "is assembled here: give the matrices of the whole (.full) by --stiffness and --mass, "
            "or delete from the file what is not to count"
        )
    try:
        blocks = list(blocks_of(archive))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    order = np.argsort(archive.numbers)
    rows = {
        name: order[np.searchsorted(archive.numbers, members, sorter=order)]
        for name, members in archive.node_sets.items()
        if np.isin(members, archive.numbers).all()
    }
    return SolidMesh(archive.points, archive.numbers, blocks, rows)


def _refuse_other_solids(mesh: SolidMesh, path: Path) -> None:
    others: dict[str, int] = {}
    for kind, _, nodes in mesh.blocks:
        if kind not in REFERENCE_NODES:
            others[kind] = others.get(kind, 0) + len(nodes)
    if others:
        counted = ", ".join(f"{count} elements of type {kind}" for kind, count in others.items())
        raise ValueError(
            f"{path}: {counted}; expected {', '.join(REFERENCE_NODES)}: matrices of others can be "
            "given by --stiffness and --mass"
        )
    if not mesh.blocks:
        raise ValueError(f"{path}: no solid elements; expected {', '.join(REFERENCE_NODES)}")


def _by_meshio(path: Path) -> SolidMesh:
    mesh = abaqus_mesh(path)
    blocks = [
        (kind if kind in _OF_ABAQUS else f"{kind} (of .inp)", name, nodes)
        for kind, name, nodes in mesh.blocks
        if kind not in _SURFACE_KINDS
    ]
    none = np.zeros(0, dtype=np.int64)
    return SolidMesh(mesh.points, none, blocks, mesh.node_sets)


def _by_pyyeti(path: Path) -> SolidMesh:
    numbers, points, blocks = nastran_mesh(path)
    solids = [block for block in blocks if block[0] not in _SURFACE_KINDS]
    return SolidMesh(points, numbers, solids)


def _by_gmsh(path: Path) -> SolidMesh:
    if path.suffix.lower() == ".msh":
        refuse_lost_groups(path)
    with quiet_geometry():
        gmsh.merge(str(path))
        tags, points, row = gmsh_nodes()
        return SolidMesh(points, tags, list(_gmsh_solids(row)), dict(_gmsh_sets(row)))


def _gmsh_solids(row: NDArray[np.int64]) -> Iterator[tuple[str, str, NDArray[np.int64]]]:
    for block in gmsh_elements(_SOLID, row):
        kind = _OF_GMSH.get(block.kind)
        if kind is None:
            yield block.words, block.group, block.rows
        else:
            yield kind, block.group, block.rows[:, _order(kind, block.unit_nodes)]


def _order(kind: str, unit_nodes: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which of gmsh's nodes each reference node is, by its place on gmsh's element."""
    unit = unit_nodes.copy()
    # gmsh's hexahedra, and its wedges along their axis, reach from -1 to 1.
    if kind.startswith("hexahedron"):
        unit = (unit + 1.0) / 2.0
    elif kind == "wedge":
        unit[:, 2] = (unit[:, 2] + 1.0) / 2.0
    return matching_nodes(unit, REFERENCE_NODES[kind])


def matching_nodes(points: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.int64]:
    """Number of the place at every wanted place, shape (len(wanted),)."""
    distance = np.linalg.norm(points[None] - wanted[:, None], axis=2)
    assert (distance.min(axis=1) < 1e-9).all(), "the element has nodes elsewhere"
    return np.asarray(distance.argmin(axis=1), dtype=np.int64)


def _gmsh_sets(row: NDArray[np.int64]) -> Iterator[tuple[str, NDArray[np.int64]]]:
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag).strip()
        if dimension < _SOLID and name:
            tags, _ = gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)
            yield name, np.unique(row[tags.astype(np.int64)])
