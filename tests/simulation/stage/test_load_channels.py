"""Loads, speeds and energies as columns: equilibrium, ratios, balance."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.stage.load_channels import load_columns
from carrierflex.simulation.stage.part_loads import (
    PartLoads,
    mesh_misalignment,
    part_loads,
    part_tilt,
)
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad
from tests.simulation.stage.conftest import SPEED

TORQUE = 360e3


#: Holds the housing, so that bearings alone share the load.
FIXED_HOUSING = MountingData(radial_stiffness=1e13, axial_stiffness=1e13, tilt_stiffness=1e13)


def static_columns(body, load, **bearings):
    data = StageData(bearings=BearingData(**bearings), mounting=FIXED_HOUSING)
    model = stage_model(body, data, speed=0.0)
    record = quasi_static_turn(model, load, 5)
    return load_columns(model, record, part_loads(model, record.c))


def test_teeth_and_pins_carry_the_torque_and_share_it(stage_body):
    columns = static_columns(stage_body, SteadyLoad(TORQUE, gravity=0.0))
    for planet in (1, 2, 3):
        assert_allclose(columns[f"pin_{planet}_force_tangential"], -TORQUE / (3 * 0.308), rtol=1e-6)
        assert_allclose(columns[f"share_{planet}"], 1.0 / 3.0, rtol=1e-6)
        # Sun and ring push a planet equally against the rotation.
        assert_allclose(columns[f"sun_mesh_{planet}"], columns[f"ring_mesh_{planet}"], rtol=0.05)
    assert_allclose(columns["load_sharing_factor"], 1.0, rtol=1e-6)


@pytest.mark.parametrize("unequal", [1.0, 0.2])
def test_a_bearing_carries_what_the_radial_load_asks_for_at_every_angle(stage_body, unequal):
    # Bearing A alone is statically determinate: F 1.22 m over 2.16 m, downwards, and the main
    # bearing the sum; a load that stands still in the fixed frame.
    columns = static_columns(
        stage_body,
        SteadyLoad(TORQUE, ntl_z=1e4, gravity=0.0),
        downwind_radial=0.0,
        sun_radial=1.0,
        sun_tilt=1.0,
        upwind_y_factor=unequal,
    )
    # Upwards at the hub: the main bearing holds it down, bearing A the shaft's other end up.
    assert_allclose(columns["bearing_A_z"], 1e4 * 1.22 / 2.16, rtol=0.01)
    assert_allclose(columns["main_bearing_z"], -1e4 * (1.0 + 1.22 / 2.16), rtol=0.01)
    assert np.abs(columns["bearing_A_y"]).max() < 200.0
    assert np.abs(columns["bearing_B_z"]).max() == 0.0


def test_speeds_torque_and_energies_of_a_run(stage_body):
    model = stage_model(stage_body, speed=SPEED)
    (piece,) = simulate_stage(
        model, SteadyLoad(TORQUE), (), duration=0.5, sample_rate=100.0, step=1e-3
    )
    columns = load_columns(model, piece.record, piece.loads)
    assert all(values.shape == (50,) for values in columns.values())
    ratio = model.data.ratio
    assert_allclose(columns["carrier_speed"].mean(), SPEED, rtol=1e-3)
    assert_allclose(columns["sun_speed"].mean(), SPEED * 120 / 21, rtol=1e-3)
    assert_allclose(columns["generator_speed"].mean(), SPEED * ratio, rtol=1e-3)
    assert_allclose(columns["planet_1_speed"].mean(), SPEED * (1 - 99 / 39), rtol=1e-3)
    assert_allclose(columns["generator_torque"].mean(), -TORQUE / ratio, rtol=0.02)
    power = TORQUE * SPEED
    assert_allclose(columns["energy_torque"][-1], 0.5 * power, rtol=0.01)
    assert np.abs(columns["energy_imbalance"]).max() < 1e-9 * power
    # The sum of the shares is one, and weight loads one planet after the other.
    assert_allclose(sum(columns[f"share_{i}"] for i in (1, 2, 3)), 1.0, rtol=1e-12)
    assert (columns["load_sharing_factor"] > 1.0).all()


def test_the_housing_turns_against_its_bushings_in_the_fixed_frame(stage_body):
    model = stage_model(stage_body, speed=0.0)
    record = quasi_static_turn(model, SteadyLoad(TORQUE), 5)
    columns = load_columns(model, record, part_loads(model, record.c))
    roll = TORQUE * (1.0 - 1.0 / model.data.ratio) / (2.0 * 20.2e6 * 0.75**2)
    assert_allclose(columns["housing_theta_x"], roll, rtol=1e-3)
    # Weight pulls down at every carrier angle; in the carrier's frame it would turn.
    assert (columns["housing_d_z"] < -1e-4).all()
    assert np.ptp(columns["housing_d_z"]) < 1e-6
    assert np.abs(columns["housing_d_y"]).max() < 2e-6


def test_a_part_that_alone_is_tilted_tells_its_tilt(stage_body):
    model = stage_model(stage_body, speed=0.0)
    c = np.zeros((1, len(model.K)))
    c[0, 0] = 2.0  # the drive's large angle is no tilt
    c[0, model.labels.index("sun Rz [rad]")] = 3e-4
    assert_allclose(part_tilt(model, "sun", c), [[0.0, 3e-4]], atol=1e-15)
    assert_allclose(part_tilt(model, "ring", c), 0.0, atol=1e-15)


def test_a_tilted_ring_misaligns_its_meshes_alone(stage_body):
    model = stage_model(stage_body, speed=0.0)
    # A motion of the ring alone: its rotation about y in the coordinates c.
    c = np.zeros((1, len(model.K)))
    c[0, model.labels.index("ring Ry [rad]")] = 1e-4
    slopes = mesh_misalignment(model, c)[0]
    assert np.abs(slopes[:3]).max() == 0.0
    # e_x leads to -z under a rotation about y: the ring leaves the planets by -n_z a unit of x.
    normals = np.array([line.normal for line in model.channels.lines[3:6]])
    assert_allclose(slopes[3:], normals[:, 2] * 1e-4, rtol=1e-12)
    assert np.abs(slopes[3:]).max() > 5e-5


def test_slices_resist_the_misalignment_of_their_meshes_and_nothing_else(stage_body):
    # Energy of small motions: k b^2 / 12 per slope of the gap over the face width, on top of k.
    gear, mesh = StageData().gear, MeshData()
    one, two, five = (
        stage_model(stage_body, StageData(mesh=MeshData(n_slices=n)), speed=0.0) for n in (1, 2, 5)
    )
    c = 1e-5 * np.random.default_rng(4).standard_normal((3, len(one.K)))
    c[:, 0] = 0.0
    slopes = mesh_misalignment(one, c)
    tilt = np.repeat(
        [mesh.sun_stiffness * gear.sun_width**2, mesh.ring_stiffness * gear.planet_width**2], 3
    )
    expected = (tilt / 12.0 * slopes**2).sum(axis=1)
    for sliced in (two, five):
        added = np.einsum("ni,ij,nj->n", c, sliced.K - one.K, c)
        assert_allclose(added, expected, rtol=1e-6)


def test_a_moment_on_a_pin_loads_one_row_more(stage_body):
    force = np.array([[[0.0, 30e3, -390e3]]])
    # 0.04 m from mid-span downwind: all of the load on the downwind row of two 0.08 m apart.
    moment = np.array([[np.cross([0.04, 0.0, 0.0], force[0, 0])]])
    rows = PartLoads(np.zeros((1, 4)), force, moment).row_load(0.08)
    assert_allclose(rows, [[[0.0, np.hypot(30e3, 390e3)]]], atol=1e-6)


def test_teeth_that_resist_tilt_load_the_upwind_row_more(stage_body):
    rows = {}
    for n_slices in (1, 2):
        data = StageData(mesh=MeshData(n_slices=n_slices))
        model = stage_model(stage_body, data, speed=0.0)
        record = quasi_static_turn(model, SteadyLoad(TORQUE), 6)
        columns = load_columns(model, record, part_loads(model, record.c))
        rows[n_slices] = [
            np.mean([columns[f"pin_{pin}_{side}_row"] for pin in (1, 2, 3)])
            for side in ("upwind", "downwind")
        ]
    # The helix tilts a planet across the pin load, which loads both rows alike.
    assert_allclose(rows[1][0], rows[1][1], rtol=0.01)
    assert rows[2][0] > 1.1 * rows[2][1]
