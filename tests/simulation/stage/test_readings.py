"""What the sensors read: rim against housing, patterns and sensor errors."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.sensing import SensorError
from carrierflex.simulation.stage.readings import ReadingEffects, sensor_signals
from carrierflex.simulation.stage.response import StageRecord

ANGLE = 2.0 * np.pi * np.arange(36) / 36
SENSOR = Sensor("s", AXIAL, np.deg2rad(47.0), 0.412)
RIM = Sensor("r", RADIAL, np.deg2rad(40.0), 0.412)


def record_of(model, c, torque=0.0, ntl_z=0.0):
    """A turn of the carrier with the small coordinates c standing still in its frame.

    One sample every 0.1 s.
    """
    rows = np.tile(c, (len(ANGLE), 1))
    rows[:, 0] = ANGLE
    drive = np.tile([torque, 0.0, 0.0, ntl_z], (len(ANGLE), 1))
    return StageRecord(
        0.1 * np.arange(len(ANGLE)), rows, np.zeros_like(rows), drive, np.zeros((len(ANGLE), 6))
    )


def read(model, c, sensor=SENSOR, effects=None, **options):
    rng = options.pop("rng", None)
    return sensor_signals(
        model, record_of(model, c, **options), [sensor], effects=effects, rng=rng
    )[sensor.name]


def rest(model):
    return np.zeros(len(model.K))


def test_a_sensor_reads_the_material_point_that_stands_under_it(nominal_stage, stage_body):
    rng = np.random.default_rng(0)
    c = np.concatenate([[0.0], 1e-6 * rng.standard_normal(len(nominal_stage.K) - 1)])
    q = nominal_stage.L[:, 1:] @ c[1:]
    housing = nominal_stage.channels.B[1:, nominal_stage.channels.housing].T @ c[1:]
    rim = (stage_body.model.sensor_rows @ q[: stage_body.model.n_coordinates])[:360]
    signal = read(nominal_stage, c)
    for k in (
        0,
        5,
        20,
    ):  # 10 deg a sample: the material point is a whole number of degrees from the sensor
        degree = (47 - 10 * k) % 360
        phi = np.deg2rad(degree)
        plane = housing[0] + 0.412 * (housing[4] * np.cos(phi) + housing[5] * np.sin(phi))
        assert_allclose(signal[k], rim[degree] - plane, rtol=1e-9, atol=1e-15)


def test_carrier_and_housing_moving_together_are_not_seen(nominal_stage):
    # Everything tilted and shifted as one: body, parts and housing.
    layout = nominal_stage.layout
    q = np.zeros(layout.n)
    amplitude = np.array([1e-4, 2e-4, -1e-4, 0.0, 3e-4, 4e-4])
    n = layout.body.model.n_coordinates
    q[:n] = geometric_rigid_modes(layout.body.model) @ amplitude
    centre = layout.centre("housing")
    q[layout.rows["housing"]] = np.concatenate(
        [amplitude[:3] + np.cross(amplitude[3:], centre), amplitude[3:]]
    )
    c = np.linalg.solve(nominal_stage.L, q)
    for sensor in (SENSOR, RIM):
        # The coarse mesh's circle is 412 mm to 5e-5.
        assert np.abs(read(nominal_stage, c, sensor)).max() < 2e-4 * 0.412 * 5e-4


def test_patterns_are_those_of_the_papers_equations(nominal_stage):
    c = rest(nominal_stage)
    bare = read(nominal_stage, c)
    face = read(nominal_stage, c, effects=ReadingEffects(phi_face=1e-3, theta_face=0.3)) - bare
    assert_allclose(face, 0.412e-3 * np.sin(0.3 + ANGLE - SENSOR.angle), rtol=0.0, atol=1e-15)
    housing = read(nominal_stage, c, effects=ReadingEffects(phi_H=1e-3, theta_H=0.2)) - bare
    assert_allclose(housing, 0.412e-3 * np.sin(0.2 - SENSOR.angle), rtol=0.0, atol=1e-15)
    effects = ReadingEffects(saddle=(1e-5, 1e-10, -4.2e-10), axial_offset=2e-5)
    warp = read(nominal_stage, c, effects=effects, torque=360e3, ntl_z=-200e3) - bare
    assert_allclose(warp, 2e-5 + 1e-5 + 36e-6 + 84e-6, rtol=1e-9)
    runout = read(nominal_stage, c, effects=ReadingEffects(runout={2: (5e-6, 0.4)})) - bare
    assert_allclose(runout, 5e-6 * np.cos(2.0 * (SENSOR.angle - ANGLE) - 0.4), rtol=0.0, atol=1e-15)
    drift = read(nominal_stage, c, effects=ReadingEffects(drift_rate=1e-6)) - bare
    assert_allclose(drift, 1e-7 * np.arange(36), rtol=0.0, atol=1e-15)
    assert (
        read(nominal_stage, c, RIM, effects=effects, torque=360e3) == read(nominal_stage, c, RIM)
    ).all()


def test_sensor_errors_change_their_own_sensor(nominal_stage):
    c, tilt = rest(nominal_stage), ReadingEffects(phi_face=1e-3)
    clean = read(nominal_stage, c, effects=tilt)
    wrong = replace(tilt, sensors={"s": SensorError(gain=0.01, zero=2e-5)})
    assert_allclose(read(nominal_stage, c, effects=wrong), 1.01 * clean + 2e-5, rtol=1e-12)
    turned = replace(tilt, sensors={"s": SensorError(angle=np.deg2rad(10.0))})
    assert_allclose(read(nominal_stage, c, effects=turned)[1:], clean[:-1], rtol=0.0, atol=1e-12)
    late = replace(tilt, delay=0.1)
    assert_allclose(read(nominal_stage, c, effects=late)[1:], clean[:-1], rtol=0.0, atol=1e-12)


def test_noise_has_the_stated_size_and_needs_a_generator(nominal_stage):
    noisy = ReadingEffects(noise_std=5e-6)
    c = rest(nominal_stage)
    noise = read(nominal_stage, c, effects=noisy, rng=np.random.default_rng(1)) - read(
        nominal_stage, c
    )
    assert 3e-6 < noise.std() < 7e-6  # 36 samples: 12 % standard error
    with pytest.raises(ValueError, match="expected a random generator rng"):
        read(nominal_stage, c, effects=noisy)


def test_impossible_readings_are_refused(nominal_stage):
    with pytest.raises(ValueError, match=r"noise_std is -1\.0 m"):
        ReadingEffects(noise_std=-1.0)
    with pytest.raises(ValueError, match="face_runout has order 1; expected 2 or more"):
        ReadingEffects(runout={1: (1e-6, 0.0)})
    with pytest.raises(ValueError, match="an error is given for sensor 'x'"):
        read(
            nominal_stage, rest(nominal_stage), effects=ReadingEffects(sensors={"x": SensorError()})
        )


def test_a_delayed_run_reads_alike_in_pieces_and_as_a_whole(nominal_stage):
    effects = ReadingEffects(phi_face=1e-4, theta_face=0.3, delay=0.25)
    at_once = record_of(nominal_stage, rest(nominal_stage))
    names = ("time", "c", "c_rate", "drive", "energy")
    first, last = (
        StageRecord(*(getattr(at_once, name)[samples] for name in names))
        for samples in (slice(0, 20), slice(20, None))
    )
    expected = sensor_signals(nominal_stage, at_once, [SENSOR], effects=effects)["s"]
    pieces = [
        sensor_signals(nominal_stage, first, [SENSOR], effects=effects)["s"],
        sensor_signals(nominal_stage, last, [SENSOR], effects=effects, before=first)["s"],
    ]
    assert_allclose(np.concatenate(pieces), expected, rtol=0.0, atol=1e-15)
