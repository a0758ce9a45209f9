import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.carrier.motion import clean_signal, simulate_run
from carrierflex.simulation.carrier.run_cases import (
    AXIAL,
    RADIAL,
    CarrierMotion,
    RunCase,
    Sensor,
    rim_factors,
)
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

MOTION = CarrierMotion(
    d_x=1e-4,
    phi_H=4e-4,
    theta_H=1.5,
    phi_PLC=6e-4,
    theta_PLC=1.0,
    rho_s=0.3,
    rho_f=0.6,
    saddle=1e-4,
)
SPEED = 22.1 * 2.0 * np.pi / 60.0


def case(**changes):
    values = {
        "name": "LC1",
        "condition": "100 %",
        "torque": 360e3,
        "ntl_y": 1e3,
        "ntl_z": -2e5,
        "speed": SPEED,
        "duration": 120.0,
        "sample_rate": 50.0,
        "motion": MOTION,
        "speed_ripple": 0.01,
        "torque_ripple": 0.01,
    }
    return RunCase(**{**values, **changes})


def sensor(angle_deg=47.0, quantity=AXIAL):
    return Sensor("s", quantity, float(np.deg2rad(angle_deg)), 0.412)


def simulate(run_case, sensors=None, noise_std=0.0, seed=1):
    rng = np.random.default_rng(seed)
    return simulate_run(
        run_case,
        sensors or [sensor()],
        stiff_curve(),
        flexible_curve(),
        noise_std=noise_std,
        rng=rng,
    )


def test_carrier_turns_forward_at_its_mean_speed_with_the_stated_ripple():
    response = simulate(case())
    speed = np.gradient(response.carrier_angle, response.time)
    assert response.carrier_angle[0] == 0.0
    assert (speed > 0.0).all()
    assert_allclose(speed.mean(), SPEED, rtol=0.005)
    # The slowest ripple takes 17 s: its standard deviation over 120 s is known to a fifth.
    assert_allclose(speed[1:-1].std() / SPEED, 0.01, rtol=0.2)
    assert_allclose(response.torque.std() / 360e3, 0.01, rtol=0.2)


def test_time_is_a_multiple_of_the_step():
    response = simulate(case(duration=10.0))
    assert_allclose(response.time, np.arange(500) / 50.0, rtol=0, atol=0)


def test_deflection_follows_the_instantaneous_torque():
    rigid = CarrierMotion(**{**vars(MOTION), "rho_s": 0.0, "rho_f": 0.0})
    full, half = simulate(case()), simulate(case(torque=180e3))
    bending = full.signals["s"] - simulate(case(motion=rigid)).signals["s"]
    half_bending = half.signals["s"] - simulate(case(motion=rigid, torque=180e3)).signals["s"]
    assert_allclose(half_bending, 0.5 * bending, rtol=0, atol=1e-16)
    assert np.abs(bending).max() > 3e-5


def test_third_order_of_the_rim_has_the_stated_amplitude():
    rho_s, rho_f = rim_factors(42e-6, 0.3, 360e3, flexible_curve(), 3)
    motion = CarrierMotion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, rho_f)
    angle = 2.0 * np.pi * np.arange(720) / 720
    signal = clean_signal(
        sensor(),
        motion,
        angle,
        np.full(720, 360e3),
        delta_s=stiff_curve(),
        delta_f=flexible_curve(),
    )
    assert_allclose(2.0 * np.abs(np.fft.rfft(signal)[3]) / 720, 42e-6, rtol=1e-12)
    assert_allclose(rho_s / (rho_s + rho_f), 0.3, rtol=1e-12)


def test_radial_sensor_reads_the_radial_deflection_alone():
    response = simulate(case(), [sensor(40.0, RADIAL)])
    v = np.deg2rad(40.0)
    expected = (response.torque / 1000.0) * (
        0.3 * stiff_curve().radial_at(v - response.carrier_angle)
        + 0.6 * flexible_curve().radial_at(v - response.carrier_angle)
    )
    assert_allclose(response.signals["s"], expected, rtol=0, atol=1e-18)


def test_noise_is_white_and_of_the_stated_size():
    noise = simulate(case(), noise_std=5e-6).signals["s"] - simulate(case()).signals["s"]
    # 6000 samples: standard deviation known to 1 %, correlation of neighbours to 0.013.
    assert_allclose(noise.std(), 5e-6, rtol=0.04)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.05


def test_the_same_seed_gives_the_same_record_and_another_one_does_not():
    first, again, other = (
        simulate(case(), noise_std=1e-6, seed=seed).signals["s"] for seed in (4, 4, 5)
    )
    assert (first == again).all()
    assert (first != other).any()


def test_permuting_sensors_permutes_clean_signals():
    pair = [Sensor("a", AXIAL, 0.5, 0.4), Sensor("b", AXIAL, 1.5, 0.4)]
    forward, backward = simulate(case(), pair), simulate(case(), pair[::-1])
    for name in ("a", "b"):
        assert (forward.signals[name] == backward.signals[name]).all()


def test_simulation_leaves_the_curves_unchanged():
    stiff, flexible = stiff_curve(), flexible_curve()
    before = stiff.axial.copy(), flexible.axial.copy()
    simulate_run(case(), [sensor()], stiff, flexible, noise_std=1e-6, rng=np.random.default_rng(0))
    assert (stiff.axial == before[0]).all()
    assert (flexible.axial == before[1]).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: case(duration=0.01), "fewer than two samples"),
        (lambda: case(speed_ripple=0.5), "speed_ripple is 0.5; expected 0 <= speed_ripple < 0.2"),
        (
            lambda: Sensor("s", "speed", 0.0, 0.4),
            "quantity is 'speed'; expected axial_displacement",
        ),
        (lambda: Sensor("s", AXIAL, 0.0, -0.4), "radius -0.4 m must be positive"),
        (lambda: simulate(case(), noise_std=-1.0), "noise_std is -1.0 m; expected a value >= 0"),
        (lambda: rim_factors(1e-5, 1.0, 1e5, flexible_curve(), 3), "0 <= stiff_share < 1"),
        (
            lambda: rim_factors(1e-5, 0.2, 0.0, flexible_curve(), 3),
            "order 3; a positive torque and a curve with that order",
        ),
    ],
)
def test_wrong_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
