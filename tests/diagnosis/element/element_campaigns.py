"""Simulated element campaigns of known truth, integrated by another method than the simulator's."""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel
from carrierflex.identification.campaign.records import Run

MASS = 2.0
STIFFNESS = 8.0e3  # 10 Hz
DAMPING = 12.0  # 5 % of critical
STEP, PERIOD = 5e-3, 512


def no_law(q, v):
    """Of a linear element; one function for all files, whose motion is integrated once."""
    return 0.0 * q


def lines_of(seed, lines):
    """Frequencies [rad/s] and random phases of the lines of a multisine."""
    lines = np.array(list(lines))
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines.size)
    return 2.0 * np.pi * lines / (PERIOD * STEP), phases


def multisine(amplitude, seed, *, periods=4, lines=range(1, 80, 2)):
    """Odd random-phase multisine, its RMS equal to `amplitude`; lines are 0.39 Hz apart."""
    frequency, phases = lines_of(seed, lines)

    def force(t):
        return (
            amplitude
            * np.sqrt(2.0 / frequency.size)
            * np.cos(np.multiply.outer(t, frequency) + phases).sum(axis=-1)
        )

    return force, periods * PERIOD


@cache
def driven_motions(law, amplitudes, seed, lines=range(1, 80, 2)):
    """Time [s], forces, deflections from rest with an extra law(q, v), (n,) and (n_runs, n) twice.

    The runs are integrated together: a call of the law on three numbers costs what it costs on one,
    and so do the forces at one time.
    """
    pairs = [
        multisine(amplitude, 10 * seed + number, lines=lines)
        for number, amplitude in enumerate(amplitudes)
    ]
    forces = [force for force, _ in pairs]
    time = STEP * np.arange(pairs[0][1])
    n_runs = len(amplitudes)
    seeds = [10 * seed + number for number in range(n_runs)]
    frequency = lines_of(seed, lines)[0]
    phases = np.array([lines_of(seed_of_run, lines)[1] for seed_of_run in seeds])
    heights = np.array(amplitudes) * np.sqrt(2.0 / frequency.size)

    def rates(t, state):
        q = state[:n_runs]
        v = state[n_runs:]
        drive = heights * np.cos(t * frequency + phases).sum(axis=1)
        return np.concatenate([v, (drive - STIFFNESS * q - DAMPING * v - law(q, v)) / MASS])

    solution = solve_ivp(
        rates, (0.0, time[-1]), np.zeros(2 * n_runs), "DOP853", time, rtol=1e-8, atol=1e-12
    )
    return time, np.array([force(time) for force in forces]), solution.y[:n_runs]


def force_campaign(
    law,
    *,
    amplitudes=(1.0, 2.0, 4.0),
    lines=range(1, 80, 2),
    noise=2e-6,
    seed=0,
    declared=True,
    settle=PERIOD,
    effects=(),
):
    """Mass on an element with an extra law(q, v) under three amplitudes, one run each."""
    rng = np.random.default_rng(seed)
    time, forces, motions = driven_motions(law, amplitudes, seed, lines)
    runs = []
    for number, amplitude in enumerate(amplitudes):
        q = motions[number] + noise * rng.standard_normal(time.size)
        runs.append(
            Run(
                f"R{number}",
                f"R{number}.csv",
                f"amplitude {amplitude}",
                time,
                {"force": forces[number]},
                {"q": q},
            )
        )
    channel = Channel("q", "displacement", "m", noise_std=noise if declared else None)
    rig = {"drive": "force", "periodic": True, "period_samples": PERIOD, "settle_samples": settle}
    return Campaign(
        "element", "twin", Baseline("model", tuple(effects)), rig, (channel,), tuple(runs)
    )


def bouc_wen(q, length, *, exponent, beta, gamma, substeps):
    """State of a Bouc-Wen loop along a motion, each step of it in some parts."""
    z, states = 0.0, np.empty(q.size)
    for k in range(q.size):
        moved = (q[k] - q[k - 1]) / length if k else 0.0
        for _ in range(substeps):
            z += moved / substeps * (1.0 - abs(z) ** exponent * (beta * np.sign(moved * z) + gamma))
        states[k] = z
    return states


def displacement_campaign(law, *, amplitudes=(0.5e-3, 1e-3, 2e-3), noise=0.05, seed=0, n=4000):
    """Element moved by a slow random multisine; the force is K q + C v + law(q, v)."""
    rng = np.random.default_rng(seed)
    runs = []
    for number, amplitude in enumerate(amplitudes):
        shape, _ = multisine(1.0, 10 * seed + number, lines=range(1, 12))
        time = STEP * np.arange(n)
        q = amplitude * shape(time)
        # The derivative of the sum of cosines by a complex step would be exact too; differences of
        # 1e-6 s are.
        v = amplitude * (shape(time + 1e-6) - shape(time - 1e-6)) / 2e-6
        force = STIFFNESS * q + DAMPING * v + law(q, v) + noise * rng.standard_normal(n)
        runs.append(
            Run(
                f"R{number}",
                f"R{number}.csv",
                f"amplitude {amplitude}",
                time,
                {"displacement": q},
                {"F": force},
            )
        )
    channel = Channel("F", "force", "N", noise_std=noise)
    rig = {"drive": "displacement", "settle_samples": 100}
    return Campaign("element", "twin", Baseline("model"), rig, (channel,), tuple(runs))


def late(campaign, delay):
    """Campaign whose channel is read `delay` [s] ago."""
    name = campaign.channels[0].name

    def of(run):
        moved = CubicSpline(run.time, run.signals[name])(run.time - delay)
        return replace(run, signals={name: moved})

    return replace(campaign, runs=tuple(of(run) for run in campaign.runs))
