"""Bars with exact three-dimensional solutions.

The elements give them exactly, or converge at their own order.
"""

import numpy as np
import pytest
import skfem
from numpy.testing import assert_allclose
from scipy.sparse.linalg import eigsh
from scipy.spatial import cKDTree

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness
from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.materials import STEEL, Material
from carrierflex.reduction.held_structure import GroundedBody
from tests.analytic import bending_rotation, cantilever_work, longitudinal_frequency, torsion_twist
from tests.fe.box_meshes import box_mesh, round_bar

#: Saint-Venant's flexure is exact in three dimensions only without lateral contraction.
NO_CONTRACTION = Material("no contraction", E=210e9, nu=0.0, rho=7850.0)


def twisted_ends(mesh, length, load, material):
    """Relative motion of the end pilots under the load at x = length and its reaction at x = 0."""
    start = distributing_pilot(mesh, "start", np.zeros(3))
    end = distributing_pilot(mesh, "end", np.array([length, 0.0, 0.0]))
    body = GroundedBody(assemble_stiffness(mesh, {"carrier": material}), mesh.points)
    u = body.displacement((end.G - start.G).T @ load)
    return (end.G - start.G) @ u


def test_torsion_of_a_round_bar_converges_to_saint_venants_twist():
    radius, length = 0.05, 0.1
    torque = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    refinements = np.array([3, 4, 6])
    exact = torsion_twist(1.0, length, radius, STEEL.lame[1])
    meshes = [round_bar(radius, length, n) for n in refinements]
    errors = np.array(
        [twisted_ends(mesh, length, torque, STEEL)[3] / exact - 1.0 for mesh in meshes]
    )
    assert (np.abs(errors) < [1e-3, 5e-4, 1.5e-4]).all(), errors
    slope = -np.polyfit(np.log(refinements), np.log(np.abs(errors)), 1)[0]
    # Fourth order for the circle, a little less near the axis, where this mesh's rings turn into
    # squares.
    assert 2.8 < slope < 4.2, errors


@pytest.mark.parametrize(("axis", "width", "height"), [(4, 0.02, 0.03), (5, 0.03, 0.02)])
def test_a_bar_bent_by_end_moments_has_exactly_the_beams_rotation(axis, width, height):
    # Pure bending is quadratic in the coordinates, and a pilot's traction is linear: nothing is
    # left to converge.
    mesh = box_mesh((0.2, 0.02, 0.03), (4, 1, 2))
    moment = np.eye(6)[axis] * 10.0
    mesh.points[:, 1:] -= [0.01, 0.015]
    rotation = twisted_ends(mesh, 0.2, moment, STEEL)[axis]
    assert_allclose(
        rotation, bending_rotation(10.0, 0.2, width, height, STEEL.E), rtol=1e-9
    )  # rounding


def test_a_stretched_bar_has_exactly_hookes_elongation():
    mesh = box_mesh((0.2, 0.02, 0.03), (2, 1, 1))
    mesh.points[:, 1:] -= [0.01, 0.015]
    stretch = twisted_ends(mesh, 0.2, np.array([1e3, 0.0, 0.0, 0.0, 0.0, 0.0]), STEEL)[0]
    assert_allclose(stretch, 1e3 * 0.2 / (STEEL.E * 0.02 * 0.03), rtol=1e-9)  # rounding


def flexure_load(mesh, lengths):
    """Consistent nodal forces of unit end shear.

    Parabolic shear at both ends, linear bending stress at x = 0.
    """
    length, width, height = lengths
    second = width * height**3 / 12.0
    quadratic = skfem.MeshTet2(
        np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.tets.T)
    )
    basis = skfem.Basis(quadratic, skfem.ElementTetP2())
    distance, nodes = cKDTree(mesh.points).query(basis.doflocs.T)
    assert distance.max() < 1e-12
    f = np.zeros((len(mesh.points), 3))

    def add(x_end, axis, traction):
        facets = basis.mesh.facets_satisfying(
            lambda x: np.abs(x[0] - x_end) < 1e-9, boundaries_only=True
        )
        end = skfem.FacetBasis(basis.mesh, basis.elem, facets=facets, intorder=4)
        f[nodes, axis] += skfem.LinearForm(
            lambda v, w: traction(w.x[2] - height / 2.0) * v
        ).assemble(end)

    add(length, 2, lambda z: (height**2 / 4.0 - z**2) / (2.0 * second))
    add(0.0, 2, lambda z: -(height**2 / 4.0 - z**2) / (2.0 * second))
    add(0.0, 0, lambda z: length * z / second)
    return f.ravel()


def test_cantilever_converges_to_saint_venants_flexure_at_fourth_order():
    lengths = (0.2, 0.05, 0.05)
    cells = np.array([2, 3, 4, 6])
    exact = cantilever_work(1.0, *lengths, NO_CONTRACTION.E)
    errors = []
    for n in cells:
        mesh = box_mesh(lengths, (2 * n, 1, n))
        f = flexure_load(mesh, lengths)
        body = GroundedBody(assemble_stiffness(mesh, {"carrier": NO_CONTRACTION}), mesh.points)
        errors.append(1.0 - f @ body.displacement(f) / exact)
    # Too stiff on every mesh (an energy minimum over fewer shapes), and fourth order in the element
    # size.
    assert (np.array(errors) > 0.0).all()
    assert errors[-1] < 1e-4
    slope = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert 3.6 < slope < 4.4, errors


def test_longitudinal_vibration_converges_from_above_at_fourth_order():
    length = 0.3
    cells = np.array([2, 3, 4, 6])
    errors = []
    exact = longitudinal_frequency(length, NO_CONTRACTION.E, NO_CONTRACTION.rho)
    for n in cells:
        mesh = box_mesh((length, 0.02, 0.02), (n, 1, 1))
        materials = {"carrier": NO_CONTRACTION}
        K, M = assemble_stiffness(mesh, materials), assemble_mass(mesh, materials)
        squares, shapes = eigsh(K.tocsc(), k=12, M=M.tocsc(), sigma=0.98 * exact**2)
        expected = np.zeros((len(mesh.points), 3))
        expected[:, 0] = np.cos(np.pi * mesh.points[:, 0] / length)
        mode = np.abs(expected.ravel() @ (M @ shapes)).argmax()
        errors.append(squares[mode] / exact**2 - 1.0)
    assert (np.array(errors) > 0.0).all()
    slope = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    assert 3.6 < slope < 4.4, errors
