"""Stiffness and mass of isoparametric solids: tetrahedra, hexahedra and wedges.

Shape functions are scikit-fem's, in the weak forms of :mod:`carrierflex.fe.scikit_fem_path`,
integrated in full over the element's own geometry.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.quadrature import get_quadrature
from skfem.refdom import RefHex, RefLine, RefTet, RefTri

from carrierflex.fe.materials import Material, material_of
from carrierflex.geometry.given_meshes.solid_files import (
    REFERENCE_NODES,
    SolidMesh,
    matching_nodes,
)

FloatArray = NDArray[np.float64]
#: scikit-fem's element of every kind; it has no quadratic wedge and no pyramid.
_ELEMENTS = {
    "tetra": skfem.ElementTetP1,
    "tetra10": skfem.ElementTetP2,
    "hexahedron": skfem.ElementHex1,
    "hexahedron20": skfem.ElementHexS2,
    "hexahedron27": skfem.ElementHex2,
    "wedge": skfem.ElementWedge1,
}
#: Order of the rules of stiffness and of mass, along each direction of hexahedra and wedges: exact
#: for straight elements.
_ORDERS = {
    "tetra": (1, 2), "tetra10": (2, 4), "hexahedron": (3, 3), "hexahedron20": (5, 5),
    "hexahedron27": (5, 5), "wedge": (2, 2),
}  # fmt: skip
#: Kinds that are too stiff in bending.
LINEAR = ("tetra", "hexahedron", "wedge")
#: Entries of elements' matrices that are made at once.
_ENTRIES_AT_ONCE = 10_000_000


@dataclass(frozen=True, eq=False)
class _Rule:
    """Shape functions (q, m), their gradients (q, m, 3) and weights (q,) on the unit element."""

    shapes: FloatArray
    gradients: FloatArray
    weights: FloatArray


def solid_matrices(
    mesh: SolidMesh, materials: Mapping[str, Material]
) -> tuple[sp.csr_array, sp.csr_array]:
    """Stiffness and consistent mass of a mesh.

    Parameters
    ----------
    mesh : SolidMesh
        Nodes in metres, n of them.
    materials : mapping of str to Material
        Material of every group of elements.

    Returns
    -------
    K, M : csr_array, shape (3 n, 3 n)
        [N/m] and [kg]; x, y and z of a node one after another.

    Raises
    ------
    ValueError
        Where a group has no material.
    """
    n = len(mesh.points)
    K, M = sp.csr_array((3 * n, 3 * n)), sp.csr_array((n, n))
    for kind, group, nodes in mesh.blocks:
        at_once = max(1, _ENTRIES_AT_ONCE // (3 * nodes.shape[1]) ** 2)
        for first in range(0, len(nodes), at_once):
            some = nodes[first : first + at_once]
            stiffness, mass = _element_matrices(
                mesh.points[some], kind, material_of(materials, group)
            )
            dofs = (3 * some[:, :, None] + np.arange(3)).reshape(len(some), -1)
            K = K + _added(stiffness, dofs, 3 * n)
            M = M + _added(mass, some, n)
    return K, sp.csr_array(sp.kron(M, sp.eye_array(3)))


def _added(matrices: FloatArray, rows: NDArray[np.int64], n: int) -> sp.csr_array:
    """Sum of element matrices (k, m, m) at their rows (k, m)."""
    m = rows.shape[1]
    first, second = np.repeat(rows, m, axis=1), np.tile(rows, (1, m))
    index_pairs = (first.ravel().astype(np.int32), second.ravel().astype(np.int32))
    return sp.csr_array(sp.coo_array((matrices.ravel(), index_pairs), shape=(n, n)))


def inverted_elements(mesh: SolidMesh) -> Iterator[tuple[str, str, int]]:
    """Kind, group and count of elements whose volume turns inside out somewhere."""
    for kind, group, nodes in mesh.blocks:
        determinants = np.linalg.det(_jacobians(mesh.points[nodes], _rule(kind, _ORDERS[kind][1])))
        count = int((determinants.min(axis=1) <= 0.0).sum())
        if count:
            yield kind, group, count


def refuse_inverted(mesh: SolidMesh, where: str) -> None:
    """Raise ValueError where elements of the file `where` turn inside out."""
    for kind, group, count in inverted_elements(mesh):
        raise ValueError(
            f"{where}: {count} elements of type {kind} in group {group!r} are turned inside out; "
            "expected positive volumes"
        )


def linear_warnings(mesh: SolidMesh) -> Iterator[str]:
    """What is to be told of elements that are too stiff in bending, with kinds and counts."""
    counts = {kind: 0 for kind in LINEAR}
    for kind, _, nodes in mesh.blocks:
        if kind in counts:
            counts[kind] += len(nodes)
    counted = [f"{count} of type {kind}" for kind, count in counts.items() if count]
    if counted:
        yield (
            f"linear elements, {', '.join(counted)}: too stiff in bending; quadratic elements of "
            "the same edge length are much more accurate"
        )


def _element_matrices(
    points: FloatArray, kind: str, material: Material
) -> tuple[FloatArray, FloatArray]:
    """Stiffness (k, 3 m, 3 m), and mass in one direction (k, m, m), of elements of one kind."""
    of_stiffness, of_mass = (_rule(kind, order) for order in _ORDERS[kind])
    lam, mu = material.lame
    J = _jacobians(points, of_stiffness)
    volumes = np.linalg.det(J) * of_stiffness.weights
    # Gradients of the shape functions in space: g = dN/dξ J⁻¹.
    g = np.einsum("qmi,kqij->kqmj", of_stiffness.gradients, np.linalg.inv(J), optimize=True)
    # λ ∂u_a/∂x_a ∂v_b/∂x_b + μ (∂u_a/∂x_b ∂v_b/∂x_a + δ_ab ∇u·∇v)
    products = np.einsum("kq,kqma,kqnb->kmanb", volumes, g, g, optimize=True)
    K = lam * products + mu * products.transpose(0, 1, 4, 3, 2)
    along = mu * np.einsum("kmana->kmn", products)
    for axis in range(3):
        K[:, :, axis, :, axis] += along
    volumes = np.linalg.det(_jacobians(points, of_mass)) * of_mass.weights
    shapes = of_mass.shapes
    M = material.rho * np.einsum("kq,qm,qn->kmn", volumes, shapes, shapes, optimize=True)
    size = 3 * points.shape[1]
    return K.reshape(-1, size, size), M


def _jacobians(points: FloatArray, rule: _Rule) -> FloatArray:
    """``J = dx/dξ`` at the points of a rule, shape (k, q, 3, 3), rows x, columns ξ."""
    return np.einsum("kma,qmi->kqai", points, rule.gradients, optimize=True)


@cache
def _rule(kind: str, order: int) -> _Rule:
    element = _ELEMENTS[kind]()
    quadrature_points, weights = _quadrature(kind, order)
    node_of = matching_nodes(np.asarray(element.doflocs), REFERENCE_NODES[kind])
    values = [element.lbasis(quadrature_points, int(i)) for i in node_of]
    ones = np.ones(len(weights))
    shapes = np.stack([value * ones for value, _ in values], axis=-1)
    gradients = np.stack([(gradient * ones).T for _, gradient in values], axis=1)
    return _Rule(shapes, gradients, weights)


def _quadrature(kind: str, order: int) -> tuple[FloatArray, FloatArray]:
    if kind.startswith("tetra"):
        points, weights = get_quadrature(RefTet, order)
    elif kind.startswith("hexahedron"):
        points, weights = get_quadrature(RefHex, order)
    else:
        # scikit-fem's own rule of a wedge sums to half its volume.
        (across, w), (along, v) = get_quadrature(RefTri, order), get_quadrature(RefLine, order)
        points = np.concatenate([np.repeat(across, v.size, axis=1), np.tile(along, w.size)])
        weights = np.outer(w, v).ravel()
    return np.asarray(points, np.float64), np.asarray(weights, np.float64)
