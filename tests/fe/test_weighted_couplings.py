"""Distributing couplings with the user's weights, directions and components."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.assembly import assemble_mass, assemble_stiffness
from carrierflex.fe.couplings import distributing_pilot, weighted_pilot
from carrierflex.fe.factorisation import SingularMatrixError
from carrierflex.fe.materials import STEEL
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.fe.surface_integrals import rigid_motion, surface_moments
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure
from tests.fe.box_meshes import box_mesh

#: Off the face, off its normal and off its middle.
POINT = np.array([1.4, 0.1, 0.9])


@pytest.fixture(scope="module")
def mesh():
    return box_mesh((1.0, 0.8, 0.6), (2, 2, 2))


@pytest.fixture(scope="module")
def nodes(mesh):
    return np.unique(mesh.surface("end"))


def radial_frames(points, centre):
    """Axial, radial and tangential unit vectors about an axis along x, as rows.

    The axis goes through `centre`.
    """
    r = points - centre
    r[:, 0] = 0.0
    r /= np.linalg.norm(r, axis=1)[:, None]
    x = np.broadcast_to([1.0, 0.0, 0.0], r.shape)
    return np.stack([x, r, np.cross(x, r)], axis=1)


def resultant(pilot, mesh, load):
    """Force and moment about the pilot that its nodal forces add up to."""
    forces = pilot.nodal_forces(load).reshape(-1, 3)
    return np.concatenate(
        [forces.sum(axis=0), np.cross(mesh.points - pilot.point, forces).sum(axis=0)]
    )


@pytest.mark.parametrize("seed", range(5))
def test_any_weights_keep_force_moment_and_rigid_motion(mesh, nodes, seed):
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.1, 10.0, (len(nodes), 3)) * (rng.random((len(nodes), 3)) < 0.6)
    frames = np.linalg.qr(rng.standard_normal((len(nodes), 3, 3)))[0]
    pilot = weighted_pilot(mesh, "end", POINT, weights, frames=frames)
    load = rng.standard_normal(6)
    assert_allclose(resultant(pilot, mesh, load), load, rtol=0.0, atol=1e-12)  # rounding
    R = rigid_motion(mesh.points, POINT).reshape(-1, 6)
    assert_allclose(pilot.G @ R, np.eye(6), rtol=0.0, atol=1e-12)


def test_a_force_is_shared_in_proportion_to_the_weights(mesh, nodes):
    # At the weighted centre a force makes no moment: each node takes its own share of it.
    weights = np.random.default_rng(0).uniform(1.0, 5.0, len(nodes))
    centre = weights @ mesh.points[nodes] / weights.sum()
    pilot = weighted_pilot(mesh, "end", centre, weights)
    forces = pilot.nodal_forces([0.0, 2.0, 0.0, 0.0, 0.0, 0.0]).reshape(-1, 3)[nodes]
    assert_allclose(forces[:, 1], 2.0 * weights / weights.sum(), rtol=1e-12)
    assert_allclose(
        weighted_pilot(mesh, "end", centre, 7.0 * weights).G.toarray(),
        pilot.G.toarray(),
        atol=1e-14,
    )


def test_the_areas_own_shares_as_weights_give_the_areas_mean_translation(mesh, nodes):
    # Only the translation: moments need the integral of the square of the arm, which is not a sum
    # over nodes.
    centre = np.array([1.0, 0.4, 0.3])
    shares = np.maximum(surface_moments(mesh, mesh.surface("end"), centre)[0][0, nodes, 0], 0.0)
    summed, integrated = (
        weighted_pilot(mesh, "end", centre, shares),
        distributing_pilot(mesh, "end", centre),
    )
    assert_allclose(summed.G[:3].toarray(), integrated.G[:3].toarray(), rtol=0.0, atol=1e-13)
    assert np.abs(summed.G[3:].toarray() - integrated.G[3:].toarray()).max() > 1e-3


def test_directions_without_weight_carry_nothing(mesh, nodes):
    weights = np.tile([1.0, 0.0, 1.0], (len(nodes), 1))
    weights[:3] = [0.0, 1.0, 0.0]
    pilot = weighted_pilot(mesh, "end", POINT, weights)
    touched = np.zeros(mesh.points.shape, dtype=bool)
    touched.ravel()[np.unique(pilot.G.indices[np.abs(pilot.G.data) > 1e-14])] = True
    assert not touched[nodes][weights == 0.0].any()
    assert not np.delete(touched, nodes, axis=0).any()


def test_a_radial_hold_has_four_motions_and_is_refused_six(mesh):
    # The cube's skin held along the radius about the x axis only: nothing resists sliding along x
    # or turning about it.
    skin, axis = np.unique(mesh.surface("skin")), np.array([0.5, 0.4, 0.3])
    off_axis = np.linalg.norm((mesh.points[skin] - axis)[:, 1:], axis=1) > 1e-9
    frames = np.tile(np.eye(3), (len(skin), 1, 1))
    frames[off_axis] = radial_frames(mesh.points[skin[off_axis]], axis)
    weights = np.tile([0.0, 1.0, 0.0], (len(skin), 1)) * off_axis[:, None]
    pilot = weighted_pilot(mesh, "skin", axis, weights, frames=frames, components=(1, 2, 4, 5))
    load = np.array([0.0, 1.0, -2.0, 0.0, 0.5, 0.7])
    assert_allclose(resultant(pilot, mesh, load), load, rtol=0.0, atol=1e-12)
    message = (
        r"surface 'skin' with weights on \d+ nodes \(.*\) cannot hold a pilot's translation x, "
        r"rotation x: "
    )
    with pytest.raises(ValueError, match=message):
        weighted_pilot(mesh, "skin", axis, weights, frames=frames)
    with pytest.raises(
        ValueError,
        match=r"pilot 'skin' is loaded along its translation x, rotation x, which is not coupled",
    ):
        pilot.nodal_forces(np.ones(6))


def on_nodes(nodes, chosen):
    return np.isin(nodes, chosen).astype(float)


def test_nodes_in_line_hold_all_but_the_rotation_about_it(mesh, nodes):
    line = nodes[(mesh.points[nodes, 1] == 0.0)]
    weights = on_nodes(nodes, line)
    with pytest.raises(
        ValueError, match=rf"weights on {len(line)} nodes \(.* cannot hold a pilot's rotation z: "
    ):
        weighted_pilot(mesh, "end", mesh.points[line].mean(axis=0), weights)
    pilot = weighted_pilot(
        mesh, "end", mesh.points[line].mean(axis=0), weights, components=(0, 1, 2, 3, 4)
    )
    load = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 0.0])
    assert_allclose(resultant(pilot, mesh, load), load, rtol=0.0, atol=1e-12)
    # Off the line, the motion along x depends on the lost rotation as well.
    off_line = mesh.points[line].mean(axis=0) + np.array([0.0, 0.3, 0.0])
    with pytest.raises(ValueError, match=r"cannot hold a pilot's translation x, rotation z: "):
        weighted_pilot(mesh, "end", off_line, weights)


def test_a_single_node_holds_translations_only(mesh, nodes):
    weights = on_nodes(nodes, nodes[4])
    message = (
        r"weights on 1 node \(\d+ at .* m\) cannot hold a pilot's rotation x, rotation y, "
        r"rotation z: "
    )
    with pytest.raises(ValueError, match=message):
        weighted_pilot(mesh, "end", mesh.points[nodes[4]], weights)
    pilot = weighted_pilot(mesh, "end", mesh.points[nodes[4]], weights, components=(0, 1, 2))
    assert_allclose(
        pilot.nodal_forces([1.0, 2.0, 3.0, 0.0, 0.0, 0.0]).reshape(-1, 3)[nodes[4]], [1.0, 2.0, 3.0]
    )


def test_components_are_rows_of_the_full_coupling_in_the_order_asked_for(mesh):
    full = distributing_pilot(mesh, "end", POINT)
    some = distributing_pilot(mesh, "end", POINT, components=(5, 0, 3))
    assert_allclose(some.G.toarray(), full.G[[5, 0, 3]].toarray(), rtol=0.0, atol=0.0)
    load = np.array([2.0, 0.0, 0.0, -1.0, 0.0, 3.0])
    assert_allclose(resultant(some, mesh, load), load, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("components", [(), (0, 0), (1, 6), (-1,)])
def test_odd_components_are_refused(mesh, components):
    with pytest.raises(ValueError, match=r"components are \(.*\); expected some of 0 to 5"):
        distributing_pilot(mesh, "end", POINT, components=components)


def test_wrong_weights_are_refused_with_the_node(mesh, nodes):
    with pytest.raises(ValueError, match=rf"has {len(nodes)} nodes, weights have shape \(3,\)"):
        weighted_pilot(mesh, "end", POINT, np.ones(3))
    weights = np.ones(len(nodes))
    weights[2] = -1.0
    with pytest.raises(ValueError, match=rf"weight of node {nodes[2]} is -1.0"):
        weighted_pilot(mesh, "end", POINT, weights)
    weights[2] = np.nan
    with pytest.raises(ValueError, match=rf"weight of node {nodes[2]} is nan"):
        weighted_pilot(mesh, "end", POINT, weights)
    with pytest.raises(ValueError, match="all weights are zero"):
        weighted_pilot(mesh, "end", POINT, np.zeros(len(nodes)))
    with pytest.raises(ValueError, match=r"frames have shape \(2, 3, 3\)"):
        weighted_pilot(mesh, "end", POINT, np.ones(len(nodes)), frames=np.ones((2, 3, 3)))
    with pytest.raises(ValueError, match=r"frames deviate from orthonormal rows by 1.0e\+00"):
        weighted_pilot(
            mesh, "end", POINT, np.ones(len(nodes)), frames=2.0 * np.eye(3)[[0, 1, 1]] / 2.0
        )


def test_a_body_that_its_pilots_do_not_hold_is_not_reduced():
    mesh = box_mesh((1.0, 0.8, 0.6), (2, 2, 2))
    pilot = distributing_pilot(mesh, "end", POINT, components=(0, 1, 2))
    materials = {"carrier": STEEL}
    box = StructuralModel(
        "box",
        assemble_stiffness(mesh, materials),
        assemble_mass(mesh, materials),
        mesh.points,
        (pilot,),
    )
    with pytest.raises(
        SingularMatrixError, match=r"what is held holds 3 of 6 rigid motions of the body"
    ):
        craig_bampton(box, 1)
    # Held, it holds what it couples: translations of the face's mean, not its turning.
    start = distributing_pilot(mesh, "start", np.zeros(3))
    constrained = HeldStructure(GroundedBody(box.K, box.points), (pilot, start))
    u, reaction = constrained.solve(np.zeros((box.n_dofs, 1)), np.eye(9)[:, :1])
    assert_allclose(pilot.G @ u, np.eye(3)[:, :1], rtol=0.0, atol=1e-9)
    assert_allclose(start.G @ u, 0.0, rtol=0.0, atol=1e-9)
    assert_allclose(reaction[:3] + reaction[3:6], 0.0, rtol=0.0, atol=1e-9 * np.abs(reaction).max())
