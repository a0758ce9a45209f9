"""What a page will draw: the numbers behind the picture."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.fe.carrier_curves import flexible_cases
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.versions import provenance
from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.parameter_files import read_parameters
from carrierflex.geometry.view import rounded_magnification, torque_arrow
from carrierflex.reduction.pin_fit import torque_curve
from carrierflex.reduction.shapes.body_shapes import body_shapes
from carrierflex.workflows.view3d.body_scene import body_scene
from carrierflex.workflows.view3d.rim_motion_files import RimMotion, RimSignal
from carrierflex.workflows.view3d.rim_scene import rim_scene
from carrierflex.workflows.view3d.scene import directions, feature_edges
from carrierflex.workflows.view3d.view_file import _curve_scene


@pytest.fixture(scope="module")
def shapes(flexible_mesh, flexible_structure, flexible_reduction):
    return body_shapes(flexible_mesh, flexible_reduction.basis)


@pytest.fixture(scope="module")
def model(flexible_reduction):
    record = provenance(parameters=read_parameters(None), size=0.06, modes=11)
    return replace(flexible_reduction.model, provenance=record)


@pytest.fixture(scope="module")
def body(model, shapes):
    return body_scene(model, shapes)


def part_of(scene, name):
    return next(surface for surface in scene.objects if surface.name == name)


def test_the_entries_are_surfaces_torque_free_modes_and_kept_modes(body):
    names = [entry.name for entry in body.entries]
    assert names[:2] == ["surfaces by name", "torque of 1 kN m"]
    assert sum(name.startswith("free mode ") for name in names) == 12
    assert sum(name.startswith("mode ") for name in names) == 11
    assert {surface.name for surface in body.objects} >= {
        "rim_face",
        "shaft_face",
        "pin_1_upwind",
        "body",
    }


def test_the_rim_under_torque_moves_as_the_sensors_on_it_say(body, model, carrier, gear):
    rim = part_of(body, "rim_face")
    values = rim.values[1] * body.entries[1].limit * 1e-6
    y, z = rim.rest[:, 1], rim.rest[:, 2]
    on_circle = np.abs(np.hypot(y, z) - carrier.sensor_radius) < 1e-6
    assert np.count_nonzero(on_circle) >= 12
    loads = flexible_cases(carrier, gear)["both"]
    curve = torque_curve("rim", model, loads, carrier.sensor_radius)
    expected = curve.axial_at(np.arctan2(-y[on_circle], z[on_circle]))
    # The sensors' curve is sampled every degree and interpolated; nodes stand between.
    scale = np.abs(curve.axial).max()
    np.testing.assert_allclose(values[on_circle], expected, rtol=0.0, atol=2e-3 * scale)


def test_a_mode_is_drawn_to_the_same_size_as_another(body):
    sizes = [
        max(float(np.linalg.norm(surface.moved[k], axis=1).max()) for surface in body.objects)
        for k in range(2, len(body.entries))
    ]
    extent = np.ptp(part_of(body, "body").rest, axis=0).max()
    np.testing.assert_allclose(sizes, 0.06 * extent, rtol=0.02)


def test_a_body_of_other_dimensions_has_no_torque(model, shapes):
    names = [entry.name for entry in body_scene(replace(model, provenance={}), shapes).entries]
    assert "torque of 1 kN m" not in names


def test_a_cube_has_twelve_edges():
    points = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))])
    edges = feature_edges(points, triangles, np.zeros(12, dtype=int))
    assert len(edges) == 12
    np.testing.assert_allclose(np.linalg.norm(np.diff(points[edges], axis=1), axis=2), 1.0)
    # The diagonal of a face on which the surface's name changes is an edge too.
    assert len(feature_edges(points, triangles, np.arange(12) == 0)) == 13


def test_magnifications_are_round_and_never_too_large():
    for wanted in (1.0, 1.999, 2.0, 49.9, 5e4, 0.3):
        factor = rounded_magnification(wanted)
        assert factor <= wanted * (1.0 + 1e-9) < 2.5 * factor * (1.0 + 1e-9)
        assert f"{factor:e}"[:8] in ("1.000000", "2.000000", "5.000000")


def test_the_arrow_turns_as_a_positive_torque(carrier):
    centre = np.array([-0.2, 0.0, 0.0])
    points, triangles = torque_arrow(centre, 0.1)
    # Along the arc towards the tip: e(v) with v growing, right-handed about +x.
    tail, tip = points[:12].mean(axis=0), points[-12:].mean(axis=0)
    angle = [np.arctan2(-p[1], p[2]) for p in (tail, tip)]
    assert angle[0] < 0.0 < angle[1]
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    assert np.einsum("ij,ij->", a - centre, np.cross(b - centre, c - centre)) > 0.0


def curve(name, axial, radial):
    return DeflectionCurve(name, 0.412, 1000.0, axial, radial)


def test_a_curve_is_drawn_along_x_and_along_the_radius():
    angle = np.deg2rad(np.arange(360.0))
    scene = _curve_scene(
        {"delta_f": curve("delta_f", 2e-7 * np.cos(3 * angle), 1e-7 + 0 * angle)}, "c"
    )
    rim = part_of(scene, "rim")
    factor = rim.moved[0, 0, 0] / 2e-7
    assert f"{factor:,.0f} times" in scene.entries[0].words
    np.testing.assert_allclose(rim.moved[0, :360, 0], factor * 2e-7 * np.cos(3 * angle), atol=1e-12)
    outwards = np.einsum("ij,ij->i", rim.moved[0, :360], directions(angle))
    np.testing.assert_allclose(outwards, factor * 1e-7, rtol=1e-9)
    assert [label.text for label in scene.labels] == ["pin 1", "pin 2", "pin 3"]


def test_curves_without_a_deflection_are_refused():
    with pytest.raises(ValueError, match="c: every curve is zero; expected one that deflects"):
        _curve_scene({"delta_f": curve("delta_f", np.zeros(36), np.zeros(36))}, "c")


@pytest.mark.parametrize("direction", ["axial", "radial"])
def test_the_point_before_the_sensor_shows_what_the_sensor_reads(direction):
    theta = 2.0 * np.pi * np.arange(90) / 90
    reading = 1e-4 + 3e-4 * np.cos(theta - 0.3) + 1e-4 * np.sin(3 * theta)
    signal = RimSignal("LC1", "s", direction, np.deg2rad(50.0), reading, 0.5 * reading)
    scene = rim_scene(RimMotion("twin", "m", 3, 0.4, (), (signal,)))
    line = part_of(scene, "measured")
    way = directions(np.array(signal.sensor_angle)) if direction == "radial" else np.eye(3)[0]
    factor = float(scene.entries[0].words.split("drawn ")[1].split(" times")[0].replace(",", ""))
    for k in (0, 10, 35):
        turned = (line.rest + line.moved[0]) @ rotation_about_x(theta[k]).T
        at_rest = line.rest @ rotation_about_x(theta[k]).T
        before_sensor = np.argmax(at_rest @ directions(np.array(signal.sensor_angle)))
        moved = (turned - at_rest)[before_sensor] @ way
        np.testing.assert_allclose(moved, factor * reading[k], rtol=1e-9)


def test_the_colours_of_the_gap_keep_the_limit_of_the_baseline():
    theta = 2.0 * np.pi * np.arange(90) / 90
    measured = 1e-4 * np.cos(theta)
    signal = RimSignal("A", "s", "axial", 0.0, measured, 0.2 * measured, 0.9 * measured)
    scene = rim_scene(RimMotion("twin", "m", 3, 0.4, ("carrier_tilt",), (signal,)))
    before, after = scene.entries
    assert before.limit == after.limit == pytest.approx(80.0)
    gap = part_of(scene, "gap")
    assert np.abs(gap.values[0]).max() == pytest.approx(1.0)
    assert np.abs(gap.values[1]).max() == pytest.approx(0.1 / 0.8)
    assert scene.first == 0


def test_fewer_entries_are_those_in_front(body):
    fewer = body.with_entries(3)
    assert fewer.entries == body.entries[:3]
    assert all(len(surface.moved) == 3 for surface in fewer.objects)
