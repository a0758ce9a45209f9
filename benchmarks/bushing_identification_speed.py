"""The three bushing models fitted to figure 6's record, beside the complex method of Box.

    python -m benchmarks.bushing_identification_speed [RATE] [--no-complex-method]

Each model is timed with the simpler models it starts from, on two processes. The search of the
complex method stops after 5000 simulations, or after EVALUATIONS.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.measured import measured
from benchmarks.ratio import TIME, Quantity, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.mounting.bushing_identification import (
    identify_bushings,
    search_bushings,
)
from carrierflex.identification.mounting.bushing_models import BUSHING_MODELS
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.workflows.executors import work_executor

QUICK = {"rate": 50.0, "seconds": 130.0, "evaluations": 300}

NOISE = 5e-6
#: Nonlinear bushings and the parasitic torque of the 2011 paper's fit [SI].
TRUTH = {"K1": 17.6e6, "K3": 65e9, "K5": 1.55e15, "C1": 1e5, "P_T": 0.11}
#: Time [s] wanted for 520 s at 100 Hz.
WANTED_SECONDS = {"linear_bushing": 2.0, "nonlinear_bushing": 5.0, "hydrodynamic_bushing": 20.0}
RMS = Quantity("RMS of the residual", "um")
RUNS = Quantity("model runs")


def ratios(
    rate: float = 100.0,
    *,
    seconds: float = 520.0,
    evaluations: int = 5000,
    complex_method: bool = True,
) -> Iterator[Ratio]:
    """Time, residual and model runs of both ways.

    Parameters
    ----------
    rate
        Samples a second [Hz].
    seconds
        Length of the record [s].
    evaluations
        Simulations after which the complex method stops.
    complex_method
        Run the complex method too.
    """
    campaign = _campaign(rate, seconds)
    with work_executor(2) as executor:
        list(executor.map(abs, range(4)))  # the processes are there before the clock starts
        identify_bushings(campaign, BUSHING_MODELS[-1], executor)  # compiles
        for model in BUSHING_MODELS:
            fitted = measured(partial(identify_bushings, campaign, model, executor))
            last = fitted.result[-1]
            case = f"{model.name}, {rate:.0f} Hz"
            wanted = at_most(WANTED_SECONDS[model.name])
            yield Ratio(case, TIME, fitted.wall, wanted=wanted)
            if not complex_method:
                continue
            search = measured(
                partial(search_bushings, campaign, model, max_evaluations=evaluations)
            )
            search_result = search.result
            rms = np.sqrt(search_result.cost / last.fit.cost) * last.rms
            runs = sum(estimate.fit.model_runs for estimate in fitted.result)
            peer = "complex method"
            note = (
                "" if search_result.converged else f"stopped after {search_result.evaluations} runs"
            )
            yield Ratio(case, TIME, fitted.wall, peer, search.wall, note=note)
            yield Ratio(case, RMS, last.rms * 1e6, peer, rms * 1e6, at_least(0.999))
            yield Ratio(case, RUNS, runs, peer, search_result.evaluations, note=note)


def _campaign(rate: float, seconds: float) -> Campaign:
    rig = MountingRig()
    inputs = history_inputs(LoadHistory(sample_rate=rate), first=0.0, last=seconds)
    result = simulate(rig, parameter_array(rig, TRUTH), inputs)
    noise = np.random.default_rng(0).normal(0.0, NOISE, result.signals.shape)
    noisy = result.signals + noise
    signals = {name: noisy[:, k] for k, name in enumerate(SENSORS)}
    columns = {name: column for name, column in inputs.columns().items() if name != "time"}
    channels = tuple(
        Channel(name, "housing_displacement", "m", sensor=name, noise_std=NOISE) for name in SENSORS
    )
    run = Run("R", "R.csv", "figure 6", inputs.time, columns, signals)
    return Campaign("mounting", "speed", Baseline("model", ()), rig.table(), channels, (run,))


if __name__ == "__main__":
    run_alone(ratios)
