"""Stiffness and mass: symmetry, rigid motion, mass properties, patch test.

And another assembly of the same matrix.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness, assemble_stiffness_and_mass
from carrierflex.fe.materials import BODY_MATERIALS, CAST_IRON, STEEL
from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.geometry.quality import mesh_quality
from tests.analytic import box_inertia
from tests.fe.box_meshes import box_mesh

MATERIALS = {"carrier": CAST_IRON}
STRUCTURES = pytest.mark.parametrize(
    "body", ["flexible_structure", "stiff_structure", "pin_structure"]
)


@STRUCTURES
def test_stiffness_and_mass_are_exactly_symmetric(body, request):
    structure = request.getfixturevalue(body)
    assert abs(structure.K - structure.K.T).max() == 0.0
    assert abs(structure.M - structure.M.T).max() == 0.0


@STRUCTURES
def test_rigid_motions_cause_no_force(body, request):
    structure = request.getfixturevalue(body)
    R = rigid_motion(structure.points, structure.points.mean(axis=0)).reshape(-1, 6)
    force = np.abs(structure.K @ R)
    # Scale: the largest force any single stiffness entry makes under the same motion.
    assert (force.max(axis=0) < 1e-9 * abs(structure.K).max() * np.abs(R).max(axis=0)).all()


def test_a_small_free_body_has_six_zero_energy_modes_and_no_more():
    mesh = box_mesh((0.3, 0.1, 0.1), (2, 1, 1))
    eigenvalues = np.linalg.eigvalsh(assemble_stiffness(mesh, MATERIALS).toarray())
    assert (np.abs(eigenvalues[:6]) < 1e-9 * eigenvalues[-1]).all()
    assert eigenvalues[6] > 1e-6 * eigenvalues[-1]


def test_mass_properties_of_a_box_are_exact():
    lengths, points_to_centre = (0.4, 0.1, 0.2), np.array([0.2, 0.05, 0.1])
    mesh = box_mesh(lengths, (2, 2, 1))
    R = rigid_motion(mesh.points, points_to_centre).reshape(-1, 6)
    rigid = R.T @ (assemble_mass(mesh, MATERIALS) @ R)
    mass = CAST_IRON.rho * np.prod(lengths)
    # Rounding; the box is straight and quadratic fields are integrated exactly.
    assert_allclose(rigid[:3, :3], mass * np.eye(3), rtol=0.0, atol=1e-12 * mass)
    assert_allclose(rigid[:3, 3:], 0.0, rtol=0.0, atol=1e-12 * mass)
    assert_allclose(rigid[3:, 3:], box_inertia(mass, lengths), rtol=0.0, atol=1e-12 * mass)


@pytest.mark.parametrize(
    ("variant", "body"),
    [("flexible_mesh", "flexible_structure"), ("stiff_mesh", "stiff_structure")],
)
def test_total_mass_is_density_times_the_volume_of_each_body(
    variant, body, request, one_pin_mesh, flexible_mesh
):
    mesh, M = request.getfixturevalue(variant), request.getfixturevalue(body).M
    pins = mesh_quality(mesh).volume - mesh_quality(flexible_mesh).volume
    expected = CAST_IRON.rho * mesh_quality(flexible_mesh).volume + STEEL.rho * pins
    x = np.tile([1.0, 0.0, 0.0], len(mesh.points))
    # The volumes of two meshes' carriers agree to the geometry error of the bores, some 1e-5.
    assert_allclose(x @ (M @ x), expected, rtol=2e-5)


def test_patch_test_linear_displacement_leaves_no_interior_force_and_has_its_exact_energy():
    mesh = box_mesh((0.3, 0.2, 0.2), (3, 2, 2))
    on_skin = np.isin(np.arange(len(mesh.points)), mesh.surface("skin"))
    gradient = np.array([[1.0, 0.4, -0.2], [0.1, -0.7, 0.3], [0.5, 0.2, 0.6]]) * 1e-3
    K = assemble_stiffness(mesh, MATERIALS)
    u = (mesh.points @ gradient.T).ravel()
    force = (K @ u).reshape(-1, 3)
    strain = (gradient + gradient.T) / 2.0
    lam, mu = CAST_IRON.lame
    stress = lam * np.trace(strain) * np.eye(3) + 2.0 * mu * strain
    assert not on_skin.all()
    assert_allclose(force[~on_skin], 0.0, rtol=0.0, atol=1e-12 * np.abs(force).max())
    assert_allclose(u @ (K @ u), 0.012 * np.sum(stress * strain), rtol=1e-12)  # 0.012 m^3, rounding


def test_stiffness_and_mass_scale_with_the_material_of_each_body(stiff_half):
    K = assemble_stiffness(stiff_half, BODY_MATERIALS)
    only = {"carrier": CAST_IRON, "pins": CAST_IRON}
    pin_nodes = np.setdiff1d(
        np.arange(len(stiff_half.points)), stiff_half.tets[stiff_half.bodies["carrier"]]
    )
    other = assemble_stiffness(stiff_half, only)
    carrier_nodes = np.setdiff1d(
        np.arange(len(stiff_half.points)), stiff_half.tets[stiff_half.bodies["pins"]]
    )
    assert abs(K[3 * carrier_nodes] - other[3 * carrier_nodes]).max() == 0.0
    assert abs(K[3 * pin_nodes] - other[3 * pin_nodes]).max() > 0.01 * abs(K).max()


def test_both_matrices_at_once_are_those_made_one_by_one(stiff_half):
    K, M = assemble_stiffness_and_mass(stiff_half, BODY_MATERIALS)
    for once, alone in (
        (K, assemble_stiffness(stiff_half, BODY_MATERIALS)),
        (M, assemble_mass(stiff_half, BODY_MATERIALS)),
    ):
        assert (once.indptr == alone.indptr).all()
        assert (once.indices == alone.indices).all()
        assert (once.data == alone.data).all()


def test_a_body_without_material_is_refused(stiff_half):
    message = r"body 'pins' has no material; materials are given for carrier"
    with pytest.raises(ValueError, match=message):
        assemble_stiffness(stiff_half, MATERIALS)
    with pytest.raises(ValueError, match=message):
        assemble_mass(stiff_half, MATERIALS)
