"""A structural model of the matrices of another finite element program."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from carrierflex.fe.couplings import Pilot
from carrierflex.fe.matrices.component_names import COMPONENT_NAMES
from carrierflex.fe.matrices.dof_layout import DofLayout, standard_order
from carrierflex.fe.matrices.interface_files import read_interfaces
from carrierflex.fe.matrices.matrix_files import read_matrix
from carrierflex.fe.matrices.nastran_links import with_linked_pilots
from carrierflex.fe.matrices.node_files import NodeTable, node_table, read_dofs, read_nodes
from carrierflex.fe.matrices.numbered_model import NumberedModel, numbered_model
from carrierflex.fe.matrices.rigid_freedom import free_motions, refuse_loose_parts
from carrierflex.fe.matrices.stored_matrix import DofNames, StoredMatrix, precision_note
from carrierflex.fe.pilot_overlaps import independence
from carrierflex.fe.point_couplings import AveragedDofs, point_coupling
from carrierflex.fe.structural_model import Sensors, StructuralModel
from carrierflex.files.shown_values import shown

if TYPE_CHECKING:
    from carrierflex.fe.matrices.interface_tables import (
        DistributingTable,
        InterfacesDocument,
        NodePilotsTable,
        NodesTable,
        PilotTable,
        RigidTable,
        SensorTable,
    )

#: Mass over the volume of the nodes' convex hull [kg/m^3]: beyond these limits the units are
#: unlikely to be those stated. A solid of platinum fills its hull with 21 450.
_HULL_DENSITY = (1.0, 25_000.0)
#: Force against a rigid motion, over the sum of its terms, that is told.
_TOLD_GROUNDING = 1e-9
#: Share of the sum of its terms below which a translation's mass is rounding: what is left of a
#: free body's stiffness.
_NO_MASS = 1e-6
#: Singular value of the pilots' rigid motions below which one is not held.
_RANK_TOLERANCE = 1e-8
_ALL_MOTIONS = 6
#: Sizes of a part of a wind turbine's drivetrain [m], from a sensor's bracket to a frame.
_LIKELY_SIZE = (0.02, 20.0)
#: Units that preprocessors write lengths in [m], the usual one first.
_LENGTH_UNITS = {"millimetres": 1e-3, "metres": 1.0, "inches": 0.0254}
#: Names of components in an interfaces file, from that of scalar points, -1, on.
_ROW_NAMES = ("S", *COMPONENT_NAMES)


_SIX = 6
_TRANSLATIONS = 3


@dataclass(frozen=True, eq=False)
class _GivenInterface:
    """A model with its pilots and sensors."""

    model: NumberedModel
    pilots: tuple[Pilot, ...]
    sensors: Sensors | None


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
            f"{interfaces}: table [materials] together with matrices; expected [nodes], or a mesh"
        )
    nodes = _nodes(document.nodes, interfaces)
    dofs = _dofs(document.nodes, interfaces, stiffness)
    if document.links:
        if document.nodes.file is None:
            raise ValueError(
                f"{interfaces}: links = true without a file in [nodes]; expected the bulk data "
                "with the RBE2 and RBE3 entries"
            )
        document = with_linked_pilots(document, interfaces.parent / document.nodes.file)
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
    interface = _given_interface(model, nodes, document)
    free, ratio = free_motions(interface.model.K, interface.model.layout.rigid_modes(np.zeros(3)))
    refuse_loose_parts(interface.model.K, interface.model.layout, free.shape[1])
    _refuse_loose_pilots(interface, free)
    warnings = (
        *filter(None, [precision_note(stiffness.A)]),
        *_freedom_warnings(free, ratio),
        *_unit_warnings(interface.model),
        *_size_warnings(nodes, document),
    )
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
    companion = {".sti": ".dof", ".matrix": ".mapping"}.get(stiffness.suffix.lower())
    if companion and table.dofs_per_node is None and stiffness.with_suffix(companion).exists():
        return read_dofs(stiffness.with_suffix(companion))
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
            f"{free.shape[1]} of six rigid motions are free: the body is fixed to the ground or "
            "lacks directions; floating-frame exports require free bodies"
        )


def _refuse_loose_pilots(interface: _GivenInterface, free: NDArray[np.float64]) -> None:
    """Refuse pilots that leave the body free to move when they are held."""
    motions = interface.model.layout.rigid_modes(np.zeros(3)) @ free
    if not motions.shape[1]:
        return
    unit = motions / np.abs(motions).max(axis=0)
    resisted = np.concatenate([pilot.G @ unit for pilot in interface.pilots])
    rank = int(
        np.linalg.matrix_rank(
            resisted, tol=_RANK_TOLERANCE * max(1.0, float(np.abs(resisted).max()))
        )
    )
    if rank < motions.shape[1]:
        raise ValueError(
            f"with all pilots fixed the body still moves freely in {motions.shape[1] - rank} ways; "
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


def _size_warnings(nodes: NodeTable, document: "InterfacesDocument") -> Iterator[str]:
    """Name what has an unlikely size, with the unit of length that would make it a likely one."""
    length = document.units.length
    extent = float(np.ptp(nodes.points, axis=0).max())
    if not _LIKELY_SIZE[0] <= extent * length <= _LIKELY_SIZE[1]:
        likely = next(
            (
                f"; if its coordinates are in {unit}, write length = {size:g}"
                for unit, size in _LENGTH_UNITS.items()
                if _LIKELY_SIZE[0] <= extent * size <= _LIKELY_SIZE[1]
            ),
            "",
        )
        yield (
            f"the body is {extent * length:.3g} m across, by [units] length = {length:g}; expected "
            f"{_LIKELY_SIZE[0]:g} to {_LIKELY_SIZE[1]:g} m{likely}"
        )
    for table in document.pilots:
        point = getattr(table, "point", None)
        if point is None:
            continue
        coupled = nodes.points[np.searchsorted(nodes.numbers, _nodes_of(table, nodes))]
        off = float(np.linalg.norm(np.array(point) - coupled.mean(axis=0)))
        if off > 2.0 * extent:
            yield (
                f"pilot {table.name!r}: its point is {off * length:.3g} m from the middle of its "
                f"nodes, on a body {extent * length:.3g} m across; expected a point near them, in "
                "the unit of [units] length"
            )


def _structure(
    name: str, interface: _GivenInterface, free: NDArray[np.float64]
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


def _given_interface(
    model: NumberedModel, nodes: NodeTable, document: "InterfacesDocument"
) -> _GivenInterface:
    """Couple the pilots of an interfaces file to a model."""
    members = {
        table.name: _nodes_of(table, nodes) for table in (*document.pilots, *document.sensors)
    }
    L, layout, pilots = _coupled(model, nodes, document.pilots, members, document.units.length)
    sensors = _sensors(document.sensors, model.layout, members, L)
    if any(table.type == "rigid" for table in document.pilots):
        K, M = (sp.csr_array(L.T @ A @ L) for A in (model.K, model.M))
        model = NumberedModel(_symmetric(K), _symmetric(M), layout)
    return _GivenInterface(model, pilots, sensors)


def _coupled(
    model: NumberedModel,
    nodes: NodeTable,
    tables: "Sequence[PilotTable]",
    members: dict[str, NDArray[np.int64]],
    length: float,
) -> tuple[sp.csr_array, DofLayout, tuple[Pilot, ...]]:
    """Matrix L from the new to the old degrees of freedom, the new ones' layout, and the pilots."""
    rigid = [table for table in tables if table.type == "rigid"]
    L, layout = _with_rigid_pilots(model.layout, rigid, members, nodes, length)
    first_rigid = L.shape[1] - _SIX * len(rigid)
    pilots: list[Pilot] = []
    for table in tables:
        coupled_nodes = members[table.name]
        if table.type == "rigid":
            start = first_rigid + _SIX * rigid.index(table)
            pilots.append(_selected(table.name, layout, np.arange(start, start + _SIX)))
        elif table.type == "nodes":
            pilots += _node_pilots(table, layout, coupled_nodes)
        else:
            point = _point(table, nodes, coupled_nodes, length)
            pilots.append(_distributing(table, model.layout, coupled_nodes, point, L))
    _refuse_dependent(pilots)
    return L, layout, tuple(pilots)


def linked_interface(
    model: NumberedModel, nodes: NodeTable, tables: "Sequence[DistributingTable | RigidTable]"
) -> tuple[sp.csr_array, tuple[Pilot, ...]]:
    """Pilots of tables on a model in SI units, with the freedoms that rigid ones leave.

    Parameters
    ----------
    model : NumberedModel
        Matrices of n degrees of freedom.
    nodes : NodeTable
        Places of its nodes [m].
    tables : sequence of DistributingTable or RigidTable
        The pilots.

    Returns
    -------
    L : csr_array, shape (n, k)
        Degrees of freedom from those that the rigid pilots leave.
    pilots : tuple of Pilot
        Coupled to these k.

    Raises
    ------
    ValueError
        As :func:`body_of`, of the pilots.
    """
    members = {table.name: _nodes_of(table, nodes) for table in tables}
    L, _, pilots = _coupled(model, nodes, tables, members, 1.0)
    return L, pilots


def _nodes_of(table: "PilotTable | SensorTable", nodes: NodeTable) -> NDArray[np.int64]:
    """Numbers of the nodes of a pilot or sensor."""
    if table.nodes is not None:
        numbers = np.array(table.nodes, dtype=np.int64)
    else:
        assert table.node_set is not None
        sets = {name.upper(): members for name, members in nodes.sets.items()}
        if table.node_set.upper() not in sets:
            raise ValueError(
                f"{table.name!r}: no set {shown(table.node_set)} in the file with the nodes; it "
                f"has {', '.join(sorted(sets)) or 'none'}"
            )
        numbers = sets[table.node_set.upper()]
    unknown = numbers[~np.isin(numbers, nodes.numbers)]
    if len(unknown) or len(np.unique(numbers)) < len(numbers) or not len(numbers):
        what = f"node {unknown[0]} is none of the model" if len(unknown) else "a node occurs twice"
        raise ValueError(f"{table.name!r}: {what}; expected different nodes of the model")
    weights = getattr(table, "weights", None)
    if weights is not None and len(weights) != len(numbers):
        raise ValueError(
            f"{table.name!r}: {len(weights)} weights for {len(numbers)} nodes; expected one each"
        )
    return numbers


def _point(
    table: "DistributingTable | RigidTable",
    nodes: NodeTable,
    node_numbers: NDArray[np.int64],
    length: float,
) -> NDArray[np.float64]:
    """Position of a pilot [m]: as stated, or the mean of its nodes."""
    if table.point is not None:
        return np.array(table.point) * length
    mean = nodes.points[np.searchsorted(nodes.numbers, node_numbers)].mean(axis=0)
    return np.asarray(mean * length)


def _with_rigid_pilots(
    layout: DofLayout,
    rigid: "Sequence[RigidTable]",
    members: dict[str, NDArray[np.int64]],
    nodes: NodeTable,
    length: float,
) -> tuple[sp.csr_array, DofLayout]:
    """Matrix L from the new to the old degrees of freedom, and the new ones' layout."""
    n = len(layout)
    following: dict[int, str] = {}
    is_free = np.ones(n, dtype=np.bool_)
    blocks, new = [], []
    number = int(max(nodes.numbers.max(), layout.names.nodes.max())) + 1
    for i, table in enumerate(rigid):
        coupled_nodes = members[table.name]
        twice = next((int(node) for node in coupled_nodes if int(node) in following), None)
        if twice is not None:
            raise ValueError(
                f"rigid pilots {following[twice]!r} and {table.name!r} share node {twice}, which "
                "cannot follow both; expected nodes of their own"
            )
        following |= dict.fromkeys(coupled_nodes.tolist(), table.name)
        rows = layout.dofs_of(coupled_nodes)
        rows = rows[rows >= 0]
        point = _point(table, nodes, coupled_nodes, length)
        motion = layout.at(rows).rigid_modes(point)
        if np.linalg.matrix_rank(motion / np.abs(motion).max(axis=0).clip(min=1e-300)) < _SIX:
            raise ValueError(
                f"rigid pilot {table.name!r}: its {len(coupled_nodes)} nodes do not hold all six "
                "motions; expected three nodes not in line, or nodes with rotations"
            )
        is_free[rows] = False
        blocks.append(sp.coo_array((motion.ravel(), _grid(rows)), shape=(n, _SIX)))
        names = DofNames(np.full(_SIX, number + i), np.arange(_SIX))
        new.append(DofLayout(names, np.repeat(point[None], _SIX, axis=0)))
    free = np.flatnonzero(is_free)
    selection = sp.csr_array((np.ones(len(free)), (free, np.arange(len(free)))), (n, len(free)))
    changed = layout.at(free)
    for each in new:
        changed = changed.joined(each)
    return sp.csr_array(sp.hstack([selection, *blocks])), changed


def _grid(rows: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    return np.repeat(rows, _SIX), np.tile(np.arange(_SIX), len(rows))


def _selected(name: str, layout: DofLayout, rows: NDArray[np.int64]) -> Pilot:
    """Pilot that is a node itself: some of its degrees of freedom."""
    components = tuple(int(i) for i in layout.names.components[rows])
    G = sp.csr_array(
        (np.ones(len(rows)), (np.arange(len(rows)), rows)), shape=(len(rows), len(layout))
    )
    return Pilot(name, layout.points[rows[0]], G, components)


def _node_pilots(
    table: "NodePilotsTable", layout: DofLayout, node_numbers: NDArray[np.int64]
) -> list[Pilot]:
    pilots = []
    wanted = [COMPONENT_NAMES.index(name) for name in table.components or COMPONENT_NAMES]
    for node, rows in zip(node_numbers, layout.dofs_of(node_numbers), strict=True):
        chosen = rows[sorted(set(wanted))]
        if table.components is not None and (chosen < 0).any():
            absent = COMPONENT_NAMES[sorted(set(wanted))[int(np.argmin(chosen))]]
            raise ValueError(
                f"pilot {table.name!r}: node {node} has no {absent} in the matrices; expected "
                "components that it has"
            )
        name = table.name if len(node_numbers) == 1 else f"{table.name}_{node}"
        pilots.append(_selected(name, layout, chosen[chosen >= 0]))
    return pilots


def _distributing(
    table: "DistributingTable",
    layout: DofLayout,
    node_numbers: NDArray[np.int64],
    point: NDArray[np.float64],
    L: sp.csr_array,
) -> Pilot:
    averaged = sorted(COMPONENT_NAMES.index(name) for name in set(table.averaged))
    rows = layout.dofs_of(node_numbers)[:, averaged]
    node, column = np.nonzero(rows >= 0)
    used, local = np.unique(node, return_inverse=True)
    component = np.array(averaged)[column]
    weights = np.ones(len(node_numbers)) if table.weights is None else np.array(table.weights)
    if len(used) < len(node_numbers):
        absent = np.setdiff1d(np.arange(len(node_numbers)), used)
        raise ValueError(
            f"pilot {table.name!r}: node {node_numbers[absent[0]]} has none of the averaged "
            f"directions {', '.join(table.averaged)} in the matrices; expected one at least"
        )
    positions = layout.points[rows.max(axis=1)]
    dofs = AveragedDofs(
        positions, local, np.eye(3)[component % 3], component >= _TRANSLATIONS, weights[node]
    )
    components = tuple(sorted(COMPONENT_NAMES.index(name) for name in set(table.components)))
    subject = f"pilot {table.name!r} on {len(node_numbers)} nodes"
    small = point_coupling(dofs, point, components, subject=subject)
    columns = rows[node, column]
    shape = (len(components), len(layout))
    index = (np.repeat(np.arange(shape[0]), len(columns)), np.tile(columns, shape[0]))
    G = sp.csr_array(sp.coo_array((small.ravel(), index), shape=shape))
    return Pilot(table.name, point, sp.csr_array(G @ L), components)


def _refuse_dependent(pilots: Sequence[Pilot]) -> None:
    """Refuse pilots of one name, and pilots on common degrees of freedom that are dependent."""
    names = [pilot.name for pilot in pilots]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"pilot {twice!r} is given twice; expected different names")
    count = np.zeros(pilots[0].G.shape[1], dtype=np.int64)
    for pilot in pilots:
        count[np.unique(pilot.G.indices)] += 1
    sharing = tuple(pilot for pilot in pilots if (count[pilot.G.indices] > 1).any())
    if not sharing:
        return
    rank, _ = independence(sharing)
    n_coordinates = sum(len(pilot.components) for pilot in sharing)
    if rank < n_coordinates:
        raise ValueError(
            f"pilots {', '.join(repr(p.name) for p in sharing[:6])} cannot move independently: "
            f"their {n_coordinates} coordinates have rank {rank}; expected nodes of their own, or "
            "fewer components"
        )


def _sensors(
    tables: "Sequence[SensorTable]",
    layout: DofLayout,
    members: dict[str, NDArray[np.int64]],
    L: sp.csr_array,
) -> Sensors | None:
    if not tables:
        return None
    rows = []
    for table in tables:
        direction = np.array(table.direction)
        length = float(np.linalg.norm(direction))
        if not 0.0 < length < np.inf:
            raise ValueError(f"sensor {table.name!r}: direction is zero; expected a direction")
        nodes = members[table.name]
        at = layout.dofs_of(nodes)[:, :_TRANSLATIONS]
        needed = direction != 0.0
        if (at[:, needed] < 0).any():
            raise ValueError(
                f"sensor {table.name!r}: a node has no displacement along its direction in the "
                "matrices; expected nodes that move along it"
            )
        weights = np.ones(len(nodes)) if table.weights is None else np.array(table.weights)
        row = np.zeros(len(layout))
        share = np.outer(weights / weights.sum(), direction / length)
        np.add.at(row, at[:, needed], share[:, needed])
        rows.append(sp.csr_array(row[None]))
    names = tuple(table.name for table in tables)
    return Sensors(names, 0.0, sp.csr_array(sp.vstack(rows) @ L))


def _symmetric(A: sp.csr_array) -> sp.csr_array:
    return sp.csr_array((A + A.T) * 0.5)
