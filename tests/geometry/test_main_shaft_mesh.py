"""The main shaft's dimensions and mesh against its drawing."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.main_shaft_mesh import main_shaft_mesh
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameter_files import StageParameters, read_parameters
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.quality import mesh_quality

SHAFT = MainShaftParameters()


@pytest.fixture(scope="module")
def mesh(carrier):
    return main_shaft_mesh(carrier, SHAFT, 0.06)


def area(mesh, surface):
    corners = mesh.points[mesh.surface(surface)[:, :3]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.linalg.norm(normals, axis=1).sum() / 2.0


def test_volume_is_that_of_the_tube(mesh):
    section = math.pi / 4.0 * (SHAFT.outer_diameter**2 - SHAFT.inner_diameter**2)
    # Quadratic edges follow the circles but for their own fourth order.
    assert_allclose(mesh_quality(mesh).volume, section * 2.22, rtol=1e-4)


def test_named_surfaces_are_where_the_drawing_has_them(mesh):
    x = {name: mesh.points[np.unique(facets)][:, 0] for name, facets in mesh.surfaces.items()}
    # The hub's upwind face is at -0.12 m, the main bearing 2.1 m upwind of it, the flange 0.12 m
    # further.
    assert_allclose(x["carrier_joint"], -0.12, rtol=0.0, atol=1e-9)
    assert_allclose(x["coupling_flange"], -2.34, rtol=0.0, atol=1e-9)
    assert_allclose(
        [x["main_bearing_seat"].min(), x["main_bearing_seat"].max()],
        [-2.31, -2.13],
        rtol=0.0,
        atol=1e-9,
    )
    # Flat facets on the cylinder: a few per cent less than the curved area.
    assert_allclose(area(mesh, "main_bearing_seat"), math.pi * 0.341 * 0.18, rtol=0.03)
    assert_allclose(area(mesh, "carrier_joint"), area(mesh, "coupling_flange"), rtol=1e-9)


def test_surfaces_share_no_node_so_that_all_of_them_can_be_held_rigidly(mesh):
    nodes = [set(np.unique(facets)) for facets in mesh.surfaces.values()]
    assert sum(map(len, nodes)) == len(set.union(*nodes))


def test_the_mesh_maps_onto_itself_under_the_rotation_by_120_degrees(mesh):
    assert mesh.symmetry_order == 3
    c, s = math.cos(2.0 * math.pi / 3.0), math.sin(2.0 * math.pi / 3.0)
    turned = mesh.points @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]).T

    def ordered(points):
        return points[np.lexsort(np.round(points, 9).T)]

    assert_allclose(ordered(turned), ordered(mesh.points), rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("size", [0.03, 0.2])
def test_any_allowed_size_gives_sound_elements(carrier, size):
    quality = mesh_quality(main_shaft_mesh(carrier, SHAFT, size))
    assert quality.worst_scaled_jacobian > 0.2


def test_useless_sizes_are_refused(carrier):
    with pytest.raises(
        ValueError, match=r"mesh size is 30 m; expected an edge length between 0\.0002 and 0\.2 m"
    ):
        main_shaft_mesh(carrier, SHAFT, 30)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"outer_diameter": -0.3}, "outer_diameter is -0.3; expected a positive number"),
        (
            {"inner_diameter": 0.341},
            "inner_diameter is 0.341 m; expected less than outer_diameter 0.341 m",
        ),
        (
            {"bearing_to_joint": 2100.0},
            "bearing_to_joint is 2100.0 m; expected dimensions in metres, at most 20 m",
        ),
        (
            {"bearing_width": 0.3},
            "bearing_width is 0.3 m: the bearing reaches an end of the shaft; expected less "
            "than 0.24 m",
        ),
        (
            {"hub_to_bearing": 0.1},
            "hub_to_bearing is 0.1 m; expected at least bearing_to_flange 0.12 m",
        ),
    ],
)
def test_contradicting_dimensions_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(SHAFT, **change)


@pytest.mark.parametrize("diameter", [0.3, 0.47])
def test_a_shaft_that_does_not_meet_the_hub_is_refused(diameter):
    shaft = replace(SHAFT, outer_diameter=diameter)
    message = (
        f"outer_diameter is {diameter} m; expected between the hub_inner_diameter 0.32 m and "
        f"the hub_outer_diameter 0.46 m"
    )
    with pytest.raises(ValueError, match=message):
        StageParameters(main_shaft=shaft)
    with pytest.raises(ValueError, match=message):
        main_shaft_mesh(CarrierParameters(), shaft, 0.1)


def test_dimensions_come_from_the_parameter_file(tmp_path):
    path = tmp_path / "stage.toml"
    path.write_text("[main_shaft]\nouter_diameter = 0.38\n", encoding="utf-8")
    assert read_parameters(path).main_shaft == replace(SHAFT, outer_diameter=0.38)
