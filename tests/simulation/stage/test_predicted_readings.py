"""Readings that a stage predicts under measured loads, and what a change inside it adds."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.rim import CarrierInputs, RimSensor
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage import causes
from carrierflex.simulation.stage.causes import GapSeries, stage_prediction
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.predicted_readings import (
    LoadPoints,
    PredictedStage,
    StageReadings,
    load_points,
    stage_readings,
)
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.readings import ReadingEffects, sensor_signals
from carrierflex.simulation.stage.stage_data import BearingData, StageData
from carrierflex.simulation.stage.stage_model import stage_model
from carrierflex.simulation.stage.statics import SteadyLoad
from studies.stage_in_time import series_in_time

SENSORS = (
    Sensor("a", AXIAL, 0.8, 0.412),
    Sensor("b", AXIAL, 2.4, 0.412),
    Sensor("r", RADIAL, 0.8, 0.412),
)
SCALE = np.array([360e3, 2e5, 2e5])
LOADS = np.array([[360e3, 0.0, 0.0], [180e3, 0.0, 0.0], [360e3, 5e4, -2e5]])


def inputs_under(loads, angle):
    columns = np.broadcast_to(loads, (angle.size, 3)).T
    return CarrierInputs(angle, angle, *columns, start=0.0, end=1.0)


@pytest.fixture(scope="module")
def stage(stage_body):
    return PredictedStage(stage_body, StageData(), StageEffects(), ReadingEffects(), 2.3)


@pytest.fixture(scope="module")
def readings(stage):
    return stage_readings(stage, SENSORS, LoadPoints(LOADS, SCALE))[0]


@pytest.mark.parametrize("number", range(3))
def test_the_series_is_what_sensors_read_in_an_equilibrium_at_any_angle(stage, readings, number):
    model = stage_model(stage.body, stage.data, effects=stage.effects, speed=stage.speed)
    turn = quasi_static_turn(model, SteadyLoad(*LOADS[number]), 7)
    expected = sensor_signals(model, turn, SENSORS)
    for sensor in SENSORS:
        rim = RimSensor(sensor.angle, sensor.radius, sensor.quantity == AXIAL)
        signal = readings.signal(rim, inputs_under(LOADS[number], turn.c[:, 0]))
        # Orders beyond the series, 27 and on, of a coarse rim.
        assert_allclose(signal, expected[sensor.name], atol=3e-7)


def test_the_prediction_is_that_of_another_integrator_in_time(stage, readings):
    series = series_in_time(stage, SENSORS, [tuple(LOADS[2])], step=1e-3, highest_order=6)
    # Tooth meshes at the sensors' places of the turn, and the housing that swings on its bushings.
    assert_allclose(series[0], readings.series[2, :, :7], atol=1e-6)
    assert np.abs(readings.series[2, 0, 3]) > 5e-5


def test_a_load_between_two_points_is_on_the_line_between_them():
    series = np.array([[[1.0 + 0.0j]], [[3.0 + 0.0j]]])
    readings = StageReadings(SENSORS[:1], LoadPoints(LOADS[:2], SCALE), series)
    half = inputs_under([270e3, 0.0, 0.0], np.zeros(1))
    assert_allclose(readings.signal(RimSensor(0.8, 0.412, True), half), 2.0, rtol=1e-12)


def test_points_are_close_to_every_load_and_as_few_as_the_loads_that_differ():
    rng = np.random.default_rng(1)
    steady = np.repeat(LOADS, 50, axis=0) * (1.0 + 1e-3 * rng.standard_normal((150, 1)))
    assert len(load_points(steady, SCALE).loads) == 3
    ramp = np.outer(np.linspace(0.0, 1.0, 400), [360e3, 0.0, 0.0])
    points = load_points(ramp, SCALE)
    nearest = np.abs(ramp[:, None, 0] - points.loads[None, :, 0]).min(axis=1)
    assert nearest.max() <= 0.02 * SCALE[0]


def test_a_cause_at_a_size_is_what_the_stage_of_that_size_reads_more(stage, readings):
    loose = BearingData(upwind_clearance=0.1375e-3, downwind_clearance=0.1225e-3)
    case = replace(stage, data=replace(stage.data, bearings=loose))
    points = LoadPoints(LOADS[2:], SCALE)
    prediction = stage_prediction(case, SENSORS, points)
    assert prediction.not_solved == ()
    causes = {cause.id: cause for cause in prediction.causes}
    angle = np.linspace(0.0, 6.0, 9)
    inputs = inputs_under(LOADS[2], angle)
    rim = RimSensor(0.8, 0.412, True)

    def added(**bearings):
        changed = replace(loose, **bearings)
        other, _ = stage_readings(
            replace(case, data=replace(case.data, bearings=changed)), SENSORS, points
        )
        return (other - prediction.readings).signal(rim, inputs)

    sun_support = causes["stage/sun_radial"]
    at_node = sun_support.signals(rim, inputs, None, 2e8)
    assert_allclose(at_node[0], added(sun_radial=2e8), atol=1e-9)
    assert np.abs(at_node).max() > 2e-6
    # As the case has it, it adds nothing.
    assert_allclose(sun_support.signals(rim, inputs, None, loose.sun_radial), 0.0, atol=1e-12)
    tighter = causes["stage/upwind_clearance"].signals(rim, inputs, None, 0.12e-3)
    assert_allclose(tighter[0], added(upwind_clearance=0.12e-3), atol=1e-9)


def test_a_tilt_of_the_joint_is_a_secant_along_both_axes(stage):
    points = LoadPoints(LOADS[:1], SCALE)
    prediction = stage_prediction(stage, SENSORS, points)
    (cause,) = [one for one in prediction.causes if one.id == "stage/joint_tilt"]
    phi, theta = 0.8e-3, 1.1
    tilted = replace(stage, effects=StageEffects(phi_PLC=phi, theta_PLC=theta))
    other, _ = stage_readings(tilted, SENSORS, points)
    inputs = inputs_under(LOADS[0], np.linspace(0.0, 6.0, 9))
    rim = RimSensor(2.4, 0.412, True)
    rows = cause.signals(rim, inputs, None)
    expected = (other - prediction.readings).signal(rim, inputs)
    assert np.abs(expected).max() > 1e-6
    assert_allclose(
        phi * (np.cos(theta) * rows[0] + np.sin(theta) * rows[1]),
        expected,
        atol=0.02 * np.abs(expected).max(),
    )


def test_a_tilt_that_records_favour_follows_the_stage_where_it_is_not_linear(stage, monkeypatch):
    monkeypatch.setattr(causes, "SIZED_CAUSES", {})
    monkeypatch.setattr(causes, "GROUPS", {"joint_tilt": "joint_tilt"})
    bearings = BearingData(upwind_clearance=0.1375e-3, downwind_clearance=0.1225e-3)
    loose = replace(stage, data=replace(stage.data, bearings=bearings))
    tilt, points = 1.2e-3 * np.exp(2.0j), LoadPoints(LOADS, SCALE)
    tilted = replace(loose, effects=StageEffects(phi_PLC=1.2e-3, theta_PLC=2.0))
    records, _ = stage_readings(tilted, SENSORS, points)
    is_axial = np.array([sensor.quantity == AXIAL for sensor in SENSORS])

    def gap_of(readings):
        return GapSeries((records - readings).series, np.eye(len(LOADS)), is_axial)

    inputs, rim = inputs_under(LOADS[2], np.linspace(0.0, 6.0, 9)), RimSensor(2.4, 0.412, True)
    missed = []
    for gap in (None, gap_of):
        prediction = stage_prediction(loose, SENSORS, points, gap)
        rows = prediction.causes[0].signals(rim, inputs, None)
        expected = (records - prediction.readings).signal(rim, inputs)
        added = tilt.real * rows[0] + tilt.imag * rows[1]
        missed.append(np.abs(added - expected).max() / np.abs(expected).max())
    assert missed[0] > 3e-3
    assert missed[1] < 1e-3 * missed[0]
