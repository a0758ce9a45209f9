"""The baseline's own refit of the mounting.

Radial stiffness and damping of both bushings, in sample and held out.

Without effects the motion is three oscillators that do not know of one another: roll, pitch, and
yaw with the axial springs. Each answers as a linear filter whose input is straight between samples:
the first-order hold of ``x'' + 2 d x' + w² x = b f`` [1]_. The filters' numbers are those of
:func:`scipy.signal.cont2discrete` bit by bit, for all oscillators at once: a refit asks for them
some forty times, and what that function checks costs ten times the algebra.

References
----------
.. [1] G. F. Franklin, J. D. Powell, M. L. Workman, "Digital Control of Dynamic Systems", 3rd ed.
   (1998), 204-206.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.signal import lfilter

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
        return self._residuals(signals, every, theta)

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
            residuals += self._residuals(signals, [run], theta)
        return residuals

    def _fitted(
        self, signals: Sequence[FloatArray], runs: Sequence[int], start: FloatArray
    ) -> FloatArray:
        """Stiffness and damping over their nominal values."""
        scale = np.concatenate([signals[run] for run in runs]).std()

        def residual(logarithms: FloatArray) -> FloatArray:
            """Misfit of the runs over their scatter."""
            theta = _parameters(logarithms)
            residuals = self._residuals(signals, runs, theta)
            return np.concatenate([block.reshape(-1) for block in residuals]) / scale

        # Logarithms need no bounds; damping hardly moves a slow record, so that a smaller
        # difference drowns in rounding.
        fitted = least_squares(
            residual, np.log(start), method="lm", xtol=1e-10, ftol=1e-12, diff_step=1e-4
        )
        return _parameters(fitted.x)

    def _residuals(
        self, signals: Sequence[FloatArray], runs: Sequence[int], theta: FloatArray
    ) -> list[FloatArray]:
        """What the baseline leaves of some runs."""
        predicted = self._predicted(runs, theta)
        return [signals[run] - signal for run, signal in zip(runs, predicted, strict=True)]

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
        predictions = []
        for run in runs:
            forces = self._forces[run]
            q = np.empty_like(forces)
            for i, (numerator, denominator) in enumerate(filters):
                q[:, i] = lfilter(numerator, denominator, forces[:, i])
            predictions.append(zeroed(q @ self.bodies.sensors[:, :3].T))
        return predictions


def _parameters(logarithms: FloatArray) -> FloatArray:
    """Parameters over their nominal values, of finite size."""
    return np.asarray(np.exp(np.clip(logarithms, -_LARGEST_LOGARITHM, _LARGEST_LOGARITHM)))


def zeroed(signals: FloatArray) -> FloatArray:
    """Signals relative to their mean at rest."""
    return np.asarray(signals - signals[: RIG["zeroing_samples"]].mean(axis=0))


def oscillator_filters(
    M: FloatArray, C: FloatArray, K: FloatArray, step: float
) -> list[tuple[FloatArray, FloatArray]]:
    """Numerator and denominator of each oscillator ``M x'' + C x' + K x = f``.

    Parameters
    ----------
    M, C, K : ndarray, shape (n,)
        Masses, damping, stiffness.
    step : float
        Sampling interval [s].

    Returns
    -------
    list of tuple of ndarray, shape (3,)
        Coefficients in powers of the delay, the denominator's first is 1.
    """
    n = len(M)
    # States are rate and displacement; behind them the force and its rise over a step.
    exponent = np.zeros((n, 4, 4))
    exponent[:, 0, 0] = -(C / M) * step
    exponent[:, 0, 1] = -(K / M) * step
    exponent[:, 0, 2] = step
    exponent[:, 1, 0] = step
    exponent[:, 2, 3] = 1.0
    over_step = expm(exponent)
    A = over_step[:, :2, :2]
    rise = over_step[:, :2, 3:]
    B = over_step[:, :2, 2:3] - rise + A @ rise
    output = np.zeros((n, 1, 2))
    output[:, 0, 1] = 1.0 / M
    through = (output @ rise)[:, 0, 0]
    poles = np.linalg.eigvals(A)
    zeros = np.linalg.eigvals(A - B @ output)
    filters = []
    for i in range(n):
        denominator = np.asarray(np.poly(poles[i]), dtype=np.float64)
        numerator = np.poly(zeros[i]) + (through[i] - 1.0) * denominator
        filters.append((np.asarray(numerator), denominator))
    return filters
