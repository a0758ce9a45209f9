"""Stress of the stage's carrier: that of the full finite elements under the loads it carries."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.stress_recovery import stress_rows
from carrierflex.geometry.pins import PAPER_STIFFNESS
from carrierflex.geometry.tet_mesh import boundary_facets
from carrierflex.reduction.held_structure import HeldStructure
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.reduction.shapes.body_stresses import body_stresses
from carrierflex.reduction.shapes.stress_measures import von_mises
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from carrierflex.simulation.stage.stress import (
    PeakStress,
    no_stress_yet,
    stress_reader,
    with_stress_rows,
)


@pytest.fixture(scope="module")
def reading_stage(flexible_mesh, flexible_reduction, pin_reduction):
    """Stage at standstill whose carrier reads its stresses."""
    stresses = body_stresses(flexible_mesh, flexible_reduction.basis)
    carrier = with_stress_rows(flexible_reduction.model, stresses)
    pinned = carrier_with_pins(carrier, pin_reduction.model, PAPER_STIFFNESS)
    body = joined_to_shaft(pinned, beam_shaft(ShaftData(), pinned.pilots["shaft_face"]))
    return stage_model(body, speed=0.0)


def test_stress_under_torque_and_radial_load_is_that_of_the_full_carrier(
    reading_stage, flexible_mesh, flexible_structure, flexible_reduction
):
    c = static_coordinates(reading_stage, SteadyLoad(360e3, ntl_z=100e3))
    reader = stress_reader(reading_stage)
    ours = reader.stress(np.arange(len(reader.rows)), c[None])[:, :, 0]
    # Motion of the carrier's pilots in the stage, put on the full finite elements.
    joined = reading_stage.layout.body.model
    c[0] = 0.0
    q = (reading_stage.L @ c)[: joined.n_coordinates]
    names = flexible_reduction.model.pilots
    motion = np.concatenate([q[joined.coordinates_of(name)] for name in names])
    held = HeldStructure(flexible_reduction.body, flexible_structure.pilots)
    u = held.solve(np.zeros((flexible_structure.n_dofs, 1)), motion[:, None])[0][:, 0]
    nodes = np.unique(boundary_facets(flexible_mesh.tets)[:, :3])
    full = (stress_rows(flexible_mesh, nodes, BODY_MATERIALS) @ u).reshape(-1, 6)
    # What the carrier's own weight adds between its pilots is in the modes alone.
    size = von_mises(full[:, :, None]).max()
    assert size > 2e7
    assert np.abs(ours - full).max() < 0.01 * size


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
