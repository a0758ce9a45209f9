"""Effects that act in the stage.

Pins that bear on their bores above a torque, the flange's motion as planets pass, the zero.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.geometry.pins import pin_angles
from carrierflex.reduction.assembly import Joint, assembled
from carrierflex.reduction.pin_joints import PAPER_STIFFNESS, pin_pilot
from carrierflex.reduction.reduced_model import turned
from carrierflex.simulation.carrier.kinematics import carrier_tilt_pattern, housing_tilt_pattern
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.quasi_static import rest_readings
from carrierflex.simulation.stage.readings import (
    ReadingEffects,
    SensorError,
    rim_reader,
    sensor_signals,
)
from carrierflex.simulation.stage.response import (
    StageRecord,
    joined_records,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from carrierflex.simulation.stage.stage_data import BearingData, RollerBearingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad, static_coordinates
from tests.simulation.stage.conftest import SPEED

SENSORS = [Sensor(f"s{v:g}", AXIAL, np.deg2rad(v), 0.412) for v in (47.0, 137.0, 227.0, 317.0)]
SENSORS.append(Sensor("r40", RADIAL, np.deg2rad(40.0), 0.412))
PLAY, CLOSED = 0.5e-3, 1e8


def orders(model, torque):
    """Amplitudes of orders 3 and 6 of the rim's axial deflection at a torque [m]."""
    reader, c = (
        rim_reader(model),
        static_coordinates(model, SteadyLoad(torque, gravity=0.0), mean_stiffness=True),
    )
    amplitude = dict(zip(reader.orders.tolist(), reader.axial @ c, strict=True))
    return np.array([amplitude[3], amplitude[6]])


def bends(model, torque):
    """Largest relative rotation of a pin in a bore [rad], 0 without such contact."""
    c, channels = (
        static_coordinates(model, SteadyLoad(torque, gravity=0.0), mean_stiffness=True),
        model.channels,
    )
    play = (c @ channels.B - channels.free)[channels.clearances].reshape(-1, 2)
    return np.linalg.norm(play, axis=1).max()


@pytest.fixture(scope="module")
def loose_pins(stage_body):
    return stage_model(
        stage_body, effects=StageEffects(pin_fit_play=PLAY, pin_fit_closed=CLOSED), speed=0.0
    )


def test_pins_are_flexible_below_the_torque_that_closes_their_play(loose_pins, stage_body):
    open_pins = stage_model(stage_body, speed=0.0)
    closing = 180e3 * PLAY / bends(loose_pins, 180e3)  # linear until then
    assert 150e3 < closing < 250e3
    for torque in (0.5 * closing, 0.98 * closing):
        assert_allclose(orders(loose_pins, torque), orders(open_pins, torque), rtol=1e-9)
    # Above: order 3 grows more slowly than the torque.
    above = np.abs(orders(loose_pins, 360e3)[0]) / 360e3
    assert above < 0.8 * np.abs(orders(open_pins, 360e3)[0]) / 360e3
    assert StageEffects(pin_fit_play=PLAY).ids == ("pin_clearance",)


def test_far_above_the_threshold_the_share_is_that_of_stiff_pins(
    loose_pins, flexible_reduction, pin_reduction
):
    # The play's contact and the pin fit are springs side by side in both bores; about the pin's own
    # axis the fit is alone.
    bodies, joints = [flexible_reduction.model], []
    for number, angle in enumerate(pin_angles(3), start=1):
        rename = {
            f"pin_1_{station}": pin_pilot(number, station)
            for station in ("upwind", "midspan", "downwind")
        }
        bodies.append(turned(pin_reduction.model, float(angle), rename))
        for side in ("upwind", "downwind"):
            bending = PAPER_STIFFNESS + CLOSED
            joints.append(
                Joint(f"pin_{number}_{side}", pin_pilot(number, side), bending, PAPER_STIFFNESS)
            )
    carrier = assembled("carrier_with_pins", bodies, joints)
    stiff = stage_model(
        joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"])), speed=0.0
    )
    slope = (orders(loose_pins, 21e6) - orders(loose_pins, 20e6)) / 1e6
    assert_allclose(slope, orders(stiff, 1e6) / 1e6, rtol=0.0, atol=1e-3 * np.abs(slope).max())


def test_energy_balances_while_pins_meet_their_bores(stage_body):
    model = stage_model(stage_body, effects=StageEffects(pin_fit_play=PLAY), speed=SPEED)
    steady = steady_drive(model, SteadyLoad(360e3))

    def drive(time):
        rows = steady(time)
        rows[:, 0] *= np.cos(12.0 * np.pi * time)
        return rows

    start = quasi_static_start(model, SteadyLoad(360e3))
    record = joined_records(
        list(run_stage(model, drive, start, duration=0.6, sample_rate=500.0, step=1e-3))
    )
    play = (record.c @ model.channels.B - model.channels.free)[
        :, model.channels.clearances
    ].reshape(len(record.time), -1, 2)
    closed = np.linalg.norm(play, axis=2) > PLAY
    assert closed.any(axis=0).sum() >= 3  # bores that come into contact
    assert (~closed).any(axis=0).all()  # and all of them lose it again
    work = np.abs(np.diff(record.energy[:, 0])).sum()
    assert np.abs(record.imbalance).max() < 1e-6 * work


def still_record(model, theta, torque):
    c = np.zeros((len(theta), len(model.K)))
    c[:, 0] = theta
    drive = np.zeros((len(theta), 4))
    drive[:, 0] = torque
    return StageRecord(
        np.arange(len(theta)) * 0.01, c, np.zeros_like(c), drive, np.zeros((len(theta), 6))
    )


def test_ring_pass_moves_the_flange_three_times_a_turn_with_the_torque(stage_body):
    effects = StageEffects(
        ring_pass_offset=(2e-11, -1e-11), ring_pass_tilt=(5e-11, 0.0, 0.0, 3e-11)
    )
    assert effects.ids == ("ring_pass",)
    theta = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    model, plain = (
        stage_model(stage_body, effects=effects, speed=SPEED),
        stage_model(stage_body, speed=SPEED),
    )
    for torque in (180e3, 360e3):
        with_ring_pass = sensor_signals(model, still_record(model, theta, torque), SENSORS)
        none = sensor_signals(plain, still_record(plain, theta, torque), SENSORS)
        for sensor in SENSORS:
            if sensor.quantity == RADIAL:
                assert_allclose(
                    with_ring_pass[sensor.name], none[sensor.name], rtol=0.0, atol=1e-18
                )
                continue
            # diagnosis' own form of ring_pass: T (p + R q sin(0 - v) + R r sin(pi/2 - v)) at cos
            # and sin of 3 theta.
            v = sensor.angle
            c = np.cos(3.0 * theta)
            s = np.sin(3.0 * theta)
            tilt = 5e-11 * c * 0.412 * np.sin(-v) + 3e-11 * s * 0.412 * np.sin(np.pi / 2.0 - v)
            expected = torque * (2e-11 * c - 1e-11 * s + tilt)
            assert_allclose(
                with_ring_pass[sensor.name] - none[sensor.name], expected, rtol=0.0, atol=1e-12
            )


def test_effects_out_of_range_are_refused(stage_body, pinned_carrier):
    with pytest.raises(ValueError, match=r"ring_pass_tilt is \(1\.0,\); expected 4 finite numbers"):
        StageEffects(ring_pass_tilt=(1.0,))
    with pytest.raises(
        ValueError, match=r"pin_fit_play -1\.0 rad and pin_fit_closed .* expected a play >= 0"
    ):
        StageEffects(pin_fit_play=-1.0)
    names = {"pin_1_upwind_of_pin": "other"}
    model = stage_body.model
    pilots = {names.get(name, name): point for name, point in model.pilots.items()}
    rows = {
        names.get(name, name): coordinates for name, coordinates in model.pilot_coordinates.items()
    }
    bonded = replace(stage_body, model=replace(model, pilots=pilots, pilot_coordinates=rows))
    with pytest.raises(
        ValueError, match="no pilot 'pin_1_upwind_of_pin'; expected pins as bodies of their own"
    ):
        stage_model(bonded, effects=StageEffects(pin_fit_play=PLAY), speed=SPEED)


def test_rest_reading_holds_what_does_not_depend_on_load_and_no_noise(stage_body):
    model = stage_model(stage_body, speed=SPEED)
    effects = ReadingEffects(
        axial_offset=1e-4,
        phi_H=5e-4,
        phi_face=6e-4,
        theta_face=1.0,
        noise_std=1e-3,
        sensors={"s47": SensorError(zero=2e-5)},
    )
    angle = 0.7
    plain, result = (
        rest_readings(model, SENSORS, angle),
        rest_readings(model, SENSORS, angle, effects=effects),
    )
    for sensor in SENSORS:
        expected = 0.0
        if sensor.quantity == AXIAL:
            theta, v = np.array([angle]), sensor.angle
            expected = 1e-4 + 5e-4 * housing_tilt_pattern(theta, v, 0.412, 0.0)[0]
            expected += 6e-4 * carrier_tilt_pattern(theta, v, 0.412, 1.0)[0] + (
                2e-5 if sensor.name == "s47" else 0.0
            )
        assert_allclose(result[sensor.name] - plain[sensor.name], expected, rtol=0.0, atol=1e-15)
    # Weight alone: micrometres at rest, none of the torque's 70.
    assert 0.0 < max(abs(value) for value in plain.values()) < 5e-5


def test_a_zeroed_run_differs_from_a_plain_one_by_the_rest_reading(stage_body):
    model, sensors = stage_model(stage_body, speed=SPEED), SENSORS[:2]
    effects = ReadingEffects(axial_offset=1e-4)

    def signals(**keywords):
        pieces = simulate_stage(
            model,
            SteadyLoad(360e3),
            sensors,
            duration=0.1,
            sample_rate=100.0,
            step=1e-3,
            effects=effects,
            **keywords,
        )
        return next(iter(pieces)).signals

    zero = rest_readings(model, sensors, 0.3, effects=effects)
    plain = signals()
    zeroed = signals(rest_angle=0.3)
    for sensor in sensors:
        assert_allclose(plain[sensor.name] - zeroed[sensor.name], zero[sensor.name], rtol=1e-12)


@pytest.mark.parametrize("torque", [0.0, 1e3, -5e3])
@pytest.mark.parametrize("clearance", [0.0, 40e-6])
@pytest.mark.parametrize("rollers", [None, RollerBearingData()])
def test_a_stage_that_hangs_in_its_clearances_finds_its_rest(
    stage_body, torque, clearance, rollers
):
    bearings = BearingData(
        planet_clearance=clearance, upwind_clearance=0.14e-3, downwind_clearance=0.12e-3
    )
    data = StageData(bearings=bearings, planet_rollers=rollers)
    model = stage_model(stage_body, data, effects=StageEffects(pin_fit_play=PLAY), speed=0.0)
    for angle in (0.0, 2.0, 4.4):
        c = static_coordinates(model, SteadyLoad(torque), angle)
        # Bearings and mounting carry the weight: about 56 kN of parts, carrier, shaft and coupling.
        mount = model.springs["main_bearing"].G @ model.L @ np.concatenate([[0.0], c[1:]])
        assert np.isfinite(c).all()
        assert np.abs(mount[:3]).max() < 1e-3
