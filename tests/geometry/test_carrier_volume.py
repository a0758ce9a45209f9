"""Volumes and named areas of the meshes against integrals over the drawing's circles, which know no mesh.

Curved quadratic facets miss a circle by the fourth power of their angle: some 1e-4 of an area at
the tests' size.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.surface_integrals import surface_area
from carrierflex.geometry.carrier_mesh import flexible_half_sector
from carrierflex.geometry.quality import mesh_quality
from tests.analytic import carrier_volume, covered_angle, ring_section

#: Area error of a full bore, eight quadratic arcs: 1.03e-4 measured.
ARCS = 2e-4


def test_volume_of_the_flexible_carrier_is_that_of_its_drawing(flexible_mesh, carrier):
    # Convex and concave arcs cancel in part: 1.4e-5 measured.
    assert_allclose(mesh_quality(flexible_mesh).volume, carrier_volume(carrier), rtol=3e-5)


def test_bonded_pins_add_their_own_volume(stiff_mesh, carrier, pin):
    pins = 3.0 * math.pi * (pin.diameter / 2.0) ** 2 * carrier.length_between_faces
    assert_allclose(mesh_quality(stiff_mesh).volume, carrier_volume(carrier) + pins, rtol=3e-5)


def test_volume_converges_with_the_fourth_power_of_the_mesh_size(carrier):
    sizes = np.array([0.08, 0.04, 0.02])
    exact = carrier_volume(carrier) / 6.0
    errors = [
        abs(mesh_quality(flexible_half_sector(carrier, size)).volume / exact - 1.0)
        for size in sizes
    ]
    slope = np.polyfit(np.log(sizes), np.log(errors), 1)[0]
    assert 3.3 < slope < 4.7, errors  # fourth order in theory; unstructured meshes scatter about it


def expected_areas(carrier, pin):
    hole, a = carrier.pin_hole_diameter / 2.0, carrier.centre_distance
    hub = carrier.hub_outer_diameter / 2.0
    around_hub = 2.0 * math.pi - 3.0 * covered_angle(hub, hole, a)
    areas = {
        "shaft_face": ring_section(carrier.hub_inner_diameter / 2.0, hub, hole, a)[0],
        "rim_face": math.pi * (carrier.outer_radius**2 - carrier.sensor_radius**2),
        "upwind_seat": around_hub * hub * carrier.upwind_bearing_width,
        "downwind_seat": math.pi * carrier.seat_outer_diameter * carrier.seat_length,
    }
    for number in (1, 2, 3):
        areas[f"pin_{number}_upwind"] = 2.0 * math.pi * hole * carrier.upwind_plate_thickness
        areas[f"pin_{number}_downwind"] = 2.0 * math.pi * hole * carrier.downwind_plate_thickness
        areas[f"pin_{number}_midspan"] = 2.0 * math.pi * hole * pin.bearing_width
    return areas


@pytest.mark.parametrize("variant", ["flexible_mesh", "stiff_mesh"])
def test_named_surfaces_have_the_areas_of_the_drawing(variant, request, carrier, pin):
    mesh, expected = request.getfixturevalue(variant), expected_areas(carrier, pin)
    if variant == "flexible_mesh":
        expected = {name: area for name, area in expected.items() if "midspan" not in name}
    assert set(mesh.surfaces) == set(expected)
    for name, area in expected.items():
        assert_allclose(surface_area(mesh, mesh.surface(name)), area, rtol=ARCS, err_msg=name)


def test_a_half_sector_holds_a_sixth_of_carrier_surfaces_and_half_of_pin_1(
    flexible_half, carrier, pin
):
    expected = expected_areas(carrier, pin)
    shares = dict.fromkeys(("shaft_face", "rim_face", "upwind_seat", "downwind_seat"), 1.0 / 6.0)
    shares |= {"pin_1_upwind": 0.5, "pin_1_downwind": 0.5}
    assert set(flexible_half.surfaces) == set(shares)
    for name, share in shares.items():
        area = surface_area(flexible_half, flexible_half.surface(name))
        assert_allclose(area, share * expected[name], rtol=ARCS, err_msg=name)


def test_the_single_pin_has_its_seats_and_nothing_else(one_pin_mesh, carrier, pin):
    expected = {
        name: area
        for name, area in expected_areas(carrier, pin).items()
        if name.startswith("pin_1")
    }
    assert set(one_pin_mesh.surfaces) == set(expected)
    for name, area in expected.items():
        assert_allclose(
            surface_area(one_pin_mesh, one_pin_mesh.surface(name)), area, rtol=ARCS, err_msg=name
        )
