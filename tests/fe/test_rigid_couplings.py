"""Rigid couplings: the surface follows its pilot, and the body only gets stiffer.

Loads keep their resultant.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.fe.structural_model import structural_model
from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure


@pytest.fixture(scope="module")
def rigid(flexible_structure, flexible_mesh):
    return rigidly_coupled(flexible_structure, flexible_mesh)


def test_surface_nodes_follow_their_pilot_as_one_rigid_piece(rigid, flexible_mesh):
    motion = np.array([1e-3, -2e-3, 3e-3, 1e-3, 2e-3, -1e-3])
    pilot = rigid.pilots[0]
    u = rigid.nodal_displacement(pilot.G.T @ motion).reshape(-1, 3)
    nodes = np.unique(flexible_mesh.surface(pilot.name))
    assert_allclose(
        u[nodes], rigid_motion(flexible_mesh.points[nodes], pilot.point) @ motion, atol=1e-17
    )
    others = np.setdiff1d(np.arange(len(u)), nodes)
    assert np.all(u[others] == 0.0)


def test_rigid_motion_of_the_body_meets_no_force_and_weighs_what_it_did(rigid, flexible_structure):
    R = rigid.rigid_modes
    assert_allclose(rigid.L @ R, flexible_structure.rigid_modes, atol=1e-12)
    assert np.abs(rigid.K @ R).max() < 1e-9 * np.abs(rigid.K.data).max()
    expected = flexible_structure.rigid_modes.T @ (
        flexible_structure.M @ flexible_structure.rigid_modes
    )
    assert_allclose(R.T @ (rigid.M @ R), expected, rtol=1e-9, atol=1e-9 * expected.max())


def test_force_and_moment_at_a_pilot_keep_their_resultant(rigid):
    load = np.array([1.0, 2.0, -3.0, 0.5, -0.25, 0.75])
    for pilot in rigid.pilots:
        resultant = rigid.rigid_modes.T @ (pilot.G.T @ load)
        assert_allclose(resultant[:3], load[:3], rtol=1e-12)
        assert_allclose(
            resultant[3:], load[3:] + np.cross(pilot.point, load[:3]), rtol=1e-9, atol=1e-12
        )


@pytest.mark.long
def test_rigid_pilots_are_stiffer_than_distributing_ones(rigid, flexible_structure):
    def compliance(structure):
        body = GroundedBody(structure.K, structure.points, structure.rigid_points)
        force = structure.pilots[3].G.T.toarray()
        u, _ = HeldStructure(body, structure.pilots[:1]).solve(force, np.zeros((6, 6)))
        return structure.pilots[3].G @ u

    softer = compliance(flexible_structure) - compliance(rigid)
    # Constraining a surface takes compliance away in every direction: the difference is positive
    # definite.
    assert np.linalg.eigvalsh((softer + softer.T) / 2.0).min() > 0.0


def test_surfaces_that_share_nodes_are_refused_by_name(flexible_mesh, carrier):
    overlapping = {
        **flexible_mesh.surfaces,
        "upwind_seat": flexible_mesh.surface("shaft_face")[:10],
    }
    mesh = replace(flexible_mesh, surfaces=overlapping)
    structure = structural_model("both", mesh, carrier, ("shaft_face", "upwind_seat"))
    with pytest.raises(
        ValueError,
        match=r"rigid surfaces 'shaft_face' and 'upwind_seat' share [0-9]+ nodes \([0-9]+ at ",
    ):
        rigidly_coupled(structure, mesh)


def test_some_pilots_can_be_rigid_while_the_others_stay_distributing(
    flexible_structure, flexible_mesh
):
    mixed = rigidly_coupled(flexible_structure, flexible_mesh, ("pin_2_upwind",))
    assert [pilot.name for pilot in mixed.pilots] == [
        pilot.name for pilot in flexible_structure.pilots
    ]
    load = np.array([1.0, 2.0, -3.0, 0.5, -0.25, 0.75])
    for pilot in mixed.pilots:
        resultant = mixed.rigid_modes.T @ (pilot.G.T @ load)
        assert_allclose(resultant[:3], load[:3], rtol=1e-12)
        assert_allclose(
            resultant[3:], load[3:] + np.cross(pilot.point, load[:3]), rtol=1e-9, atol=1e-12
        )
    rng = np.random.default_rng(0)
    u = rng.standard_normal(mixed.n_dofs)
    for before, after in zip(flexible_structure.pilots, mixed.pilots, strict=True):
        # A rigid surface's mean motion is its pilot's: the distributing rows read the same from the
        # displacement of all nodes.
        assert_allclose(before.G @ mixed.nodal_displacement(u), after.G @ u, rtol=0.0, atol=1e-11)


def test_a_rigid_pilot_that_the_body_does_not_have_is_refused(flexible_structure, flexible_mesh):
    with pytest.raises(
        KeyError, match="no pilot 'pin_4_upwind' to make rigid; the body has shaft_face, "
    ):
        rigidly_coupled(flexible_structure, flexible_mesh, ("pin_4_upwind",))


def test_a_rigid_surface_that_takes_a_distributing_pilots_nodes_is_refused(flexible_mesh, carrier):
    surfaces = {**flexible_mesh.surfaces, "upwind_seat": flexible_mesh.surface("shaft_face")[:20]}
    mesh = replace(flexible_mesh, surfaces=surfaces)
    structure = structural_model("both", mesh, carrier, ("shaft_face", "upwind_seat"))
    message = (
        r"with 'shaft_face' rigid the pilots cannot move independently: 'shaft_face' and "
        r"'upwind_seat' share \d+ nodes \("
    )
    with pytest.raises(ValueError, match=message):
        rigidly_coupled(structure, mesh, ("shaft_face",))
    # The other way round most of the face keeps its own displacement.
    assert rigidly_coupled(structure, mesh, ("upwind_seat",)).pilots[0].G.nnz
