"""M1 and M2 of a ten-minute record in closed form, beside the complex method of Box on the same record.

    python benchmarks/carrier_identification_speed.py

Six sensors at 100 Hz; the search evaluates the model at every sample, as the papers did. Wanted: M1
and M2 together under 0.2 s, a residual no higher than the search's, at under one percent of its
model evaluations.
"""

import time
from dataclasses import replace

import numpy as np

from carrierflex.identification.campaign.simulated_campaign import simulated_campaign
from carrierflex.identification.carrier.carrier_identification import (
    FitOptions,
    identify_each_run,
    rim_channels,
)
from carrierflex.identification.carrier.models import (
    CarrierModel,
    flexible_model,
    rigid_model,
    with_radial_motion,
)
from carrierflex.identification.estimation.complex_method import complex_search
from carrierflex.simulation.carrier.case_files import read_case, shipped_case
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.workflows.support.default_curves import default_curves

MINUTES, RATE = 10, 100.0


def main() -> None:
    curves = default_curves()
    delta_s, delta_f = curves["delta_s"], curves["delta_f"]
    campaign = _campaign(delta_s, delta_f)
    options = FitOptions(radial=True)
    models = [with_radial_motion(one) for one in (rigid_model(), flexible_model(delta_s, delta_f))]
    print(
        f"{MINUTES} min at {RATE:.0f} Hz, {len(campaign.channels)} sensors, {campaign.runs[0].time.size} samples each"
    )
    for repeat in range(3):
        start = time.perf_counter()
        estimates = [identify_each_run(campaign, model, options)["LC1"] for model in models]
        print(
            f"M1 and M2 in closed form, pass {repeat + 1}: {time.perf_counter() - start:.3f} s (wanted under 0.2)"
        )
    print(
        f"{'model':5} {'closed form, mm':>16} {'search, mm':>12} {'evaluations':>12} {'search, s':>10} {'share, %':>9}"
    )
    for model, estimate in zip(models, estimates, strict=True):
        start = time.perf_counter()
        search = _searched(campaign, model)
        seconds = time.perf_counter() - start
        rms = np.sqrt(search.cost / estimate.n_samples)
        share = 100.0 / search.evaluations
        print(
            f"{model.name:5} {estimate.rms * 1e3:16.6f} {rms * 1e3:12.6f} {search.evaluations:12d} {seconds:10.1f} {share:9.3f}"
        )


def _campaign(delta_s, delta_f):
    case = read_case(shipped_case(), delta_f)
    run = replace(case.runs[0], duration=60.0 * MINUTES, sample_rate=RATE)
    rng = np.random.default_rng(1)
    response = simulate_run(run, case.sensors, delta_s, delta_f, noise_std=5e-6, rng=rng)
    rig = {"nominal_torque": 360e3, "sensor_radius": 0.412, "n_planets": 3}
    return simulated_campaign("speed", case.sensors, [(run, response)], rig=rig, noise_std=5e-6)


def _searched(campaign, model: CarrierModel):
    run, channels = campaign.runs[0], rim_channels(campaign)
    designs = [model.design(run.inputs, channel) for channel in channels]

    def cost(values):
        return sum(
            float(np.square(run.signals[c.name] - X @ values).sum())
            for c, X in zip(channels, designs, strict=True)
        )

    size = np.array([1.0 if name.startswith("rho") else 1e-3 for name in model.coefficients])
    return complex_search(cost, -2 * size, 2 * size, rng=np.random.default_rng(0), tolerance=1e-4)


if __name__ == "__main__":
    main()
