"""Assembly and statics by scikit-fem alone: the plain path beside the compiled one.

It reads like the weak form (:mod:`carrierflex.fe.weak_forms`) and takes some fifty times longer;
the compiled assembly is tested against it.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from numpy.typing import NDArray
from skfem.helpers import ddot, dot, eye, sym_grad, trace

from carrierflex.fe.assembly import MASS_ORDER, STIFFNESS_ORDER
from carrierflex.fe.factorisation import superlu_solution
from carrierflex.fe.materials import Material, material_of
from carrierflex.geometry.tet_mesh import TetMesh


def stiffness_and_mass_by_scikit_fem(
    mesh: TetMesh, materials: Mapping[str, Material]
) -> tuple[sp.csr_array, sp.csr_array]:
    """K [N/m] and M [kg] of the free structure, assembled by scikit-fem.

    Parameters
    ----------
    mesh : TetMesh
        Quadratic tetrahedra, n nodes.
    materials : mapping of str to Material
        Material of every body of the mesh.

    Returns
    -------
    K, M : csr_array, shape (3 n, 3 n)
        Degrees of freedom node by node, as :func:`carrierflex.fe.assembly.assemble_stiffness` has
        them.

    Raises
    ------
    ValueError
        Where a body has no material.
    """
    n_dofs = 3 * len(mesh.points)
    K, M = sp.csr_array((n_dofs, n_dofs)), sp.csr_array((n_dofs, n_dofs))
    for body, elements in mesh.bodies.items():
        material = material_of(materials, body)
        K = K + _assembled(stiffness_form(*material.lame), mesh, elements, STIFFNESS_ORDER)
        M = M + _assembled(mass_form(material.rho), mesh, elements, MASS_ORDER)
    return K, M


def displacement_by_scikit_fem(
    K: sp.csr_array, fixed: NDArray[np.int64], loads: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What :func:`carrierflex.fe.static.held_displacement` gives, by scikit-fem.

    ``solve(*condense(K, f, D=fixed))`` with scipy's direct solver, which factorises once for all
    columns.
    """
    condensed = skfem.condense(K, loads, x=np.zeros_like(loads), D=fixed)
    return np.asarray(skfem.solve(*condensed, solver=superlu_solution))


def _assembled(
    form: skfem.BilinearForm, mesh: TetMesh, elements: NDArray[np.int64], order: int
) -> sp.csr_array:
    """Matrix of a form over some elements, in the node-by-node order of degrees of freedom."""
    skfem_mesh = skfem.MeshTet2(
        np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tets.T)
    )
    element = skfem.ElementVector(skfem.ElementTetP2())
    basis = skfem.CellBasis(skfem_mesh, element, intorder=order, elements=elements)
    dof_of = np.empty(basis.N, dtype=np.int64)
    node_dofs = 3 * mesh.tets[:, :, None] + np.arange(3)
    dof_of[basis.dofs.element_dofs] = node_dofs.reshape(-1, 30).T
    matrix = sp.coo_array(form.assemble(basis))
    shape = (3 * len(mesh.points), 3 * len(mesh.points))
    return sp.csr_array((matrix.data, (dof_of[matrix.row], dof_of[matrix.col])), shape=shape)


def stiffness_form(lam: float, mu: float) -> skfem.BilinearForm:
    """Strain energy ``a(u, v) = ∫ (λ tr ε(u) I + 2 μ ε(u)) : ε(v) dV``.

    Parameters
    ----------
    lam, mu : float
        Lamé's constants [Pa].
    """

    def a(u: Any, v: Any, w: Any) -> Any:
        strain = sym_grad(u)
        stress = lam * eye(trace(strain), 3) + 2.0 * mu * strain
        return ddot(stress, sym_grad(v))

    return skfem.BilinearForm(a)


def mass_form(rho: float) -> skfem.BilinearForm:
    """Kinetic energy ``m(u, v) = ∫ ρ u · v dV``.

    Parameters
    ----------
    rho : float
        Density [kg/m³].
    """

    def m(u: Any, v: Any, w: Any) -> Any:
        return rho * dot(u, v)

    return skfem.BilinearForm(m)
