"""Small mounting campaigns with a known truth."""

from dataclasses import replace

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate

RIG = MountingRig()
#: Table 3 of the 2011 paper with moderate linear damping; the elastic terms of the hydro-dynamic
#: one stay positive.
LINEAR_TRUTH = {"K1": 18e6, "C1": 2e5, "P_T": 0.11}
NONLINEAR_TRUTH = {"K1": 15e6, "C1": 2e5, "K3": 1.5e11, "K5": 2e15, "C3": 2e9, "P_T": 0.11}
HYDRO_TRUTH = {
    "K1": 8e6, "C1": 1e5, "K3": 1.2e11, "K5": 2e15, "C3": 2e9,
    "k": 1e7, "c": 4e6, "Kp": 8e6, "Fy": 15e3, "P_T": 0.1,
}  # fmt: skip


def loads(seed=0, duration=60.0, rate=20.0):
    """Rest, then torque and radial load with slow and fast parts.

    They move the bushings by several millimetres.
    """
    time = np.arange(round(duration * rate)) / rate
    rng = np.random.default_rng(seed)
    rise = np.clip((time - 2.0) / 5.0, 0.0, 1.0)

    def wave(periods):
        return sum(
            np.sin(2.0 * np.pi * time / period + rng.uniform(0, 6.28)) for period in periods
        ) / len(periods)

    torque = 80e3 * rise * (1.0 + 0.9 * wave((17.0, 7.0, 1.3, 0.7)))
    ntl_z = -80e3 * rise * (1.0 + 0.8 * wave((13.0, 3.1, 0.9)))
    ntl_y = 30e3 * rise * wave((11.0, 2.3))
    zero = np.zeros_like(time)
    return MountingInputs(time, torque, zero + 2.3 * rise, 2.3 * rise * time, ntl_y, ntl_z)


def mounting_campaign(
    truth, *, noise_std=5e-6, memory=0.0, seed=0, rate=20.0, duration=60.0, n_runs=1, sideways=1.0
):
    """Campaign of `n_runs` runs.

    `memory` in seconds gives coloured noise, `sideways` scales the load that makes the housing yaw.
    """
    rng = np.random.default_rng(1000 + seed)
    runs = []
    for k in range(n_runs):
        inputs = loads(k, duration, rate)
        inputs = replace(inputs, ntl_y=sideways * inputs.ntl_y)
        clean = simulate(RIG, parameter_array(RIG, truth), inputs).signals
        noise = _noise(clean.shape, memory * rate, rng) * noise_std
        columns = inputs.columns()
        columns.pop("time")
        signals = {
            sensor: clean[:, column] + noise[:, column] for column, sensor in enumerate(SENSORS)
        }
        runs.append(Run(f"R{k}", f"R{k}.csv", f"condition {k}", inputs.time, columns, signals))
    channels = tuple(
        Channel(sensor, "housing_displacement", "m", sensor=sensor, noise_std=noise_std or None)
        for sensor in SENSORS
    )
    return Campaign("mounting", "twin", Baseline("model", ()), RIG.table(), channels, tuple(runs))


def _noise(shape, memory, rng):
    noise = rng.standard_normal(shape)
    if memory == 0.0:
        return noise
    share = np.exp(-1.0 / memory)
    for k in range(1, shape[0]):
        noise[k] = share * noise[k - 1] + np.sqrt(1.0 - share**2) * noise[k]
    return noise
