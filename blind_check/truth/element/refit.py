"""The baseline's own refit of an element.

Mass, spring, damper and constant force, in sample and held out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter

from carrierflex.blind_check.truth.linear_refit import LinearBaseline

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Refit:
    """What is left of each run after a refit to all runs, and after one to the other runs.

    Shape (n,) each.
    """

    residuals: list[FloatArray]
    held_out: list[FloatArray]


def driven_refit(
    motions: Sequence[tuple[FloatArray, ...]], signals: Sequence[FloatArray], *, settle: int
) -> Refit:
    """Refit of a driven element: force linear in deflection, rate, second rate and one."""
    columns = [np.array([*motion, np.ones_like(motion[0])]).T[settle:] for motion in motions]
    baseline = LinearBaseline(columns, own_offset=False)
    rows = [signal[None, settle:] for signal in signals]
    return Refit(
        [series[0] for series in baseline.residuals(rows)],
        [series[0] for series in baseline.held_out(rows)],
    )


@dataclass(frozen=True, eq=False)
class ForcedRefit:
    """Refit of a mass on an element under a force.

    Its response with straight lines between finely sampled forces.

    `forces` by run at `fine` times the samples, `step` of the fine samples [s], `start` mass,
    stiffness, damping, constant force.
    """

    forces: Sequence[FloatArray]
    signals: Sequence[FloatArray]
    step: float
    fine: int
    start: FloatArray
    settle: int

    def refit(self) -> Refit:
        """Residuals after a refit to all runs, and to the other runs.

        One run is scored by itself.
        """
        every = list(range(len(self.signals)))
        theta = self._fitted(every, np.ones(4))
        residuals = [self._left(run, theta) for run in every]
        if len(every) == 1:
            return Refit(residuals, residuals)
        held_out = [
            self._left(run, self._fitted([k for k in every if k != run], theta)) for run in every
        ]
        return Refit(residuals, held_out)

    def _fitted(self, runs: list[int], start: FloatArray) -> FloatArray:
        scale = np.concatenate([self.signals[run] for run in runs]).std()

        def residual(theta: FloatArray) -> FloatArray:
            """Misfit of the runs over their scatter."""
            return np.concatenate([self._left(run, theta) for run in runs]) / scale

        lowest = [1e-3, 1e-3, 1e-3, -np.inf]
        solution = least_squares(
            residual,
            start,
            bounds=(lowest, np.inf),
            x_scale="jac",
            diff_step=1e-6,
            xtol=1e-9,
            ftol=1e-11,
            gtol=1e-12,
        )
        return np.asarray(solution.x)

    def _left(self, run: int, theta: FloatArray) -> FloatArray:
        mass, stiffness, damping = self.start[:3] * theta[:3]
        # The constant force in units of the force that moves the spring by the size of the signal.
        constant = self.start[3] * theta[3]
        system = ([1.0], [mass, damping, stiffness])
        numerator, denominator, _ = cont2discrete(system, self.step, method="foh")
        predicted = lfilter(numerator.reshape(-1), denominator, self.forces[run] - constant)[
            :: self.fine
        ]
        return np.asarray((self.signals[run] - predicted)[self.settle :])
