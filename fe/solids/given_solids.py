"""A body of a mesh of any solid elements, with an interfaces file of materials and pilots."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.fe.materials import Material
from carrierflex.fe.matrices.given_structure import GivenBody, body_of
from carrierflex.fe.matrices.nastran_links import with_linked_pilots
from carrierflex.fe.matrices.node_files import NodeTable, deck_nodes, numbers_in_turn
from carrierflex.fe.matrices.stored_matrix import DofNames, StoredMatrix
from carrierflex.fe.solids.solid_matrices import (
    linear_warnings,
    refuse_inverted,
    solid_matrices,
)
from carrierflex.geometry.given_meshes.other_entries import LINKS_REPLACED
from carrierflex.geometry.given_meshes.solid_files import SolidMesh, read_solid_mesh

if TYPE_CHECKING:
    from carrierflex.fe.matrices.interface_tables import InterfacesDocument


def solid_body(path: Path, document: "InterfacesDocument") -> GivenBody:
    """Body of a mesh file: matrices by finite elements, the rest as for those that are given.

    Parameters
    ----------
    path : Path
        Mesh file; coordinates in the document's unit of length.
    document : InterfacesDocument
        Materials by group of elements, pilots and sensors.

    Returns
    -------
    GivenBody
        The body in SI units; groups of one mesh share their nodes and are one body.

    Raises
    ------
    FileNotFoundError, ValueError
        Where the file is none that can be computed with, a group has no material or is none of the
        mesh, elements are inverted; and as
        :func:`carrierflex.fe.matrices.given_structure.body_of`.
    """
    document = with_linked_pilots(document, path)
    mesh = read_solid_mesh(path, numbers_in_turn).without_unused_nodes()
    if document.links:
        mesh = replace(mesh, left_out=tuple(t for t in mesh.left_out if LINKS_REPLACED not in t))
    units = document.units
    in_metres = replace(mesh, points=mesh.points * units.length)
    refuse_inverted(in_metres, str(path))
    K, M = solid_matrices(in_metres, _materials(mesh, document, path))
    # body_of takes matrices in the document's units.
    factor = units.length / units.force
    names = DofNames(np.repeat(mesh.numbers, 3), np.tile(np.arange(3), len(mesh.numbers)))
    K_given, M_given = (StoredMatrix(A * factor, names) for A in (K, M))
    try:
        body = body_of(K_given, M_given, _nodes(mesh, path), document)
    except ValueError as error:
        raise ValueError("; ".join((f"{path}: {error}", *mesh.left_out))) from error
    return replace(body, warnings=(*mesh.left_out, *linear_warnings(mesh), *body.warnings))


def _nodes(mesh: SolidMesh, path: Path) -> NodeTable:
    """Nodes with the sets of the file; those of a deck as its own reader knows them."""
    order = np.argsort(mesh.numbers)
    if path.suffix.lower() == ".inp":
        sets = deck_nodes(path).sets
        nodes_of_set = {name: nodes[np.isin(nodes, mesh.numbers)] for name, nodes in sets.items()}
    else:
        nodes_of_set = {name: mesh.numbers[rows] for name, rows in mesh.node_sets.items()}
    return NodeTable(mesh.numbers[order], mesh.points[order], nodes_of_set)


def _materials(mesh: SolidMesh, document: "InterfacesDocument", path: Path) -> dict[str, Material]:
    """Material of every group; the only one of a file whose groups are not told apart."""
    groups = list(dict.fromkeys(group for _, group, _ in mesh.blocks))
    tables = {
        name: Material(name, table.E, table.nu, table.rho)
        for name, table in document.materials.items()
    }
    if len(groups) == 1 and len(tables) == 1:
        return dict.fromkeys(groups, *tables.values())
    by_name = {name.upper(): material for name, material in tables.items()}
    without = [group for group in groups if group.upper() not in by_name]
    unknown = [name for name in tables if name.upper() not in {group.upper() for group in groups}]
    if without or unknown:
        listed = ", ".join(repr(group) for group in groups)
        raise ValueError(
            f"{path}: groups of elements {listed}, materials for {', '.join(tables)}; expected a "
            "table [materials.GROUP] for each group"
        )
    return {group: by_name[group.upper()] for group in groups}
