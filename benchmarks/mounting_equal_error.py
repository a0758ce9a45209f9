"""The mounting model against Exudyn at equal error: of each, the fastest setting within a level.

    python -m benchmarks.mounting_equal_error

Loads are formulas of time, which Exudyn evaluates at every step without a table (its best case), or
a record sampled every 10 ms, what the model is for. Ours reads the formulas as samples, straight
between them: where they are smooth, that is its whole error.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import NamedTuple

import exudyn as exu
import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.measured import best_of, wall_seconds
from benchmarks.mounting_by_exudyn import exudyn_bodies, exudyn_equations
from benchmarks.mounting_cases import (
    PEER_MODELS,
    RIG,
    Array,
    error_of,
    formula_inputs,
    noisy_record,
)
from benchmarks.ratio import SPEED, Bound, Ratio, at_least
from benchmarks.run import run_alone
from carrierflex.simulation.mounting.inputs import MountingInputs
from carrierflex.simulation.mounting.parameter_arrays import ParameterArray
from carrierflex.simulation.mounting.simulate import simulate
from carrierflex.simulation.mounting.time_integration import marched, mounting_model, state_at_rest

QUICK = {"duration": 15.0, "budget": 0.1}

#: Levels of the error over the largest signal at which both are compared.
LEVELS = (1e-4, 1e-2)
#: Steps of Exudyn [s].
STEPS = (0.625e-3, 1.25e-3, 2.5e-3, 5e-3, 10e-3, 20e-3, 40e-3)
#: Sampling intervals of our loads [s].
SAMPLINGS = (10e-3, 20e-3, 40e-3)
_WRITTEN = 10e-3
_SOLVERS = {
    "RK4": exu.DynamicSolverType.RK44,
    "generalised-alpha": exu.DynamicSolverType.GeneralizedAlpha,
}
#: Exudyn's models. With bodies, as its user would build the mounting, its explicit solver with
#: eliminated constraints moves wrongly (errors of 30 %).
_FORMS = {
    "bodies": (exudyn_bodies, ("generalised-alpha",)),
    "our condensed equations": (exudyn_equations, ("RK4", "generalised-alpha")),
}

#: Signals and wall seconds of an Exudyn run.
ExudynRun = Callable[..., tuple[Array, float]]


class Setting(NamedTuple):
    """Speed [s/s], error and name of one way to run a code."""

    speed: float
    error: float
    name: str


def ratios(duration: float = 30.0, *, budget: float = 1.0) -> Iterator[Ratio]:
    """Ours over Exudyn, by model, loads, form of Exudyn's model and level of the error.

    Parameters
    ----------
    duration
        Length of the simulated record [s]; the loads have risen after 12.
    budget
        Time for the repetitions of a setting [s].
    """
    record = noisy_record(duration)
    with threadpool_limits(1):
        for name, parameters in PEER_MODELS.items():
            yield from _with_formulas(name, parameters, duration, budget)
            yield from _with_record(name, parameters, record, budget)


def _with_formulas(
    name: str, parameters: ParameterArray, duration: float, budget: float
) -> Iterator[Ratio]:
    reference = simulate(RIG, parameters, formula_inputs(0.5e-3, duration)).signals[::20]
    inputs = [formula_inputs(interval, duration) for interval in SAMPLINGS]
    ours = _our_settings(parameters, reference, inputs, budget)
    times = _WRITTEN * np.arange(round(duration / _WRITTEN) + 1, dtype=np.float64)
    for form, (run, solvers) in _FORMS.items():
        build = partial(run, RIG, parameters, times)
        theirs = _exudyn_settings(build, reference, times, solvers, budget)
        wanted = at_least(100) if form == "bodies" else None
        yield from _compared(f"formulas, {name}", ours, f"Exudyn, {form}", theirs, wanted)


def _with_record(
    name: str, parameters: ParameterArray, record: MountingInputs, budget: float
) -> Iterator[Ratio]:
    reference = simulate(RIG, parameters, record, step=record.step / 64).signals
    ours = _our_settings(parameters, reference, [record], budget)
    loads = record.torque, record.ntl_z
    build = partial(exudyn_bodies, RIG, parameters, record.time, loads=loads)
    solvers = ("generalised-alpha",)
    theirs = _exudyn_settings(build, reference, record.time, solvers, budget)
    yield from _compared(f"record, {name}", ours, "Exudyn, bodies", theirs, at_least(100))


def _our_settings(
    parameters: ParameterArray, reference: Array, records: Iterable[MountingInputs], budget: float
) -> list[Setting]:
    """Ours by sampling interval; as for Exudyn, the clock runs while the equations are solved."""
    settings = []
    for inputs in records:
        model = mounting_model(RIG, parameters, inputs.loads, inputs.step)
        rest = state_at_rest(model, inputs.loads[0])
        solve = partial(wall_seconds, partial(marched, model, rest, inputs.loads))
        speed = inputs.time[-1] / best_of(solve, budget)
        error = error_of(simulate(RIG, parameters, inputs).signals, reference)
        settings.append(Setting(speed, error, f"loads every {inputs.step * 1e3:.0f} ms"))
    return settings


def _exudyn_settings(
    run: ExudynRun, reference: Array, times: Array, solvers: Iterable[str], budget: float
) -> list[Setting]:
    """Exudyn's by solver and step; a step with which it diverges is left out."""
    settings = []
    duration = times[-1]
    for solver in solvers:
        for step in STEPS:
            again = partial(run, step, _SOLVERS[solver])
            signals, first = again()
            if not np.isfinite(signals).all() or len(signals) < duration / max(step, _WRITTEN):
                continue
            seconds = min(first, best_of(partial(_seconds, again), budget))
            error = error_of(signals, reference)
            settings.append(Setting(duration / seconds, error, f"{solver} {step * 1e3:g} ms"))
    return settings


def _seconds(run: ExudynRun) -> float:
    return run()[1]


def _compared(
    case: str, ours: list[Setting], peer: str, theirs: list[Setting], wanted: Bound | None
) -> Iterator[Ratio]:
    """One row a level: the fastest of both, and the settings that were it."""
    for level in LEVELS:
        our, other = _fastest_within(ours, level), _fastest_within(theirs, level)
        note = f"{our.name}, {our.error:.0e}; {other.name}, {other.error:.0e}"
        name = f"{case}, error {level:.0e}"
        yield Ratio(name, SPEED, our.speed, peer, other.speed, wanted, note)


def _fastest_within(settings: list[Setting], level: float) -> Setting:
    within = [setting for setting in settings if setting.error <= level]
    return max(within) if within else Setting(np.nan, np.nan, "no setting")


if __name__ == "__main__":
    run_alone(ratios)
