"""Assembly of K and M against scikit-fem's own elasticity forms, in one run.

Run as `python benchmarks/assembly_against_scikit_fem.py [SIZE]`, SIZE the element edge length [m]:
0.045, 0.03 and 0.022 make 59 000, 126 000 and 262 000 unknowns.
"""

import sys

import numpy as np
import scipy.sparse as sp
import skfem
from measured import fastest, print_ratios
from skfem.models.elasticity import lame_parameters, linear_elasticity

from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.materials import CAST_IRON
from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh
from carrierflex.geometry.parameters import CarrierParameters


@skfem.BilinearForm
def vector_mass(u, v, w):
    return CAST_IRON.rho * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])


def stock(mesh):
    """K and M by scikit-fem's vector forms, in scikit-fem's order of degrees of freedom, and that order."""
    skfem_mesh = skfem.MeshTet2(
        np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tets.T)
    )
    element = skfem.ElementVector(skfem.ElementTetP2())
    stiffness_basis = skfem.CellBasis(skfem_mesh, element, intorder=2)
    K = linear_elasticity(*lame_parameters(CAST_IRON.E, CAST_IRON.nu)).assemble(stiffness_basis)
    M = vector_mass.assemble(skfem.CellBasis(skfem_mesh, element, intorder=4))
    return K, M, stiffness_basis


def in_our_order(matrix, basis, mesh):
    ours = np.empty(basis.N, dtype=np.int64)
    ours[basis.element_dofs] = (
        (3 * mesh.tets[:, :, None] + np.arange(3)).reshape(len(mesh.tets), 30).T
    )
    P = sp.csr_array((np.ones(len(ours)), (ours, np.arange(len(ours)))))
    return P @ matrix @ P.T


def main(size=0.045):
    materials = {"carrier": CAST_IRON}
    assemble_stiffness_and_mass(
        flexible_carrier_mesh(CarrierParameters(), 0.1), materials
    )  # compiles the kernels
    mesh = flexible_carrier_mesh(CarrierParameters(), size)
    ours = fastest(lambda: assemble_stiffness_and_mass(mesh, materials), 5)
    theirs = fastest(lambda: stock(mesh), 3)
    print(
        f"{3 * len(mesh.points)} unknowns, fastest of five and three\nours         {ours}\nscikit-fem   {theirs}"
    )
    *matrices, basis = theirs.result
    differences = []
    for name, a, b in zip("KM", ours.result, matrices, strict=True):
        difference = abs(a - in_our_order(b, basis, mesh)).max() / abs(b).max()
        differences.append(
            (
                f"largest difference of {name}, over its largest entry",
                "< 1e-12",
                f"{difference:.1e}",
            )
        )
    print_ratios(
        [("scikit-fem's time over ours", ">= 20", f"{theirs.wall / ours.wall:.1f}"), *differences]
    )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
