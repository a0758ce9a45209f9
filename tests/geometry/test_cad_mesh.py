"""The parametric carrier written as STEP and found again.

Faces, surfaces, volumes, frames and units.
"""

import math
import re
from dataclasses import replace

import gmsh
import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry import cad_mesh
from carrierflex.geometry.cad_export import write_step
from carrierflex.geometry.cad_faces import cad_faces, circle_through
from carrierflex.geometry.cad_mesh import (
    step_carrier_mesh,
    step_faces,
    step_volume_and_area,
)
from carrierflex.geometry.cad_recognition.step_solid import declared_unit
from carrierflex.geometry.cad_surface_files import (
    CadFrame,
    read_cad_statements,
    write_cad_statements,
)
from carrierflex.geometry.carrier_solid import carrier_solid
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.quality import check_quality
from carrierflex.geometry.tet_mesh import boundary_facets

#: Coarser than anything useful [m]: what is looked at here does not depend on it.
COARSE = 0.08


@pytest.fixture(scope="module")
def folder(tmp_path_factory, carrier, pin):
    folder = tmp_path_factory.mktemp("cad")
    write_step(carrier, folder / "carrier.step")
    write_cad_statements(folder / "surfaces.toml", carrier, pin)
    return folder


@pytest.fixture(scope="module")
def statements(folder):
    return read_cad_statements(folder / "surfaces.toml")


@pytest.fixture(scope="module")
def cad_meshes(folder, statements):
    return {
        pins: step_carrier_mesh(folder / "carrier.step", statements, COARSE, pins=pins)
        for pins in (False, True)
    }


def exact_volume(carrier):
    with quiet_geometry() as geometry:
        carrier_solid(geometry, carrier, [0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0])
        geometry.synchronize()
        return gmsh.model.occ.getMass(3, gmsh.model.getEntities(3)[0][1])


def test_the_exported_file_is_in_millimetres_and_nothing_is_left_beside_it(folder, carrier):
    assert declared_unit(folder / "carrier.step") == "millimetre"
    assert (
        f",{carrier.hub_outer_diameter / 2.0 * 1e3:.0f}.)" in (folder / "carrier.step").read_text()
    )
    assert sorted(path.name for path in folder.iterdir()) == ["carrier.step", "surfaces.toml"]


def test_export_prints_nothing(tmp_path, carrier, capfd):
    write_step(carrier, tmp_path / "carrier.stp")
    assert capfd.readouterr() == ("", "")
    with pytest.raises(ValueError, match=r"suffix '\.igs'; expected \.step or \.stp"):
        write_step(carrier, tmp_path / "carrier.igs")


@pytest.mark.long
def test_faces_are_measured_in_metres(folder, carrier):
    faces = step_faces(folder / "carrier.step", CadFrame.of_the_file())
    bores = [
        face
        for face in faces
        if face.kind == "cylinder" and abs(face.radius - carrier.pin_hole_radius) < 1e-9
    ]
    assert len(bores) == 6
    for bore in bores:
        assert_allclose(bore.direction, [1.0, 0.0, 0.0], atol=1e-9)  # OpenCASCADE's rounding
        assert_allclose(np.hypot(*bore.point[1:]), carrier.centre_distance, rtol=1e-9)
    rim = next(face for face in faces if face.kind == "plane" and abs(face.point[0]) < 1e-9)
    assert "plane, normal (1, 0, 0), station 0 m, radii 0.23 to 0.435 m" in str(rim)
    volume, area = step_volume_and_area(
        folder / "carrier.step", read_cad_statements(folder / "surfaces.toml"), pins=False
    )
    assert_allclose(
        volume, exact_volume(carrier), rtol=1e-6
    )  # STEP keeps 15 digits, the mass integral 7
    assert_allclose(area, sum(face.area for face in faces), rtol=1e-9)


def test_kinds_are_found_by_shape_not_by_name():
    with quiet_geometry():
        occ = gmsh.model.occ
        occ.addCylinder(0.1, 0.2, 0.3, 0.0, 0.5, 0.0, 0.05)
        # An affine map of OpenCASCADE makes B-splines of every face.
        ball = occ.addSphere(1.0, 0.0, 0.0, 0.1)
        occ.affineTransform([(3, 1), (3, ball)], [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        occ.synchronize()
        names = {gmsh.model.getType(2, tag) for _, tag in gmsh.model.getEntities(2)}
        faces = cad_faces()
    assert names == {"BSpline surface"}
    assert sorted(face.kind for face in faces) == ["cylinder", "other", "plane", "plane"]
    tube = next(face for face in faces if face.kind == "cylinder")
    assert str(tube).startswith(
        "cylinder, axis (0, 1, 0) through (0.1, 0, 0.3), radius 0.05 m, stations 0.2 to 0.7 m"
    )
    assert str(next(face for face in faces if face.kind == "other")).startswith(
        "other surface about (0.989"
    )


def test_circle_through_points_of_a_short_arc():
    angle = np.linspace(0.3, 0.6, 9)
    centre, normal = np.array([1.0, 2.0, 3.0]), np.array([1.0, 1.0, 0.0]) / math.sqrt(2.0)
    u = np.array([0.0, 0.0, 1.0])
    points = centre + 0.25 * (
        np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * np.cross(normal, u)
    )
    result, radius, deviation = circle_through(points)
    # An arc of 17 deg leaves twelve digits of sixteen.
    assert_allclose(result, centre, atol=1e-11)
    assert_allclose(radius, 0.25, rtol=1e-11)
    assert deviation < 1e-13


@pytest.mark.long
def test_mesh_has_the_bodies_and_surfaces_of_the_parametric_one(
    cad_meshes, flexible_mesh, stiff_mesh
):
    for pins, parametric in ((False, flexible_mesh), (True, stiff_mesh)):
        mesh = cad_meshes[pins]
        assert list(mesh.bodies) == list(parametric.bodies)
        assert set(mesh.surfaces) == set(parametric.surfaces)
        assert mesh.symmetry_order == 1
        for name in parametric.surfaces:
            assert_allclose(
                area(mesh, name), area(parametric, name), rtol=0.01
            )  # chords of 8 and 6 cm
            low, high = (
                np.ptp(m.points[np.unique(m.surface(name)), 0]) for m in (mesh, parametric)
            )
            assert_allclose(low, high, atol=1e-9)
    assert_allclose(
        check_quality(cad_meshes[True]).volume, check_quality(stiff_mesh).volume, rtol=1e-3
    )


def area(mesh, name):
    """Area of the four flat triangles that a quadratic one's nodes span."""
    triangles = mesh.surface(name)[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]].reshape(-1, 3)
    corners = mesh.points[triangles]
    return (
        np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        ).sum()
        / 2.0
    )


@pytest.mark.long
def test_facets_are_seen_from_outside_the_carrier_also_where_pins_fill_the_bores(cad_meshes):
    mesh = cad_meshes[True]
    for name, sign in (("pin_1_upwind", -1.0), ("pin_1_midspan", 1.0)):
        corners = mesh.points[mesh.surface(name)[:, :3]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        outward = corners.mean(axis=1) - np.array([0.0, 0.0, 0.308])
        assert (sign * (normals[:, 1:] * outward[:, 1:]).sum(axis=1) > 0.0).all(), name
    carrier_outside = {
        tuple(row) for row in boundary_facets(mesh.tets[mesh.bodies["carrier"]])[:, :3].tolist()
    }
    assert {tuple(row) for row in mesh.surface("pin_2_downwind")[:, :3].tolist()} <= carrier_outside


@pytest.fixture(scope="module")
def turned_step(folder):
    """The same carrier with its axis along -y, pin 1 along x, its rim face at (0.1, 0.2, 0.3) m."""
    path = folder / "turned.stp"
    R = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    with quiet_geometry():
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        gmsh.model.occ.importShapes(str(folder / "carrier.step"))
        # R is the rotation by -120 deg about (1, -1, 1).
        axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        gmsh.model.occ.rotate([(3, 1)], 0.0, 0.0, 0.0, *axis, math.acos((np.trace(R) - 1.0) / 2.0))
        gmsh.model.occ.translate([(3, 1)], 0.1, 0.2, 0.3)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    return path


@pytest.mark.long
def test_a_carrier_in_another_frame_is_brought_into_its_own(turned_step, statements, cad_meshes):
    frame = CadFrame(
        np.array([0.1, 0.2, 0.3]), np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    )
    assert_allclose(np.linalg.det(frame.rotation), 1.0, atol=1e-12)
    mesh = step_carrier_mesh(turned_step, replace(statements, frame=frame), COARSE, pins=False)
    assert_allclose(
        np.ptp(mesh.points, axis=0), np.ptp(cad_meshes[False].points, axis=0), atol=1e-9
    )
    assert_allclose(mesh.points.min(axis=0), cad_meshes[False].points.min(axis=0), atol=1e-9)
    with pytest.raises(
        ValueError,
        match=r"surface 'shaft_face': the CAD model has no plane .*; candidates: \[1\] plane",
    ):
        step_carrier_mesh(turned_step, statements, COARSE, pins=False)


@pytest.mark.long
def test_the_unit_that_the_file_declares_counts(folder, tmp_path):
    text = (folder / "carrier.step").read_text()
    path = tmp_path / "centimetres.step"
    path.write_text(text.replace("SI_UNIT(.MILLI.,.METRE.)", "SI_UNIT(.CENTI.,.METRE.)"))
    assert declared_unit(path) == "centimetre"
    radii = [
        max(face.radius for face in step_faces(p, CadFrame.of_the_file()))
        for p in (path, folder / "carrier.step")
    ]
    assert_allclose(radii[0] / radii[1], 10.0, rtol=1e-9)
    inches = tmp_path / "inches.step"
    inches.write_text(
        "ISO-10303-21; #1=(CONVERSION_BASED_UNIT('INCH',#2)LENGTH_UNIT()NAMED_UNIT(#3)); "
        "END-ISO-10303-21;"
    )
    assert declared_unit(inches) == "inch"


@pytest.mark.long
def test_pins_that_do_not_fit_between_the_plates_are_refused(folder, statements):
    with pytest.raises(
        ValueError,
        match=(
            r"bearing_width is 0\.25 m; expected less than the 0\.24 m between the bores of "
            r"pin 1"
        ),
    ):
        step_carrier_mesh(
            folder / "carrier.step", replace(statements, bearing_width=0.25), COARSE, pins=True
        )
    with pytest.raises(ValueError, match=r"no \[pin\] bearing_width"):
        step_carrier_mesh(
            folder / "carrier.step", replace(statements, bearing_width=None), COARSE, pins=True
        )
    short = tuple(s for s in statements.surfaces if s.name != "pin_3_downwind")
    with pytest.raises(
        KeyError, match="no surface 'pin_3_downwind' is stated; stated are shaft_face"
    ):
        step_carrier_mesh(
            folder / "carrier.step", replace(statements, surfaces=short), COARSE, pins=True
        )


def test_a_bonded_pin_in_bores_of_two_radii_is_refused(folder, statements):
    faces = step_faces(folder / "carrier.step", CadFrame.of_the_file())
    bore = statements.named("pin_1_downwind")
    wider = replace(bore, size=bore.size + 0.01)
    tags = {face.tag for face in bore.touched(faces, statements.tolerance)}
    stepped = replace(
        statements,
        surfaces=tuple(
            wider if surface.name == bore.name else surface for surface in statements.surfaces
        ),
    )
    bored = tuple(
        replace(face, radius=face.radius + 0.01) if face.tag in tags else face for face in faces
    )
    with pytest.raises(ValueError, match=r"bores of pin 1 have radii of 0\.\d+ and 0\.\d+ m"):
        cad_mesh._pins(stepped, bored)


def test_two_solids_are_refused(tmp_path, statements):
    path = tmp_path / "two.step"
    with quiet_geometry():
        for x in (0.0, 1.0):
            gmsh.model.occ.addBox(x, 0.0, 0.0, 0.5, 0.5, 0.5)
        gmsh.model.occ.synchronize()
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        gmsh.write(str(path))
    with pytest.raises(
        ValueError,
        match=r"holds 2 solids \(1: '.*' of 500 x 500 x 500 mm, 1.25e\+05 cm\^3; .*\); exp",
    ):
        step_faces(path, CadFrame.of_the_file())


def test_a_damaged_file_that_brings_opencascade_down_is_one_line(tmp_path, folder):
    # Faces whose inner bounds are gone: read in this process, the tests would end here.
    text = (folder / "carrier.step").read_text()
    damaged, count = re.subn(r"#\d+ = FACE_BOUND\('',#\d+,\.F\.\);\n", "", text)
    assert count > 0
    (tmp_path / "a.step").write_text(damaged)
    with pytest.raises(ValueError, match=r"a\.step: OpenCASCADE ended by SIGSEGV while reading"):
        step_faces(tmp_path / "a.step", CadFrame.of_the_file())
