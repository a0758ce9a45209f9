"""Planet loads from readings: the Gaussian closed form, errors of sensors, orders of a record."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.planet_loads import (
    TURN,
    ReadingErrors,
    inferred_loads,
    load_inference,
    measured_turn,
)
from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage.hidden_stages import StageEnsemble
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft

SENSORS = tuple(
    Sensor(f"s{angle}", AXIAL, np.deg2rad(angle), 0.412) for angle in (47, 137, 227, 317)
)
N_LATENT, N_STAGES = 6, 3000


@pytest.fixture(scope="module")
def body(flexible_reduction, pin_reduction):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, 1.7e7)
    return joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))


@pytest.fixture(scope="module")
def gaussian():
    """Stages whose readings (H) and pin loads (G) are linear in six standard normal numbers."""
    rng = np.random.default_rng(0)
    H = 10e-6 * rng.standard_normal((2 * 4 * 12, N_LATENT))
    G = 1e3 * rng.standard_normal((3 * 4 * 12, N_LATENT))
    x = rng.standard_normal((N_STAGES, N_LATENT))
    loads = np.zeros((N_STAGES, 2, 3))
    loads[:, 1, 0] = 200e3
    pins = np.zeros((N_STAGES, 2, 3, 4, 12))
    pins[:, 1] = (x @ G.T).reshape(-1, 3, 4, 12)
    pins[:, :, :, 0] += 200e3
    ensemble = StageEnsemble(
        loads, (x @ H.T).reshape(-1, 2, 4, 12), np.zeros((N_STAGES, 2, 12, 30)), pins, 0
    )
    return ensemble, H, G


def test_posterior_is_the_gaussian_one(body, gaussian):
    """``x | y``: mean ``P H^T R^-1 y``, covariance ``P = (1 + H^T R^-1 H)^-1``."""
    ensemble, H, G = gaussian
    R = (8e-6) ** 2 * np.eye(len(H))
    rng = np.random.default_rng(1)
    y = H @ rng.standard_normal(N_LATENT) + 8e-6 * rng.standard_normal(len(H))
    estimate = inferred_loads(
        load_inference(ensemble, [(1.7e7, body)], SENSORS), y.reshape(2, 4, 12), R
    )
    P = np.linalg.inv(np.eye(N_LATENT) + H.T @ np.linalg.solve(R, H))
    std = np.sqrt(np.diag(G @ P @ G.T)).reshape(3, 4, 12)
    mean = (G @ P @ H.T @ np.linalg.solve(R, y)).reshape(3, 4, 12)
    mean[:, 0] += 200e3
    # 3000 stages, of which a thousand near ones count: 5 % of a standard deviation's size.
    assert_allclose(estimate.pins_std, std, rtol=0.2)
    assert np.sqrt(np.mean(((estimate.pins - mean) / std) ** 2)) < 0.35
    assert estimate.misfit == pytest.approx(1.0, abs=0.2)


def test_readings_that_no_stage_makes_are_a_misfit(body, gaussian):
    ensemble, H, _ = gaussian
    R = (8e-6) ** 2 * np.eye(len(H))
    y = 100e-6 * np.random.default_rng(2).standard_normal(len(H))
    inference = load_inference(ensemble, [(1.7e7, body)], SENSORS)
    assert inferred_loads(inference, y.reshape(2, 4, 12), R).misfit > 5.0


def test_known_run_keeps_its_load(body, gaussian):
    ensemble, H, _ = gaussian
    inference = load_inference(ensemble, [(1.7e7, body)], SENSORS, of_known=True)
    estimate = inferred_loads(inference, np.zeros((1, 4, 12)), (8e-6) ** 2 * np.eye(len(H) // 2))
    assert_allclose(estimate.load, ensemble.loads[0, 0])
    assert_allclose(estimate.load_std, 0.0, atol=1e-9)


def test_orders_of_a_record_are_read_free_of_its_speed():
    """A record of uneven speed gives its wave at the angles of a turn."""
    rng = np.random.default_rng(0)
    time = np.linspace(0.0, 30.0, 3000)
    angle = 2.3 * time + 0.2 * np.sin(0.4 * time)
    wave = 40e-6 * np.cos(3.0 * angle - 0.7) + 5e-6 * np.sin(2.0 * angle) + 1e-4
    run = Run("a", "a.csv", "", time, {"carrier_angle": angle}, {
        "clean": wave, "noisy": wave + 5e-6 * rng.standard_normal(time.size),
    })  # fmt: skip
    turn = measured_turn(run, ["clean", "noisy"])
    expected = 40e-6 * np.cos(3.0 * TURN - 0.7) + 5e-6 * np.sin(2.0 * TURN) + 1e-4
    assert_allclose(turn.readings[0], expected, atol=1e-12)
    gap = turn.readings[1] - expected
    assert gap @ np.linalg.solve(turn.noise[1], gap) < 40.0  # chi^2 of 12


def test_less_than_a_turn_is_refused():
    angle = np.linspace(0.0, 5.0, 500)
    run = Run("short", "a.csv", "", angle, {"carrier_angle": angle}, {"s": np.zeros(500)})
    with pytest.raises(ValueError, match="run short holds"):
        measured_turn(run, ["s"])


def test_a_turned_sensor_reads_the_carriers_waves_earlier():
    """Error of a sensor's place: the difference of a wave of order 3 read 0.5 deg further on."""
    errors = ReadingErrors(gain=0.0)
    v = SENSORS[0].angle
    readings = np.zeros((1, 4, 12))
    readings[0, 0] = 40e-6 * np.cos(3.0 * (v - TURN))
    column = errors.proportional(readings)[:, 1].reshape(4, 12)[0]
    moved = 40e-6 * np.cos(3.0 * (v + errors.angle - TURN)) - readings[0, 0]
    assert_allclose(column, moved, atol=0.02 * np.abs(moved).max())


def test_errors_of_the_face_turn_with_the_carrier():
    """One wave is read by all axial sensors, each in its phase, and alike in both runs."""
    sensors = (*SENSORS, Sensor("r", RADIAL, 0.7, 0.412))
    E = ReadingErrors().additive(sensors, 2).reshape(2, 5, 12, -1)
    # After the zeros and brackets of five sensors: cosine of the axial face's order 1.
    face = E[..., 5 * 3]
    assert_allclose(face[0], face[1])
    assert_allclose(face[0, 4], 0.0)
    # 90 degrees on is three angles of the turn later.
    assert_allclose(np.roll(face[0, 0], 3), face[0, 1], atol=1e-15)
