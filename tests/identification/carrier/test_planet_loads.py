"""Planet loads from readings: the Gaussian closed form, errors of sensors, orders of a record."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.carrier.planet_loads import (
    TURN,
    ReadingErrors,
    inferred_loads,
    measured_turn,
)
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.workflows.executors import SerialExecutor

SENSORS = tuple(
    Sensor(f"s{angle}", AXIAL, np.deg2rad(angle), 0.412) for angle in (47, 137, 227, 317)
)
N_LATENT = 6
SERIAL = SerialExecutor()


class Linear:
    """Stages whose readings (H) and pin loads (G) are linear in six standard normal numbers."""

    n_unknowns = N_LATENT

    def __init__(self, stiffening=0.0):
        rng = np.random.default_rng(0)
        self.H = 10e-6 * rng.standard_normal((2 * 4 * 12, N_LATENT))
        self.G = 1e3 * rng.standard_normal((3 * 4 * 12, N_LATENT))
        self.stiffening = stiffening

    def __call__(self, z):
        z = z + self.stiffening * np.sign(z) * np.maximum(np.abs(z) - 0.5, 0.0)
        return self.H @ z, np.concatenate([[200e3, 0.0, 0.0, 1.0, np.log(1.7e7)], self.G @ z])

    def each(self, Z):
        return [self(z) for z in Z]


def estimated(forward, y, size=8e-6, executor=SERIAL):
    return inferred_loads(
        forward,
        y.reshape(2, 4, 12),
        size**2 * np.eye(len(y)),
        n_draws=1600,
        rng=np.random.default_rng(3),
        executor=executor,
    )


def test_posterior_is_the_gaussian_one():
    """``x | y``: mean ``P H^T R^-1 y``, covariance ``P = (1 + H^T R^-1 H)^-1``."""
    forward, rng = Linear(), np.random.default_rng(1)
    H, G, R = forward.H, forward.G, (8e-6) ** 2 * np.eye(96)
    y = H @ rng.standard_normal(N_LATENT) + 8e-6 * rng.standard_normal(len(H))
    estimate = estimated(forward, y)
    P = np.linalg.inv(np.eye(N_LATENT) + H.T @ np.linalg.solve(R, H))
    std = np.sqrt(np.diag(G @ P @ G.T)).reshape(3, 4, 12)
    mean = (G @ P @ H.T @ np.linalg.solve(R, y)).reshape(3, 4, 12)
    # The fit to linear stages is exact, whatever is drawn.
    assert_allclose(estimate.pins_std, max(1.0, estimate.misfit) * std, rtol=1e-6)
    assert_allclose(estimate.pins, mean, atol=1e-6 * std.max())
    assert estimate.misfit == pytest.approx(1.0, abs=0.2)
    assert estimate.pin_fit == pytest.approx(1.7e7)


def test_the_answer_does_not_depend_on_where_stages_are_solved():
    y = Linear(stiffening=10.0)(np.random.default_rng(4).standard_normal(N_LATENT))[0]
    here = estimated(Linear(stiffening=10.0), y)
    with ThreadPoolExecutor(3) as executor:
        elsewhere = estimated(Linear(stiffening=10.0), y, executor=executor)
    assert_allclose(elsewhere.pins, here.pins, rtol=1e-12)
    assert_allclose(elsewhere.pins_std, here.pins_std, rtol=1e-12)


def test_clearances_that_close_are_followed():
    """Readings that grow eleven times as fast beyond contacts: a stage is reached, loads hold."""
    forward, rng, covered, misfits = Linear(stiffening=10.0), np.random.default_rng(4), [], []
    for _ in range(8):
        y, q = forward(rng.standard_normal(N_LATENT))
        estimate = estimated(forward, y + 8e-6 * rng.standard_normal(len(y)))
        covered.append(np.abs(estimate.pins.ravel() - q[5:]) <= estimate.half_width.ravel())
        misfits.append(estimate.misfit)
    assert 0.85 < np.mean(covered) <= 1.0
    assert np.median(misfits) < 1.3


def test_readings_that_no_stage_makes_are_a_misfit():
    y = 100e-6 * np.random.default_rng(2).standard_normal(96)
    estimate = estimated(Linear(), y)
    assert estimate.misfit > 5.0
    near = estimated(Linear(), np.zeros(96))
    assert_allclose(estimate.pins_std, estimate.misfit * near.pins_std, rtol=1e-6)


class OtherContact(Linear):
    """Stages that stay in another state of contact, far from the readings, for so many calls."""

    def __init__(self, calls):
        super().__init__()
        self.calls = calls

    def __call__(self, z):
        self.calls -= 1
        y, q = super().__call__(z)
        return (y + 100e-6 if self.calls >= 0 else y), q


def test_passes_that_end_in_another_state_of_contact_begin_anew():
    y = Linear()(np.random.default_rng(5).standard_normal(N_LATENT))[0]
    nearest = estimated(Linear(), y)
    anew = estimated(OtherContact(1600), y)
    assert anew.misfit == pytest.approx(nearest.misfit, rel=0.2)
    assert_allclose(anew.pins, nearest.pins, atol=1e-6 * nearest.pins_std.max())
    assert estimated(OtherContact(3 * 1600), y).misfit > 5.0


def test_stages_that_run_away_end_in_one_line():
    forward = Linear()
    forward.H = 1e140 * forward.H
    with pytest.raises(ValueError, match="nowhere near the readings in 3 attempts"):
        estimated(forward, np.zeros(96))


def test_stages_without_equilibrium_are_refused():
    forward = Linear()
    forward.__class__ = type("Loose", (Linear,), {"__call__": lambda self, z: None})
    with pytest.raises(ValueError, match="200 of 200 drawn stages reach no static equilibrium"):
        estimated(forward, np.zeros(96))


def test_an_attempt_without_equilibrium_does_not_end_the_others():
    """The first attempt's stages reach none; the next ones give the answer."""

    class LooseAtFirst(Linear):
        attempts = 0

        def each(self, Z):
            self.attempts += 1
            return [None for _ in Z] if self.attempts <= 13 else super().each(Z)

    y = Linear()(np.random.default_rng(5).standard_normal(N_LATENT))[0]
    nearest, anew = estimated(Linear(), y), estimated(LooseAtFirst(), y)
    assert_allclose(anew.pins, nearest.pins, atol=1e-6 * nearest.pins_std.max())


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
