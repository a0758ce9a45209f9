"""Pilots and sensors that an interfaces file states, on the degrees of freedom of matrices.

Rigid pilots come first: their nodes follow them, ``u = L û``, and leave the degrees of freedom.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.couplings import Pilot
from carrierflex.fe.matrices.component_names import COMPONENT_NAMES
from carrierflex.fe.matrices.dof_layout import DofLayout
from carrierflex.fe.matrices.node_files import NodeTable
from carrierflex.fe.matrices.numbered_model import NumberedModel
from carrierflex.fe.matrices.stored_matrix import DofNames
from carrierflex.fe.pilot_overlaps import independence
from carrierflex.fe.point_couplings import AveragedDofs, point_coupling
from carrierflex.fe.structural_model import Sensors
from carrierflex.files.shown_values import shown

if TYPE_CHECKING:
    from carrierflex.fe.matrices.interface_tables import (
        DistributingTable,
        InterfacesDocument,
        NodePilotsTable,
        PilotTable,
        RigidTable,
        SensorTable,
    )

_SIX = 6
_TRANSLATIONS = 3


@dataclass(frozen=True, eq=False)
class GivenInterface:
    """A model with its pilots and sensors.

    Parameters
    ----------
    model : NumberedModel
        Matrices, nodes of rigid pilots replaced by the pilots.
    pilots : tuple of Pilot
        In the order of the file.
    sensors : Sensors or None
        Recovery rows, None where the file has none.
    """

    model: NumberedModel
    pilots: tuple[Pilot, ...]
    sensors: Sensors | None


def given_interface(
    model: NumberedModel, nodes: NodeTable, document: "InterfacesDocument"
) -> GivenInterface:
    """Couple the pilots of an interfaces file to a model.

    Raises
    ------
    ValueError
        Where nodes or sets are unknown, do not determine a pilot, or belong to two rigid ones, or
        pilots cannot move independently.
    """
    members = {
        table.name: _nodes_of(table, nodes) for table in (*document.pilots, *document.sensors)
    }
    rigid = [table for table in document.pilots if table.type == "rigid"]
    L, layout = _with_rigid_pilots(model.layout, rigid, members, nodes, document.units.length)
    first_rigid = L.shape[1] - _SIX * len(rigid)
    pilots: list[Pilot] = []
    for table in document.pilots:
        own = members[table.name]
        if table.type == "rigid":
            start = first_rigid + _SIX * rigid.index(table)
            pilots.append(_selected(table.name, layout, np.arange(start, start + _SIX)))
        elif table.type == "nodes":
            pilots += _node_pilots(table, layout, own)
        else:
            point = _point(table, nodes, own, document.units.length)
            pilots.append(_distributing(table, model.layout, own, point, L))
    _refuse_dependent(pilots)
    sensors = _sensors(document.sensors, model.layout, members, L)
    if rigid:
        K, M = (sp.csr_array(L.T @ A @ L) for A in (model.K, model.M))
        model = NumberedModel(_symmetric(K), _symmetric(M), layout)
    return GivenInterface(model, tuple(pilots), sensors)


def _nodes_of(table: "PilotTable | SensorTable", nodes: NodeTable) -> NDArray[np.int64]:
    """Numbers of the nodes of a pilot or sensor."""
    if table.nodes is not None:
        own = np.array(table.nodes, dtype=np.int64)
    else:
        assert table.node_set is not None
        sets = {name.upper(): members for name, members in nodes.sets.items()}
        if table.node_set.upper() not in sets:
            raise ValueError(
                f"{table.name!r}: no set {shown(table.node_set)} in the file with the nodes; it "
                f"has {', '.join(sorted(sets)) or 'none'}"
            )
        own = sets[table.node_set.upper()]
    unknown = own[~np.isin(own, nodes.numbers)]
    if len(unknown) or len(np.unique(own)) < len(own) or not len(own):
        what = f"node {unknown[0]} is none of the model" if len(unknown) else "a node stands twice"
        raise ValueError(f"{table.name!r}: {what}; expected different nodes of the model")
    weights = getattr(table, "weights", None)
    if weights is not None and len(weights) != len(own):
        raise ValueError(
            f"{table.name!r}: {len(weights)} weights for {len(own)} nodes; expected one each"
        )
    return own


def _point(
    table: "DistributingTable | RigidTable", nodes: NodeTable, own: NDArray[np.int64], length: float
) -> NDArray[np.float64]:
    """Position of a pilot [m]: as stated, or the mean of its nodes."""
    if table.point is not None:
        return np.array(table.point) * length
    mean = nodes.points[np.searchsorted(nodes.numbers, own)].mean(axis=0)
    return np.asarray(mean * length)


def _with_rigid_pilots(
    layout: DofLayout,
    rigid: "Sequence[RigidTable]",
    members: dict[str, NDArray[np.int64]],
    nodes: NodeTable,
    length: float,
) -> tuple[sp.csr_array, DofLayout]:
    """Matrix L from the new to the old degrees of freedom, and the new ones' layout.

    Those of free nodes keep their order; six of every rigid pilot follow.
    """
    n = len(layout)
    following: dict[int, str] = {}
    is_free = np.ones(n, dtype=np.bool_)
    blocks, new = [], []
    number = int(max(nodes.numbers.max(), layout.names.nodes.max())) + 1
    for i, table in enumerate(rigid):
        own = members[table.name]
        twice = next((int(node) for node in own if int(node) in following), None)
        if twice is not None:
            raise ValueError(
                f"rigid pilots {following[twice]!r} and {table.name!r} share node {twice}, which "
                "cannot follow both; expected nodes of their own"
            )
        following |= dict.fromkeys(own.tolist(), table.name)
        rows = layout.dofs_of(own)
        rows = rows[rows >= 0]
        point = _point(table, nodes, own, length)
        motion = layout.at(rows).rigid_modes(point)
        if np.linalg.matrix_rank(motion / np.abs(motion).max(axis=0).clip(min=1e-300)) < _SIX:
            raise ValueError(
                f"rigid pilot {table.name!r}: its {len(own)} nodes do not hold all six motions; "
                "expected three nodes not in line, or nodes with rotations"
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
    table: "NodePilotsTable", layout: DofLayout, own: NDArray[np.int64]
) -> list[Pilot]:
    pilots = []
    wanted = [COMPONENT_NAMES.index(name) for name in table.components or COMPONENT_NAMES]
    for node, rows in zip(own, layout.dofs_of(own), strict=True):
        chosen = rows[sorted(set(wanted))]
        if table.components is not None and (chosen < 0).any():
            absent = COMPONENT_NAMES[sorted(set(wanted))[int(np.argmin(chosen))]]
            raise ValueError(
                f"pilot {table.name!r}: node {node} has no {absent} in the matrices; expected "
                "components that it has"
            )
        name = table.name if len(own) == 1 else f"{table.name}_{node}"
        pilots.append(_selected(name, layout, chosen[chosen >= 0]))
    return pilots


def _distributing(
    table: "DistributingTable",
    layout: DofLayout,
    own: NDArray[np.int64],
    point: NDArray[np.float64],
    L: sp.csr_array,
) -> Pilot:
    averaged = sorted(COMPONENT_NAMES.index(name) for name in set(table.averaged))
    rows = layout.dofs_of(own)[:, averaged]
    node, column = np.nonzero(rows >= 0)
    used, local = np.unique(node, return_inverse=True)
    component = np.array(averaged)[column]
    weights = np.ones(len(own)) if table.weights is None else np.array(table.weights)
    if len(used) < len(own):
        absent = np.setdiff1d(np.arange(len(own)), used)
        raise ValueError(
            f"pilot {table.name!r}: node {own[absent[0]]} has none of the averaged directions "
            f"{', '.join(table.averaged)} in the matrices; expected one at least"
        )
    places = layout.points[rows.max(axis=1)]
    dofs = AveragedDofs(
        places, local, np.eye(3)[component % 3], component >= _TRANSLATIONS, weights[node]
    )
    components = tuple(sorted(COMPONENT_NAMES.index(name) for name in set(table.components)))
    subject = f"pilot {table.name!r} on {len(own)} nodes"
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
        own = members[table.name]
        at = layout.dofs_of(own)[:, :_TRANSLATIONS]
        needed = direction != 0.0
        if (at[:, needed] < 0).any():
            raise ValueError(
                f"sensor {table.name!r}: a node has no displacement along its direction in the "
                "matrices; expected nodes that move along it"
            )
        weights = np.ones(len(own)) if table.weights is None else np.array(table.weights)
        row = np.zeros(len(layout))
        share = np.outer(weights / weights.sum(), direction / length)
        np.add.at(row, at[:, needed], share[:, needed])
        rows.append(sp.csr_array(row[None]))
    names = tuple(table.name for table in tables)
    return Sensors(names, 0.0, sp.csr_array(sp.vstack(rows) @ L))


def _symmetric(A: sp.csr_array) -> sp.csr_array:
    return sp.csr_array((A + A.T) * 0.5)
