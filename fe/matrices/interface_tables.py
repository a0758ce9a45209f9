"""What an interfaces file holds: units, nodes, pilots and sensors of another program's matrices."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from carrierflex.fe.matrices.component_names import COMPONENT_NAMES
from carrierflex.files.problems import refuse
from carrierflex.files.toml_values import (
    Expected,
    FileStem,
    Positive,
    Text,
    ThreeNumbers,
    TomlTable,
    different,
    key,
)
from carrierflex.geometry.cad_surface_tables import MaterialTable

_MOST_NODES = 2_000_000
_MOST_PILOTS = 500
_Component = Literal["Tx", "Ty", "Tz", "Rx", "Ry", "Rz"]
Components = Annotated[
    list[_Component],
    Field(min_length=1, max_length=6),
    Expected(f"a list of some of {', '.join(COMPONENT_NAMES)}"),
]
_Node = Annotated[int, Field(ge=1, lt=2**40)]
Nodes = Annotated[
    list[_Node], Field(min_length=1, max_length=_MOST_NODES), Expected("a list of node numbers")
]
_Weight = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Weights = Annotated[list[_Weight], Field(min_length=1), Expected("a list of positive numbers")]
_Coordinate = Annotated[float, Field(allow_inf_nan=False)]
_Position = Annotated[tuple[_Node, _Coordinate, _Coordinate, _Coordinate], Field(strict=False)]
Positions = Annotated[
    list[_Position],
    Field(min_length=1, max_length=_MOST_NODES),
    Expected("a list of [number, x, y, z]"),
]
_Dof = Annotated[
    tuple[_Node, Literal["Tx", "Ty", "Tz", "Rx", "Ry", "Rz", "S"]], Field(strict=False)
]
Dofs = Annotated[
    list[_Dof],
    Field(min_length=1, max_length=_MOST_NODES),
    Expected('a list of [node, "Tx"] in the order of the rows; "S" for scalar points'),
]
DofsPerNode = Annotated[
    int, Field(ge=1, le=6), Expected("a whole number from 1 to 6: Tx, Ty, Tz, Rx, Ry, Rz in turn")
]


class UnitsTable(TomlTable):
    """Units of matrices and coordinates; time is in seconds."""

    length: Positive = key("Metres of one unit of length (0.001: mm)", "m", default=1.0)
    force: Positive = key(
        "Newtons of one unit of force; the unit of mass follows (mm and N: tonnes)",
        "N",
        default=1.0,
    )


class NodesTable(TomlTable):
    """Where the nodes are, and which degrees of freedom the rows of the matrices are."""

    file: Text | None = key(
        "File with the nodes: .inp, .bdf, .dat, .nas, .asm, .cdb, relative to this file",
        default=None,
    )
    positions: Positions | None = key("Nodes in place of a file", default=None)
    dof_file: Text | None = key(
        "File with the names of the rows: CalculiX .dof, Ansys .mapping", default=None
    )
    dofs: Dofs | None = key("Names of the rows in place of a file", default=None)
    dofs_per_node: DofsPerNode | None = key(
        "Rows of every node, nodes in the order of their numbers; of the sizes by default",
        default=None,
    )

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        refuse(_contradictions(self))
        return self


def _contradictions(table: NodesTable) -> list[str]:
    problems = []
    if (table.file is None) == (table.positions is None):
        problems.append("expected one of the keys 'file' and 'positions'")
    given = [
        name for name in ("dof_file", "dofs", "dofs_per_node") if getattr(table, name) is not None
    ]
    if len(given) > 1:
        problems.append(f"{' and '.join(given)} are both given; expected one of them")
    return problems


class _OnNodes(TomlTable):
    """Something that stands on nodes, listed or a set of the nodes' file."""

    name: FileStem = key("Name")
    nodes: Nodes | None = key("Numbers of the nodes", default=None)
    node_set: Text | None = key("Set of nodes in the nodes' file, in place of nodes", default=None)

    @model_validator(mode="after")
    def _has_nodes(self) -> Self:
        problems = []
        if (self.nodes is None) == (self.node_set is None):
            problems.append("expected one of the keys 'nodes' and 'node_set'")
        refuse(problems)
        return self


class DistributingTable(_OnNodes):
    """Pilot that follows the weighted mean motion of its nodes (RBE3 type)."""

    type: Literal["distributing"] = key("Kind of the pilot")
    point: ThreeNumbers | None = key(
        "Position in the unit of length; the mean of its nodes by default", default=None
    )
    weights: Weights | None = key("Weight of every node; equal ones by default", default=None)
    averaged: Components = key(
        "Directions of the nodes that are averaged", default=["Tx", "Ty", "Tz"]
    )
    components: Components = key("Motions of the pilot that follow", default=list(COMPONENT_NAMES))


class RigidTable(_OnNodes):
    """Pilot that its nodes follow rigidly (RBE2 type)."""

    type: Literal["rigid"] = key("Kind of the pilot")
    point: ThreeNumbers | None = key(
        "Position in the unit of length; the mean of its nodes by default", default=None
    )


class NodePilotsTable(_OnNodes):
    """Nodes that are pilots themselves, one each."""

    type: Literal["nodes"] = key("Kind of the pilot")
    components: Components | None = key(
        "Motions that are kept; all that the node has by default", default=None
    )


PilotTable = Annotated[
    DistributingTable | RigidTable | NodePilotsTable, Field(discriminator="type")
]


class SensorTable(_OnNodes):
    """Displacement along a direction, the weighted mean of some nodes."""

    direction: ThreeNumbers = key("Direction of the displacement")
    weights: Weights | None = key("Weight of every node; equal ones by default", default=None)


class InterfacesDocument(TomlTable):
    """Interfaces of a body whose matrices, or whose mesh, another program made."""

    format: Literal["carrierflex-interfaces"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: FileStem = key("Name of the body")
    units: UnitsTable = key("Units", default_factory=UnitsTable)
    nodes: NodesTable | None = key("Nodes and rows of matrices; a mesh has its own", default=None)
    materials: dict[str, MaterialTable] = key(
        "Material of every group of elements, in place of matrices", default_factory=dict
    )
    links: bool = key(
        "Whether every RBE2 and RBE3 of the mesh, or of the file with the nodes, is a pilot "
        "(Nastran bulk data)",
        default=False,
    )
    pilots: Annotated[list[PilotTable], Field(max_length=_MOST_PILOTS), different("pilot")] = key(
        "Pilots", default_factory=list
    )
    sensors: Annotated[list[SensorTable], different("sensor")] = key(
        "Sensors", default_factory=list
    )

    @model_validator(mode="after")
    def _of_matrices_or_of_a_mesh(self) -> Self:
        problems = []
        if (self.nodes is None) == (not self.materials):
            problems.append("expected either [nodes], of matrices, or [materials], of a mesh")
        if not self.pilots and not self.links:
            problems.append("expected at least one table [[pilots]], or links = true")
        refuse(problems)
        return self
