"""Simulated seconds per wall second of the mounting model, with scipy's solve_ivp and Exudyn beside it on the same model.

Run as `python benchmarks/mounting_speed.py`; one core: set OMP_NUM_THREADS and OPENBLAS_NUM_THREADS to 1. Warm: all is compiled
before the clock starts, each figure is the best of several whole calls. Errors are the largest of all six sensors, relative
to the largest signal, against a run of a sixty-fourth of the step (linear: loads refined 16 times).
"""

import time
from functools import partial

import exudyn as exu
import numpy as np

from benchmarks.measured import print_ratios
from benchmarks.mounting_peers import (
    element_coordinates,
    exudyn_bodies,
    exudyn_equations,
    radial_at,
    scipy_run,
    torque_at,
)
from simulation.bushings import HydrodynamicBushing, LinearBushing, NonlinearBushing
from simulation.mounting.inputs import MountingInputs
from simulation.mounting.load_history import LoadHistory
from simulation.mounting.march import mounting_model
from simulation.mounting.parameters import parameter_array
from simulation.mounting.rig import MountingRig
from simulation.mounting.simulate import simulate

#: Error up to which a setting of a peer counts: a few times what is asked of ours (1e-4).
ALLOWED = 5e-4
RK4, ALPHA = exu.DynamicSolverType.RK44, exu.DynamicSolverType.GeneralizedAlpha
RIG = MountingRig(zeroing_samples=1)
MODELS = {
    "linear, moderate damping": ({**LinearBushing().parameters(), "C1": 1e5}, 80_000, 1e-9),
    "linear, damping of the paper": (LinearBushing().parameters(), 80_000, 1e-9),
    "nonlinear, moderate damping": ({**NonlinearBushing().parameters(), "C1": 3e4}, 10_000, 1e-4),
    "nonlinear, damping of the paper": ({**NonlinearBushing().parameters(), "C1": 4.83e6}, 10_000, 1e-4),
    "hydro-dynamic, Maxwell branch": (HydrodynamicBushing(m=0.0).parameters(), 10_000, 1e-4),
    "hydro-dynamic, fluid mass": (HydrodynamicBushing().parameters(), 10_000, 1e-4),
    "hydro-dynamic, damping of the paper": ({**HydrodynamicBushing(m=0.0).parameters(), "C1": 4.83e6}, 10_000, 1e-4),
}


def best_of(repeats, work):
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return min(seconds)


def rough_inputs():
    """The history of figure 6 with 5 % of noise below 10 Hz on torque and radial load: nothing smooth to live on."""
    smooth = LoadHistory().inputs(40.0, 560.0)
    rng = np.random.default_rng(1)
    spectrum = np.fft.rfft(rng.standard_normal((2, smooth.time.size)), axis=1)
    spectrum[:, np.fft.rfftfreq(smooth.time.size, smooth.step) > 10.0] = 0.0
    noise = np.fft.irfft(spectrum, smooth.time.size, axis=1)
    noise *= 0.05 / noise.std(axis=1, keepdims=True)
    torque, ntl_z = smooth.torque * (1.0 + noise[0]), smooth.ntl_z * (1.0 + noise[1])
    return MountingInputs(smooth.time, torque, smooth.speed, smooth.carrier_angle, smooth.ntl_y, ntl_z)


def error_of(parameters, inputs, signals, linear):
    if linear:
        reference = simulate(RIG, parameters, inputs.refined(16)).signals[::16]
    else:
        reference = simulate(RIG, parameters, inputs, step=inputs.step / 64).signals
    return np.abs(signals - reference).max() / np.abs(reference).max()


def our_rows(label, inputs):
    for name, (values, wanted, error_wanted) in MODELS.items():
        parameters, linear = parameter_array(RIG, values), name.startswith("linear")
        signals = simulate(RIG, parameters, inputs).signals
        seconds = best_of(15, lambda parameters=parameters: simulate(RIG, parameters, inputs))
        step = inputs.step / mounting_model(RIG, parameters, inputs.loads, inputs.step).substeps
        speed, error = 520.0 / seconds, error_of(parameters, inputs, signals, linear)
        what = f"{speed:8.0f} s/s, error {error:.0e} (<= {error_wanted:.0e}), step {step * 1e3:.3g} ms, {seconds * 1e3:.1f} ms"
        yield f"{label}: {name}", f">= {wanted}", what


def peer_rows(duration=30.0):
    """Ours, scipy and Exudyn on the loads that are formulas; scipy's tolerance 1e-6, ours at 10 ms, Exudyn as it is fastest."""
    times = np.arange(round(duration * 100) + 1) / 100.0
    rest = np.zeros_like(times)
    inputs = MountingInputs(times, torque_at(times), rest, rest, rest, radial_at(times))
    long = MountingInputs(
        *(np.concatenate([v, v[-1:] + (0.01 if n == "time" else 0.0)]) for n, v in inputs.columns().items())
    )
    for name in ("linear, moderate damping", "nonlinear, moderate damping"):
        parameters = parameter_array(RIG, {**MODELS[name][0], "P_T": 0.0})
        to_signals = element_coordinates(RIG, parameters)[-1]
        fine_times = np.arange(round(duration * 2000) + 1) / 2000.0
        fine_rest = np.zeros_like(fine_times)
        fine = MountingInputs(fine_times, torque_at(fine_times), fine_rest, fine_rest, fine_rest, radial_at(fine_times))
        reference = simulate(RIG, parameters, fine).signals[::20]
        size = np.abs(reference).max()
        # Setting up costs a millisecond whatever the length: the speed is that of a record of 520 s.
        repeated = MountingInputs(
            0.01 * np.arange(52_000), *(np.resize(v, 52_000) for v in list(long.columns().values())[1:])
        )
        ours = 520.0 / best_of(15, partial(simulate, RIG, parameters, repeated))
        error = np.abs(simulate(RIG, parameters, inputs).signals - reference).max() / size
        yield f"{name}: ours", "", f"{ours:8.0f} s/s, error {error:.0e}"
        for method in ("RK45", "DOP853", "LSODA", "Radau"):
            u, seconds = scipy_run(RIG, parameters, times, method)
            error = np.abs(u @ to_signals.T - reference).max() / size
            yield f"{name}: scipy {method}", "", f"{duration / seconds:8.0f} s/s, error {error:.0e}"
        runs = [("our equations handed over", exudyn_equations, RK4, step) for step in (2.5e-3, 5e-3, 10e-3)]
        runs += [("our equations handed over", exudyn_equations, ALPHA, step) for step in (2.5e-3, 5e-3, 10e-3)]
        # Explicit with eliminated constraints the rigid body moves wrongly (errors of 30 %): only the implicit one serves.
        runs += [("bodies", exudyn_bodies, ALPHA, step) for step in (2.5e-3, 5e-3, 10e-3)]
        yield from exudyn_rows(name, ours, runs, (parameters, times), reference)


def exudyn_rows(name, ours, runs, model, reference):
    best, (parameters, times) = {}, model
    for how, run, solver, step in runs:
        tries = [run(RIG, parameters, times, step, solver) for _ in range(2)]
        signals = tries[0][0][:: max(1, len(tries[0][0]) // len(times))]
        error = np.abs(signals - reference).max() / np.abs(reference).max()
        speed = (times[-1] - times[0]) / min(seconds for _, seconds in tries)
        best[how] = max(best.get(how, 0.0), speed if error < ALLOWED else 0.0)
        label = "RK4" if solver == RK4 else "generalised-alpha"
        yield f"{name}: Exudyn, {how}, {label}, {step * 1e3:g} ms", "", f"{speed:8.0f} s/s, error {error:.0e}"
    for how, speed in best.items():
        wanted = "" if "handed" in how else ">= 100"
        yield f"{name}: ours over Exudyn's best ({how}, error < {ALLOWED:.0e})", wanted, f"{ours / speed:.0f}"


def measured_rows():
    """The same with loads from a record, what the model is for: 30 s with torque of the noisy history."""
    whole = rough_inputs()
    part = MountingInputs(*(values[50_000:] for values in whole.columns().values()))
    ramp = np.minimum(1.0, (part.time - part.time[0]) / 2.0)
    part = MountingInputs(
        part.time - part.time[0], part.torque * ramp, part.speed, part.carrier_angle, part.ntl_y, part.ntl_z * ramp
    )
    for name in ("linear, moderate damping", "nonlinear, moderate damping"):
        parameters = parameter_array(RIG, {**MODELS[name][0], "P_T": 0.0})
        reference = simulate(RIG, parameters, part, step=part.step / 64).signals
        ours = 520.0 / best_of(15, partial(simulate, RIG, parameters, whole))
        yield f"{name}, measured loads: ours", "", f"{ours:8.0f} s/s"
        bodies = partial(exudyn_bodies, measured=(part.torque, part.ntl_z))
        runs = [("bodies", bodies, ALPHA, step) for step in (1.25e-3, 2.5e-3, 5e-3, 10e-3)]
        yield from exudyn_rows(f"{name}, measured loads", ours, runs, (parameters, part.time), reference)


def main():
    print_ratios(list(our_rows("figure 6", LoadHistory().inputs(40.0, 560.0))))
    print_ratios(list(our_rows("with noise", rough_inputs())))
    print_ratios(list(peer_rows()))
    print_ratios(list(measured_rows()))


if __name__ == "__main__":
    main()
