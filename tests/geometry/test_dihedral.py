"""The whole carrier has the symmetry of its drawing exactly.

Rotation by 120 deg and mirroring map mesh onto mesh.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from carrierflex.geometry.dihedral import rotation_about_x

#: Rounding of a rotation at the carrier's size [m]; the nearest other node is more than 1 mm away.
ROUNDING = 1e-12


def image_numbers(points, image_of):
    """Node number of the image of every node; fails where an image is no node."""
    distance, number = cKDTree(points).query(image_of)
    assert distance.max() < ROUNDING
    assert len(np.unique(number)) == len(points)
    return number


def as_sets(tets):
    return {tuple(row) for row in np.sort(tets, axis=1)}


SYMMETRIES = {
    "rotation by 120 deg": rotation_about_x(2.0 * math.pi / 3.0),
    "mirror through pin 1": np.diag([1.0, -1.0, 1.0]),
}


@pytest.mark.parametrize("name", SYMMETRIES)
@pytest.mark.parametrize("variant", ["flexible_mesh", "stiff_mesh"])
def test_symmetry_maps_nodes_elements_and_bodies_onto_themselves(variant, name, request):
    mesh = request.getfixturevalue(variant)
    number = image_numbers(mesh.points, mesh.points @ SYMMETRIES[name].T)
    for elements in mesh.bodies.values():
        assert as_sets(number[mesh.tets[elements]]) == as_sets(mesh.tets[elements])


@pytest.mark.parametrize("side", ["upwind", "downwind"])
def test_rotation_carries_the_surfaces_of_pin_1_to_pin_2_and_on(flexible_mesh, side):
    R = SYMMETRIES["rotation by 120 deg"]
    number = image_numbers(flexible_mesh.points, flexible_mesh.points @ R.T)
    for first, second in ((1, 2), (2, 3), (3, 1)):
        moved = number[flexible_mesh.surface(f"pin_{first}_{side}")]
        assert as_sets(moved) == as_sets(flexible_mesh.surface(f"pin_{second}_{side}"))


def test_pins_are_numbered_along_increasing_angle(stiff_mesh, carrier):
    # e(v) = (0, -sin v, cos v) written out: pin 2 stands at +120 deg, on the side of negative y.
    height = carrier.centre_distance * math.sqrt(3.0) / 2.0
    low = -carrier.centre_distance / 2.0
    expected = {1: (0.0, carrier.centre_distance), 2: (-height, low), 3: (height, low)}
    for number, (y, z) in expected.items():
        for side, x in (("upwind", 0.0325), ("midspan", 0.185), ("downwind", 0.3275)):
            points = stiff_mesh.points[np.unique(stiff_mesh.surface(f"pin_{number}_{side}"))]
            # Mid-range: the nodes of a ring are symmetric about its axis, whatever their spacing.
            # Arcs of 22 deg leave up to 0.02 radii of the extent uncovered.
            assert_allclose(
                (points.min(axis=0) + points.max(axis=0)) / 2.0, [x, y, z], rtol=0.0, atol=2e-3
            )


def test_rotation_about_x_takes_z_towards_increasing_angle():
    v = 0.3
    assert_allclose(
        rotation_about_x(v) @ [0.0, 0.0, 1.0],
        [0.0, -math.sin(v), math.cos(v)],
        rtol=0.0,
        atol=1e-16,
    )


def test_the_single_pin_is_its_own_mirror_image(one_pin_mesh):
    number = image_numbers(one_pin_mesh.points, one_pin_mesh.points * np.array([1.0, -1.0, 1.0]))
    assert as_sets(number[one_pin_mesh.tets]) == as_sets(one_pin_mesh.tets)


def test_meshes_state_their_rotational_symmetry(flexible_mesh, flexible_half, one_pin_mesh):
    assert (
        flexible_mesh.symmetry_order,
        flexible_half.symmetry_order,
        one_pin_mesh.symmetry_order,
    ) == (3, 1, 1)
