"""What the mesh tells of a carrier is what its parameters say."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.structural_model import carrier_pilot_points
from carrierflex.geometry.carrier_interface import carrier_interface
from carrierflex.geometry.dihedral import rotation_about_x


@pytest.mark.parametrize("variant", ["flexible", "stiff"])
def test_interface_read_off_the_mesh_is_that_of_the_parameters(request, carrier, variant):
    interface = carrier_interface(request.getfixturevalue(f"{variant}_mesh"))
    expected = carrier_pilot_points(carrier)
    assert set(interface.points) == set(expected)
    for name, point in expected.items():
        assert_allclose(interface.points[name], point, atol=1e-12)  # rounding of the circle fit
    assert_allclose(interface.pin_stations, carrier.pin_stations, atol=1e-12)
    assert_allclose(interface.centre_distance, carrier.centre_distance, rtol=1e-12)
    assert_allclose(interface.sensor_radius, carrier.sensor_radius, rtol=1e-12)


def test_a_carrier_in_another_frame_is_refused_with_the_angle_found(flexible_mesh):
    turned = replace(flexible_mesh, points=flexible_mesh.points @ rotation_about_x(np.pi / 6.0).T)
    with pytest.raises(
        ValueError, match=r"'pin_1_upwind' is at 30 deg about the x axis; expected 0 deg"
    ):
        carrier_interface(turned)
    tilted = replace(
        flexible_mesh, points=flexible_mesh.points @ np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    )
    with pytest.raises(ValueError, match=r"from a cylinder of radius .* along x; expected a bore"):
        carrier_interface(tilted)


def test_pins_that_differ_are_refused(flexible_mesh):
    moved = flexible_mesh.points.copy()
    moved[np.unique(flexible_mesh.surface("pin_2_upwind")), 0] += 0.001
    with pytest.raises(
        ValueError, match=r"the pins' bores differ: stations .*\(0\.0335, .* expected 3 alike"
    ):
        carrier_interface(replace(flexible_mesh, points=moved))


def test_a_missing_surface_is_named(flexible_mesh):
    surfaces = {
        name: facets for name, facets in flexible_mesh.surfaces.items() if name != "upwind_seat"
    }
    with pytest.raises(KeyError, match="no surface 'upwind_seat'; it has downwind_seat"):
        carrier_interface(replace(flexible_mesh, surfaces=surfaces))


@pytest.mark.parametrize("first", ["upwind_seat", "pin_2_upwind"])
def test_upwind_and_downwind_exchanged_is_refused(flexible_mesh, first):
    surfaces, second = dict(flexible_mesh.surfaces), first.replace("upwind", "downwind")
    surfaces[first], surfaces[second] = surfaces[second], surfaces[first]
    with pytest.raises(ValueError, match=rf"'{first}' is at station .* exchange the two names"):
        carrier_interface(replace(flexible_mesh, surfaces=surfaces))
