"""Stiffness and mass of another program with the place of every degree of freedom, in SI units.

What belongs together is brought together: rows by name, units, directions of nodes, and a triangle
that differs from the other by rounding only.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from carrierflex.fe.matrices.dof_layout import DofLayout
from carrierflex.fe.matrices.node_files import NodeTable
from carrierflex.fe.matrices.stored_matrix import SCALAR, DofNames, StoredMatrix

if TYPE_CHECKING:
    from carrierflex.fe.matrices.interface_tables import UnitsTable

#: Difference between an entry and its mirror image, over the root of the product of their
#: diagonals, that counts as rounding of the file.
_ASYMMETRY = 1e-5
_MOST_COMPONENTS = 6


@dataclass(frozen=True, eq=False)
class NumberedModel:
    """Matrices and places of the degrees of freedom that have stiffness or mass.

    Parameters
    ----------
    K, M : csr_array, shape (n, n)
        Stiffness [N/m] and mass [kg], symmetric.
    layout : DofLayout
        Their degrees of freedom.
    """

    K: sp.csr_array
    M: sp.csr_array
    layout: DofLayout


def numbered_model(
    stiffness: StoredMatrix,
    mass: StoredMatrix,
    nodes: NodeTable,
    *,
    dofs: DofNames | None,
    dofs_per_node: int | None,
    units: "UnitsTable",
) -> NumberedModel:
    """Bring matrices, names and places together.

    Parameters
    ----------
    stiffness, mass : StoredMatrix
        As read.
    nodes : NodeTable
        Places, in the files' unit of length.
    dofs : DofNames or None
        Names of the rows where the matrices have none.
    dofs_per_node : int or None
        Rows of every node, where there are no names at all; of the sizes where None.
    units : UnitsTable
        Units of length and force.

    Raises
    ------
    ValueError
        Where sizes or names do not fit, a matrix is not symmetric, or a node has no place.
    """
    K, M, names = _named(stiffness, mass, nodes, dofs, dofs_per_node)
    for letter, matrix in (("stiffness", K), ("mass", M)):
        _refuse_unsymmetric(letter, matrix, names)
    used = np.flatnonzero((_row_sizes(K) > 0.0) | (_row_sizes(M) > 0.0))
    if len(used) < len(names):
        K = K[used][:, used]
        M = M[used][:, used]
        names = names.at(used)
    layout = DofLayout(names, _dof_points(names, nodes) * units.length)
    K, M = (_turned(A, names, nodes.frames) for A in (K, M))
    K, M = (_symmetric(_in_si(A, layout, units)) for A in (K, M))
    return NumberedModel(K, M, layout)


def _named(
    stiffness: StoredMatrix,
    mass: StoredMatrix,
    nodes: NodeTable,
    dofs: DofNames | None,
    dofs_per_node: int | None,
) -> tuple[sp.csr_array, sp.csr_array, DofNames]:
    if stiffness.dofs is not None and mass.dofs is not None:
        return _united(stiffness, mass)
    most = max(stiffness.A.shape[0], mass.A.shape[0])
    stiffness, mass = (_with_rows(matrix, most) for matrix in (stiffness, mass))
    n = stiffness.A.shape[0]
    if mass.A.shape[0] != n:
        raise ValueError(
            f"the stiffness has {n} rows, the mass {mass.A.shape[0]}; expected as many: matrices "
            "of one model"
        )
    names = stiffness.dofs or mass.dofs or dofs or nodes.dofs
    if names is None:
        names = _in_turn(n, nodes, dofs_per_node)
    if len(names) != n:
        raise ValueError(
            f"the stiffness has {n} rows, names of {len(names)} degrees of freedom are given; "
            "expected one a row"
        )
    return stiffness.A, mass.A, names


def _with_rows(matrix: StoredMatrix, n: int) -> StoredMatrix:
    """A list of entries with the empty rows behind its last one."""
    if matrix.states_order or matrix.A.shape[0] == n:
        return matrix
    A = matrix.A.copy()
    A.resize((n, n))
    return replace(matrix, A=A)


def _united(
    stiffness: StoredMatrix, mass: StoredMatrix
) -> tuple[sp.csr_array, sp.csr_array, DofNames]:
    """Matrices with rows for all names that either of them has: files leave empty columns out."""
    assert stiffness.dofs is not None
    assert mass.dofs is not None
    keys = stiffness.dofs.keys
    if np.array_equal(keys, mass.dofs.keys):
        return stiffness.A, mass.A, stiffness.dofs
    added = np.flatnonzero(~np.isin(mass.dofs.keys, keys))
    more = mass.dofs.at(added)
    names = DofNames(
        np.concatenate([stiffness.dofs.nodes, more.nodes]),
        np.concatenate([stiffness.dofs.components, more.components]),
    )
    order = np.argsort(names.keys)
    rows = order[np.searchsorted(names.keys, mass.dofs.keys, sorter=order)]
    M = sp.coo_array(mass.A)
    n = len(names)
    wide = sp.coo_array((M.data, (rows[M.coords[0]], rows[M.coords[1]])), shape=(n, n))
    K = stiffness.A.copy()
    K.resize((n, n))
    return K, sp.csr_array(wide), names


def _in_turn(n: int, nodes: NodeTable, dofs_per_node: int | None) -> DofNames:
    """Names of rows without any: the same components of every node, in the order of numbers."""
    count = len(nodes.numbers)
    each = dofs_per_node or (n // count if count and n % count == 0 else 0)
    if each * count != n or not 0 < each <= _MOST_COMPONENTS:
        raise ValueError(
            f"the matrices have {n} rows without names, the model {count} nodes; expected the "
            "names of the rows (dof_file or dofs) or as many rows of every node (dofs_per_node)"
        )
    return DofNames(np.repeat(nodes.numbers, each), np.tile(np.arange(each), count))


def _dof_points(names: DofNames, nodes: NodeTable) -> NDArray[np.float64]:
    scalar = names.components == SCALAR
    index = np.minimum(np.searchsorted(nodes.numbers, names.nodes), len(nodes.numbers) - 1)
    unknown = np.flatnonzero(~scalar & (nodes.numbers[index] != names.nodes))
    if len(unknown):
        missing = np.unique(names.nodes[unknown])
        raise ValueError(
            f"{len(missing)} nodes of the matrices have no coordinates ({names.nodes[unknown[0]]} "
            f"first); expected all of them among the {len(nodes.numbers)} nodes that are given"
        )
    return np.where(scalar[:, None], 0.0, nodes.points[index])


def _row_sizes(A: sp.csr_array) -> NDArray[np.float64]:
    """Largest entry of every row."""
    return np.asarray(abs(A).max(axis=1).toarray()).ravel() if A.nnz else np.zeros(A.shape[0])


def _refuse_unsymmetric(what: str, A: sp.csr_array, names: DofNames) -> None:
    difference = sp.coo_array(A - A.T)
    if not difference.nnz:
        return
    rows, columns = difference.coords
    diagonal = np.abs(A.diagonal())
    size = np.sqrt(diagonal[rows] * diagonal[columns])
    worst = int(np.argmax(np.abs(difference.data) - _ASYMMETRY * size))
    if abs(difference.data[worst]) > _ASYMMETRY * size[worst]:
        i, j = int(rows[worst]), int(columns[worst])
        raise ValueError(
            f"the {what} is not symmetric: {A[i, j]:.6g} at {names.named(i)}, {names.named(j)}, "
            f"{A[j, i]:.6g} mirrored; expected a symmetric matrix"
        )


def _turned(
    A: sp.csr_array, names: DofNames, frames: Mapping[int, NDArray[np.float64]]
) -> sp.csr_array:
    """Matrix of displacements along x, y and z, where some nodes have directions of their own."""
    if not frames:
        return A
    turning = sp.lil_array(sp.eye_array(A.shape[0]))
    rows = {key: row for row, key in enumerate(names.keys.tolist())}
    for node, axes in frames.items():
        for first in (1, 4):
            node_rows = [rows.get(8 * node + first + i) for i in range(3)]
            if None in node_rows and any(row is not None for row in node_rows):
                raise ValueError(
                    f"node {node} has directions of its own and not all of them in the matrices; "
                    "expected all three translations or rotations"
                )
            for i, row in enumerate(node_rows):
                for j, column in enumerate(node_rows):
                    if row is not None and column is not None:
                        # Columns of `axes` are the node's directions: u_own = axesᵀ u.
                        turning[row, column] = axes[j, i]
    T = sp.csr_array(turning)
    return sp.csr_array(T.T @ A @ T)


def _in_si(A: sp.csr_array, layout: DofLayout, units: "UnitsTable") -> sp.csr_array:
    """Energy is force times length; displacements count in the unit of length, rotations in rad."""
    if units.length == units.force == 1.0:
        return A
    scale = np.where(layout.is_rotation | layout.is_scalar, 1.0, 1.0 / units.length)
    energy = units.force * units.length
    if (scale == scale[0]).all():
        return A * (energy * scale[0] ** 2)
    S = sp.diags_array(scale)
    return sp.csr_array(S @ (energy * A) @ S)


def _symmetric(A: sp.csr_array) -> sp.csr_array:
    """The mean of both triangles, sorted."""
    symmetric = A if not (A - A.T).nnz else sp.csr_array((A + A.T) * 0.5)
    symmetric.sum_duplicates()
    return symmetric
