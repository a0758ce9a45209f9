"""Assembly of K and M against scikit-fem's own elasticity forms, in one run.

Run as `python benchmarks/assembly_against_scikit_fem.py [SIZE]`, SIZE the element edge length [m].
"""

import sys
import time

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from fe.assembly import assemble_mass, assemble_stiffness
from fe.materials import CAST_IRON
from geometry.carrier_mesh import flexible_carrier_mesh
from geometry.parameters import CarrierParameters


@skfem.BilinearForm
def vector_mass(u, v, w):
    return CAST_IRON.rho * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])


def timed(work):
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def stock(mesh):
    """K and M by scikit-fem's vector forms, in our order of degrees of freedom."""
    skfem_mesh = skfem.MeshTet2(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tets.T))
    element = skfem.ElementVector(skfem.ElementTetP2())
    stiffness_basis = skfem.CellBasis(skfem_mesh, element, intorder=2)
    K = linear_elasticity(*lame_parameters(CAST_IRON.E, CAST_IRON.nu)).assemble(stiffness_basis)
    M = vector_mass.assemble(skfem.CellBasis(skfem_mesh, element, intorder=4))
    ours = np.empty(stiffness_basis.N, dtype=np.int64)
    ours[stiffness_basis.element_dofs] = (3 * mesh.tets[:, :, None] + np.arange(3)).reshape(len(mesh.tets), 30).T
    P = sp.csr_array((np.ones(len(ours)), (ours, np.arange(len(ours)))))
    return P @ K @ P.T, P @ M @ P.T


def main(size=0.045):
    materials = {"carrier": CAST_IRON}
    warm_up = flexible_carrier_mesh(CarrierParameters(), 0.1 if size > 0.1 else 0.06)
    assemble_stiffness(warm_up, materials), assemble_mass(warm_up, materials)
    mesh = flexible_carrier_mesh(CarrierParameters(), size)
    (K, M), ours = timed(lambda: (assemble_stiffness(mesh, materials), assemble_mass(mesh, materials)))
    (K_stock, M_stock), theirs = timed(lambda: stock(mesh))
    for name, a, b in (("K", K, K_stock), ("M", M, M_stock)):
        print(f"{name}: largest difference {abs(a - b).max() / abs(b).max():.1e} of the largest entry")
    print(f"{3 * len(mesh.points)} unknowns: ours {ours:.2f} s, scikit-fem {theirs:.2f} s, ratio {theirs / ours:.1f}")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
