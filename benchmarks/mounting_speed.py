"""Simulated seconds per wall second of the mounting model, with scipy's solve_ivp and Exudyn beside it on the same model.

Run as `python -m benchmarks.mounting_speed`; one core: set OMP_NUM_THREADS and OPENBLAS_NUM_THREADS
to 1. Warm: all is compiled before the clock starts. Each figure is the best of what two seconds
hold: other work on the machine only slows. Errors are the largest of all six sensors, relative to
the largest signal, against a run of a sixty-fourth of the step (linear: loads refined 16 times).
Exudyn: see `mounting_equal_error.py`.
"""

import time
from functools import partial

import numpy as np

from benchmarks.measured import print_ratios
from benchmarks.mounting_equal_error import equal_error_rows, formula_inputs
from benchmarks.mounting_equal_error import error_of as error_of_peer
from benchmarks.mounting_peers import best_of, element_coordinates, scipy_run, timed
from carrierflex.simulation.mounting.bushings import (
    HydrodynamicBushing,
    LinearBushing,
    NonlinearBushing,
)
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameters import parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.simulate import response_of, signal_pieces, simulate
from carrierflex.simulation.mounting.time_integration import mounting_model

RIG = MountingRig(zeroing_samples=1)
MODELS = {
    "linear, moderate damping": ({**LinearBushing().parameters(), "C1": 1e5}, 80_000, 1e-9),
    "linear, damping of the paper": (LinearBushing().parameters(), 80_000, 1e-9),
    "nonlinear, moderate damping": ({**NonlinearBushing().parameters(), "C1": 3e4}, 10_000, 1e-4),
    "nonlinear, damping of the paper": (
        {**NonlinearBushing().parameters(), "C1": 4.83e6},
        10_000,
        1e-4,
    ),
    "hydro-dynamic, Maxwell branch": (HydrodynamicBushing(m=0.0).parameters(), 10_000, 1e-4),
    "hydro-dynamic, fluid mass": (HydrodynamicBushing().parameters(), 10_000, 1e-4),
    "hydro-dynamic, damping of the paper": (
        {**HydrodynamicBushing(m=0.0).parameters(), "C1": 4.83e6},
        10_000,
        1e-4,
    ),
}


#: What a peer integrates too: without the parasitic torque, whose load its user would have to
#: build.
PEER_MODELS = {
    name: {**MODELS[name][0], "P_T": 0.0}
    for name in ("linear, moderate damping", "nonlinear, moderate damping")
}


def best_of_pieces(parameters, inputs, budget=2.0):
    """Wall seconds of a run, each of its 27 pieces and the zeroing at its best.

    On a busy machine no whole run is left alone.
    """
    begin, best = time.perf_counter(), np.inf
    while time.perf_counter() - begin < budget:
        stamps, pieces = [time.perf_counter()], []
        for piece in signal_pieces(RIG, parameters, inputs):
            pieces.append(piece)
            stamps.append(time.perf_counter())
        response_of(RIG, parameters, inputs, np.concatenate(pieces))
        best = np.minimum(best, np.diff([*stamps, time.perf_counter()]))
    return best.sum()


def rough_inputs():
    """The history of figure 6 with 5 % of noise below 10 Hz on torque and radial load.

    Nothing smooth to live on.
    """
    smooth = LoadHistory().inputs(40.0, 560.0)
    rng = np.random.default_rng(1)
    spectrum = np.fft.rfft(rng.standard_normal((2, smooth.time.size)), axis=1)
    spectrum[:, np.fft.rfftfreq(smooth.time.size, smooth.step) > 10.0] = 0.0
    noise = np.fft.irfft(spectrum, smooth.time.size, axis=1)
    noise *= 0.05 / noise.std(axis=1, keepdims=True)
    torque, ntl_z = smooth.torque * (1.0 + noise[0]), smooth.ntl_z * (1.0 + noise[1])
    return MountingInputs(
        smooth.time, torque, smooth.speed, smooth.carrier_angle, smooth.ntl_y, ntl_z
    )


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
        whole, quiet = (
            best_of(partial(timed, partial(simulate, RIG, parameters, inputs))),
            best_of_pieces(parameters, inputs),
        )
        step = inputs.step / mounting_model(RIG, parameters, inputs.loads, inputs.step).substeps
        error = error_of(parameters, inputs, signals, linear)
        what = f"{520.0 / quiet:8.0f} s/s in pieces, {520.0 / whole:.0f} whole, error {error:.0e} "
        what += f"(<= {error_wanted:.0e}), step {step * 1e3:.3g} ms, {quiet * 1e3:.1f} ms"
        yield f"{label}: {name}", f">= {wanted}", what


def scipy_rows():
    """What scipy's solve_ivp takes at its tolerance of 1e-6 on the loads that are formulas."""
    inputs = formula_inputs(10e-3)
    for name in PEER_MODELS:
        parameters = parameter_array(RIG, PEER_MODELS[name])
        to_signals = element_coordinates(RIG, parameters)[-1]
        reference = simulate(RIG, parameters, formula_inputs(0.5e-3)).signals[::20]
        for method in ("RK45", "DOP853", "LSODA", "Radau"):
            u, seconds = scipy_run(RIG, parameters, inputs.time, method)
            error = error_of_peer(u @ to_signals.T, reference)
            yield (
                f"{name}: scipy {method}",
                "",
                f"{inputs.time[-1] / seconds:8.0f} s/s, error {error:.0e}",
            )


def measured_part():
    """Thirty seconds with torque of the noisy history, from rest: loads of a record."""
    part = MountingInputs(*(values[-3001:] for values in rough_inputs().columns().values()))
    ramp = np.minimum(1.0, (part.time - part.time[0]) / 2.0)
    return MountingInputs(
        part.time - part.time[0],
        part.torque * ramp,
        part.speed,
        part.carrier_angle,
        part.ntl_y,
        part.ntl_z * ramp,
    )


def main():
    print_ratios(list(our_rows("figure 6", LoadHistory().inputs(40.0, 560.0))))
    print_ratios(list(our_rows("figure 6 with ntl_y", LoadHistory(ntl_y=30e3).inputs(40.0, 560.0))))
    print_ratios(list(our_rows("with noise", rough_inputs())))
    print_ratios(list(scipy_rows()))
    models = {name: parameter_array(RIG, values) for name, values in PEER_MODELS.items()}
    print_ratios(list(equal_error_rows(RIG, models, measured_part())))


if __name__ == "__main__":
    main()
