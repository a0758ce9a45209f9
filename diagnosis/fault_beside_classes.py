"""Faults of the measurement put right first, and the classes compared anew beside them.

A fault that lies beside a cause explains a part of the gap by itself: it is no rival of the class
that explains the rest, and the nearest law beside the fault is not the true one. Columns of another
simulator are never refitted: what they are late by, ``d y'`` beside a signal y, looks like damping,
memory or a delay of the sensors. Where the slope of the columns explains half a step of time or
more, they are put back by whole steps.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.results import MEASURED, ClassAnswer
from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_left
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.diagnosis.wiring.refits import AS_GOOD, Fault, GapSquare, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import sample_of

FloatArray = NDArray[np.float64]
_ABOUT = "columns of the prediction"
#: Values of all columns up to which they are moved: 80 MB.
_MOST_VALUES = 10_000_000


def fault_beside_classes(
    faults: Iterable[WiringRival],
    answer: ClassAnswer | None,
    gap: GapSquare,
    problem_of: Callable[[Campaign], ComparisonProblem],
    *,
    explained: float,
) -> tuple[WiringRival, float] | None:
    """The fault beside which the classes leave least, with the share that both explain.

    None where there is no gap, or where beside no fault less remains than the classes leave of the
    records as read, or as little with fewer classes. `answer` holds the classes of the `gap` as
    read; `explained` is the share of it that what is named explains in the simulator.
    """
    before, floor = gap.before, gap.floor
    if not floor < before < np.inf:
        return None
    as_read = min(_remaining(answer, gap), gap.remaining(min(explained, 1.0)))
    equal, n_classes = ClassConstants().most_equal_left, 0 if answer is None else len(answer.ids)
    # No fault beside a class leaves less than noise, nor is it simpler than one class alone.
    if as_read <= equal * floor and n_classes == 1:
        return None
    tried = [
        _compared_anew(fault, fault.corrected, floor, problem_of)
        for fault in faults
        if fault.corrected is not None
    ]
    least = min((rival.mean_square for rival in tried), default=np.inf)
    if not least < np.inf:
        return None
    as_good = (rival for rival in tried if rival.mean_square <= equal * least)
    best = min(as_good, key=lambda rival: (len(rival.laws), rival.mean_square))
    remaining = best.mean_square
    is_simpler = len(best.laws) < n_classes
    clearly = AS_GOOD * (before - floor)
    is_better = equal * remaining < as_read and as_read - remaining > clearly
    is_as_good = remaining < equal * as_read and remaining - as_read < clearly
    if not (is_better or (is_simpler and is_as_good)):
        return None
    return best, (before - remaining) / (before - floor)


def _compared_anew(
    fault: WiringRival,
    corrected: Campaign,
    floor: float,
    problem_of: Callable[[Campaign], ComparisonProblem],
) -> WiringRival:
    """The fault with the classes that the records show once it is put right."""
    try:
        problem = problem_of(corrected)
        before = mean_square_left(problem, fit_effects(problem, ()))
        gap = GapSquare(before, problem.noise_floor_square)
        answer = problem.class_answer()
    except ValueError:  # A baseline that these records lead out of its bounds is no better one.
        return replace(fault, mean_square=np.inf)
    laws = () if answer is None else tuple(MEASURED + name for name in answer.ids)
    # Without a channel the noise of the others is another one.
    remaining = _remaining(answer, gap) * floor / gap.floor
    return replace(fault, mean_square=remaining, laws=laws)


def late_columns(campaign: Campaign) -> Iterator[WiringRival]:
    """Columns of another simulator put back by some whole steps of time; none of a model.

    None where the columns are less than half a step off or too many to be moved.
    """
    n_values = len(campaign.channels) * sum(run.time.size for run in campaign.runs)
    is_of_columns = campaign.baseline.source == "columns" and n_values <= _MOST_VALUES
    late = _late_steps(campaign) if is_of_columns else 0
    if late == 0:
        return
    step = mean_step(campaign.runs[0].time)
    line = sample_of(campaign.runs[0].file, 0)
    # A cause beside it may turn the sign of the slope.
    for n in sorted({1, -1, late}):
        size = f"{abs(n)} step{'s' * (abs(n) > 1)} of time ({abs(n) * step * 1e3:.3g} ms)"
        text = f"the {_ABOUT} {size} {'earlier' if n > 0 else 'later'}"
        corrected = replace(campaign, runs=tuple(_put_back(run, n) for run in campaign.runs))
        yield WiringRival(Fault.CLOCK, _ABOUT, text, np.inf, line, corrected=corrected)


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


def _remaining(answer: ClassAnswer | None, gap: GapSquare) -> float:
    """Mean square that the classes of an answer leave of a gap; the floor at least."""
    share = 0.0 if answer is None or not answer.ids else min(answer.share, 1.0)
    return max(gap.remaining(share), gap.floor)
