"""Simulated seconds per wall second of the mounting model, and scipy's solve_ivp on the same model.

    python -m benchmarks.mounting_speed

On one thread, warm: all is compiled before the clock starts. Each figure is the best of what two
seconds hold, as other work on the machine only slows. Errors are the largest of all six sensors,
relative to the largest signal, against a run of a sixty-fourth of the step (linear: loads refined
16 times). Exudyn: ``mounting_equal_error``.
"""

import time
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from threadpoolctl import threadpool_limits

from benchmarks.measured import best_of, measured, wall_seconds
from benchmarks.mounting_cases import (
    MODERATE_LINEAR,
    MODERATE_NONLINEAR,
    PEER_MODELS,
    RIG,
    Array,
    element_coordinates,
    error_of,
    formula_inputs,
    noisy_inputs,
    radial_at,
    torque_at,
)
from benchmarks.ratio import ERROR, SPEED, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray, parameter_array
from carrierflex.simulation.mounting.simulate import response_of, signal_pieces, simulate
from carrierflex.simulation.mounting.table_3 import TABLE_3
from carrierflex.simulation.mounting.time_integration import mounting_model

QUICK = {"first": 500.0, "budget": 0.2, "formula_seconds": 15.0}

#: Damping of the papers' tables [N s/m].
_PAPER = {"C1": 4.83e6}
_MAXWELL = {**TABLE_3["hydrodynamic"], "m": 0.0}
MODELS = {
    "linear, moderate damping": MODERATE_LINEAR,
    "linear, damping of the paper": TABLE_3["linear"],
    "nonlinear, moderate damping": MODERATE_NONLINEAR,
    "nonlinear, damping of the paper": {**TABLE_3["nonlinear"], **_PAPER},
    "hydro-dynamic, Maxwell branch": _MAXWELL,
    "hydro-dynamic, fluid mass": TABLE_3["hydrodynamic"],
    "hydro-dynamic, damping of the paper": {**_MAXWELL, **_PAPER},
}

#: Wanted speed [s/s] and error of linear models, which are solved exactly, and of the others.
_LINEAR_WANTED = at_least(80_000), at_most(1e-9)
_NONLINEAR_WANTED = at_least(10_000), at_most(1e-4)

_SCIPY_METHODS = ("RK45", "DOP853", "LSODA", "Radau")


def ratios(
    first: float = 40.0, *, budget: float = 2.0, formula_seconds: float = 30.0
) -> Iterator[Ratio]:
    """Speed and error of every model under three load histories; then beside scipy.

    Parameters
    ----------
    first
        Time of figure 6's history at which a run begins; all end at 560 [s].
    budget
        Time for the repetitions of a run [s].
    formula_seconds
        Length of the record that scipy simulates too [s].
    """
    histories = {
        "figure 6": history_inputs(LoadHistory(), first, 560.0),
        "figure 6 with ntl_y": history_inputs(LoadHistory(ntl_y=30e3), first, 560.0),
        "figure 6 with noise": noisy_inputs(first, 560.0),
    }
    with threadpool_limits(1):
        for history, inputs in histories.items():
            for name, values in MODELS.items():
                yield from _speed_and_error(f"{history}: {name}", values, inputs, budget)
        for name, parameters in PEER_MODELS.items():
            yield from _beside_scipy(name, parameters, formula_seconds, budget)


def _speed_and_error(
    case: str, values: Mapping[str, float], inputs: MountingInputs, budget: float
) -> Iterator[Ratio]:
    parameters = parameter_array(RIG, values)
    model = mounting_model(RIG, parameters, inputs.loads, inputs.step)
    linear = ": linear" in case
    signals = simulate(RIG, parameters, inputs).signals
    run = partial(wall_seconds, partial(simulate, RIG, parameters, inputs))
    duration = inputs.time[-1] - inputs.time[0]
    whole_record_speed = duration / best_of(run, budget)
    speed = duration / _best_of_pieces(parameters, inputs, budget)
    wanted_speed, wanted_error = _LINEAR_WANTED if linear else _NONLINEAR_WANTED
    note = f"step {inputs.step / model.substeps * 1e3:.3g} ms; {whole_record_speed:.0f} s/s whole"
    yield Ratio(case, SPEED, speed, wanted=wanted_speed, note=note)
    if linear:
        reference = simulate(RIG, parameters, inputs.refined(16)).signals[::16]
    else:
        reference = simulate(RIG, parameters, inputs, step=inputs.step / 64).signals
    yield Ratio(case, ERROR, error_of(signals, reference), wanted=wanted_error)


def _best_of_pieces(parameters: ParameterArray, inputs: MountingInputs, budget: float) -> float:
    """Wall seconds of a run, the zeroing and each of its pieces at its best.

    On a busy machine no whole run is left alone; a piece of it is.
    """
    begin = time.perf_counter()
    best: Array = np.array([np.inf])
    while time.perf_counter() - begin < budget or not np.isfinite(best).all():
        stamps = [time.perf_counter()]
        pieces = []
        for piece in signal_pieces(RIG, parameters, inputs):
            pieces.append(piece)
            stamps.append(time.perf_counter())
        response_of(RIG, parameters, inputs, np.concatenate(pieces))
        best = np.minimum(best, np.diff([*stamps, time.perf_counter()]))
    return float(best.sum())


def _beside_scipy(
    name: str, parameters: ParameterArray, duration: float, budget: float
) -> Iterator[Ratio]:
    """Speed on loads that are formulas, and that of solve_ivp at its tolerance of 1e-6."""
    inputs = formula_inputs(10e-3, duration)
    to_signals = element_coordinates(RIG, parameters)[-1]
    reference = simulate(RIG, parameters, formula_inputs(0.5e-3, duration)).signals[::20]
    error = error_of(simulate(RIG, parameters, inputs).signals, reference)
    run = partial(wall_seconds, partial(simulate, RIG, parameters, inputs))
    ours = duration / best_of(run, budget)
    for method in _SCIPY_METHODS:
        scipy = measured(partial(_scipy_deflections, parameters, inputs.time, method))
        scipy_error = error_of(scipy.result @ to_signals.T, reference)
        note = f"errors {error:.0e} and {scipy_error:.0e}"
        speed = duration / scipy.wall
        yield Ratio(f"formulas: {name}", SPEED, ours, f"scipy {method}", speed, note=note)


def _scipy_deflections(parameters: ParameterArray, times: Array, method: str) -> Array:
    """Deflections of both bushings by solve_ivp, shape (n, 2) [m]."""
    M, C, K, G, law, _ = element_coordinates(RIG, parameters)
    inverse = np.linalg.inv(M)
    K3, K5 = law[:2]

    def rates(t: Any, y: Array) -> Array:
        u, v = y[:2], y[2:]
        square = u * u
        springs = K @ u + u * square * (K3 + K5 * square)
        force = G[:, 0] * torque_at(t) + G[:, 1] * radial_at(t) - springs - C @ v
        return np.concatenate([v, inverse @ force])

    tolerances = {"rtol": 1e-6, "atol": [1e-10] * 2 + [1e-8] * 2}
    span = times[0], times[-1]
    solution = solve_ivp(rates, span, np.zeros(4), method=method, t_eval=times, **tolerances)
    if not solution.success:
        raise RuntimeError(f"solve_ivp {method} stopped: {solution.message}")
    return solution.y[:2].T


if __name__ == "__main__":
    run_alone(ratios)
