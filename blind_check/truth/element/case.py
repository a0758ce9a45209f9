"""One case of the kind "element": an element under its drives, without causes and with them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.element.drawing import smaller
from carrierflex.blind_check.truth.element.drives import DECAY, Drive
from carrierflex.blind_check.truth.element.element import FINE, Element
from carrierflex.blind_check.truth.element.reference import Reference, reference_motion
from carrierflex.blind_check.truth.element.refit import (
    DecayRefit,
    ForcedRefit,
    driven_residuals,
)

FloatArray = NDArray[np.float64]

_SAMPLES = 2400
#: A decay is recorded until it has fallen to this share of its start, for so many samples at most.
_DECAYED, _LONGEST_DECAY = 0.01, 1200
_SETTLE = 300
#: A cause under which the motion grows beyond this many times the plain one is made smaller.
_LARGEST_MOTION = 4.0
_SMALLER = 0.6
_TRIALS = 12


@dataclass(frozen=True, eq=False)
class ElementCase:
    """Drives of a case, its element without causes and with them, and the changes of form."""

    drive: str
    drives: tuple[Drive, ...]
    plain: Element
    element: Element
    reference: Reference
    changes: tuple[float, ...]

    @property
    def n(self) -> int:
        """Samples of a run."""
        return samples(self.drive, self.plain)

    @property
    def settle(self) -> int:
        """Samples of a run that do not count."""
        return 0 if self.drive == DECAY else _SETTLE

    @cached_property
    def recorded(self) -> list[FloatArray]:
        """Deflection of every run with all causes, at the truth's own steps; under a force."""
        return [self.element.motion(drive, run, self.n) for run, drive in enumerate(self.drives)]

    @cached_property
    def channels(self) -> list[FloatArray]:
        """Channel of every run with all causes, without noise."""
        if not self.plain.by_force:
            return self.signals(self.element)
        return [self.element.sensed(q, self.n) for q in self.recorded]

    def signals(self, element: Element) -> list[FloatArray]:
        """Channel of every run of another element, without noise."""
        return [element.channel(drive, run, self.n) for run, drive in enumerate(self.drives)]

    @cached_property
    def baseline(self) -> Callable[[Sequence[FloatArray]], list[FloatArray]]:
        """What the baseline's own refit leaves; constant gains change its parameters only."""
        plain = self.plain
        if self.drive == DECAY:
            return DecayRefit(plain.step, plain.omega, plain.damping_ratio).residuals
        if not plain.by_force:
            motions = [reference_motion(plain, drive, self.n).columns for drive in self.drives]
            kept = [columns[::FINE][self.settle :] for columns in motions]
            return lambda signals: driven_residuals(
                kept, [signal[self.settle :] for signal in signals]
            )
        fine = 8
        time = plain.step / fine * np.arange((self.n - 1.0) * fine + 1.0)
        forces = [drive.at(time) for drive in self.drives]
        return ForcedRefit(forces, plain.step / fine, fine, plain.base, self.settle).residuals


def samples(drive: str, plain: Element) -> int:
    """Samples of a run; whoever releases an element records until it has all but stopped."""
    if drive != DECAY:
        return _SAMPLES
    time = -np.log(_DECAYED) / (plain.damping_ratio * plain.omega)
    return min(round(time / plain.step), _LONGEST_DECAY)


def settling_time(plain: Element) -> float:
    """Time [s] of the samples of a run that do not count."""
    return _SETTLE * plain.step


def _is_bounded(case: ElementCase) -> bool:
    """Whether a motion under a force stays within some times that of the plain element."""
    values = np.array(case.channels)
    largest = _LARGEST_MOTION * case.reference.scale[0]
    is_within = not case.plain.by_force or np.abs(values).max() <= largest
    return bool(np.isfinite(values).all() and is_within)


def bounded(case: ElementCase) -> ElementCase:
    """Case whose causes are smaller until no motion runs away.

    Raises
    ------
    ArithmeticError
        Where twelve reductions do not bound it.
    """
    for _ in range(_TRIALS):
        if _is_bounded(case):
            return case
        case = replace(case, element=smaller(case.element, _SMALLER))
    raise ArithmeticError(
        f"the motion grows without bound after {_TRIALS} reductions; expected a softer cause"
    )
