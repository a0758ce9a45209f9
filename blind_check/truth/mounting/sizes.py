"""Withheld causes of a mounting at their sizes: as drawn, or each at a gap of its own."""

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import FORM, CasePlan
from carrierflex.blind_check.truth.mounting.other_forms import with_form
from carrierflex.blind_check.truth.mounting.state import MountingState, with_effect
from carrierflex.blind_check.truth.mounting.time_integration import COARSE, FINE

FloatArray = NDArray[np.float64]

#: A cause has its size where the gap that it leaves alone is the wanted one within this: sizes are
#: drawn over a factor of fourteen, and the label holds the gap that it does leave.
_TOLERANCE = 0.07
_STEPS = 12
#: Second cause of a pair over the first, both alone: as of an element.
_BALANCE = (0.6, 1.6)

#: Gap [m] of a state, by integration steps in a sample.
Gap = Callable[[MountingState, int], float]
Caused = Callable[[MountingState, float], tuple[MountingState, float]]


@dataclass(frozen=True, eq=False)
class Withheld:
    """State with the withheld causes.

    Parameters
    ----------
    state : MountingState
        All causes together.
    changes : tuple of float
        Change of form of each.
    own_gaps : tuple of float
        Where there are several, gap [m] that each leaves alone.
    floor : float
        Noise [m] that the sizes are set for; zero where it follows from the gap.
    """

    state: MountingState
    changes: tuple[float, ...] = ()
    own_gaps: tuple[float, ...] = ()
    floor: float = 0.0


def withheld(
    plan: CasePlan,
    rng: np.random.Generator,
    known: MountingState,
    size: FloatArray,
    *,
    gap: Gap,
    share: float = 1.0,
) -> Withheld:
    """State with the causes of a plan.

    One cause is as large as it is drawn. Causes of several have gaps of their own: those of the
    plan, or a pair's, whose noise follows from the gap of both.

    Parameters
    ----------
    plan : CasePlan
        Causes, and of several at once the gap over the noise that each leaves alone.
    rng : Generator
        Random numbers.
    known : MountingState
        What the baseline holds.
    size : ndarray, shape (2,)
        Largest radial deflection [m] and its speed [m/s] without the causes.
    gap : callable
        RMS [m] of what a state leaves after the baseline's refit, and how finely it is integrated.
    share : float
        Share of the drawn size that causes in other forms have at most.

    Raises
    ------
    ArithmeticError
        Where the motion grows beyond all numbers.
    """
    if plan.own_ratios:
        return _several(plan, plan.own_ratios, rng, known, size, gap=gap, share=share)
    if plan.family == FORM and len(plan.effects) > 1:
        ratios = (1.0, float(rng.uniform(*_BALANCE)))
        return replace(_several(plan, ratios, rng, known, size, gap=gap, share=share), floor=0.0)
    state = known
    changes = []
    for name in plan.effects:
        if plan.family == FORM:
            state, change = with_form(state, name, rng, size, share)
            changes.append(change)
        else:
            state = with_effect(state, name, rng, size)
    return Withheld(state, tuple(changes))


def _several(
    plan: CasePlan,
    ratios: Sequence[float],
    rng: np.random.Generator,
    known: MountingState,
    size: FloatArray,
    *,
    gap: Gap,
    share: float,
) -> Withheld:
    """State with several causes of wanted gaps, one of them as large as it is drawn, none larger.

    `ratios`: gap over the noise that each leaves alone; the rest as of :func:`withheld`.
    """
    causes: list[Caused] = []
    for name in plan.effects:
        causes.append(_with_share(name, deepcopy(rng), size))
        with_form(known, name, rng, size)
    largest = [_largest(cause, known, gap, float(size[0]), share) for cause in causes]
    floor = min(own / ratio for (_, own), ratio in zip(largest, ratios, strict=True))
    state = known
    changes = []
    own_gaps = []
    for cause, start, ratio in zip(causes, largest, ratios, strict=True):
        own_share, own_gap = _share(cause, known, ratio * floor, start, gap)
        state, change = cause(state, own_share)
        changes.append(change)
        own_gaps.append(own_gap)
    return Withheld(state, tuple(changes), tuple(own_gaps), floor)


def _with_share(name: str, numbers: np.random.Generator, size: FloatArray) -> Caused:
    """A cause that has the same form at every share of its size."""

    def caused(state: MountingState, share: float) -> tuple[MountingState, float]:
        """State with the cause, and its change of form."""
        return with_form(state, name, deepcopy(numbers), size, share)

    return caused


def _coarse_gap(gap: Gap, state: MountingState) -> float:
    """Gap in coarse steps; a damping by a power of the speed may ask for those of a record."""
    try:
        return gap(state, COARSE)
    except ArithmeticError:
        return gap(state, FINE)


def _largest(
    cause: Caused, known: MountingState, gap: Gap, deflection: float, share: float
) -> tuple[float, float]:
    """Largest share of a cause's size that the motion bears, of halves, and its gap [m].

    Bushings that soften beyond a limit hold the housing no more: it runs away, at first to values
    that are still numbers. A gap as large as the largest deflection is no small cause's.
    """
    while True:
        try:
            own = _coarse_gap(gap, cause(known, share)[0])
        except ArithmeticError:
            own = np.inf
        if own < deflection:
            return share, own
        share *= 0.5


def _share(
    cause: Caused, known: MountingState, wanted: float, start: tuple[float, float], gap: Gap
) -> tuple[float, float]:
    """Share of the drawn size at which a cause alone leaves the wanted gap, and what it leaves.

    The gap grows with the share, more than in proportion where a cause softens: a line between the
    logarithms of the last two.
    """
    shares, gaps = [start[0]], [start[1]]
    share = start[0] * wanted / start[1]
    for _ in range(_STEPS):
        if abs(gaps[-1] / wanted - 1.0) < _TOLERANCE:
            break
        shares.append(share)
        gaps.append(_coarse_gap(gap, cause(known, share)[0]))
        rise = np.log(gaps[-1] / gaps[-2]) / np.log(shares[-1] / shares[-2])
        share *= float((wanted / gaps[-1]) ** (1.0 / np.clip(rise, 0.3, 4.0)))
    return shares[-1], gaps[-1]
