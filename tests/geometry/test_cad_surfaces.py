"""Statements of surfaces: what they match, what they cut, and what their file may say."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.cad_export import write_step
from carrierflex.geometry.cad_faces import CadFace
from carrierflex.geometry.cad_mesh import step_carrier_mesh, step_faces
from carrierflex.geometry.cad_surface_files import (
    CadFrame,
    read_cad_statements,
    write_cad_statements,
)
from carrierflex.geometry.cad_surfaces import SurfaceStatement

X = np.array([1.0, 0.0, 0.0])
TOLERANCE = 1e-5


def tube(x, radius=0.1, centre=(0.0, 0.0), tag=1, edges=()):
    """Face of a cylinder along x between two stations, its outline two circles."""
    v = np.linspace(0.0, 2.0 * math.pi, 17)
    ring = np.stack(
        [np.zeros_like(v), centre[0] - radius * np.sin(v), centre[1] + radius * np.cos(v)], axis=1
    )
    outline = np.concatenate([ring + np.array([end, 0.0, 0.0]) for end in x])
    area = 2.0 * math.pi * radius * (x[1] - x[0])
    return CadFace(
        tag, "cylinder", -X, np.array([0.0, *centre]), radius, outline, frozenset(edges), area
    )


def ring(x, inner, outer, tag=1, edges=()):
    v = np.linspace(0.0, 2.0 * math.pi, 17)
    outline = np.concatenate(
        [np.stack([np.full(17, x), -r * np.sin(v), r * np.cos(v)], axis=1) for r in (inner, outer)]
    )
    return CadFace(tag, "plane", X, np.array([x, 0.0, inner]), 0.0, outline, frozenset(edges), 1.0)


def bore(**changes):
    return replace(SurfaceStatement("bore", "cylinder", np.zeros(3), X, 0.1), **changes)


def test_a_cylinder_is_matched_by_axis_radius_and_station():
    faces = (
        tube((0.0, 0.1)),
        tube((0.3, 0.4), tag=2),
        tube((0.0, 0.1), radius=0.2, tag=3),
        ring(0.0, 0.1, 0.2, tag=4),
    )
    assert [face.tag for face in bore(window=(0.25, 0.45)).chosen(faces, TOLERANCE)] == [2]
    assert [face.tag for face in bore(size=0.2).chosen(faces, TOLERANCE)] == [3]
    # Half a tolerance off in radius and off the axis still counts, more does not.
    assert bore(size=0.2 + 0.5e-5).chosen(faces, TOLERANCE)
    assert bore(size=0.2, point=np.array([7.0, 0.5e-5, 0.0])).chosen(faces, TOLERANCE)
    for wrong in (
        bore(size=0.2 + 2e-5),
        bore(size=0.2, point=np.array([0.0, 2e-5, 0.0])),
        bore(direction=np.array([0.0, 1.0, 0.0])),
    ):
        with pytest.raises(ValueError, match="the CAD model has no cylinder"):
            wrong.chosen(faces, TOLERANCE)


def test_none_lists_the_nearest_candidates_of_its_kind():
    faces = (
        tube((0.3, 0.4), radius=0.12),
        tube((0.0, 0.1), radius=0.101, tag=2),
        ring(0.0, 0.1, 0.2, tag=3),
    )
    with pytest.raises(ValueError, match="candidates") as refusal:
        bore(window=(0.0, 0.1)).touched(faces, TOLERANCE)
    assert str(refusal.value) == (
        "surface 'bore': the CAD model has no cylinder of radius 0.1 m about the axis (1.0, 0.0, "
        "0.0) through (0.0, 0.0, 0.0) between 0 and 0.1 m; candidates: [1] cylinder, axis (-1, 0, "
        "0) through (0, 0, 0), radius 0.101 m, stations -0.1 to 0 m, area 0.06346 m^2; [2] "
        "cylinder, axis (-1, 0, 0) through (0, 0, 0), radius 0.12 m, stations -0.4 to -0.3 m, area "
        "0.0754 m^2"
    )


def test_several_are_refused_unless_they_are_one_surface_or_stated():
    apart = (tube((0.0, 0.1)), tube((0.3, 0.4), tag=2))
    with pytest.raises(
        ValueError,
        match=(
            r"'bore': 2 separate surfaces .*; expected 1, choose by axial_range or say parts = "
            r"2; can"
        ),
    ):
        bore().chosen(apart, TOLERANCE)
    assert len(bore(n_bands=2).chosen(apart, TOLERANCE)) == 2
    with pytest.raises(ValueError, match=r"1 separate surfaces .*; expected 2"):
        bore(n_bands=2, window=(0.2, 0.5)).chosen(apart, TOLERANCE)
    # Halves of one cylinder share an edge; what a notch separates lies side by side around the
    # axis.
    assert (
        len(
            bore().chosen(
                (tube((0.0, 0.1), edges=(1, 2)), tube((0.1, 0.2), tag=2, edges=(2, 3))), TOLERANCE
            )
        )
        == 2
    )
    assert len(bore().chosen((tube((0.0, 0.1)), tube((0.02, 0.12), tag=2)), TOLERANCE)) == 2


def test_a_plane_is_matched_by_station_and_radii_and_many_candidates_are_cut_short():
    faces = tuple(ring(0.1 * n, 0.1, 0.2, tag=n) for n in range(9))
    plane = SurfaceStatement("rim", "plane", np.zeros(3), -X, -0.3, (0.05, 0.25))
    assert [face.tag for face in plane.chosen(faces, TOLERANCE)] == [3]
    with pytest.raises(
        ValueError,
        match=(
            r"no plane of normal \(-1.0, 0.0, 0.0\) at station 0.31 m, radii between 0.05 .*; "
            r"and 3 more"
        ),
    ):
        replace(plane, size=0.31).chosen(faces, TOLERANCE)
    with pytest.raises(ValueError, match="no face of the CAD model lies inside the window"):
        replace(plane, window=(0.12, 0.18)).chosen(faces, TOLERANCE)


def test_faces_are_cut_where_the_window_ends_inside_them():
    circles = bore(window=(-0.1, 0.25)).circles([tube((0.0, 0.3), centre=(0.0, 0.0))], TOLERANCE)
    [(centre, _, radius)] = circles
    assert_allclose(centre, [0.25, 0.0, 0.0], atol=1e-15)
    assert radius == 0.1
    plane = SurfaceStatement("rim", "plane", np.zeros(3), X, 0.3, (0.15, 0.2))
    [(centre, _, radius)] = plane.circles([ring(0.3, 0.1, 0.2)], TOLERANCE)
    assert_allclose(centre, [0.3, 0.0, 0.0], atol=1e-15)
    assert radius == 0.15


@pytest.fixture(scope="module")
def folder(tmp_path_factory, carrier, pin):
    folder = tmp_path_factory.mktemp("cad")
    write_step(carrier, folder / "carrier.step")
    write_cad_statements(folder / "surfaces.toml", carrier, pin)
    return folder


def test_a_wrong_radius_in_the_file_is_answered_with_the_right_one(folder):
    statements = read_cad_statements(folder / "surfaces.toml")
    wrong = tuple(
        replace(s, size=0.079) if s.name == "pin_2_upwind" else s for s in statements.surfaces
    )
    with pytest.raises(
        ValueError,
        match=(
            r"'pin_2_upwind': .*candidates: \[1\] cylinder, axis \(1, 0, 0\) through \(0, "
            r"-0.26674, -0.154\), radius 0.08 m"
        ),
    ):
        step_carrier_mesh(
            folder / "carrier.step", replace(statements, surfaces=wrong), 0.08, pins=False
        )
    unbounded = tuple(
        replace(s, window=(-math.inf, math.inf)) if s.name == "pin_2_upwind" else s
        for s in statements.surfaces
    )
    with pytest.raises(
        ValueError, match=r"'pin_2_upwind': 2 separate surfaces match the cylinder of radius 0.08 m"
    ):
        step_carrier_mesh(
            folder / "carrier.step", replace(statements, surfaces=unbounded), 0.08, pins=False
        )


def test_written_statements_match_every_face_they_name_and_come_back(folder, carrier, pin):
    statements = read_cad_statements(folder / "surfaces.toml")
    assert statements.bearing_width == pin.bearing_width
    assert statements.tolerance == 1e-5
    assert_allclose(statements.frame.rotation, np.eye(3), atol=0.0)
    assert statements.named("rim_face").window == (carrier.sensor_radius, carrier.outer_radius)
    assert statements.named("upwind_seat").window == carrier.upwind_bearing_x
    faces = step_faces(folder / "carrier.step", CadFrame.of_the_file())
    for surface in statements.surfaces:
        assert surface.touched(faces, statements.tolerance), surface.name


HEAD = 'format = "carrierflex-surfaces"\nversion = 1\n'
RIM = '[surfaces.rim_face]\ntype = "plane"\nnormal = [1, 0, 0]\nstation = 0\n'
WRONG_FILES = [
    (
        "version = 1\n" + RIM,
        r"missing key 'format'; expected 'carrierflex-surfaces' for a surfaces file",
    ),
    (
        HEAD.replace("1", "2") + RIM,
        "key 'version' is 2, written by a newer version; expected 1: update carrierflex",
    ),
    (HEAD.replace("1", "true") + RIM, "key 'version' is true; expected 1"),
    (HEAD, r"missing key 'surfaces'; expected at least one table \[surfaces.<name>\]"),
    (HEAD + "surface = 1\n" + RIM, r"unknown key 'surface'; did you mean 'surfaces'\?"),
    (
        HEAD + "tolerance = 0.1\n" + RIM,
        "key 'tolerance' is 0.1; expected more than 0 and at most 0.001 m",
    ),
    (
        HEAD + RIM + "[pin]\nbearing_width = -1\n",
        r"\[pin\]: key 'bearing_width' is -1; expected a positive width",
    ),
    (
        HEAD + RIM + "[pin]\nwidth = 1\n",
        r"\[pin\]: unknown key 'width'; expected one of bearing_width",
    ),
    (HEAD + RIM + "[frame]\naxis = [1, 0, 0]\npin_1 = [1, 0, 1]\n", "expected a right angle"),
    (
        HEAD + RIM + "[frame]\naxis = [0, 0, 0]\n",
        r"\[frame\]: key 'axis' is \[0, 0, 0\]; expected a direction",
    ),
    (
        HEAD + RIM.replace("plane", "cone"),
        r"\[surfaces.rim_face\]: key 'type' is 'cone'; expected one of cylinder, plane",
    ),
    (HEAD + RIM + "radius = 1\n", "unknown key 'radius'; expected one of type, normal, station"),
    (HEAD + RIM.replace("station = 0", ""), "missing key 'station'; expected a finite number"),
    (
        HEAD + RIM.replace("station = 0", "station = nan"),
        "key 'station' is nan; expected a finite number",
    ),
    (
        HEAD + RIM.replace("[1, 0, 0]", "[1, 0]"),
        r"key 'normal' is \[1, 0\]; expected a direction: three numbers",
    ),
    (
        HEAD + RIM + "radial_range = [2, 1]\n",
        r"key 'radial_range' is \[2, 1\]; expected two numbers, the smaller value first",
    ),
    (HEAD + RIM + "parts = 0\n", "key 'parts' is 0; expected a whole number from 1 to 100"),
    (
        HEAD
        + '[surfaces.bore]\ntype = "cylinder"\npoint = [0, 0, 0]\n'
        + "direction = [1, 0, 0]\nradius = -1\n",
        r"\[surfaces.bore\]: key 'radius' is -1; expected a positive number",
    ),
    (
        HEAD + '[surfaces.bore]\ntype = "cylinder"\ndirection = [1, 0, 0]\nradius = 1\n',
        "missing key 'point'; expected three finite numbers",
    ),
    ("format = \n", "not a TOML file"),
    ("#" * 100_001, "100001 bytes; expected a surfaces file of at most 100000 bytes"),
]


@pytest.mark.parametrize(("text", "message"), WRONG_FILES)
def test_wrong_files_are_refused_by_name(tmp_path, text, message):
    path = tmp_path / "surfaces.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_cad_statements(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"absent\.toml: no such file"):
        read_cad_statements(tmp_path / "absent.toml")
