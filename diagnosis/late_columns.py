"""Columns of another simulator that are some steps of time off the signals that they predict.

Beside a signal y a prediction that is late by d leaves ``d y'``, in the gap with all that is
missing. A baseline of columns is never refitted: what it is late by looks like damping, memory or a
delay of the sensors. Where the slope of the columns explains half a step of time or more, they are
put back by whole steps, and the classes are compared anew.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.results import MEASURED, ClassAnswer
from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_left
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.diagnosis.wiring.refits import CLOCK, GapSquare, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import sample_of

FloatArray = NDArray[np.float64]
_ABOUT = "columns of the prediction"
#: Values of all columns up to which they are moved: 80 MB.
_MOST_VALUES = 10_000_000


def columns_put_back(
    campaign: Campaign,
    answer: ClassAnswer | None,
    gap: GapSquare,
    problem_of: Callable[[Campaign], ComparisonProblem],
    *,
    remaining_as_read: float,
) -> tuple[WiringRival, float] | None:
    """Classes beside columns that are put back in time, with the share that both explain.

    Parameters
    ----------
    campaign : Campaign
        Records with the prediction of another simulator.
    answer : ClassAnswer, optional
        Classes that the gap shows beside the columns as they are.
    gap : GapSquare
        Mean squares of that gap and of the noise.
    problem_of : callable
        ``(campaign) -> problem`` of the same records with other columns.
    remaining_as_read : float
        Mean square that what is named leaves in the simulator; infinite where nothing was fitted.

    Returns
    -------
    tuple of (WiringRival, float), optional
        None where there is no gap, where the columns are less than half a step off or too many to
        be moved, or where, put back, neither less remains nor as little with fewer classes.
    """
    before, floor = gap.before, gap.floor
    n_values = len(campaign.channels) * sum(run.time.size for run in campaign.runs)
    is_of_columns = campaign.baseline.source == "columns" and n_values <= _MOST_VALUES
    late = _late_steps(campaign) if is_of_columns and floor < before < np.inf else 0
    if late == 0:
        return None
    equal = ClassConstants().most_equal_left
    as_read = min(_remaining(answer, before, floor), max(remaining_as_read, floor))
    # A cause beside it may turn the sign of the slope.
    tried = [(*_compared_anew(campaign, n, floor, problem_of), n) for n in sorted({1, -1, late})]
    remaining, classes, steps = min(tried)
    is_simpler = len(classes) < len(() if answer is None else answer.ids)
    if not (equal * remaining < as_read or (is_simpler and remaining < equal * as_read)):
        return None
    step = mean_step(campaign.runs[0].time)
    size = f"{abs(steps)} step{'s' * (abs(steps) > 1)} of time ({abs(steps) * step * 1e3:.3g} ms)"
    text = f"the {_ABOUT} {size} {'earlier' if steps > 0 else 'later'}"
    line = sample_of(campaign.runs[0].file, 0)
    laws = tuple(MEASURED + name for name in classes)
    rival = WiringRival(CLOCK, _ABOUT, text, remaining, line, laws)
    return rival, (before - remaining) / (before - floor)


def _compared_anew(
    campaign: Campaign,
    steps: int,
    floor: float,
    problem_of: Callable[[Campaign], ComparisonProblem],
) -> tuple[float, tuple[str, ...]]:
    """Mean square that remains beside columns put back by some steps, and the classes there."""
    runs = tuple(_put_back(run, steps) for run in campaign.runs)
    try:
        problem = problem_of(replace(campaign, runs=runs))
        gap = mean_square_left(problem, fit_effects(problem, ()))
        answer = problem.class_answer()
    except ValueError:  # A baseline that these columns lead out of its bounds is no better one.
        return np.inf, ()
    return _remaining(answer, gap, floor), () if answer is None else answer.ids


def _late_steps(campaign: Campaign) -> int:
    """Whole steps by which the columns are late, from their slopes; negative: early."""
    along = square = 0.0
    for run in campaign.runs:
        for name, predicted in run.predictions.items():
            slope = np.gradient(predicted)
            known = np.isfinite(slope) & np.isfinite(run.signals[name])
            gap = (run.signals[name] - predicted)[known]
            along += float(gap @ slope[known])
            square += float(slope[known] @ slope[known])
    return round(along / square) if square > 0.0 else 0


def _put_back(run: Run, steps: int) -> Run:
    """Run whose columns are those of some steps later, with the slope of their end beyond it."""
    at = np.arange(run.time.size) + steps

    def moved(values: FloatArray) -> FloatArray:
        inside = np.clip(at, 0, values.size - 1)
        end = values[-1] - values[-2] if steps > 0 else values[1] - values[0]
        return np.asarray(values[inside] + (at - inside) * end)

    return replace(run, predictions={name: moved(v) for name, v in run.predictions.items()})


def _remaining(answer: ClassAnswer | None, before: float, floor: float) -> float:
    """Mean square that the classes of an answer leave of a gap; the floor at least."""
    share = 0.0 if answer is None or not answer.ids else min(answer.share, 1.0)
    return max(before - share * (before - floor), floor)
