"""A structural model of the matrices of another finite element program."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from carrierflex.fe.matrices.component_names import COMPONENT_NAMES
from carrierflex.fe.matrices.dof_layout import DofLayout, standard_order
from carrierflex.fe.matrices.given_pilots import GivenInterface, given_interface
from carrierflex.fe.matrices.interface_files import read_interfaces
from carrierflex.fe.matrices.matrix_files import read_matrix
from carrierflex.fe.matrices.node_files import NodeTable, node_table, read_dofs, read_nodes
from carrierflex.fe.matrices.numbered_model import NumberedModel, numbered_model
from carrierflex.fe.matrices.rigid_freedom import free_motions, refuse_loose_parts
from carrierflex.fe.matrices.stored_matrix import DofNames, StoredMatrix
from carrierflex.fe.structural_model import StructuralModel

if TYPE_CHECKING:
    from carrierflex.fe.matrices.interface_tables import InterfacesDocument, NodesTable

#: Mass over the volume of the nodes' convex hull [kg/m^3]: beyond these limits the units are
#: unlikely to be those stated. A solid of platinum fills its hull with 21 450.
_HULL_DENSITY = (1.0, 25_000.0)
#: Force against a rigid motion, over the sum of its terms, that is told.
_TOLD_GROUNDING = 1e-9
#: Share of the sum of its terms below which a translation's mass is rounding: what is left of a
#: free body's stiffness.
_NO_MASS = 1e-6
#: Singular value of the pilots' rigid motions below which one is not held.
_HELD = 1e-8
_ALL_MOTIONS = 6
#: Names of components in an interfaces file, from that of scalar points, -1, on.
_ROW_NAMES = ("S", *COMPONENT_NAMES)


@dataclass(frozen=True, eq=False)
class GivenBody:
    """A body of another program's matrices.

    Parameters
    ----------
    structure : StructuralModel
        The body.
    layout : DofLayout
        Its degrees of freedom by the program's names, in the order of its matrices.
    warnings : tuple of str
        What about the files may be a mistake.
    """

    structure: StructuralModel
    layout: DofLayout
    warnings: tuple[str, ...]


def given_body(stiffness: Path, mass: Path, interfaces: Path) -> GivenBody:
    """Body from matrix files and an interfaces file.

    Parameters
    ----------
    stiffness, mass : Path
        Files that :func:`carrierflex.fe.matrices.matrix_files.read_matrix` knows; may be one file.
        A CalculiX ``.dof`` or Ansys ``.mapping`` file of the same name beside the stiffness names
        the rows.
    interfaces : Path
        File of units, nodes, pilots and sensors.

    Returns
    -------
    GivenBody
        The body in SI units, with what rigid motions it is free in.

    Raises
    ------
    FileNotFoundError, ValueError
        Where a file is missing or damaged, or they do not make one body; one line that names the
        file.
    """
    document = read_interfaces(interfaces)
    if document.nodes is None:
        raise ValueError(
            f"{interfaces}: table [materials] beside matrices; expected [nodes], or a mesh"
        )
    nodes = _nodes(document.nodes, interfaces)
    dofs = _dofs(document.nodes, interfaces, stiffness)
    K, M = read_matrix(stiffness, "stiffness"), read_matrix(mass, "mass")
    try:
        return body_of(K, M, nodes, document, dofs=dofs)
    except ValueError as error:
        raise ValueError(f"{stiffness}, {mass}, {interfaces}: {error}") from error


def body_of(
    stiffness: StoredMatrix,
    mass: StoredMatrix,
    nodes: NodeTable,
    document: "InterfacesDocument",
    *,
    dofs: DofNames | None = None,
) -> GivenBody:
    """Body from matrices, nodes and an interfaces document.

    Parameters
    ----------
    stiffness, mass : StoredMatrix
        Matrices as read.
    nodes : NodeTable
        Places in the document's unit of length.
    document : InterfacesDocument
        Units, pilots and sensors.
    dofs : DofNames, optional
        Names of the rows where the matrices have none.

    Raises
    ------
    ValueError
        Where they do not make one body: unsymmetric, other sizes, without mass, with missing
        degrees of freedom or with a part that moves without strain.
    """
    model = numbered_model(
        stiffness,
        mass,
        nodes,
        dofs=dofs,
        dofs_per_node=None if document.nodes is None else document.nodes.dofs_per_node,
        units=document.units,
    )
    _refuse_no_mass(model)
    interface = given_interface(model, nodes, document)
    free, ratio = free_motions(interface.model.K, interface.model.layout.rigid_modes(np.zeros(3)))
    refuse_loose_parts(interface.model.K, interface.model.layout, free.shape[1])
    _refuse_loose_pilots(interface, free)
    warnings = (*_freedom_warnings(free, ratio), *_unit_warnings(interface.model))
    structure, layout = _structure(document.name, interface, free)
    return GivenBody(structure, layout, warnings)


def _nodes(table: "NodesTable", interfaces: Path) -> NodeTable:
    if table.file is not None:
        return read_nodes(interfaces.parent / table.file)
    assert table.positions is not None
    numbers = np.array([entry[0] for entry in table.positions], dtype=np.int64)
    points = np.array([entry[1:] for entry in table.positions], dtype=np.float64)
    try:
        return node_table(numbers, points)
    except ValueError as error:
        raise ValueError(f"{interfaces}: {error}") from error


def _dofs(table: "NodesTable", interfaces: Path, stiffness: Path) -> DofNames | None:
    """Names of the rows from the interfaces file, or from a file beside the matrix."""
    if table.dof_file is not None:
        return read_dofs(interfaces.parent / table.dof_file)
    if table.dofs is not None:
        listed = table.dofs
        return DofNames(
            np.array([node for node, _ in listed], dtype=np.int64),
            np.array([_ROW_NAMES.index(name) - 1 for _, name in listed], dtype=np.int64),
        )
    beside = {".sti": ".dof", ".matrix": ".mapping"}.get(stiffness.suffix.lower())
    if beside and table.dofs_per_node is None and stiffness.with_suffix(beside).exists():
        return read_dofs(stiffness.with_suffix(beside))
    return None


def _refuse_no_mass(model: NumberedModel) -> None:
    masses = model.M.diagonal()
    translations = (model.layout.names.components >= 0) & ~model.layout.is_rotation
    if not (masses[translations] > 0.0).any():
        raise ValueError("the mass matrix has no positive mass; expected the mass of the body")
    if (masses < 0.0).any():
        worst = int(np.argmin(masses))
        raise ValueError(
            f"the mass of {model.layout.names.named(worst)} is {masses[worst]:.6g}; expected none "
            "below zero"
        )
    R = model.layout.rigid_modes(np.zeros(3))[:, :3]
    moved = np.einsum("nk,nk->k", R, model.M @ R)
    terms = np.einsum("nk,nk->k", R, abs(model.M) @ R)
    if not (moved > _NO_MASS * terms).any():
        raise ValueError(
            f"the mass that moves with a translation is {moved.max():.2g} kg, entries of "
            f"{terms.max():.2g} kg cancel as those of a stiffness do; expected the mass matrix: "
            "are stiffness and mass interchanged?"
        )


def _freedom_warnings(free: NDArray[np.float64], ratio: float) -> Iterator[str]:
    if ratio > _TOLD_GROUNDING:
        yield (
            f"free motions meet forces of {ratio:.1e} of the sums they are left of: rounding of "
            "the stiffness file, or a soft support"
        )
    if free.shape[1] < _ALL_MOTIONS:
        yield (
            f"{free.shape[1]} of six rigid motions are free: the body is held to the ground or "
            "has no other directions; floating-frame exports take free bodies only"
        )


def _refuse_loose_pilots(interface: GivenInterface, free: NDArray[np.float64]) -> None:
    """Refuse pilots that leave the body free to move when they are held."""
    motions = interface.model.layout.rigid_modes(np.zeros(3)) @ free
    if not motions.shape[1]:
        return
    unit = motions / np.abs(motions).max(axis=0)
    held = np.concatenate([pilot.G @ unit for pilot in interface.pilots])
    rank = int(np.linalg.matrix_rank(held, tol=_HELD * max(1.0, float(np.abs(held).max()))))
    if rank < motions.shape[1]:
        raise ValueError(
            f"with all pilots held the body still moves freely in {motions.shape[1] - rank} ways; "
            "expected pilots with components that hold it"
        )


def _unit_warnings(model: NumberedModel) -> Iterator[str]:
    """Compare mass and volume: a wrong unit of length is a factor of a billion."""
    points = model.layout.node_points
    R = model.layout.rigid_modes(np.zeros(3))[:, :3]
    mass = float(max(np.einsum("nk,nk->k", R, model.M @ R)))
    try:
        volume = float(ConvexHull(points).volume) if len(points) > 3 else 0.0
    except QhullError:
        # All nodes in one plane: no volume to compare with.
        volume = 0.0
    if volume > 0.0 and not _HULL_DENSITY[0] <= mass / volume <= _HULL_DENSITY[1]:
        least, most = _HULL_DENSITY
        yield (
            f"{mass:.4g} kg in a hull of {volume:.4g} m^3 around the nodes, "
            f"{mass / volume:.4g} kg/m^3; expected {least:g} to {most:g}: check the table [units]"
        )


def _structure(
    name: str, interface: GivenInterface, free: NDArray[np.float64]
) -> tuple[StructuralModel, DofLayout]:
    """Structural model with nodes of three translations first, where there are no others."""
    K = interface.model.K
    M = interface.model.M
    layout = interface.model.layout
    pilots, sensors = interface.pilots, interface.sensors
    order = standard_order(layout)
    if order is None:
        points = layout.node_points
        model = StructuralModel(name, K, M, points, pilots, sensors, free_motions=free)
        return replace(model, layout=layout), layout
    if not np.array_equal(order, np.arange(len(order))):
        K, M = (sp.csr_array(A[order][:, order]) for A in (K, M))
        pilots = tuple(replace(pilot, G=sp.csr_array(pilot.G[:, order])) for pilot in pilots)
        if sensors is not None:
            sensors = replace(sensors, rows=sp.csr_array(sensors.rows[:, order]))
        layout = layout.at(order)
    points, rigid_points = _places_in_order(layout)
    # A free body of solids is one like those of this program; rotations are scaled.
    plain = free.shape[1] == _ALL_MOTIONS and not len(rigid_points)
    model = StructuralModel(name, K, M, points, pilots, sensors, rigid_points=rigid_points)
    return model if plain else replace(model, free_motions=free), layout


def _places_in_order(layout: DofLayout) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes of three translations, and nodes of six components, from their standard order."""
    n_rotations = int(np.count_nonzero(layout.is_rotation))
    first_six = len(layout) - 2 * n_rotations
    return layout.points[:first_six:3], layout.points[first_six::6]
