"""Stress of the stage's carrier and pins: the full finite elements' under the loads they carry."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.stress_recovery import stress_rows
from carrierflex.geometry.dihedral import rotation_about_x
from carrierflex.geometry.pins import PAPER_STIFFNESS, pin_angles
from carrierflex.geometry.tet_mesh import boundary_facets
from carrierflex.reduction.held_structure import HeldStructure
from carrierflex.reduction.pin_joints import carrier_with_each_pin
from carrierflex.reduction.shapes.body_stresses import body_stresses
from carrierflex.reduction.shapes.stress_measures import von_mises
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from carrierflex.simulation.stage.stress import (
    PeakStress,
    no_stress_yet,
    pins_with_stress_rows,
    stress_reader,
    surface_with_pins,
    with_stress_rows,
)


@pytest.fixture(scope="module")
def pin_stresses(one_pin_mesh, pin_reduction):
    return body_stresses(one_pin_mesh, pin_reduction.basis)


@pytest.fixture(scope="module")
def reading_stage(flexible_mesh, flexible_reduction, pin_reduction, pin_stresses):
    """Stage at standstill whose carrier and pins read their stresses."""
    stresses = body_stresses(flexible_mesh, flexible_reduction.basis)
    carrier = with_stress_rows(flexible_reduction.model, stresses)
    pins = pins_with_stress_rows(pin_reduction.model, pin_stresses, 3)
    pinned = carrier_with_each_pin(carrier, pins, PAPER_STIFFNESS)
    body = joined_to_shaft(pinned, beam_shaft(ShaftData(), pinned.pilots["shaft_face"]))
    return stage_model(body, speed=0.0)


def test_stress_under_torque_and_radial_load_is_that_of_the_full_carrier(
    reading_stage, flexible_mesh, flexible_structure, flexible_reduction
):
    c = static_coordinates(reading_stage, SteadyLoad(360e3, ntl_z=100e3))
    nodes = np.unique(boundary_facets(flexible_mesh.tets)[:, :3])
    ours = stress_reader(reading_stage).stress(np.arange(len(nodes)), c[None])[:, :, 0]
    # Motion of the carrier's pilots in the stage, put on the full finite elements.
    joined = reading_stage.layout.body.model
    c[0] = 0.0
    q = (reading_stage.L @ c)[: joined.n_coordinates]
    names = flexible_reduction.model.pilots
    motion = np.concatenate([q[joined.coordinates_of(name)] for name in names])
    constrained = HeldStructure(flexible_reduction.body, flexible_structure.pilots)
    u = constrained.solve(np.zeros((flexible_structure.n_dofs, 1)), motion[:, None])[0][:, 0]
    full = (stress_rows(flexible_mesh, nodes, BODY_MATERIALS) @ u).reshape(-1, 6)
    # What the carrier's own weight adds between its pilots is in the modes alone.
    size = von_mises(full[:, :, None]).max()
    assert size > 2e7
    assert np.abs(ours - full).max() < 0.01 * size


@pytest.mark.parametrize("number", [1, 2])
def test_stress_of_a_pin_is_that_of_the_full_pin_in_the_carriers_axes(
    number, reading_stage, pin_stresses, flexible_mesh, pin_structure, pin_reduction, one_pin_mesh
):
    c = static_coordinates(reading_stage, SteadyLoad(360e3, ntl_z=100e3))
    n_carrier = len(np.unique(boundary_facets(flexible_mesh.tets)[:, :3]))
    k = len(pin_stresses.points)
    rows = n_carrier + k * (number - 1) + np.arange(k)
    ours = stress_reader(reading_stage).stress(rows, c[None])[:, :, 0]
    # The pin of finite elements, turned to its bore, with the motion of its ends and its planet's.
    R = rotation_about_x(float(pin_angles(3)[number - 1]))
    joined = reading_stage.layout.body.model
    c[0] = 0.0
    q = (reading_stage.L @ c)[: joined.n_coordinates]
    motion = np.concatenate(
        [
            (
                R.T @ q[joined.coordinates_of(f"pin_{number}_{side}_of_pin")].reshape(2, 3).T
            ).T.ravel()
            for side in ("upwind", "midspan", "downwind")
        ]
    )
    names = [pilot.name for pilot in pin_structure.pilots]
    assert names == ["pin_1_upwind", "pin_1_midspan", "pin_1_downwind"]
    constrained = HeldStructure(pin_reduction.body, pin_structure.pilots)
    u = constrained.solve(np.zeros((pin_structure.n_dofs, 1)), motion[:, None])[0][:, 0]
    nodes = np.unique(boundary_facets(one_pin_mesh.tets)[:, :3])
    full = (stress_rows(one_pin_mesh, nodes, BODY_MATERIALS) @ u).reshape(-1, 6)
    tensors = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
    turned = np.einsum("ai,nij,bj->nab", R, full[:, tensors], R)
    size = von_mises(full[:, :, None]).max()
    assert size > 1e7
    # The pin's weight between its pilots is in the modes alone.
    assert np.abs(ours[:, tensors] - turned).max() < 0.01 * size


def test_the_surface_has_the_pins_behind_the_carrier(
    flexible_mesh, flexible_reduction, pin_stresses
):
    of_carrier = body_stresses(flexible_mesh, flexible_reduction.basis)
    surface = surface_with_pins(of_carrier, pin_stresses, 3)
    k = len(pin_stresses.points)
    assert len(surface.points) == len(of_carrier.points) + 3 * k
    assert surface.surface_names[-4:] == (
        "pin_3_upwind_of_pin", "pin_3_downwind_of_pin", "pin_3_midspan_of_pin", "pin_3",
    )  # fmt: skip
    middle = surface.surface_of == surface.surface_names.index("pin_2_midspan_of_pin")
    where = surface.points[middle].mean(axis=0)
    angle = np.deg2rad(120.0)
    expected = 0.308 * np.array([-np.sin(angle), np.cos(angle)])
    assert_allclose(where[1:], expected, atol=2e-3)
    corners = surface.points[surface.triangles[-1]]
    assert np.linalg.norm(corners.mean(axis=0)[1:] - 0.308 * np.array([0.866, -0.5])) < 0.1


def test_peaks_are_the_largest_of_all_pieces_and_the_drive_angle_strains_nothing(reading_stage):
    reader = stress_reader(reading_stage)
    rng = np.random.default_rng(3)
    c = 1e-5 * rng.standard_normal((7, reader.rows.shape[2]))
    turned = c.copy()
    turned[:, 0] += 1e4
    nodes = np.arange(len(reader.rows))
    assert_allclose(reader.stress(nodes, turned), reader.stress(nodes, c))
    time = np.arange(7.0)
    peaks = no_stress_yet(reader).or_later(reader, time[:3], c[:3])
    peaks = peaks.or_later(reader, time[3:], c[3:])
    history = von_mises(reader.stress(nodes, c))
    assert isinstance(peaks, PeakStress)
    assert_allclose(peaks.von_mises, history.max(axis=1))
    assert (peaks.time == history.argmax(axis=1)).all()


def test_a_carrier_without_stress_rows_is_refused(nominal_stage):
    with pytest.raises(ValueError, match="expected a carrier of carrierflex reduce --stresses"):
        stress_reader(nominal_stage)


def test_rows_go_behind_the_sensors_and_only_to_their_body(flexible_mesh, flexible_reduction):
    stresses = body_stresses(flexible_mesh, flexible_reduction.basis)
    model = flexible_reduction.model
    reading = with_stress_rows(model, stresses)
    n = len(model.sensor_names)
    assert reading.sensor_names[:n] == model.sensor_names
    assert_allclose(reading.sensor_rows[n + 6], stresses.S[1, 0])
    with pytest.raises(ValueError, match="expected the rows of this body"):
        with_stress_rows(model, replace(stresses, S=stresses.S[:, :, 1:]))
