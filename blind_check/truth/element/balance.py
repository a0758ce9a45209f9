"""Two causes of an element that show alike in its records.

What a cause shows is what it would leave were the other one in the model: measured on the motion
that is recorded, with both, since a damper that stands beside a spring changes the motion that
shows the spring.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.element.case import ElementCase, bounded
from carrierflex.blind_check.truth.element.drawing import resized, with_one_cause
from carrierflex.blind_check.truth.element.element import Element
from carrierflex.blind_check.truth.noise import root_mean_square

FloatArray = NDArray[np.float64]

#: How near the wanted ratio of two gaps must be met, of the ratio, and how often sizes are changed.
_NEAR, _PASSES = 0.07, 8
#: Least and largest change of what a cause shows by a change of its size, both as logarithms.
_SLOPES = (0.3, 3.0)
#: Farthest that a size is changed at once, as a logarithm.
_FARTHEST = 2.0


def own_gaps(case: ElementCase, names: Sequence[str]) -> tuple[float, ...]:
    """RMS that each of several causes leaves with the others in the model, in the channel's unit.

    Parameters
    ----------
    case : ElementCase
        Element with its causes, whose motion is bounded.
    names : sequence of str
        Its causes.

    Returns
    -------
    tuple of float
        By cause, after the baseline's own refit.
    """
    return tuple(
        root_mean_square(np.array(case.baseline(signals))) for signals in shown_by_each(case, names)
    )


def balanced(case: ElementCase, names: Sequence[str], ratio: float) -> ElementCase:
    """Case whose second cause leaves a multiple of what the first one leaves.

    One of them stays as large as it is, the other is made smaller: larger causes may make a motion
    run away.

    Parameters
    ----------
    case : ElementCase
        Element with two causes.
    names : sequence of str
        The two causes.
    ratio : float
        Wanted gap of the second over that of the first.

    Returns
    -------
    ElementCase
        The ratio is met within 7 %, or as near as eight changes come.
    """
    case = bounded(case)
    moved = last = 0.0
    slope = 1.0
    for _ in range(_PASSES):
        first, second = own_gaps(case, names)
        missed = float(np.log(ratio * first / second))
        if abs(missed) <= _NEAR:
            break
        if moved:
            # Causes change the motion that shows them: a cause twice as large may show four times.
            slope = float(np.clip((last - missed) / moved, *_SLOPES))
        moved = float(np.clip(missed / slope, -_FARTHEST, _FARTHEST))
        last = missed
        case = bounded(replace(case, element=_moved(case.element, names, moved)))
    return case


def _moved(element: Element, names: Sequence[str], moved: float) -> Element:
    """Element with one cause smaller by the exponential: the first, the second if negative."""
    return resized(element, names, int(moved < 0.0), float(np.exp(-abs(moved))))


def shown_by_each(case: ElementCase, names: Sequence[str]) -> list[list[FloatArray]]:
    """Channel of every run of the plain element that one cause acts on as in the records.

    Parameters
    ----------
    case : ElementCase
        Element with its causes.
    names : sequence of str
        Its causes.

    Returns
    -------
    list of list of ndarray, shape (n,)
        By cause and run. What they differ by from the plain element adds up to what the records
        do: the plain element is linear.
    """
    alone = [with_one_cause(case.element, names, number) for number in range(len(names))]
    if not case.plain.by_force:
        # The motion is given, and forces add.
        return [case.signals(own) for own in alone]
    return [[_shown(case, own, run) for run in range(len(case.drives))] for own in alone]


def _shown(case: ElementCase, own: Element, run: int) -> FloatArray:
    """Channel of one run with the force of one cause along the recorded motion, shape (n,)."""
    q = case.recorded[run]
    linear = replace(own, laws=(), delay=0.0, lag=0.0)
    answer = linear.motion(case.drives[run], run, case.n, added=-own.law_force(q))
    late = own.sensed(q, case.n) - linear.sensed(q, case.n)
    return linear.sensed(answer, case.n) + late
