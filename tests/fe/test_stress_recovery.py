"""Stress rows: exact for fields of linear stress, none for rigid motion, singular edges known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.materials import STEEL
from carrierflex.fe.stress_recovery import reentrant_nodes, stress_rows
from carrierflex.geometry.tet_mesh import boundary_facets
from tests.fe.box_meshes import box_mesh, round_bar

MATERIALS = {"carrier": STEEL}
#: Stress of the fields below [Pa].
SIZE = 1e8


def corner_nodes(mesh):
    return np.unique(boundary_facets(mesh.tets)[:, :3])


def recovered(mesh, field):
    """Stress (k, 6) at the boundary's corner nodes of a displacement field of the points."""
    nodes = corner_nodes(mesh)
    u = field(mesh.points).ravel()
    return nodes, (stress_rows(mesh, nodes, MATERIALS) @ u).reshape(-1, 6)


@pytest.mark.parametrize("mesh", [box_mesh((0.3, 0.1, 0.2), (3, 2, 2)), round_bar(0.1, 0.3, 4)])
def test_uniaxial_and_shear_strain_give_hookes_stress(mesh):
    strain = np.array([[1.0, 0.4, -0.2], [0.4, -0.5, 0.3], [-0.2, 0.3, 0.7]]) * SIZE / STEEL.E
    lam, mu = STEEL.lame
    expected = lam * np.trace(strain) * np.eye(3) + 2.0 * mu * strain
    _, stress = recovered(mesh, lambda x: x @ strain)
    axes = ([0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1])
    assert_allclose(stress, np.tile(expected[axes], (len(stress), 1)), rtol=0.0, atol=1e-6 * SIZE)


def test_pure_bending_is_exact_and_rigid_motion_has_no_stress():
    mesh = box_mesh((0.3, 0.1, 0.2), (3, 2, 2))
    k, nu = SIZE / STEEL.E / 0.1, STEEL.nu

    def bending(x):
        # Timoshenko and Goodier, Theory of Elasticity, section 102: sigma_xx = E k y.
        a, b, c = x.T
        return np.stack(
            [k * a * b, -0.5 * k * (a**2 + nu * (b**2 - c**2)), -nu * k * b * c], axis=1
        )

    nodes, stress = recovered(mesh, bending)
    expected = np.zeros_like(stress)
    expected[:, 0] = STEEL.E * k * mesh.points[nodes, 1]
    assert_allclose(stress, expected, rtol=0.0, atol=1e-6 * SIZE)
    turn = np.array([1e-3, -2e-3, 3e-3])
    _, stress = recovered(mesh, lambda x: 0.01 + np.cross(turn, x))
    assert np.abs(stress).max() < 1e-6 * SIZE


def test_only_concave_edges_are_reentrant():
    # A column on a plate: the edge where they meet is concave, the others are not.
    mesh = box_mesh((0.3, 0.3, 0.2), (3, 3, 2))
    centres = mesh.points[mesh.tets[:, :4]].mean(axis=1)
    is_column = (np.abs(centres[:, :2] - 0.15) < 0.05).all(axis=1)
    tets = mesh.tets[(centres[:, 2] < 0.1) | is_column]
    nodes, triangles = np.unique(boundary_facets(tets)[:, :3], return_inverse=True)
    points = mesh.points[nodes]
    reentrant = reentrant_nodes(points, triangles.reshape(-1, 3))
    on_edge = np.isclose(points[:, 2], 0.1) & (np.abs(points[:, :2] - 0.15) < 0.0501).all(axis=1)
    assert (reentrant == on_edge).all()
    assert on_edge.sum() == 4


def test_a_mid_side_node_is_refused():
    mesh = box_mesh((0.3, 0.1, 0.2), (3, 2, 2))
    with pytest.raises(ValueError, match="is no corner of an element; expected corner nodes"):
        stress_rows(mesh, mesh.tets[:1, 9], MATERIALS)
