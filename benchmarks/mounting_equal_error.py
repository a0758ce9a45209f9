"""The mounting model against Exudyn at equal error.

Of each, the fastest setting whose error is within a level.

Loads are formulas of time, which Exudyn evaluates at every step without a table (its best case), or
a record sampled every 10 ms, what the model is for. Ours reads the formulas as samples, straight
between them: where they are smooth, that is its whole error.
"""

from functools import partial

import exudyn as exu
import numpy as np

from benchmarks.mounting_peers import (
    best_of,
    exudyn_bodies,
    exudyn_equations,
    radial_at,
    timed,
    torque_at,
)
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.time_integration import marched, mounting_model, state_at_rest

RK4, ALPHA = exu.DynamicSolverType.RK44, exu.DynamicSolverType.GeneralizedAlpha

#: Levels of the error over the largest signal at which both are compared.
LEVELS = (1e-4, 1e-2)
#: Steps of Exudyn and sampling intervals of our loads [s].
STEPS, SAMPLINGS = (0.625e-3, 1.25e-3, 2.5e-3, 5e-3, 10e-3, 20e-3, 40e-3), (10e-3, 20e-3, 40e-3)
_DURATION, _WRITTEN = 30.0, 10e-3
#: Exudyn with bodies, as its user would build the mounting, explicit with eliminated constraints
#: moves wrongly (errors of 30 %).
FORMS = {
    "bodies": (exudyn_bodies, (ALPHA,)),
    "our condensed equations": (exudyn_equations, (RK4, ALPHA)),
}


def formula_inputs(interval, duration=_DURATION):
    times = np.arange(round(duration / interval) + 1) * interval
    rest = np.zeros_like(times)
    return MountingInputs(times, torque_at(times), rest, rest, rest, radial_at(times))


def error_of(signals, reference):
    """Largest deviation over the largest signal.

    The finer of both is thinned to the times of the coarser.
    """
    thin = (len(signals) - 1) / (len(reference) - 1)
    signals, reference = (
        (signals[:: round(thin)], reference)
        if thin > 1
        else (signals, reference[:: round(1 / thin)])
    )
    return np.abs(signals - reference).max() / np.abs(reference).max()


def our_settings(rig, parameters, reference, inputs_at, samplings):
    """Speed, error and name of ours by sampling interval.

    As for Exudyn, the clock runs while the equations are solved.
    """
    for interval in samplings:
        inputs = inputs_at(interval)
        model = mounting_model(rig, parameters, inputs.loads, inputs.step)
        rest = state_at_rest(model, inputs.loads[0])
        seconds = best_of(partial(timed, partial(marched, model, rest, inputs.loads)), 1.0)
        error = error_of(simulate(rig, parameters, inputs).signals, reference)
        yield _DURATION / seconds, error, f"loads every {interval * 1e3:g} ms"


def exudyn_settings(rig, parameters, reference, run, solvers):
    times = np.arange(round(_DURATION / _WRITTEN) + 1) * _WRITTEN
    for solver in solvers:
        for step in STEPS:
            signals, first = run(rig, parameters, times, step, solver)
            if not np.isfinite(signals).all() or len(signals) < _DURATION / max(step, _WRITTEN):
                continue  # it diverged
            again = partial(run, rig, parameters, times, step, solver)
            seconds = min(first, best_of(lambda again=again: again()[1], 1.0))
            label = "RK4" if solver == RK4 else "generalised-alpha"
            yield _DURATION / seconds, error_of(signals, reference), f"{label} {step * 1e3:g} ms"


def fastest_within(settings, level):
    within = [setting for setting in settings if setting[1] <= level]
    return max(within) if within else (np.nan, np.nan, "none")


def compared(title, ours, theirs, wanted):
    """One row a level: both speeds with what reached them, and the ratio."""
    for level in LEVELS:
        speed, error, how = fastest_within(ours, level)
        their_speed, their_error, their_how = fastest_within(theirs, level)
        reached = f"{speed / their_speed:6.0f} = {speed:.0f} s/s ({how}, error {error:.0e}) / "
        reached += f"{their_speed:.0f} s/s ({their_how}, error {their_error:.0e})"
        yield f"{title}, error <= {level:.0e}", wanted, reached


def equal_error_rows(rig, models, measured):
    """Ours over Exudyn for models by name, loads by formula and from the record `measured` (30 s every 10 ms)."""
    for name, parameters in models.items():
        reference = simulate(rig, parameters, formula_inputs(0.5e-3)).signals[::20]
        ours = list(our_settings(rig, parameters, reference, formula_inputs, SAMPLINGS))
        for form, (run, solvers) in FORMS.items():
            theirs = list(exudyn_settings(rig, parameters, reference, run, solvers))
            wanted = ">= 100" if form == "bodies" else ""
            yield from compared(f"{name}, formulas: ours over Exudyn, {form}", ours, theirs, wanted)
        reference = simulate(rig, parameters, measured, step=measured.step / 64).signals
        ours = list(
            our_settings(rig, parameters, reference, lambda interval: measured, (measured.step,))
        )
        run = partial(exudyn_bodies, measured=(measured.torque, measured.ntl_z))
        theirs = list(exudyn_settings(rig, parameters, reference, run, (ALPHA,)))
        yield from compared(f"{name}, record: ours over Exudyn, bodies", ours, theirs, ">= 100")
