"""Carriers with the features of real ones, from STEP to a mesh that can be computed with."""

from dataclasses import replace

import gmsh
import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.cad_mesh import step_carrier_mesh, step_volume_and_area
from carrierflex.geometry.cad_refinement import LEAST_QUALITY
from carrierflex.geometry.cad_surface_files import read_cad_statements
from carrierflex.geometry.carrier_interface import carrier_interface
from carrierflex.geometry.half_sector import MeshingError, quiet_geometry
from carrierflex.geometry.quality import mesh_quality
from tests.geometry.cad_solids import SOLIDS, write_solid

SIZE = 0.08
#: gmsh numbers the last two mid-side nodes the other way round.
GMSH_ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]


def gmsh_quality(mesh):
    """gmsh's minSJ of the mesh's worst element, of a mesh put into an empty gmsh again."""
    with quiet_geometry():
        volume = gmsh.model.addDiscreteEntity(3)
        numbers = np.arange(1, len(mesh.points) + 1)
        gmsh.model.mesh.addNodes(3, volume, numbers, mesh.points.ravel())
        tets = mesh.tets[:, GMSH_ORDER] + 1
        gmsh.model.mesh.addElementsByType(volume, 11, [], tets.ravel())
        tags = gmsh.model.mesh.getElementsByType(11)[0]
        return float(np.min(gmsh.model.mesh.getElementQualities(tags, "minSJ")))


#: Every feature once; all twenty take eight minutes.
IN_LONG = (
    ("five_with_fillet_chamfer_moved", False),
    ("four_with_chamfer_oil_keyway", False),
    ("large_with_everything", True),
)


@pytest.mark.parametrize(
    ("name", "pins"),
    [
        pytest.param(
            name,
            pins,
            marks=pytest.mark.long if (name, pins) in IN_LONG else pytest.mark.acceptance,
        )
        for name in SOLIDS
        for pins in (False, True)
    ],
)
def test_a_solid_with_real_features_is_meshed_soundly(name, pins, tmp_path):
    carrier, _ = SOLIDS[name]
    step, surfaces = write_solid(name, tmp_path)
    statements = read_cad_statements(surfaces)
    mesh = step_carrier_mesh(step, statements, SIZE, pins=pins)
    interface = carrier_interface(mesh)
    assert interface.n_planets == carrier.n_planets
    assert_allclose(interface.centre_distance, carrier.centre_distance, atol=1e-5)
    assert_allclose(interface.sensor_radius, carrier.sensor_radius, atol=1e-6)
    assert LEAST_QUALITY == 0.1
    quality = gmsh_quality(mesh)
    which = "with" if pins else "without"
    print(f"{name}, {which} pins: {len(mesh.tets)} elements, minSJ {quality:.5f}")
    assert quality > LEAST_QUALITY
    volume, _ = step_volume_and_area(step, statements, pins=pins)
    # Quadratic elements follow the bolt holes' circles.
    assert_allclose(mesh_quality(mesh).volume, volume, rtol=1e-3)


@pytest.mark.long
def test_the_large_carrier_is_of_the_2_3_mw_class_and_every_solid_has_three_features():
    carrier, features = SOLIDS["large_with_fillet_and_12_m30"]
    assert (carrier.outer_radius, carrier.centre_distance, carrier.n_planets) == (0.72, 0.5, 3)
    # The hole for an M30 is 33 mm wide (ISO 273, medium).
    assert (features.fillet, features.bolts, features.bolt_diameter) == (0.020, 12, 0.033)
    for name, (shape, each) in SOLIDS.items():
        has = [each.fillet, each.chamfer, each.bolts, each.oil_bore, each.keyway]
        # Off the origin, about z; the file is in mm; other than three planets.
        has += [each.moved, each.moved, True, shape.n_planets != 3]
        assert sum(map(bool, has)) >= 3, name
    assert {shape.n_planets for shape, _ in SOLIDS.values()} == {3, 4, 5}


@pytest.mark.long
def test_small_holes_are_left_out_on_request(tmp_path):
    step, surfaces = write_solid("four_with_fillet_and_bolts", tmp_path)
    statements = read_cad_statements(surfaces)
    carrier, features = SOLIDS["four_with_fillet_and_bolts"]
    without = replace(statements, leave_out_holes_below=1.1 * features.bolt_diameter)
    volumes = [
        mesh_quality(step_carrier_mesh(step, each, SIZE, pins=False)).volume
        for each in (statements, without)
    ]
    hole = np.pi * features.bolt_diameter**2 / 4.0 * 0.6 * carrier.hub_length
    assert_allclose(volumes[1] - volumes[0], features.bolts * hole, rtol=0.02)


@pytest.mark.long
def test_what_stays_distorted_is_refused_by_its_faces(tmp_path, monkeypatch):
    step, surfaces = write_solid("fillet_oil_moved", tmp_path)
    statements = read_cad_statements(surfaces)
    monkeypatch.setattr("carrierflex.geometry.cad_refinement.MOST_PASSES", 1)
    monkeypatch.setattr("carrierflex.geometry.cad_refinement.LEAST_QUALITY", 2.0)
    from carrierflex.geometry.cad_mesh import _step_carrier_mesh

    with pytest.raises(
        MeshingError,
        match=r"fillet_oil_moved.step: after 1 passes .* elements have a scaled Jacobian .* on "
        r"face \d+ \((plane|cylinder|other)",
    ):
        _step_carrier_mesh(step, statements, SIZE, False)
