"""Orders of convergence of the quadratic tetrahedra on curved bodies.

The solutions are exact and three-dimensional.

Beside the straight bars of test_bars.py (work and frequency at fourth order): displacement in the
mean square at third order, work and frequency at fourth, the geometry converging with them; every
rate is bounded from both sides, one too good being as suspect as one too low.
"""

import numpy as np
import pytest
import skfem
from numpy.testing import assert_allclose
from scipy.sparse.linalg import eigsh
from scipy.spatial import cKDTree

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness
from carrierflex.fe.materials import STEEL
from carrierflex.reduction.held_structure import GroundedBody
from tests.analytic import pressed_ring, torsional_frequency
from tests.fe.box_meshes import ring_mesh, round_bar

RADIUS = 0.1
THICKNESS = 0.06
LENGTH = 0.03
PRESSURE = 1e7
RADII = (RADIUS - THICKNESS / 2.0, RADIUS + THICKNESS / 2.0)
CELLS = np.array([1, 2, 3])


def scalar_basis(mesh, make=skfem.Basis, **options):
    """Scalar quadratic basis on the curved mesh, and our number of each of its dofs."""
    quadratic = skfem.MeshTet2(
        np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tets.T)
    )
    basis = make(quadratic, skfem.ElementTetP2(), **options)
    distance, nodes = cKDTree(mesh.points).query(basis.doflocs.T)
    assert distance.max() < 1e-12
    return basis, nodes


def bore_pressure(mesh):
    """Consistent nodal forces of unit pressure in the bore."""
    f = np.zeros((len(mesh.points), 3))
    quadratic = skfem.MeshTet2(
        np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tets.T)
    )
    # The middle of a facet's corners lies within the bore's circle for the bore's facets only.
    facets = quadratic.facets_satisfying(
        lambda x: np.hypot(x[1], x[2]) < RADII[0], boundaries_only=True
    )
    assert len(facets) == len(mesh.surface("bore"))
    basis, nodes = scalar_basis(mesh, skfem.FacetBasis, facets=facets, intorder=5)
    for axis in range(3):
        f[nodes, axis] += skfem.LinearForm(lambda v, w, axis=axis: -w.n[axis] * v).assemble(basis)
    return f.ravel()


def without_rigid_motion(u, M, rigid):
    return u - rigid @ np.linalg.solve(rigid.T @ (M @ rigid), rigid.T @ (M @ u))


def mean_square_error(mesh, u):
    """Root of the integral of |u - u_exact|², over that of |u_exact|²."""
    basis, nodes = scalar_basis(mesh, intorder=6)
    x = basis.global_coordinates().value
    result = [basis.interpolate(u.reshape(-1, 3)[nodes, axis]).value for axis in range(3)]
    exact = pressed_ring(x, RADII, PRESSURE, STEEL, LENGTH / 2.0)
    difference = sum((a - b) ** 2 for a, b in zip(result, exact, strict=True))
    return np.sqrt((basis.dx * difference).sum() / (basis.dx * sum(b**2 for b in exact)).sum())


@pytest.fixture(scope="module")
def pressed_rings():
    """Relative errors of displacement and of work, coarse to fine."""
    errors = []
    for n in CELLS:
        mesh = ring_mesh(RADIUS, THICKNESS, LENGTH, (12 * n, 2 * n, n))
        materials = {"carrier": STEEL}
        body = GroundedBody(assemble_stiffness(mesh, materials), mesh.points)
        f = PRESSURE * bore_pressure(mesh)
        u = without_rigid_motion(
            body.displacement(f), assemble_mass(mesh, materials), body.rigid_modes
        )
        at_bore = pressed_ring(np.array([0.0, 0.0, RADII[0]]), RADII, PRESSURE, STEEL, 0.0)[2]
        work = PRESSURE * 2.0 * np.pi * RADII[0] * LENGTH * at_bore
        errors.append((mean_square_error(mesh, u), f @ u / work - 1.0))
    return np.array(errors)


def slope(errors, cells):
    return -np.polyfit(np.log(cells), np.log(np.abs(errors)), 1)[0]


def test_displacement_of_a_pressed_ring_converges_at_third_order(pressed_rings):
    errors = pressed_rings[:, 0]
    assert errors[-1] < 1e-4, errors
    assert 2.7 < slope(errors, CELLS) < 3.4, errors


def test_work_on_a_pressed_ring_converges_at_fourth_order(pressed_rings):
    errors = pressed_rings[:, 1]
    assert np.abs(errors[-1]) < 1e-5, errors
    assert 3.4 < slope(errors, CELLS) < 4.5, errors


@pytest.mark.long
def test_torsional_frequency_of_a_round_bar_converges_at_fourth_order():
    radius = 0.05
    length = 0.1
    cells = np.array([2, 3, 4])
    exact, errors = torsional_frequency(length, *STEEL.lame[1:], STEEL.rho), []
    for n in cells:
        mesh = round_bar(radius, length, n, n_long=n)
        materials = {"carrier": STEEL}
        K, M = assemble_stiffness(mesh, materials), assemble_mass(mesh, materials)
        squares, shapes = eigsh(K.tocsc(), k=6, M=M.tocsc(), sigma=exact**2)
        twist = np.cos(np.pi * mesh.points[:, 0] / length)[:, None] * np.cross(
            [1.0, 0.0, 0.0], mesh.points
        )
        share = (twist.ravel() @ (M @ shapes)) ** 2 / (twist.ravel() @ (M @ twist.ravel()))
        assert_allclose(share.max(), 1.0, rtol=0.0, atol=1e-3)
        errors.append(squares[share.argmax()] / exact**2 - 1.0)
    assert np.abs(errors[-1]) < 4e-3, errors
    assert 3.3 < slope(errors, cells) < 4.5, errors
