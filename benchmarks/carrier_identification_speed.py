"""M1 and M2 of one record in closed form, beside the complex method of Box on the same record.

    python -m benchmarks.carrier_identification_speed [MINUTES]

Six sensors at 100 Hz; the search evaluates the model at every sample, as the papers did.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.measured import fastest, measured
from benchmarks.ratio import TIME, Quantity, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.identification.campaign.campaign import Campaign
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
from carrierflex.identification.carrier.parameter_estimate import ParameterEstimate
from carrierflex.identification.estimation.complex_method import ComplexSearch, complex_search
from carrierflex.simulation.carrier.case_files import read_case, shipped_case
from carrierflex.simulation.carrier.motion import simulate_run
from carrierflex.workflows.fe.default_curves import default_curves

QUICK = {"minutes": 1.0}

RATE = 100.0
RMS = Quantity("RMS of the residual", "um")
EVALUATIONS = Quantity("model evaluations")


def ratios(minutes: float = 10.0) -> Iterator[Ratio]:
    """Time, residual and model evaluations of both ways.

    Parameters
    ----------
    minutes
        Length of the record.
    """
    curves = default_curves()
    delta_s, delta_f = curves["delta_s"], curves["delta_f"]
    campaign = _campaign(delta_s, delta_f, minutes)
    models = {
        "M1": with_radial_motion(rigid_model()),
        "M2": with_radial_motion(flexible_model(delta_s, delta_f)),
    }
    both = fastest(lambda: [_estimate(campaign, model) for model in models.values()], 3)
    case = f"M1 and M2 of {minutes:g} min"
    yield Ratio(case, TIME, both.wall, wanted=at_most(0.2), note="fastest of three")
    for name, model in models.items():
        closed = fastest(partial(_estimate, campaign, model), 3)
        search = measured(partial(_searched, campaign, model))
        evaluations = search.result.evaluations
        estimate = closed.result
        rms = np.sqrt(search.result.cost / estimate.n_samples)
        peer = "complex method"
        yield Ratio(name, TIME, closed.wall, peer, search.wall)
        yield Ratio(name, RMS, estimate.rms * 1e6, peer, rms * 1e6, at_least(1))
        yield Ratio(name, EVALUATIONS, 1, peer, evaluations, at_least(100))


def _estimate(campaign: Campaign, model: CarrierModel) -> ParameterEstimate:
    return identify_each_run(campaign, model, FitOptions(radial=True))["LC1"]


def _campaign(delta_s: DeflectionCurve, delta_f: DeflectionCurve, minutes: float) -> Campaign:
    case = read_case(shipped_case(), delta_f)
    run = replace(case.runs[0], duration=60.0 * minutes, sample_rate=RATE)
    rng = np.random.default_rng(1)
    response = simulate_run(run, case.sensors, delta_s, delta_f, noise_std=5e-6, rng=rng)
    rig = {"nominal_torque": 360e3, "sensor_radius": 0.412, "n_planets": 3}
    return simulated_campaign("speed", case.sensors, [(run, response)], rig=rig, noise_std=5e-6)


def _searched(campaign: Campaign, model: CarrierModel) -> ComplexSearch:
    run, channels = campaign.runs[0], rim_channels(campaign)
    designs = {channel.name: model.design(run.inputs, channel) for channel in channels}

    def cost(values: NDArray[np.float64]) -> float:
        return sum(
            float(np.square(run.signals[name] - X @ values).sum()) for name, X in designs.items()
        )

    names = model.coefficients
    size = np.array([1.0 if name.startswith("rho") else 1e-3 for name in names])
    rng = np.random.default_rng(0)
    return complex_search(cost, -2 * size, 2 * size, rng=rng, tolerance=1e-4)


if __name__ == "__main__":
    run_alone(ratios)
