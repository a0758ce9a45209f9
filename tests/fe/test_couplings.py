"""The distributing coupling.

A pilot moves with its surface and hands over force and moment, whole and unchanged.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.structural_model import carrier_pilot_points
from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.geometry.tet_mesh import TetMesh
from tests.fe.box_meshes import box_mesh

STRUCTURES = pytest.mark.parametrize(
    "body", ["flexible_structure", "stiff_structure", "pin_structure"]
)


@STRUCTURES
def test_a_rigid_motion_of_the_body_is_the_pilots_motion(body, request):
    structure = request.getfixturevalue(body)
    for pilot in structure.pilots:
        R = rigid_motion(structure.points, pilot.point).reshape(-1, 6)
        assert_allclose(pilot.G @ R, np.eye(6), rtol=0.0, atol=1e-12)  # rounding


@STRUCTURES
def test_nodal_forces_carry_the_pilots_force_and_moment(body, request):
    structure = request.getfixturevalue(body)
    load = np.array([1.0, -2.0, 3.0, 0.4, 0.5, -0.6])
    for pilot in structure.pilots:
        forces = (pilot.G.T @ load).reshape(-1, 3)
        moment = np.cross(structure.points - pilot.point, forces).sum(axis=0)
        assert_allclose(forces.sum(axis=0), load[:3], rtol=0.0, atol=1e-12)
        assert_allclose(moment, load[3:], rtol=0.0, atol=1e-12)


def test_forces_act_on_the_nodes_of_the_surface_only(flexible_structure, flexible_mesh):
    for pilot in flexible_structure.pilots:
        touched = np.unique(pilot.G.indices[pilot.G.data != 0.0] // 3)
        assert np.isin(touched, flexible_mesh.surface(pilot.name)).all()


def test_a_square_face_takes_a_third_of_the_force_at_its_mid_sides_and_none_at_corners():
    # Consistent weights of a quadratic triangle: 0 at corners, a third of its area at mid-sides.
    # Two triangles make the square; the diagonal's mid-side belongs to both.
    mesh = box_mesh((1.0, 1.0, 1.0), (1, 1, 1))
    pilot = distributing_pilot(mesh, "end", np.array([1.0, 0.5, 0.5]))
    nodes = np.unique(mesh.surface("end"))
    y, z = mesh.points[nodes, 1] - 0.5, mesh.points[nodes, 2] - 0.5
    G = pilot.G.toarray().reshape(6, -1, 3)[:, nodes]
    corner, middle = np.abs(y * z) > 0.1, (y == 0.0) & (z == 0.0)
    share = np.where(corner, 0.0, np.where(middle, 1.0 / 3.0, 1.0 / 6.0))
    for axis in range(3):
        assert_allclose(G[axis, :, axis], share, rtol=0.0, atol=1e-14)
    # A moment about y is held by axial forces at the mid-sides z = +-1/2, with the arm between
    # them: consistent shares of a linear traction 12 z are 12 ∫ N z dA.
    force = (pilot.G.T @ np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])).reshape(-1, 3)[nodes]
    assert_allclose(force[:, 0] @ z, 1.0, rtol=1e-13)
    assert_allclose(force[:, 0] @ y, 0.0, rtol=0.0, atol=1e-14)
    # Positive about y: the upper half is pulled along +x.
    assert force[z > 0.4, 0].sum() > 0.0


@pytest.mark.parametrize("distance", [0.3, 30.0, 3e3])
def test_a_pilot_far_off_its_surface_keeps_force_and_moment(distance):
    # Formed about the pilot itself, the fit would lose the fourth power of distance over size: all
    # digits at 3000 m.
    mesh = box_mesh((0.1, 0.2, 0.3), (1, 2, 2))
    point = np.array([0.1, 0.1, 0.15]) + distance * np.array([0.6, 0.0, -0.8])
    pilot = distributing_pilot(mesh, "end", point)
    R = rigid_motion(mesh.points, point).reshape(-1, 6)
    assert_allclose(
        pilot.G @ R, np.eye(6), rtol=0.0, atol=1e-15 * (10.0 * distance) ** 2
    )  # rounding of arms
    centre = distributing_pilot(mesh, "end", np.array([0.1, 0.1, 0.15]))
    # The surface has one rotation, wherever it is read.
    assert_allclose(pilot.G[3:].toarray(), centre.G[3:].toarray(), rtol=0.0, atol=1e-12)


def test_a_moved_pilot_moves_with_its_surface_as_one_rigid_piece():
    mesh = box_mesh((1.0, 1.0, 1.0), (1, 1, 1))
    centre, arm = np.array([1.0, 0.5, 0.5]), np.array([0.2, -0.1, 0.4])
    u = np.random.default_rng(3).standard_normal(mesh.points.size)
    at_centre, moved = (
        distributing_pilot(mesh, "end", point).G @ u for point in (centre, centre + arm)
    )
    assert_allclose(moved[:3], at_centre[:3] + np.cross(at_centre[3:], arm), rtol=0.0, atol=1e-13)
    assert_allclose(moved[3:], at_centre[3:], rtol=0.0, atol=1e-13)


def test_the_pilot_is_the_best_rigid_fit_and_ignores_ovalisation(flexible_structure, carrier):
    pilot = next(pilot for pilot in flexible_structure.pilots if pilot.name == "pin_1_upwind")
    r = flexible_structure.points - pilot.point
    angle = np.arctan2(-r[:, 1], r[:, 2])
    for order in (2, 4):
        oval = (
            np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle)], axis=1)
            * np.cos(order * angle)[:, None]
        )
        # The bore's mesh has unequal arcs, so that the discrete oval is orthogonal to rigid motion
        # only nearly.
        assert np.abs(pilot.G @ oval.ravel())[:3].max() < 0.02


def test_pilots_stand_at_the_middle_of_their_surfaces(carrier):
    points = carrier_pilot_points(carrier)
    assert_allclose(points["shaft_face"], [-0.12, 0.0, 0.0], rtol=0.0, atol=1e-15)
    assert_allclose(points["upwind_seat"], [-0.06, 0.0, 0.0], rtol=0.0, atol=1e-15)
    assert_allclose(points["downwind_seat"], [0.38, 0.0, 0.0], rtol=0.0, atol=1e-15)
    # rig data: bearings 440 mm apart.
    assert_allclose(
        points["downwind_seat"] - points["upwind_seat"], [0.44, 0.0, 0.0], rtol=0.0, atol=1e-15
    )
    assert_allclose(points["pin_1_midspan"], [0.185, 0.0, 0.308], rtol=0.0, atol=1e-15)
    assert_allclose(
        points["pin_2_upwind"], [0.0325, -0.308 * np.sqrt(0.75), -0.154], rtol=0.0, atol=1e-15
    )


def with_surface(facets):
    mesh = box_mesh((1.0, 1.0, 1.0), (1, 1, 1))
    return TetMesh(mesh.points, mesh.tets, {"line": np.array(facets)}, mesh.bodies)


def test_a_surface_shrunk_to_a_line_is_refused_with_its_nodes():
    mesh = with_surface([[0, 7, 7, 0, 7, 7]])
    message = r"surface 'line' with 2 nodes \(0 at \(0, 0, 0\) m, 7 at \(1, 1, 1\) m\) cannot hold a pilot's translation x"
    with pytest.raises(ValueError, match=message):
        distributing_pilot(mesh, "line", np.zeros(3))


def test_a_surface_without_facets_is_refused():
    mesh = with_surface(np.zeros((0, 6), dtype=np.int64))
    with pytest.raises(
        ValueError, match=r"surface 'line' with no nodes cannot hold a pilot's translation x"
    ):
        distributing_pilot(mesh, "line", np.zeros(3))


def test_a_pilot_on_a_missing_surface_is_refused(flexible_mesh):
    with pytest.raises(KeyError, match="no surface 'pin_4_upwind'"):
        distributing_pilot(flexible_mesh, "pin_4_upwind", np.zeros(3))
