"""One case of the kind "element": an element under its drives, without causes and with them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter

from carrierflex.blind_check.truth.element.drawing import smaller
from carrierflex.blind_check.truth.element.drives import DECAY, Drive
from carrierflex.blind_check.truth.element.element import FINE, Element
from carrierflex.blind_check.truth.element.reference import Reference, reference_motion
from carrierflex.blind_check.truth.linear_refit import LinearBaseline

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
            settled = [columns[::FINE][self.settle :] for columns in motions]
            return lambda signals: _driven_residuals(
                settled, [signal[self.settle :] for signal in signals]
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


def _driven_residuals(
    columns: Sequence[FloatArray], signals: Sequence[FloatArray]
) -> list[FloatArray]:
    """What is left of driven elements, whose force is linear in the baseline's parameters."""
    baseline = LinearBaseline(columns, own_offset=False)
    return [series[0] for series in baseline.residuals([signal[None] for signal in signals])]


@dataclass(frozen=True, eq=False)
class ForcedRefit:
    """Refit of a mass on an element under a force, with straight lines between fine samples.

    `forces` by run at `fine` times the samples, `step` of the fine samples [s], `start` mass,
    stiffness, damping, constant force; `settle` samples do not count.
    """

    forces: Sequence[FloatArray]
    step: float
    fine: int
    start: FloatArray
    settle: int

    def residuals(self, signals: Sequence[FloatArray]) -> list[FloatArray]:
        """What is left after Gauss-Newton steps with the response's exact sensitivities.

        Parameters
        ----------
        signals : sequence of ndarray, shape (n,)
            Deflections.

        Returns
        -------
        list of ndarray, shape (n - settle,)
            Residuals.
        """
        theta = self.start.copy()
        remaining, columns = self._linearised(theta, signals)
        for _ in range(30):
            target, matrix = np.concatenate(remaining), np.concatenate(columns)
            size = np.linalg.norm(matrix, axis=0)
            # Where the refit runs away, to a mass that stands still, no parameter moves it.
            size[size == 0.0] = 1.0
            # At one frequency mass and spring are one parameter: the shortest step then.
            change = np.linalg.lstsq(matrix / size, target, rcond=1e-7)[0] / size
            cost = float(target @ target)
            for share in (1.0, 0.5, 0.25, 0.1, 0.03):
                trial = theta + share * change
                if (trial[:3] <= 0.0).any():
                    continue
                trial_remaining, trial_columns = self._linearised(trial, signals)
                if sum(float(run @ run) for run in trial_remaining) < cost:
                    break
            else:
                return remaining
            gain = cost - sum(float(run @ run) for run in trial_remaining)
            theta = trial
            remaining = trial_remaining
            columns = trial_columns
            if gain <= 1e-6 * cost:
                return remaining
        return remaining

    def _linearised(
        self, theta: FloatArray, signals: Sequence[FloatArray]
    ) -> tuple[list[FloatArray], list[FloatArray]]:
        """Residuals and the response's derivatives to mass, stiffness, damping, constant force."""
        mass, stiffness, damping, constant = theta
        system = ([1.0], [mass, damping, stiffness])
        numerator, denominator, _ = cont2discrete(system, self.step, method="foh")
        numerator = numerator.reshape(-1)
        remaining, columns = [], []
        for force, signal in zip(self.forces, signals, strict=True):
            x = lfilter(numerator, denominator, force - constant)
            v = np.gradient(x, self.step)
            causes = np.array([np.gradient(v, self.step), x, v, np.ones_like(x)])
            slopes = -lfilter(numerator, denominator, causes, axis=-1)
            remaining.append((signal - x[:: self.fine])[self.settle :])
            columns.append(slopes[:, :: self.fine].T[self.settle :])
        return remaining, columns


@dataclass(frozen=True, eq=False)
class DecayRefit:
    """Refit of free decays: one frequency, damping and position of rest, own starts.

    `step` of the samples [s], `omega`, `ratio` natural frequency [rad/s] and damping ratio to start
    from.
    """

    step: float
    omega: float
    ratio: float

    def residuals(self, signals: Sequence[FloatArray]) -> list[FloatArray]:
        """What is left.

        Parameters
        ----------
        signals : sequence of ndarray, shape (n,)
            Deflections.

        Returns
        -------
        list of ndarray, shape (n,)
            Residuals.
        """
        scale = np.concatenate(signals).std()

        def residual(theta: FloatArray) -> FloatArray:
            return np.concatenate(self._residuals(signals, theta)) / scale

        solution = least_squares(
            residual, [1.0, 1.0], bounds=([0.3, 0.01], [3.0, 100.0]), x_scale=[0.01, 0.3]
        )
        return self._residuals(signals, np.asarray(solution.x))

    def _residuals(self, signals: Sequence[FloatArray], theta: FloatArray) -> list[FloatArray]:
        """Residuals at a frequency and a damping, over those to start from."""
        swings = [self._swing(signal.size, theta) for signal in signals]
        moved, one = [], []
        for signal, swing in zip(signals, swings, strict=True):
            both = np.array([signal, np.ones(signal.size)]).T
            remaining = both - swing @ np.linalg.lstsq(swing, both, rcond=None)[0]
            moved.append(remaining[:, 0])
            one.append(remaining[:, 1])
        # The position of rest is that of all runs, the start of each its own.
        rests = np.concatenate(one)
        rest = float(np.concatenate(moved) @ rests / (rests @ rests))
        return [signal - rest * column for signal, column in zip(moved, one, strict=True)]

    def _swing(self, n: int, theta: FloatArray) -> FloatArray:
        omega = self.omega * theta[0]
        ratio = min(self.ratio * theta[1], 0.99)
        time = self.step * np.arange(n)
        turn = omega * np.sqrt(1.0 - ratio**2) * time
        return np.exp(-ratio * omega * time)[:, None] * np.array([np.cos(turn), np.sin(turn)]).T
