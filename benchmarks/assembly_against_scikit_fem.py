"""Assembly of K and M against scikit-fem's own elasticity forms.

    python -m benchmarks.assembly_against_scikit_fem [SIZE]

0.045, 0.03 and 0.022 make 59 000, 126 000 and 262 000 unknowns.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from benchmarks.measured import fastest
from benchmarks.ratio import DIFFERENCE, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.materials import CAST_IRON
from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.tet_mesh import TetMesh

QUICK = {"size": 0.06}


def ratios(size: float = 0.045) -> Iterator[Ratio]:
    """Time of K and M together, and what the two codes' matrices differ by.

    Parameters
    ----------
    size
        Element edge length [m].
    """
    materials = {"carrier": CAST_IRON}
    # compiles the kernels
    assemble_stiffness_and_mass(flexible_carrier_mesh(CarrierParameters(), 0.1), materials)
    mesh = flexible_carrier_mesh(CarrierParameters(), size)
    case = f"{3 * len(mesh.points)} unknowns"
    ours = fastest(lambda: assemble_stiffness_and_mass(mesh, materials), 5)
    stock = fastest(lambda: _stock_matrices(mesh), 3)
    note = "fastest of five and of three"
    yield Ratio(case, TIME, ours.wall, "scikit-fem", stock.wall, at_least(20), note)
    *matrices, basis = stock.result
    for name, a, b in zip("KM", ours.result, matrices, strict=True):
        difference = abs(a - _in_our_order(b, basis, mesh)).max() / abs(b).max()
        note = "largest, over the largest entry"
        yield Ratio(
            f"{name}, {case}", DIFFERENCE, difference, "scikit-fem", None, at_most(1e-12), note
        )


@skfem.BilinearForm
def _mass(u: Any, v: Any, w: Any) -> Any:
    return CAST_IRON.rho * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])


def _stock_matrices(mesh: TetMesh) -> tuple[sp.csr_array, sp.csr_array, skfem.CellBasis]:
    """K and M by scikit-fem's vector forms, and the basis that numbers their degrees of freedom."""
    points = np.ascontiguousarray(mesh.points.T)
    skfem_mesh = skfem.MeshTet2(points, np.ascontiguousarray(mesh.tets.T))
    element = skfem.ElementVector(skfem.ElementTetP2())
    stiffness_basis = skfem.CellBasis(skfem_mesh, element, intorder=2)
    elasticity = linear_elasticity(*lame_parameters(CAST_IRON.E, CAST_IRON.nu))
    M = _mass.assemble(skfem.CellBasis(skfem_mesh, element, intorder=4))
    return elasticity.assemble(stiffness_basis), M, stiffness_basis


def _in_our_order(matrix: sp.csr_array, basis: skfem.CellBasis, mesh: TetMesh) -> sp.csr_array:
    ours = np.empty(basis.N, dtype=np.int64)
    our_dofs = 3 * mesh.tets[:, :, None] + np.arange(3)
    ours[basis.element_dofs] = our_dofs.reshape(len(mesh.tets), 30).T
    P = sp.csr_array((np.ones(len(ours)), (ours, np.arange(len(ours)))))
    return P @ matrix @ P.T


if __name__ == "__main__":
    run_alone(ratios)
