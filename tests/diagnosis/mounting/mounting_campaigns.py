"""Simulated mounting campaigns whose truth is known."""

import numpy as np

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import parameter_array
from carrierflex.simulation.mounting.rig import SENSORS, MountingRig
from carrierflex.simulation.mounting.simulate import simulate

NOISE = 5e-6
RIG = MountingRig()
#: The truth's linear bushings are not the rig's nominal ones: the baseline must be re-fitted.
TRUE_LINEAR = {"K1": 24.0e6, "C1": 1.4e5}
CONDITIONS = (
    (3.0e5, 0.0, -1.0e5),
    (1.5e5, 1.0e5, 1.0e5),
    (2.2e5, -1.0e5, 5.0e4),
    (3.5e5, 5.0e4, 0.0),
)


def loads(condition, seed, *, seconds=130.0, step=0.05):
    """Rest, then torque with stairs, a slow and a fast wave; radial load that ramps and swings."""
    torque, side, up = condition
    rng = np.random.default_rng(seed)
    time = step * np.arange(round(seconds / step))
    rise = np.clip((time - 4.0) / 6.0, 0.0, 1.0)
    phases = rng.uniform(0.0, 2.0 * np.pi, 6)
    slow = 0.5 - 0.4 * np.cos(2.0 * np.pi * (time - 4.0) / 60.0)
    fast = 0.08 * np.sin(2.0 * np.pi * 0.7 * time + phases[0]) + 0.05 * np.sin(
        2.0 * np.pi * 1.4 * time + phases[1]
    )
    swings = [
        np.sin(2.0 * np.pi * time / length + phase)
        for length, phase in ((23.0, phases[2]), (31.0, phases[3]))
    ]
    return MountingInputs(
        time,
        torque * rise * (slow + fast),
        np.full(time.size, 2.3),
        2.3 * time,
        side * rise * swings[0],
        up * rise * swings[1],
    )


def mounting_campaign(
    values=None,
    *,
    rig=RIG,
    conditions=CONDITIONS,
    noise=NOISE,
    declared=True,
    effects=(),
    extra=None,
    tables=None,
    step=0.05,
    seconds=130.0,
    seed=0,
):
    """Campaign of a truth with these values of the simulator beside its linear bushings.

    `tables` are packed laws of the bushings.
    """
    rng = np.random.default_rng(seed)
    runs = []
    for number, condition in enumerate(conditions):
        inputs = loads(condition, 10 * seed + number, step=step, seconds=seconds)
        signals = simulate(
            rig, parameter_array(rig, {**TRUE_LINEAR, **(values or {})}), inputs, tables=tables
        ).signals
        if extra is not None:
            signals = signals + extra(inputs)
        signals = signals + noise * rng.standard_normal(signals.shape)
        columns = {name: column for name, column in inputs.columns().items() if name != "time"}
        runs.append(
            Run(
                f"R{number}",
                f"R{number}.csv",
                f"loads {number}",
                inputs.time,
                columns,
                dict(zip(SENSORS, signals.T, strict=True)),
            )
        )
    channels = tuple(
        Channel(
            sensor,
            "housing_displacement",
            "m",
            sensor=sensor,
            noise_std=noise if declared else None,
        )
        for sensor in SENSORS
    )
    return Campaign(
        "mounting", "twin", Baseline("model", tuple(effects)), rig.table(), channels, tuple(runs)
    )
