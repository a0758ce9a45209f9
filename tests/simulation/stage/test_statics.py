"""Static limit of the stage.

Ratios, load sharing, once-per-revolution loads, the rim's deflection curve.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.fe.load_cases import together
from carrierflex.reduction.held_structure import HeldStructure
from carrierflex.reduction.reduced_static import static_coordinates as held_coordinates
from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.part_loads import part_loads, spring_load
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.response import (
    joined_records,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.stage_data import BearingData, MeshData, MountingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import (
    SteadyLoad,
    static_coordinates,
    static_turn,
    turning_force,
)
from tests.simulation.stage.conftest import SPEED

TORQUE = 360e3
#: Tangential pin force of a carrier that stands still: T / (3 a).
PIN_FORCE = TORQUE / (3.0 * 0.308)
LIGHT = SteadyLoad(TORQUE, gravity=0.0)


@pytest.fixture(scope="module")
def still_stage(stage_body):
    """At standstill: centrifugal forces add 0.2 N to the pin forces of 390 kN at rated speed."""
    return stage_model(stage_body, speed=0.0)


def loads_at(model, load, angle=0.0):
    return part_loads(model, static_coordinates(model, load, angle)[None])


def shares(model, load, n=24):
    angles = 2.0 * np.pi * np.arange(n) / n
    c = [static_coordinates(model, load, angle, mean_stiffness=True) for angle in angles]
    return part_loads(model, np.array(c)).load_share


def test_torque_and_speed_ratio_is_that_of_the_teeth(nominal_stage):
    # 120/21 * 82/23 * 88/22
    assert_allclose(nominal_stage.data.ratio, 81.4907, rtol=1e-6)
    force = nominal_stage.loads
    assert_allclose(force.generator[0] / force.torque[0], 120 / 21 * 82 / 23 * 4, rtol=1e-12)


def test_planets_share_the_torque_equally_in_the_symmetric_stage(still_stage):
    loads = loads_at(still_stage, LIGHT)
    assert_allclose(loads.load_share[0], 1.0 / 3.0, rtol=0.0, atol=1e-9)
    assert_allclose(loads.pin_force[0, :, 2], -PIN_FORCE, rtol=1e-9)
    # Helix: both axial forces at the pitch radius make a moment towards increasing angle, standard
    # F_t tan(beta).
    assert (loads.pin_moment[0, :, 2] > 0.0).all()
    assert_allclose(loads.pin_moment[0, :, 2], 28.5 / 1000.0 * TORQUE, rtol=0.03)


def test_housing_carries_the_torque_that_the_generator_does_not(still_stage):
    c = static_coordinates(still_stage, LIGHT)
    housing = still_stage.channels.B[:, still_stage.channels.housing].T[:, 1:] @ c[1:]
    reaction = -(still_stage.channels.K_fixed @ housing)
    assert_allclose(reaction[3], -TORQUE * (1.0 - 1.0 / still_stage.data.ratio), rtol=1e-9)


def test_rim_curve_equals_that_of_the_reduced_and_the_full_carrier(
    still_stage, stage_body, pinned_carrier, flexible_structure, flexible_reduction
):
    loads = loads_at(still_stage, LIGHT)
    model = stage_body.model
    q = (still_stage.L[:, 1:] @ static_coordinates(still_stage, LIGHT)[1:])[: model.n_coordinates]
    face = q[model.coordinates_of("shaft_face")]
    rotation, x = face[3:], pinned_carrier.pilots["shaft_face"]
    rigid = geometric_rigid_modes(pinned_carrier) @ np.concatenate(
        [face[:3] - np.cross(rotation, x), rotation]
    )
    ours = (model.sensor_rows @ q - pinned_carrier.sensor_rows @ rigid)[:360]
    # The same pin loads and what little the seats carry, the shaft face held: reduced carrier, then
    # finite elements.
    pins = {}
    for i, v in enumerate((0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0)):
        axes = np.array(
            [[1.0, 0.0, 0.0], [0.0, -np.sin(v), np.cos(v)], [0.0, -np.cos(v), -np.sin(v)]]
        )
        load = np.concatenate([loads.pin_force[0, i] @ axes, loads.pin_moment[0, i] @ axes])
        pins[f"pin_{i + 1}_midspan_of_pin"] = load
    q_fixed = held_coordinates(pinned_carrier, ["shaft_face"], pins)
    reduced = (pinned_carrier.sensor_rows @ q_fixed)[:360]
    assert_allclose(ours, reduced, rtol=0.0, atol=1e-6 * np.abs(reduced).max())
    # Bores' loads of that answer on the finite-element carrier, which knows nothing of pins or
    # stage.
    bores = {
        name: pinned_reaction(flexible_reduction.model, pinned_carrier, q_fixed, name)
        for name in flexible_reduction.model.pilots
        if name.startswith("pin")
    }
    full = HeldStructure(flexible_reduction.body, flexible_structure.pilots[:1])
    u, _ = full.solve(flexible_structure.load_vector(together(bores))[:, None], np.zeros((6, 1)))
    assert_allclose(
        ours,
        (flexible_structure.sensors.rows @ u[:, 0])[:360],
        rtol=0.0,
        atol=1e-6 * np.abs(ours).max(),
    )


def pinned_reaction(carrier, joined, q, pilot):
    """Force on a bore of the carrier alone that its displacement in the assembly asks for."""
    q_carrier = q[: carrier.n_coordinates]
    return (carrier.K @ q_carrier)[carrier.coordinates_of(pilot)]


def test_a_pin_out_of_place_takes_more_load_and_keeps_the_sum(stage_body):
    late = stage_model(stage_body, effects=StageEffects(pin_offset=(-20e-6, 0.0, 0.0)), speed=SPEED)
    loads = loads_at(late, LIGHT)
    assert (
        loads.load_share[0, 0] < 1.0 / 3.0 - 1e-4
    )  # a pin that lags the rotation is left behind by its teeth
    assert_allclose(loads.pin_force[0, :, 2].sum(), -3.0 * PIN_FORCE, rtol=1e-6)
    early = stage_model(stage_body, effects=StageEffects(pin_offset=(20e-6, 0.0, 0.0)), speed=SPEED)
    assert loads_at(early, LIGHT).load_share[0, 0] > 1.0 / 3.0 + 1e-4


def test_the_floating_sun_evens_the_load_of_a_pin_out_of_place(stage_body):
    effects = StageEffects(pin_offset=(20e-6, 0.0, 0.0))
    excess = []
    for radial in (1e5, 5e6, 1e10):
        data = StageData(bearings=replace(BearingData(), sun_radial=radial))
        excess.append(
            loads_at(stage_model(stage_body, data, effects=effects, speed=SPEED), LIGHT).load_share[
                0, 0
            ]
        )
    assert 1.0 / 3.0 < excess[0] < excess[1] < excess[2]


def test_a_stiffer_mesh_takes_more_load(stage_body):
    stiff = StageEffects(sun_mesh_factor=(1.2, 1.0, 1.0), ring_mesh_factor=(1.2, 1.0, 1.0))
    share = loads_at(stage_model(stage_body, effects=stiff, speed=SPEED), LIGHT).load_share[0]
    assert share[0] > share[1]
    assert_allclose(share.sum(), 1.0, rtol=1e-12)


def test_a_fixed_radial_load_modulates_the_planets_once_a_revolution(stage_body):
    # Bushings equal along y and z, so that the mounting adds no second order of its own.
    data = StageData(mounting=replace(MountingData(), axial_stiffness=0.0, x=0.5))
    model = stage_model(stage_body, data, speed=SPEED)
    share = shares(model, SteadyLoad(TORQUE, ntl_z=200e3, gravity=0.0))
    orders = np.abs(np.fft.rfft(share, axis=0)) / len(share)
    assert_allclose(orders[0], 1.0 / 3.0, rtol=1e-6)
    assert (orders[1] > 1e-5).all()
    assert orders[2:].max() < 0.01 * orders[1].min()
    # Planets pass the load one after another.
    phase = np.angle(np.fft.rfft(share, axis=0)[1])
    assert_allclose(
        np.exp(1j * (phase - phase[0])),
        np.exp(2j * np.pi * np.arange(3) / 3.0),
        rtol=0.0,
        atol=1e-3,
    )


def test_loads_on_the_drive_motion_cancel(nominal_stage):
    force = turning_force(nominal_stage, SteadyLoad(TORQUE, 1e5, 2e5), 0.7)
    assert abs(force[0]) < 1e-9 * TORQUE


def test_clearance_lets_the_carrier_sink_to_its_edge(stage_body):
    bearings = replace(BearingData(), upwind_clearance=0.14e-3, downwind_clearance=0.12e-3)
    model = stage_model(stage_body, StageData(bearings=bearings), speed=SPEED)
    c = static_coordinates(model, SteadyLoad(TORQUE), 0.4, mean_stiffness=True)
    play = (c @ model.channels.B - model.channels.free)[model.channels.clearances].reshape(2, 2)
    radius = np.linalg.norm(play, axis=1)
    # The edge, and beyond it the elastic part: at most the weight over the bearing's stiffness.
    assert (radius > [0.14e-3, 0.12e-3]).all()
    assert (radius < np.array([0.14e-3, 0.12e-3]) + 1e5 / 5e9).all()


def test_wrong_input_is_refused(stage_body):
    with pytest.raises(ValueError, match="torque is nan; expected a finite number"):
        SteadyLoad(float("nan"))
    with pytest.raises(
        ValueError, match=r"\[bearings\] upwind_radial is -1\.0; expected a finite number >= 0"
    ):
        BearingData(upwind_radial=-1.0)
    with pytest.raises(
        ValueError, match=r"pin_offset is .* expected 3 to 8 finite numbers, one a planet"
    ):
        StageEffects(pin_offset=(0.0,))
    with pytest.raises(
        ValueError, match=r"pin_offset holds 4 numbers; expected 3, one a planet of this stage"
    ):
        stage_model(stage_body, effects=StageEffects(pin_offset=(0.0,) * 4), speed=SPEED)
    with pytest.raises(ValueError, match="carrier speed is inf rad/s"):
        stage_model(stage_body, speed=np.inf)
    grounded = replace(
        stage_body,
        model=replace(
            stage_body.model, K=stage_body.model.K + 1e6 * np.eye(len(stage_body.model.K))
        ),
    )
    with pytest.raises(ValueError, match="turning the drive train meets a force"):
        stage_model(grounded, speed=SPEED)


def test_planets_carry_a_moment_that_no_bearing_takes_as_guo_keller_and_lacava_say(stage_body):
    # R_i = T / (3 a) + (2/3) (M_eff / L_p) cos(...): spur gears, so that no axial force turns the
    # planets; a held ring and sun, no carrier bearing, so that all of the moment goes through the
    # planets, L_p behind the main bearing.
    force, x_main = -100e3, stage_body.model.pilots["main_bearing_seat"][0]
    data = StageData(
        gear=replace(StageData().gear, helix_angle=0.0),
        bearings=BearingData(
            upwind_radial=0.0, downwind_radial=0.0, sun_radial=1e12, ring_to_housing=1e12
        ),
        mounting=MountingData(radial_stiffness=1e13, axial_stiffness=1e13, tilt_stiffness=1e13),
    )
    model = stage_model(stage_body, data, speed=0.0)
    load = SteadyLoad(TORQUE, ntl_z=force, gravity=0.0)
    record = quasi_static_turn(model, load, 12)
    pull = -part_loads(model, record.c).pin_force[:, :, 2]
    orders = np.fft.rfft(pull, axis=0) / len(pull)
    moment, L_p = force * data.mounting.ntl_arm, data.planet.x - x_main
    assert_allclose(orders[0].real, TORQUE / (3.0 * data.gear.centre_distance), rtol=1e-6)
    assert_allclose(2.0 * np.abs(orders[1]), 2.0 / 3.0 * abs(moment) / L_p, rtol=2e-3)
    assert_allclose(np.abs(orders[2:]).max(), 0.0, atol=1e-3 * np.abs(orders[1]).min())
    # Equation 9 asks for a third of a turn from planet to planet.
    phase = np.angle(orders[1])
    assert_allclose(
        np.exp(1j * (phase - phase[0])), np.exp(2j * np.pi * np.arange(3) / 3.0), atol=1e-3
    )


#: Sun on a short quill with a spline that rubs and slips, planets one after the other out of place.
RUBBING = StageData(
    bearings=BearingData(
        upwind_clearance=0.1375e-3,
        downwind_clearance=0.1225e-3,
        sun_radial=1e9,
        sun_friction=0.05,
        sun_clearance=0.3e-3,
    )
)


def test_friction_in_the_spline_bounds_what_the_sun_carries_by_the_torque(stage_body):
    limits = []
    for torque in (180e3, 360e3):
        load = SteadyLoad(torque, ntl_z=-300e3 / 1.22)
        model = stage_model(stage_body, RUBBING, speed=0.0)
        record = quasi_static_turn(model, load, 6)
        lateral = np.linalg.norm(spring_load(model, "sun", record.c)[:, 1:3], axis=1)
        limits.append(lateral.max())
        sun_torque = torque / RUBBING.gear.ratio
        assert lateral.max() < 1.001 * 0.05 * sun_torque / 0.07
        assert lateral.max() > 0.9 * 0.05 * sun_torque / 0.07
    assert_allclose(limits[1] / limits[0], 2.0, rtol=0.05)


def test_statics_and_time_share_the_load_alike_where_the_spline_slips(stage_body):
    load = SteadyLoad(TORQUE, ntl_z=-300e3 / 1.22)
    effects = StageEffects(pin_offset=(10e-6, -10e-6, -10e-6))
    model = stage_model(stage_body, RUBBING, effects=effects, speed=SPEED)
    start = quasi_static_start(model, load)
    record = joined_records(
        list(
            run_stage(
                model, steady_drive(model, load), start, duration=2.0, sample_rate=50.0, step=1e-3
            )
        )
    )
    assert np.abs(record.imbalance).max() < 1e-9 * np.abs(record.energy[:, 0]).max()
    # Friction takes energy: more than the same stage dissipates without it.
    assert (np.diff(record.energy[:, 4]) > 0.0).all()
    at_rest = stage_model(stage_body, RUBBING, effects=effects, speed=0.0)
    c = static_turn(at_rest, load, record.c[50::10, 0], mean_stiffness=True)
    still = part_loads(at_rest, c).load_share
    assert_allclose(part_loads(model, record.c[50::10]).load_share, still, rtol=0.01)
    assert 3.0 * still.max() > 1.1


def test_a_sun_whose_spline_rubs_does_not_drive_itself(stage_body):
    """Load upwards, the sun amid its friction: at 244 Hz the steady law feeds motion."""
    load, data = SteadyLoad(TORQUE, ntl_z=300e3 / 1.22), replace(RUBBING, mesh=MeshData(n_slices=2))
    model = stage_model(stage_body, data, speed=SPEED)
    start = quasi_static_start(model, load)
    record = joined_records(
        list(
            run_stage(
                model, steady_drive(model, load), start, duration=0.5, sample_rate=200.0, step=1e-3
            )
        )
    )
    still = quasi_static_turn(stage_model(stage_body, data, speed=0.0), load, 12)
    share = part_loads(model, record.c).load_share
    # Mesh forces at 36 Hz are 0.2 of 390 kN.
    assert_allclose(share.max(), part_loads(model, still.c).load_share.max(), rtol=0.01)
    assert (np.diff(record.energy[:, 4]) > 0.0).all()
