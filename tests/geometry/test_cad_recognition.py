"""What is recognised in a CAD solid, what is left to the user, and what is refused."""

import math
from dataclasses import replace

import gmsh
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from carrierflex.geometry.cad_export import write_step
from carrierflex.geometry.cad_mesh import step_faces
from carrierflex.geometry.cad_recognition.carrier_axis import axis_candidates
from carrierflex.geometry.cad_recognition.inner_edges import grade_towards, reentrant_edges
from carrierflex.geometry.cad_recognition.merged_surfaces import merged_surfaces
from carrierflex.geometry.cad_recognition.oriented_faces import _cad_solid, cad_solid
from carrierflex.geometry.cad_recognition.proposal_files import write_proposal
from carrierflex.geometry.cad_recognition.surface_proposal import proposed_surfaces
from carrierflex.geometry.cad_surface_files import CadFrame, read_cad_statements
from carrierflex.geometry.half_sector import quiet_geometry
from carrierflex.geometry.pins import pin_angles
from tests.geometry.cad_solids import ORIGIN, SOLIDS, write_solid


@pytest.fixture(scope="module")
def step(tmp_path_factory, carrier):
    path = tmp_path_factory.mktemp("recognised") / "carrier.step"
    write_step(carrier, path)
    return path


@pytest.fixture(scope="module")
def solid(step):
    return _cad_solid(step, None)


def turned(solid, frame):
    """The solid as it is seen from another frame."""
    return replace(solid, faces=tuple(face.moved(frame) for face in solid.faces))


def is_carrier(proposal, carrier):
    """Whether the statements are those of the parametric carrier, whichever pin is the first."""
    assert proposal.left_out == ()
    chosen = {surface.name: surface.chosen.statement for surface in proposal.surfaces}
    assert len(chosen) == 4 + 2 * carrier.n_planets
    assert_allclose(chosen["shaft_face"].size, -carrier.hub_length, atol=1e-7)
    assert_allclose(chosen["rim_face"].size, 0.0, atol=1e-7)
    assert_allclose(chosen["upwind_seat"].size, carrier.hub_outer_diameter / 2.0, atol=1e-7)
    assert_allclose(chosen["downwind_seat"].size, carrier.seat_outer_diameter / 2.0, atol=1e-7)
    low = carrier.centre_distance + carrier.pin_hole_radius
    assert low < chosen["rim_face"].window[0] < carrier.outer_radius
    for number, angle in enumerate(pin_angles(carrier.n_planets), start=1):
        at = carrier.centre_distance * np.array([0.0, -math.sin(angle), math.cos(angle)])
        for side, stations in (
            ("upwind", carrier.upwind_bore_x),
            ("downwind", carrier.downwind_bore_x),
        ):
            bore = chosen[f"pin_{number}_{side}"]
            assert_allclose(bore.point, at, atol=1e-6)
            assert_allclose(bore.size, carrier.pin_hole_radius, atol=1e-7)
            assert_allclose(bore.window, stations, atol=1e-6)
    return True


@pytest.mark.long
@pytest.mark.parametrize("name", SOLIDS)
def test_frame_and_surfaces_of_a_solid_with_real_features_are_recognised(name, tmp_path):
    carrier, features = SOLIDS[name]
    step, _ = write_solid(name, tmp_path)
    proposal = proposed_surfaces(step, cad_solid(step))
    assert is_carrier(proposal, carrier)
    assert_allclose(proposal.frame.origin, ORIGIN if features.moved else (0, 0, 0), atol=1e-8)
    axis = (0.0, 0.0, 1.0) if features.moved else (1.0, 0.0, 0.0)
    assert_allclose(proposal.frame.axis, axis, atol=1e-9)
    # Bolt holes and their bottoms are one number each.
    copies = [len(group.surfaces) for group in proposal.groups]
    assert copies.count(features.bolts) >= (2 if features.bolts else 0)
    write_proposal(tmp_path / "proposed.toml", proposal)
    read = read_cad_statements(tmp_path / "proposed.toml")
    assert_allclose(read.frame.rotation, proposal.frame.rotation, atol=1e-12)
    assert {surface.name for surface in read.surfaces} == {s.name for s in proposal.surfaces}
    faces = step_faces(step, read.frame)
    for surface in read.surfaces:
        assert surface.touched(faces, read.tolerance)


def test_a_carrier_is_recognised_wherever_it_stands_and_whichever_way_it_looks(
    step, solid, carrier
):
    for seed in range(3):
        random = np.random.default_rng(seed)
        rotation = Rotation.random(random_state=seed).as_matrix()
        frame = CadFrame(random.uniform(-1.0, 1.0, 3), rotation[0], rotation[2])
        proposal = proposed_surfaces(step, turned(solid, frame))
        assert is_carrier(proposal, carrier)
        assert_allclose(proposal.frame.axis, frame.rotation @ [1.0, 0.0, 0.0], atol=1e-9)
        assert_allclose(proposal.frame.origin, frame.rotation @ -frame.origin, atol=1e-7)


def test_axis_and_origin_that_are_given_are_taken(step, solid, carrier):
    given = {"axis": np.array([2.0, 0.0, 0.0]), "origin": np.array([0.1, 0.0, 0.0])}
    proposal = proposed_surfaces(step, solid, **given)
    assert_allclose(proposal.frame.origin, given["origin"])
    named = {surface.name: surface.chosen.statement for surface in proposal.surfaces}
    assert_allclose(named["rim_face"].size, -0.1, atol=1e-7)
    # Against the evidence: the hub is then taken for the downwind end.
    proposal = proposed_surfaces(step, solid, axis=np.array([-1.0, 0.0, 0.0]))
    named = {surface.name: surface.chosen.statement for surface in proposal.surfaces}
    assert_allclose(named["downwind_seat"].size, carrier.hub_outer_diameter / 2.0, atol=1e-7)
    with pytest.raises(ValueError, match=r"--origin is \[0.0, 0.2, 0.0\]; expected a point of"):
        proposed_surfaces(step, solid, origin=np.array([0.0, 0.2, 0.0]))


def cylinders(faces, radius):
    return [
        face
        for face in faces
        if face.face.kind == "cylinder" and math.isclose(face.face.radius, radius, rel_tol=1e-6)
    ]


def second_hub(solid, carrier):
    """Faces of one more outer cylinder upwind, nearly as large as the hub's."""

    def smaller(points):
        return points * np.array([1.0, 0.9, 0.9])

    for hub in cylinders(solid.faces, carrier.hub_outer_diameter / 2.0):
        face = replace(
            hub.face,
            radius=0.9 * hub.face.radius,
            outline=smaller(hub.face.outline),
            edges=frozenset({-1}),
            area=0.9 * hub.face.area,
        )
        yield replace(hub, face=face, triangles=smaller(hub.triangles), anchor=smaller(hub.anchor))


def test_two_seats_that_are_alike_are_left_to_the_user(step, solid, carrier, tmp_path):
    faces = (*solid.faces, *second_hub(solid, carrier))
    proposal = proposed_surfaces(step, replace(solid, faces=faces))
    assert proposal.left_out == ("upwind_seat",)
    seat = next(surface for surface in proposal.surfaces if surface.name == "upwind_seat")
    assert seat.equals == 2
    assert len({number for each in seat.candidates[:2] for number in each.numbers}) == 2
    out = tmp_path / "surfaces.toml"
    write_proposal(out, proposal)
    text = out.read_text()
    assert "# upwind_seat: 2 candidates fit equally well; remove the # of one of them." in text
    assert "upwind_seat" not in {surface.name for surface in read_cad_statements(out).surfaces}
    # The first candidate's lines without their # are a statement.
    wanted = text.replace("# [surfaces.upwind_seat]", "[surfaces.upwind_seat]", 1)
    start = wanted.index("[surfaces.upwind_seat]")
    lines = wanted[start:].splitlines()[1:6]
    wanted = (
        wanted[:start]
        + "\n".join(["[surfaces.upwind_seat]", *(line.removeprefix("# ") for line in lines), ""])
        + "\n".join(wanted[start:].splitlines()[6:])
    )
    out.write_text(wanted)
    read = read_cad_statements(out).named("upwind_seat")
    assert_allclose(read.size, carrier.hub_outer_diameter / 2.0)


@pytest.mark.parametrize(
    ("length", "wanted"), [("bore", 0.0375), ("bore", 0.0425), ("pitch", 0.1875)]
)
def test_bores_are_equal_whatever_their_length_and_however_it_is_rounded(
    solid, carrier, length, wanted
):
    actual = carrier.pin_hole_radius if length == "bore" else carrier.centre_distance
    rng = np.random.default_rng(7)

    def scaled(original):
        # Rounding of a CAD program: a thousandth of a micrometre.
        s = wanted / actual * (1.0 + 1e-8 * rng.standard_normal())
        face = replace(
            original.face, point=s * original.face.point, radius=s * original.face.radius,
            outline=s * original.face.outline, area=s**2 * original.face.area,
        )  # fmt: skip
        return replace(
            original, face=face, triangles=s * original.triangles, anchor=s * original.anchor
        )

    surfaces = merged_surfaces([scaled(face) for face in solid.faces])
    pattern = axis_candidates(surfaces)[0].patterns[0]
    assert len(pattern.lines) == carrier.n_planets
    assert_allclose(pattern.radius, carrier.pin_hole_radius * wanted / actual, rtol=1e-6)
    assert_allclose(pattern.pitch_radius, carrier.centre_distance * wanted / actual, rtol=1e-6)


def test_what_cannot_be_told_is_refused_in_one_line(step, solid, carrier):
    bores = cylinders(solid.faces, carrier.pin_hole_radius)
    without_bores = tuple(face for face in solid.faces if face not in bores)
    with pytest.raises(ValueError, match=r"carrier.step: no axis with 3 to 8 equal pairs of bores"):
        proposed_surfaces(step, replace(solid, faces=without_bores))
    with pytest.raises(ValueError, match=r"--sensor-radius is 0.3 m; expected between the bores"):
        proposed_surfaces(step, solid, sensor_radius=0.3)
    with pytest.raises(ValueError, match=r"--bearing-width is 0.3 m; expected more than 0 and"):
        proposed_surfaces(step, solid, bearing_width=0.3)


@pytest.mark.long
def test_ends_that_are_alike_need_a_given_axis(tmp_path, carrier):
    alike = replace(
        carrier,
        downwind_plate_thickness=carrier.upwind_plate_thickness,
        seat_outer_diameter=carrier.hub_outer_diameter,
        seat_length=carrier.hub_length,
    )
    step = tmp_path / "alike.step"
    write_step(alike, step)
    solid = _cad_solid(step, None)
    with pytest.raises(ValueError, match=r"alike.step: which end .*both ends are equal.*--axis"):
        proposed_surfaces(step, solid)
    assert is_carrier(proposed_surfaces(step, solid, axis=np.array([1.0, 0.0, 0.0])), alike)


@pytest.mark.long
def test_a_unit_that_is_declared_wrong_is_told_and_overridden(step, solid, tmp_path):
    wrong = tmp_path / "wrong.step"
    wrong.write_text(step.read_text().replace(".MILLI.,.METRE.", "$,.METRE."))
    with pytest.raises(ValueError, match=r"wrong.step \(declared unit: metre\): 870 m across.*--l"):
        _cad_solid(wrong, None)
    corrected = _cad_solid(wrong, "mm")
    assert_allclose(corrected.extent, solid.extent, rtol=1e-9)
    assert_allclose(corrected.volume, solid.volume, rtol=1e-9)
    assert {face.face.kind for face in corrected.faces} == {"plane", "cylinder"}
    small = proposed_surfaces(wrong, _cad_solid(wrong, "cm"), length_unit="cm")
    assert any("8.7 m across is unusual" in text for text in small.assumed)
    assert small.frame.length_unit == "cm"


def test_parts_of_a_cylinder_are_one_surface_and_material_is_on_its_side(solid, carrier):
    surfaces = merged_surfaces(solid.faces)
    # The pins' bores notch the hub into three.
    (hub,) = [s for s in surfaces if cylinders(s.faces, carrier.hub_outer_diameter / 2.0)]
    assert len(hub.faces) == 3
    assert not hub.hollow
    bores = [s for s in surfaces if cylinders(s.faces, carrier.pin_hole_radius)]
    assert len(bores) == 6
    assert all(bore.hollow and bore.goes_round for bore in bores)
    # Half round the bores go in the plate only.
    low, high = bores[0].round_extent(np.array([1.0, 0.0, 0.0]))
    assert_allclose((low, high), carrier.upwind_bore_x, atol=1e-6)


def test_elements_are_smaller_at_re_entrant_edges_and_only_there():
    with quiet_geometry():
        block = gmsh.model.occ.addBox(0.0, 0.0, 0.0, 0.4, 0.4, 0.2)
        notch = gmsh.model.occ.addBox(0.2, 0.2, 0.0, 0.4, 0.4, 0.2)
        gmsh.model.occ.cut([(3, block)], [(3, notch)])
        gmsh.model.occ.synchronize()
        (edge,) = reentrant_edges()
        ends = gmsh.model.getBoundingBox(1, edge)
        assert_allclose(ends, (0.2, 0.2, 0.0, 0.2, 0.2, 0.2), atol=1e-6)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.1)
        grade_towards([edge], 0.1, 0.025, 0.15)
        # Sizes that faces carry on into the volume would reach some three times as far.
        assert gmsh.option.getNumber("Mesh.MeshSizeExtendFromBoundary") == 0.0
        gmsh.model.mesh.generate(1)
        lengths = {
            tag: gmsh.model.occ.getMass(1, tag) / len(gmsh.model.mesh.getElements(1, tag)[1][0])
            for _, tag in gmsh.model.getEntities(1)
        }
    assert_allclose(lengths[edge], 0.025, rtol=0.1)
    assert max(lengths.values()) > 2.0 * lengths[edge]


def boxes(path, *corners):
    """STEP file of cubes of 40 mm at their corners [mm]; the first one is twice as high."""
    with quiet_geometry():
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        for number, corner in enumerate(corners):
            at = [1e-3 * length for length in corner]
            gmsh.model.occ.addBox(*at, 0.04, 0.04, 0.04 if number else 0.08)
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    return path


def test_of_several_solids_one_is_chosen_by_its_number(tmp_path):
    path = boxes(tmp_path / "a.step", (0, 0, 0), (0, 100, 0), (0, 0, 200))
    with pytest.raises(ValueError, match=r"3 solids \(1: .* 40 x 40 x 80 mm, 128 cm.*--solid"):
        _cad_solid(path, None)
    volumes = [_cad_solid(path, None, number).volume for number in (1, 2, 3)]
    assert_allclose(volumes, [128e-6, 64e-6, 64e-6], rtol=1e-9)
    assert_allclose(_cad_solid(path, None, 3).faces[0].face.outline[:, 2].min(), 0.2, atol=1e-6)
    for number in (0, 4):
        with pytest.raises(ValueError, match=rf"solid {number} of 3 .*expected 1 to 3"):
            _cad_solid(path, None, number)


@pytest.mark.parametrize("corner", [(0, 0, 80), (10, 10, 80), (40, 0, 20)])
def test_solids_that_touch_in_a_face_are_united(corner, tmp_path):
    solid = _cad_solid(boxes(tmp_path / "a.step", (0, 0, 0), corner), None, "united")
    assert_allclose(solid.volume, 192e-6, rtol=1e-9)
    # The faces between them are gone: the area is that of a solid of one piece.
    area = sum(face.area for face in (each.face for each in solid.faces))
    touching = 0.04 * 0.04 if corner != (10, 10, 80) else 0.03 * 0.03
    separate = 2 * 0.04**2 + 4 * 0.04 * 0.08 + 6 * 0.04**2
    assert_allclose(area, separate - 2.0 * touching, rtol=1e-6)


@pytest.mark.parametrize("corner", [(0, 0, 81), (100, 0, 0), (40, 40, 80)])
def test_solids_that_do_not_touch_in_a_face_are_not_united(corner, tmp_path):
    path = boxes(tmp_path / "a.step", (0, 0, 0), corner)
    with pytest.raises(ValueError, match=r"a\.step: its 2 solids remain 2 when they are united"):
        _cad_solid(path, None, "united")


def test_the_chosen_solid_stands_in_the_surfaces_file(step, solid, tmp_path):
    proposal = proposed_surfaces(step, solid)
    for chosen in ("united", 2):
        path = tmp_path / f"{chosen}.toml"
        write_proposal(path, replace(proposal, frame=replace(proposal.frame, solid=chosen)))
        assert read_cad_statements(path).frame.solid == chosen
