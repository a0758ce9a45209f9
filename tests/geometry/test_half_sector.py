import math
import os
import signal
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.carrier_mesh import flexible_half_sector, pin_mesh, stiff_carrier_mesh
from carrierflex.geometry.dihedral import cut_plane_nodes
from carrierflex.geometry.half_sector import (
    MeshingError,
    carrier_half_sector,
    pin_half,
    quiet_geometry,
)
from carrierflex.geometry.named_surfaces import with_carrier_surfaces
from carrierflex.geometry.parameters import PinParameters


@pytest.mark.parametrize("size", [0.0, -0.05, 0.00019, 0.21, math.nan, math.inf])
def test_a_useless_mesh_size_is_refused(carrier, pin, size):
    message = r"mesh size is .* m; expected an edge length between 0.0002 and 0.2 m"
    with pytest.raises(ValueError, match=message):
        carrier_half_sector(carrier, size)
    with pytest.raises(ValueError, match=message):
        pin_half(carrier, pin, size)


def test_a_failure_of_the_mesher_is_reported_with_its_cause(carrier, monkeypatch):
    def fail(dimension):
        raise RuntimeError("Could not recover boundary mesh")

    monkeypatch.setattr("gmsh.model.mesh.generate", fail)
    with pytest.raises(
        MeshingError, match=r"gmsh could not mesh the half sector at size 0.06 m: Could not recover"
    ):
        carrier_half_sector(carrier, 0.06)


def written_where_nobody_reads():
    """Python's answer to a write into a pipe without a reader."""
    read, write = os.pipe()
    os.close(read)
    try:
        with pytest.raises(BrokenPipeError):
            os.write(write, b"x")
    finally:
        os.close(write)


@pytest.mark.parametrize("error", [None, ValueError])
def test_signals_are_handled_as_before_gmsh_came(error):
    # The system's handler of SIGPIPE would end this process without a word.
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGPIPE)}
    try:
        with quiet_geometry():
            assert {number: signal.getsignal(number) for number in before} == before
            written_where_nobody_reads()
            if error is not None:
                raise error
    except ValueError:
        pass
    assert {number: signal.getsignal(number) for number in before} == before
    written_where_nobody_reads()


def test_meshing_works_again_after_a_failure(carrier, monkeypatch, flexible_half):
    with monkeypatch.context() as patch:
        patch.setattr("gmsh.model.mesh.setOrder", lambda order: 1 / 0)
        with pytest.raises(MeshingError, match="division by zero"):
            carrier_half_sector(carrier, 0.06)
    again = flexible_half_sector(carrier, 0.06)
    assert_allclose(
        again.points, flexible_half.points, rtol=0.0, atol=0.0
    )  # the mesh does not depend on chance
    assert (again.tets == flexible_half.tets).all()


def test_linear_elements_are_refused(carrier, monkeypatch):
    monkeypatch.setattr("gmsh.model.mesh.setOrder", lambda order: None)
    with pytest.raises(
        MeshingError, match=r"gmsh returned element type 4; expected quadratic tetrahedra \(11\)"
    ):
        carrier_half_sector(carrier, 0.06)


def test_a_pin_that_does_not_fit_is_refused_by_every_mesh_with_pins(carrier):
    thick = PinParameters(diameter=0.17)
    for mesh_of in (stiff_carrier_mesh, pin_mesh):
        with pytest.raises(ValueError, match=r"\[pin\] diameter is 0.17 m"):
            mesh_of(carrier, thick, 0.06)


@pytest.mark.parametrize("variant", ["flexible_half", "stiff_half"])
def test_half_sector_lies_between_0_and_60_deg_with_nodes_on_both_planes(variant, request):
    half = request.getfixturevalue(variant)
    angle = np.rad2deg(np.arctan2(-half.points[:, 1], half.points[:, 2]))
    assert angle.min() >= -1e-9
    assert angle.max() <= 60.0 + 1e-9
    on_pin, on_web = cut_plane_nodes(half, 3)
    assert (half.points[on_pin, 1] == 0.0).all()
    assert_allclose(angle[on_web], 60.0, rtol=0.0, atol=1e-9)  # [deg], rounding
    assert on_pin.sum() > 100
    assert on_web.sum() > 100


def test_bodies_of_the_stiff_half_sector_share_the_nodes_of_the_bores(stiff_half):
    in_carrier = set(stiff_half.tets[stiff_half.bodies["carrier"]].ravel())
    in_pins = set(stiff_half.tets[stiff_half.bodies["pins"]].ravel())
    bores = {
        n for side in ("upwind", "downwind") for n in stiff_half.surface(f"pin_1_{side}").ravel()
    }
    assert bores == in_carrier & in_pins


def test_sensor_circle_and_bearing_seat_are_marked_by_element_edges(flexible_mesh, carrier):
    r = np.hypot(flexible_mesh.points[:, 1], flexible_mesh.points[:, 2])
    on_face = np.abs(flexible_mesh.points[:, 0]) < 1e-9
    assert (on_face & (np.abs(r - carrier.sensor_radius) < 1e-9)).sum() > 36
    rim = flexible_mesh.points[np.unique(flexible_mesh.surface("rim_face"))]
    rim_r = np.hypot(rim[:, 1], rim[:, 2])
    assert_allclose(
        [rim_r.min(), rim_r.max()], [carrier.sensor_radius, carrier.outer_radius], rtol=1e-9
    )


def test_surfaces_of_other_parameters_are_refused(flexible_mesh, carrier):
    other = replace(carrier, sensor_radius=0.42)
    with pytest.raises(
        ValueError,
        match="the mesh has no facet on rim_face: it does not belong to these parameters",
    ):
        with_carrier_surfaces(flexible_mesh, other)
