import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.rim_circle import rim_recovery
from carrierflex.fe.surface_integrals import rigid_motion
from carrierflex.geometry.given_meshes.named_solids import NamedSolids
from tests.fe.box_meshes import box_mesh

ANGLES = 2.0 * np.pi * np.arange(360) / 360


def direction(angles):
    return np.stack([np.zeros_like(angles), -np.sin(angles), np.cos(angles)], axis=1)


@pytest.fixture(scope="module")
def rows(flexible_mesh, carrier):
    return rim_recovery(flexible_mesh, carrier.sensor_radius, ANGLES)


def test_every_row_weighs_its_three_nodes_to_one(rows):
    axial, _ = rows
    unit = np.tile([1.0, 0.0, 0.0], axial.shape[1] // 3)
    assert_allclose(axial @ unit, 1.0, rtol=0.0, atol=1e-13)
    assert (np.diff(axial.indptr) == 3).all()


def test_translations_are_recovered_exactly(rows, flexible_mesh):
    u = np.tile([0.3, -0.2, 0.5], len(flexible_mesh.points))
    assert_allclose(rows[0] @ u, 0.3, rtol=1e-13)
    assert_allclose(rows[1] @ u, direction(ANGLES) @ [0.3, -0.2, 0.5], rtol=0.0, atol=1e-13)


def test_rotations_are_recovered_to_the_interpolation_error_of_an_arc(rows, flexible_mesh, carrier):
    R = rigid_motion(flexible_mesh.points, np.zeros(3)).reshape(-1, 6)
    at_circle = rigid_motion(carrier.sensor_radius * direction(ANGLES), np.zeros(3))
    on_rim = (
        np.abs(np.hypot(*flexible_mesh.points[:, 1:].T) - 0.412)
        + np.abs(flexible_mesh.points[:, 0])
        < 1e-7
    )
    width = 4.0 * np.pi / on_rim.sum()
    # Quadratic interpolation of a sine over an arc: (half its width)^3 / 9 sqrt 3; a third more,
    # the arcs being unequal.
    bound = 1.33 * carrier.sensor_radius * (width / 2.0) ** 3 / (9.0 * np.sqrt(3.0))
    for rotation in (3, 4, 5):
        assert_allclose(rows[0] @ R[:, rotation], at_circle[:, 0, rotation], rtol=0.0, atol=bound)
        expected = np.einsum("ka,ka->k", direction(ANGLES), at_circle[:, :, rotation])
        assert_allclose(rows[1] @ R[:, rotation], expected, rtol=0.0, atol=bound)


def test_a_displacement_quadratic_in_the_angle_is_recovered_exactly(flexible_half, carrier):
    def field(angle):
        return 1.0 - 2.0 * angle + 3.0 * angle**2

    inside = np.deg2rad(np.linspace(0.0, 60.0, 97))
    axial, radial = rim_recovery(flexible_half, carrier.sensor_radius, inside)
    angle = np.arctan2(-flexible_half.points[:, 1], flexible_half.points[:, 2])
    u = np.zeros_like(flexible_half.points)
    u[:, 0] = field(angle)
    assert_allclose(
        axial @ u.ravel(), field(inside), rtol=1e-10
    )  # middle nodes halve their arcs to gmsh's rounding
    assert_allclose(radial @ u.ravel(), 0.0, rtol=0.0, atol=1e-14)


def test_an_angle_outside_a_half_sector_is_refused(flexible_half, carrier):
    with pytest.raises(
        ValueError, match=r"no element edge of the rim circle covers the angle 61 deg"
    ):
        rim_recovery(flexible_half, carrier.sensor_radius, np.deg2rad([30.0, 61.0]))


def test_a_radius_without_element_edges_is_refused(flexible_half):
    with pytest.raises(ValueError, match=r"no element edges on the circle of radius 0.42 m"):
        rim_recovery(flexible_half, 0.42, np.zeros(1))


def test_a_mesh_without_rim_face_is_refused():
    with pytest.raises(KeyError, match="no surface 'rim_face'"):
        rim_recovery(box_mesh((1, 1, 1), (1, 1, 1)), 0.412, np.zeros(1))


def test_linear_edges_are_read_where_the_ray_meets_the_chord():
    n, radii = 24, (0.4, 0.45)
    angles = 2.0 * np.pi * np.arange(n) / n
    points = np.concatenate([radius * direction(angles) for radius in radii])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    quadrilaterals = np.column_stack([i, j, j + n, i + n])
    # One of them in two triangles, whose last corner is their first.
    a, b, c, d = quadrilaterals[0]
    facets = np.concatenate([quadrilaterals[1:], [[a, b, c, a], [a, c, d, a]]])
    none = np.zeros(0, dtype=np.int64)
    ring = NamedSolids(points, none, [], {}, surfaces={"rim_face": facets})
    axial, radial = rim_recovery(ring, radii[0], ANGLES)
    assert (np.diff(axial.indptr) <= 2).all()
    # An axial displacement of the size of y or of z tells where a row reads.
    y, z = (axial @ np.einsum("n,a->na", points[:, k], [1.0, 0.0, 0.0]).ravel() for k in (1, 2))
    assert_allclose(np.mod(np.arctan2(-y, z), 2.0 * np.pi), ANGLES, atol=1e-12)
    to_middle = np.remainder(ANGLES, 2.0 * np.pi / n) - np.pi / n
    chord = radii[0] * np.cos(np.pi / n) / np.cos(to_middle)
    assert_allclose(np.hypot(y, z), chord, rtol=1e-12)
    # A growth of the ring is the radius there.
    assert_allclose(radial @ points.ravel(), chord, rtol=1e-12)
