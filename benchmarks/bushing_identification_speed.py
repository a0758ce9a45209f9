"""The three bushing models fitted to the 520 s record of figure 6, beside the complex method of Box on the same record.

    python benchmarks/bushing_identification_speed.py [RATE] [--complex]

RATE is the sample rate [Hz], 100 by default. Wanted on two cores: linear under 2 s, nonlinear under
5 s, hydro-dynamic under 20 s, each with the simpler models it starts from. The search of the
complex method stops after 5000 simulations.
"""

import sys

import numpy as np
from measured import measured, print_ratios

from carrierflex.identification.campaign.campaign import Baseline, Campaign, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.mounting.bushing_identification import (
    identify_bushings,
    search_bushings,
)
from carrierflex.identification.mounting.bushing_models import BUSHING_MODELS
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameters import parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.workflows.support.executors import work_executor

SECONDS, NOISE = 520.0, 5e-6
#: Nonlinear bushings and the parasitic torque of the 2011 paper's fit [SI].
TRUTH = {"K1": 17.6e6, "K3": 65e9, "K5": 1.55e15, "C1": 1e5, "P_T": 0.11}
WANTED_SECONDS = {"linear_bushing": 2.0, "nonlinear_bushing": 5.0, "hydrodynamic_bushing": 20.0}


def main(arguments: list[str]) -> None:
    rate = float(next((text for text in arguments if not text.startswith("-")), "100"))
    campaign = _campaign(rate)
    rows = []
    with work_executor(2) as executor:
        list(executor.map(abs, range(4)))  # the workers are there before the clock starts
        identify_bushings(campaign, BUSHING_MODELS[-1], executor)  # compiled
        for model in BUSHING_MODELS:
            fitted = measured(lambda model=model: identify_bushings(campaign, model, executor))
            runs = sum(one.fit.model_runs for one in fitted.result)
            reached = f"{fitted.wall:6.2f} s, {runs:4d} model runs, rms {fitted.result[-1].rms * 1e6:.3f} um"
            if "--complex" in arguments:
                search = measured(lambda model=model: search_bushings(campaign, model))
                rms = (
                    np.sqrt(search.result.cost / fitted.result[-1].fit.cost) * fitted.result[-1].rms
                )
                reached += f"; complex method {search.wall:7.1f} s, {search.result.evaluations} runs, rms {rms * 1e6:.3f} um"
            rows.append(
                (f"{model.name}, {rate:.0f} Hz", f"<= {WANTED_SECONDS[model.name]:.0f} s", reached)
            )
    print_ratios(rows)


def _campaign(rate: float) -> Campaign:
    rig = MountingRig()
    inputs = LoadHistory(sample_rate=rate).inputs(first=0.0, last=SECONDS)
    result = simulate(rig, parameter_array(rig, TRUTH), inputs)
    noise = np.random.default_rng(0).normal(0.0, NOISE, result.signals.shape)
    signals = {name: result.signals[:, k] + noise[:, k] for k, name in enumerate(SENSORS)}
    columns = {name: column for name, column in inputs.columns().items() if name != "time"}
    channels = tuple(
        Channel(name, "housing_displacement", "m", sensor=name, noise_std=NOISE) for name in SENSORS
    )
    run = Run("R", "R.csv", "figure 6", inputs.time, columns, signals)
    return Campaign("mounting", "speed", Baseline("model", ()), rig.table(), channels, (run,))


if __name__ == "__main__":
    main(sys.argv[1:])
