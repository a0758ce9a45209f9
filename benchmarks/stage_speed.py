"""Simulated seconds per wall second of the planetary stage, and solve_ivp on the same equations.

    python -m benchmarks.stage_speed [SIZE]

On one thread, warm: everything is compiled and the body reduced before the clock starts. Flexible
carrier, pins and shaft, three planets, twelve flanks with contact loss, mounting, weight; then with
clearance in the carrier bearings, with planets on rollers, without and with clearance, and with
pins that have play in their bores. Speeds include statics, modes, sensors and loads. The error is
that of the sensors' signals over two revolutions, relative to their largest swing, against a run of
a sixteenth of the shortest step.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from benchmarks.measured import measured
from benchmarks.ratio import ERROR, SPEED, Quantity, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.modal_form import modal_stage, step_matrices
from carrierflex.simulation.stage.readings import sensor_signals
from carrierflex.simulation.stage.response import (
    joined_records,
    quasi_static_start,
    run_stage,
    steady_drive,
)
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import (
    GRAVITY,
    BearingData,
    RollerBearingData,
    StageData,
)
from carrierflex.simulation.stage.stage_model import StageModel, stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad, channel_forces, frozen_stiffness

QUICK = {"size": 0.08, "steps": (1e-3,), "duration": 4.0, "revolutions": 0.25}

Array = NDArray[np.float64]

SPEED_RAD = 22.1 * np.pi / 30.0
LOAD = SteadyLoad(360e3, ntl_z=200e3)
SENSORS = [
    *(Sensor(f"s{v}", AXIAL, np.deg2rad(v), 0.412) for v in (47, 137, 227, 317)),
    *(Sensor(f"r{v}", RADIAL, np.deg2rad(v), 0.412) for v in (40, 310)),
]
RATE = 100.0
#: Real time that solve_ivp is given [simulated s].
SCIPY_DURATION = 0.02

PROCESSOR_SPEED = Quantity("speed a processor second", "s/s", larger_is_better=True)
IMBALANCE = Quantity("energy imbalance over work")


def ratios(
    size: float = 0.045,
    *,
    steps: Sequence[float] = (1e-3, 5e-4),
    duration: float = 60.0,
    revolutions: float = 2.0,
) -> Iterator[Ratio]:
    """Speed, error and energy balance of every stage, and the speed beside scipy's.

    Parameters
    ----------
    size
        Element edge length of carrier and pins [m].
    steps
        Time steps, the shortest last [s].
    duration
        Length of the timed runs [s].
    revolutions
        Length of the runs that the error is taken from.
    """
    # The processes of benchmarks.stage_load_cases import this file, and need no meshes.
    from carrierflex.workflows.simulation.stage_bodies import default_stage_body

    body = default_stage_body(1e6, size)
    with threadpool_limits(1):
        models = _models(body)
        tight = models["tight bearings"]
        _signals(tight, quasi_static_start(tight, LOAD), 1e-3, 0.1)  # compiles
        yield from _beside_scipy(tight, steps[0], duration)
        turn = revolutions * 2.0 * np.pi / SPEED_RAD
        for name, model in models.items():
            start = quasi_static_start(model, LOAD)
            reference = _signals(model, start, steps[-1] / 16.0, turn)
            for step in steps:
                case = f"{name}, step {step * 1e3:g} ms"
                deviation = np.abs(_signals(model, start, step, turn) - reference).max()
                swing = np.ptp(reference, axis=1).max()
                yield from _speeds(case, model, step, duration)
                yield Ratio(case, ERROR, float(deviation / swing))


def _models(body: StageBody) -> dict[str, StageModel]:
    loose = replace(BearingData(), upwind_clearance=0.1375e-3, downwind_clearance=0.1225e-3)
    data = {
        "tight bearings": StageData(),
        "carrier bearings with clearance": StageData(bearings=loose),
        "planets on rollers": _on_rollers(0.0),
        "planets on rollers, 40 um of radial clearance": _on_rollers(40e-6),
    }
    models = {
        name: stage_model(body, stage_data, speed=SPEED_RAD) for name, stage_data in data.items()
    }
    play = StageEffects(pin_fit_play=0.5e-3)
    models["pins with play in their bores"] = stage_model(body, effects=play, speed=SPEED_RAD)
    return models


def _on_rollers(clearance: float) -> StageData:
    bearings = replace(BearingData(), planet_clearance=clearance)
    return StageData(planet_rollers=RollerBearingData(), bearings=bearings)


def _signals(model: StageModel, start: tuple[Array, Array], step: float, duration: float) -> Array:
    """All sensors' signals, shape (n_sensors, n_times) [m]."""
    drive = steady_drive(model, LOAD)
    records = run_stage(model, drive, start, duration=duration, sample_rate=RATE, step=step)
    return np.array(list(sensor_signals(model, joined_records(list(records)), SENSORS).values()))


def _imbalance(model: StageModel, step: float, duration: float) -> float:
    """Energy that a run gained or lost, over the work done in it."""
    last = 0.0
    for chunk in simulate_stage(
        model, LOAD, SENSORS, duration=duration, sample_rate=RATE, step=step
    ):
        last = abs(chunk.record.imbalance[-1]) / chunk.record.energy[-1, 0]
    return float(last)


def _speeds(case: str, model: StageModel, step: float, duration: float) -> Iterator[Ratio]:
    run = measured(lambda: _imbalance(model, step, duration))
    wanted = at_least(10)
    note = f"{len(model.K)} coordinates"
    yield Ratio(case, SPEED, duration / run.wall, wanted=wanted, note=note)
    yield Ratio(case, PROCESSOR_SPEED, duration / run.processor, wanted=wanted)
    yield Ratio(case, IMBALANCE, run.result, wanted=at_most(1e-6))


def _beside_scipy(model: StageModel, step: float, duration: float) -> Iterator[Ratio]:
    ours = measured(lambda: _imbalance(model, step, duration))
    speed = duration / ours.wall
    case = f"tight bearings, step {step * 1e3:g} ms"
    note = f"{SCIPY_DURATION} s of it by scipy"
    for method in ("RK45", "LSODA"):
        scipy = measured(partial(_solve_by_scipy, model, method))
        scipy_speed = SCIPY_DURATION / scipy.wall
        yield Ratio(case, SPEED, speed, f"scipy {method}", scipy_speed, at_least(100), note)


def _solve_by_scipy(model: StageModel, method: str) -> None:
    """Solve in modal coordinates with the same laws."""
    from scipy.integrate import solve_ivp

    stage = modal_stage(model)
    k = step_matrices(stage, 1e-3, GRAVITY)
    start = quasi_static_start(model, LOAD)
    inverse = stage.Phi.T @ model.M
    n = len(model.K)
    drive = steady_drive(model, LOAD)(np.zeros(1))[0]

    def rate(t: float, x: Array) -> Array:
        q, v = x[:n], x[n:]
        delta = k.B @ q - model.channels.free
        angle = delta[0]
        c, s = np.cos(angle), np.sin(angle)
        stiffness = frozen_stiffness(model.channels, angle)
        force, _ = channel_forces(model.channels, delta, angle, stiffness)
        a = np.array(
            [
                drive[0],
                k.generator_constant * drive[1],
                -GRAVITY * s,
                -GRAVITY * c,
                c * drive[2] + s * drive[3],
                c * drive[3] - s * drive[2],
                1.0,
            ]
        )
        return np.concatenate([v, a @ k.P + force @ k.B - k.stiffness * q - stage.D @ v])

    x = np.concatenate([inverse @ start[0], inverse @ start[1]])
    solution = solve_ivp(rate, (0.0, SCIPY_DURATION), x, method=method, rtol=1e-5, atol=1e-9)
    if not solution.success:
        raise RuntimeError(f"solve_ivp {method} stopped: {solution.message}")


if __name__ == "__main__":
    run_alone(ratios)
