"""The baseline's own refit of the mounting.

Radial stiffness and damping of both bushings, in sample and held out.

Without effects the motion is three oscillators that do not know of one another: roll, pitch, and
yaw with the axial springs. Each answers as a linear filter whose input is straight between samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import lfilter

from carrierflex.blind_check.truth.mounting.oscillator_filters import oscillator_filters
from carrierflex.blind_check.truth.mounting.rig import RIG, Bodies

FloatArray = NDArray[np.float64]

#: Largest logarithm of a parameter over its nominal value: bushings that hold still whatever acts.
#: Motions that run away ask for ever stiffer ones, beyond all numbers.
_LARGEST_LOGARITHM = 25.0


@dataclass(frozen=True, eq=False)
class MountingRefit:
    """Refit of K1 and C1 to zeroed signals.

    Parameters
    ----------
    bodies : Bodies
        Rig.
    loads : sequence of ndarray, shape (n, 3)
        Measured torque, ntl_y, ntl_z of each run.
    step : float
        Sampling interval [s].
    """

    bodies: Bodies
    loads: Sequence[FloatArray]
    step: float

    def residuals(self, signals: Sequence[FloatArray]) -> list[FloatArray]:
        """What a refit to all runs leaves of the signals, each shape (n, 6)."""
        every = list(range(len(signals)))
        theta = self._fitted(signals, every, np.ones(2))
        return self._left(signals, every, theta)

    def held_out(self, signals: Sequence[FloatArray]) -> list[FloatArray]:
        """What is left of each run after a refit to the other runs.

        One run alone is fitted to itself.
        """
        if len(signals) == 1:
            return self.residuals(signals)
        residuals, every = [], list(range(len(signals)))
        start = self._fitted(signals, every, np.ones(2))
        for run in every:
            theta = self._fitted(signals, [other for other in every if other != run], start)
            residuals += self._left(signals, [run], theta)
        return residuals

    def _fitted(
        self, signals: Sequence[FloatArray], runs: Sequence[int], start: FloatArray
    ) -> FloatArray:
        """Stiffness and damping over their nominal values."""
        scale = np.concatenate([signals[run] for run in runs]).std()

        def residual(logarithms: FloatArray) -> FloatArray:
            """Misfit of the runs over their scatter."""
            theta = _parameters(logarithms)
            left = self._left(signals, runs, theta)
            return np.concatenate([own.reshape(-1) for own in left]) / scale

        # Logarithms need no bounds; damping hardly moves a slow record, so that a smaller
        # difference drowns in rounding.
        fitted = least_squares(
            residual, np.log(start), method="lm", xtol=1e-10, ftol=1e-12, diff_step=1e-4
        )
        return _parameters(fitted.x)

    def _left(
        self, signals: Sequence[FloatArray], runs: Sequence[int], theta: FloatArray
    ) -> list[FloatArray]:
        """What the baseline leaves of some runs."""
        predicted = self._predicted(runs, theta)
        return [signals[run] - own for run, own in zip(runs, predicted, strict=True)]

    def _filters(self, theta: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Numerator and denominator of the three oscillators, the same in every run."""
        radial, axial = (
            np.sum(rows[:, :3] ** 2, axis=0) for rows in (self.bodies.radial, self.bodies.axial)
        )
        K = (
            theta[0] * RIG["bushing_radial_stiffness"] * radial
            + RIG["bushing_axial_stiffness"] * axial
        )
        C = theta[1] * RIG["bushing_radial_damping"] * radial + RIG["bushing_axial_damping"] * axial
        return oscillator_filters(np.diag(self.bodies.M)[:3], C, K, self.step)

    @cached_property
    def _forces(self) -> list[FloatArray]:
        """Generalised forces of every run, each shape (n, 3)."""
        return [loads @ self.bodies.loads[:3].T for loads in self.loads]

    def _predicted(self, runs: Sequence[int], theta: FloatArray) -> list[FloatArray]:
        """Zeroed signals of the baseline in some runs."""
        filters = self._filters(theta)
        found = []
        for run in runs:
            forces = self._forces[run]
            q = np.empty_like(forces)
            for i, (numerator, denominator) in enumerate(filters):
                q[:, i] = lfilter(numerator, denominator, forces[:, i])
            found.append(zeroed(q @ self.bodies.sensors[:, :3].T))
        return found


def _parameters(logarithms: FloatArray) -> FloatArray:
    """Parameters over their nominal values, of finite size."""
    return np.asarray(np.exp(np.clip(logarithms, -_LARGEST_LOGARITHM, _LARGEST_LOGARITHM)))


def zeroed(signals: FloatArray) -> FloatArray:
    """Signals relative to their mean at rest."""
    return np.asarray(signals - signals[: RIG["zeroing_samples"]].mean(axis=0))
