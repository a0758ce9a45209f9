"""Shaft orders of the rim signals of one revolution.

And which orders and sensor patterns are kept.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Sensor patterns m, in the order of every array that has a pattern axis.
PATTERNS = (0, 1, -1, 2)
#: Four sensors count as 90 deg apart within this error [rad] (half a degree); more would smear the
#: patterns.
_ANGLE_TOLERANCE = np.deg2rad(0.5)
#: Highest order that is looked for above half the samples of a turn, and samples in which it is.
_HIGHEST_ALIASED, _MOST_SAMPLES = 300, 100_000
#: Its power over that of any order below, of the best order of every run, and of white noise.
_CLEARLY, _IN_EVERY_RUN, _SURE = 2.0, 0.9, 30.0


def highest_order(n_planets: int) -> int:
    """Highest order that is kept of a carrier's signals: 12 of three planets.

    Pins bend the rim in the orders n and 2 n of n planets; twice the second shows what stands
    beside them.
    """
    return 4 * n_planets


@dataclass(frozen=True, eq=False)
class OrderFit:
    """Fit of the orders 0 to the highest to samples of one revolution, for any signals there.

    Parameters
    ----------
    theta : ndarray, shape (n,)
        Carrier angle [rad].
    highest : int
        Highest order.

    Notes
    -----
    Least squares against the measured angle. It does the work of resampling to equal angle and a
    Fourier transform without interpolation between samples; a missing sample is simply absent.
    """

    theta: FloatArray
    highest: int

    @cached_property
    def is_too_sparse(self) -> bool:
        """Whether the samples leave too large a gap for the highest order."""
        return too_sparse(self.theta, self.highest)

    def amplitudes(self, rows: FloatArray) -> tuple[NDArray[np.complex128], FloatArray]:
        """Complex amplitude of every order of every row: ``row = Re(sum_n Y(n) exp(j n theta))``.

        Parameters
        ----------
        rows : ndarray, shape (k, n)
            Signals, without missing samples.

        Returns
        -------
        orders : ndarray of complex, shape (highest + 1, k)
            Amplitudes.
        scatter : ndarray, shape (2,)
            Sum of squares of the first row about its orders, and its degrees of freedom.
        """
        design, solved = self._solved
        solution = solved @ rows.T
        residual = rows[0] - design @ solution[:, 0]
        n = self.highest + 1
        sines = np.vstack([np.zeros(len(rows)), solution[n:]])
        scatter = np.array([residual @ residual, self.theta.size - design.shape[1]])
        return solution[:n] - 1j * sines, scatter

    @cached_property
    def _solved(self) -> tuple[FloatArray, FloatArray]:
        """Waves at the samples, shape (n, m), and the solution by least squares, shape (m, n)."""
        phase = np.outer(self.theta, np.arange(1, self.highest + 1))
        design = np.hstack([np.ones((self.theta.size, 1)), np.cos(phase), np.sin(phase)])
        return design, np.linalg.solve(design.T @ design, design.T)


def too_sparse(angle: FloatArray, max_order: int) -> bool:
    """Whether the samples of a revolution leave too large a gap for the highest order.

    Too large is more than half its period.
    """
    if angle.size < 2 * max_order + 2:
        return True
    angle_sorted = np.sort(np.mod(angle, 2.0 * np.pi))
    gaps = np.diff(angle_sorted, append=angle_sorted[0] + 2.0 * np.pi)
    return bool(gaps.max() > np.pi / max_order)


def are_quarter_turns(sensor_angles: FloatArray) -> bool:
    """Whether sensors are four, 90 deg apart."""
    angle_sorted = np.sort(np.mod(sensor_angles, 2.0 * np.pi))
    gaps = np.diff(angle_sorted, append=angle_sorted[:1] + 2.0 * np.pi)
    return bool(angle_sorted.size == 4 and np.abs(gaps - np.pi / 2.0).max() <= _ANGLE_TOLERANCE)


def aliased_order(records: Iterable[tuple[FloatArray, FloatArray]]) -> int:
    """Order of a shaft above half the samples of a turn; 0 where there is none.

    Read too seldom it looks like a slower motion, but keeps ``exp(i n theta)`` at the samples: at
    another speed, with other samples of a turn, it is another slow order. One that all runs show as
    the same slow order is none.

    Parameters
    ----------
    records : iterable of (ndarray, ndarray)
        Signals of one run, shape (n, k), and the shaft's angle [rad], shape (n,).
    """
    runs: list[tuple[FloatArray, FloatArray]] = []
    for signals, angle in records:
        if np.ptp(angle) > 0.0 and sum(angle.size for _, angle in runs) < _MOST_SAMPLES:
            runs.append((signals, angle))
    turns = np.array([np.ptp(angle) / (2.0 * np.pi) for _, angle in runs])
    samples = np.array([angle.size for _, angle in runs]) / turns
    resolved = int(0.5 * samples.max(initial=0.0)) + 1
    if not 1 < resolved <= _HIGHEST_ALIASED:
        return 0
    of_runs = np.array([_power_of_orders(*run) for run in runs])
    power, best = of_runs.sum(axis=0), float(of_runs.max(axis=1).sum())
    noise = sum(float(signals.var(axis=0).sum()) for signals, _ in runs)
    order = resolved + int(np.argmax(power[resolved:]))
    slow = np.abs(order - samples * np.round(order / samples))
    least = max(_CLEARLY * float(power[:resolved].max()), _IN_EVERY_RUN * best, _SURE * noise)
    return order if power[order] > least and np.ptp(slow) * turns.max() > 1.0 else 0


def _power_of_orders(signals: FloatArray, angle: FloatArray) -> FloatArray:
    """Power of signals without their means at the orders 0 to the highest."""
    centred = signals - signals.mean(axis=0)
    power = np.zeros(_HIGHEST_ALIASED + 1)
    step = np.exp(-1j * angle)
    wave = np.ones(angle.size, dtype=np.complex128)
    for order in range(1, power.size):
        wave *= step
        power[order] = float(np.sum(np.abs(wave @ centred) ** 2)) / angle.size
    return power
