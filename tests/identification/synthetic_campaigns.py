"""Small simulated campaigns with a known truth."""

from dataclasses import replace

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.simulation.carrier.run_cases import AXIAL, CarrierMotion, RunCase, Sensor
from tests.simulation.synthetic_curves import flexible_curve, stiff_curve

SPEED = 22.1 * 2.0 * np.pi / 60.0
SENSORS = tuple(
    Sensor(f"s{angle:03d}", AXIAL, float(np.deg2rad(angle)), 0.412) for angle in (47, 137, 227, 317)
)
TRUTH = CarrierMotion(
    d_x=1e-4, phi_H=4.5e-4, theta_H=1.5, phi_PLC=5.8e-4, theta_PLC=1.05, rho_s=0.26, rho_f=0.61
)
RIG = {"nominal_torque": 360e3, "sensor_radius": 0.412, "n_planets": 3}


def run_case(name="LC1", motion=TRUTH, **changes):
    values = {
        "condition": "100 %",
        "torque": 360e3,
        "ntl_y": 0.0,
        "ntl_z": 0.0,
        "speed": SPEED,
        "duration": 22.5,  # 8.3 revolutions
        "sample_rate": 20.0,
        "speed_ripple": 0.01,
        "torque_ripple": 0.01,
    }
    return RunCase(name=name, motion=motion, **{**values, **changes})


def carrier_campaign(cases=None, *, noise_std=5e-6, seed=0, declared_noise=True, sensors=SENSORS):
    """Campaign of the given runs.

    By default two runs that share tilt of the carrier and deflection.
    """
    cases = cases or [
        run_case("LC1"),
        run_case("LC2", replace(TRUTH, d_x=6e-5, phi_H=3.5e-4), torque=180e3, condition="50 %"),
    ]
    rng = np.random.default_rng(seed)
    runs = []
    for case in cases:
        response = simulate_run(
            case, sensors, stiff_curve(), flexible_curve(), noise_std=noise_std, rng=rng
        )
        inputs = {
            "carrier_angle": response.carrier_angle,
            "torque": response.torque,
            "ntl_y": response.ntl_y,
            "ntl_z": response.ntl_z,
        }
        runs.append(
            Run(
                case.name,
                f"{case.name}.csv",
                case.condition,
                response.time,
                inputs,
                dict(response.signals),
            )
        )
    noise = noise_std if declared_noise and noise_std else None
    channels = tuple(
        Channel(s.name, s.quantity, "m", s.angle, s.radius, noise_std=noise) for s in sensors
    )
    return Campaign(
        "carrier", "twin", Baseline("model", ("axial_offset",)), RIG, channels, tuple(runs)
    )
