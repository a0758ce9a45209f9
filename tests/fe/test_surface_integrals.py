import math

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.fe.surface_integrals import rigid_motion, surface_area, surface_moments
from carrierflex.geometry.carrier_mesh import pin_mesh
from carrierflex.geometry.dihedral import rotation_about_x
from tests.fe.box_meshes import box_mesh


def test_rigid_motion_is_translation_beside_the_cross_product():
    rng = np.random.default_rng(1)
    points = rng.standard_normal((5, 3))
    origin = rng.standard_normal(3)
    q = rng.standard_normal(6)
    expected = q[:3] + np.cross(q[3:], points - origin)
    assert_allclose(rigid_motion(points, origin) @ q, expected, rtol=0.0, atol=1e-14)


def test_a_small_rotation_about_x_moves_points_towards_increasing_angle():
    points = np.array([[0.1, 0.0, 0.3], [0.0, -0.2, 0.1]])
    turned = (points @ rotation_about_x(1e-7).T - points) / 1e-7
    assert_allclose(
        rigid_motion(points, np.zeros(3))[..., 3], turned, rtol=0.0, atol=1e-7
    )  # second order of the angle


def test_moments_of_a_flat_face_are_exact():
    mesh = box_mesh((0.1, 0.2, 0.3), (1, 2, 1))
    centre = np.array([0.1, 0.1, 0.15])
    B, Z = surface_moments(mesh, mesh.surface("end"), centre)
    area = 0.06
    about_y = 0.2 * 0.3**3 / 12.0
    about_z = 0.3 * 0.2**3 / 12.0
    expected = np.diag([area, area, area, about_y + about_z, about_y, about_z])
    assert_allclose(Z, expected, rtol=0.0, atol=1e-16)
    assert_allclose(B[0, :, 0].sum(), area, rtol=1e-14)


def test_nodal_shares_reproduce_the_moments_of_rigid_motion(flexible_mesh):
    origin = np.array([0.1, -0.2, 0.3])
    B, Z = surface_moments(flexible_mesh, flexible_mesh.surface("pin_2_upwind"), origin)
    R = rigid_motion(flexible_mesh.points, origin).reshape(-1, 6)
    assert_allclose(B.reshape(6, -1) @ R, Z, rtol=0.0, atol=1e-14 * Z.max())
    nodes = np.unique(flexible_mesh.surface("pin_2_upwind"))
    assert not np.delete(B, nodes, axis=1).any()


def test_area_and_second_moments_of_a_cylinder_converge_at_fourth_order(carrier, pin):
    radius, width = pin.diameter / 2.0, pin.bearing_width
    area = 2.0 * math.pi * radius * width
    centre = np.array([0.185, 0.0, carrier.centre_distance])
    about_axis, across = area * radius**2, area * (radius**2 / 2.0 + width**2 / 12.0)
    sizes, errors = np.array([0.06, 0.03, 0.015]), []
    for size in sizes:
        mesh = pin_mesh(carrier, pin, size)
        facets = mesh.surface("pin_1_midspan")
        Z = surface_moments(mesh, facets, centre)[1]
        result = np.array([surface_area(mesh, facets), Z[3, 3], Z[4, 4], Z[5, 5]])
        errors.append(np.abs(result / [area, about_axis, across, across] - 1.0).max())
        assert_allclose(Z - np.diag(np.diag(Z)), 0.0, rtol=0.0, atol=1e-3 * area * radius)
    assert errors[0] < 3e-4
    slope = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert 3.3 < slope < 4.7, (
        errors
    )  # fourth order in theory; the number of arcs jumps by whole ones
