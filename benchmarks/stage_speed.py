"""Simulated seconds per wall second of the planetary stage, and scipy's solve_ivp beside it on the same equations.

Run as `python benchmarks/stage_speed.py [SIZE]`, SIZE the element edge length [m]; one core: set
OMP_NUM_THREADS and OPENBLAS_NUM_THREADS to 1. Flexible carrier, pins and shaft, three planets,
twelve flanks with contact loss, mounting, weight; then with clearance in the carrier bearings, with
planets on rollers, without and with clearance, and with pins that have play in their bores. Warm:
everything is compiled and the body reduced before the clock starts. The error is that of the
sensors' signals over two revolutions, relative to their largest swing, against a run of a sixteenth
of the step.
"""

import sys
import time
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

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
from carrierflex.simulation.stage.roller_bearing import RollerBearingData
from carrierflex.simulation.stage.stage_data import BearingData, StageData
from carrierflex.simulation.stage.stage_model import GRAVITY, stage_model
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.simulation.stage.statics import SteadyLoad, channel_forces, frozen_stiffness
from carrierflex.workflows.simulation.simulate_stage import default_stage_body

SPEED = 22.1 * np.pi / 30.0
LOAD = SteadyLoad(360e3, ntl_z=200e3)
SENSORS = [Sensor(f"s{v}", AXIAL, np.deg2rad(v), 0.412) for v in (47, 137, 227, 317)]
SENSORS += [Sensor(f"r{v}", RADIAL, np.deg2rad(v), 0.412) for v in (40, 310)]
STEPS = (1e-3, 5e-4)
RATE = 100.0
DURATION = 60.0
#: Real time that solve_ivp is given [simulated s].
SCIPY_DURATION = 0.02


def signals(model, start, step, duration):
    chunks = run_stage(
        model, steady_drive(model, LOAD), start, duration=duration, sample_rate=RATE, step=step
    )
    return np.array(list(sensor_signals(model, joined_records(list(chunks)), SENSORS).values()))


def measured(name, model):
    start = quasi_static_start(model, LOAD)
    turn = 2.0 * 2.0 * np.pi / SPEED
    reference = signals(model, start, STEPS[-1] / 16.0, turn)
    for step in STEPS:
        error = (
            np.abs(signals(model, start, step, turn) - reference).max()
            / np.ptp(reference, axis=1).max()
        )
        began, busy = time.perf_counter(), time.process_time()
        for piece in simulate_stage(
            model, LOAD, SENSORS, duration=DURATION, sample_rate=RATE, step=step
        ):
            imbalance = np.abs(piece.record.imbalance[-1]) / piece.record.energy[-1, 0]
        seconds, busy = time.perf_counter() - began, time.process_time() - busy
        print(
            f"{name}: {len(model.K)} coordinates, step {step * 1e3:g} ms, {DURATION / seconds:.1f} simulated s/s with statics, "
            f"modes, sensors and loads, {DURATION / busy:.1f} per s of processor time; error {error:.1e}, "
            f"energy {imbalance:.0e} of the work"
        )


def scipy_speed(model, method):
    """Simulated seconds per wall second of solve_ivp, right-hand side in modal coordinates with the same laws."""
    stage = modal_stage(model)
    k = step_matrices(stage, 1e-3, GRAVITY)
    start = quasi_static_start(model, LOAD)
    inverse = stage.Phi.T @ model.M
    n = len(model.K)
    drive = steady_drive(model, LOAD)(np.zeros(1))[0]

    def rate(t, x):
        q, v = x[:n], x[n:]
        delta = k.B @ q - model.channels.free
        angle = delta[0]
        c, s = np.cos(angle), np.sin(angle)
        force, _ = channel_forces(
            model.channels, delta, angle, frozen_stiffness(model.channels, angle)
        )
        a = np.array([drive[0], k.generator_constant * drive[1], -GRAVITY * s, -GRAVITY * c,
                      c * drive[2] + s * drive[3], c * drive[3] - s * drive[2], 1.0])  # fmt: skip
        return np.concatenate([v, a @ k.P + force @ k.B - k.stiffness * q - stage.D @ v])

    x = np.concatenate([inverse @ start[0], inverse @ start[1]])
    began = time.perf_counter()
    solution = solve_ivp(rate, (0.0, SCIPY_DURATION), x, method=method, rtol=1e-5, atol=1e-9)
    assert solution.success
    return SCIPY_DURATION / (time.perf_counter() - began)


def main(size=0.045):
    body = default_stage_body(1e6, size)
    tight = stage_model(body, speed=SPEED)
    loose_bearings = replace(
        BearingData(), upwind_clearance=0.1375e-3, downwind_clearance=0.1225e-3
    )
    loose = stage_model(body, StageData(bearings=loose_bearings), speed=SPEED)
    signals(tight, quasi_static_start(tight, LOAD), 1e-3, 0.1)
    rollers = [
        stage_model(
            body,
            StageData(
                planet_rollers=RollerBearingData(),
                bearings=replace(BearingData(), planet_clearance=clearance),
            ),
            speed=SPEED,
        )
        for clearance in (0.0, 40e-6)
    ]
    bores = stage_model(body, effects=StageEffects(pin_fit_play=0.5e-3), speed=SPEED)
    cases = {
        "tight bearings": tight,
        "carrier bearings with clearance": loose,
        "planets on rollers": rollers[0],
        "planets on rollers with 40 um of radial clearance": rollers[1],
        "pins with play in their bores": bores,
    }
    for name, model in cases.items():
        measured(name, model)
    for method in ("RK45", "LSODA"):
        print(
            f"scipy solve_ivp {method}, {SCIPY_DURATION} s simulated: {scipy_speed(tight, method):.4f} simulated s/s"
        )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
