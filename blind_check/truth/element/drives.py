"""How an element is driven: multisine, noise, sweeps, sines, and free decay."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

DRIVES = ("multisine", "noise", "sweeps", "sines", "one_sine", "decay")
MULTISINE, NOISE, SWEEPS, SINES, ONE_SINE, DECAY = DRIVES

#: Stratum of the score that a drive belongs to.
STRATUM = {
    MULTISINE: "wide_band", NOISE: "wide_band", SWEEPS: "levels", SINES: "levels",
    ONE_SINE: "single_level", DECAY: "decays",
}  # fmt: skip
#: Levels of the runs; sweeps go up and down at each of two.
_LEVELS = {
    MULTISINE: (0.4, 0.7, 1.0, 1.4), NOISE: (0.4, 0.7, 1.0, 1.4), SWEEPS: (0.6, 0.6, 1.2, 1.2),
    SINES: (0.4, 0.7, 1.0, 1.4), ONE_SINE: (1.0, 1.0, 1.0),
}  # fmt: skip
#: Decays of a campaign, and the smallest start over the largest.
_DECAYS = (4, 6)
_SMALLEST_START = (0.2, 0.5)
#: Band of the drive over the natural frequency.
_BAND = (0.15, 2.5)
_LINES = {MULTISINE: 60, NOISE: 120}


@dataclass(frozen=True, eq=False)
class Lines:
    """Sum of sines that grows from rest.

    Amplitudes, frequencies [rad/s], phases, and the time of growth [s].
    """

    amplitude: FloatArray
    omega: FloatArray
    phase: FloatArray
    growth: float

    def at(self, time: FloatArray) -> FloatArray:
        """Value at evenly spaced times."""
        return phasor_sum(
            self.amplitude * np.exp(1j * (self.omega * time[0] + self.phase)),
            np.exp(1j * self.omega * (time[1] - time[0])),
            time.size,
        ) * _growth(time, self.growth)

    def scaled(self, factor: float) -> "Lines":
        """The same drive, larger."""
        return replace(self, amplitude=factor * self.amplitude)


@dataclass(frozen=True, eq=False)
class Sweep:
    """Sine whose frequency rises or falls by a constant rate of its logarithm.

    `amplitude`, `first` and `last` frequency [rad/s], `duration` [s]; `corner` frequency above
    which the amplitude falls with the square of the frequency, `growth` time [s].
    """

    amplitude: float
    first: float
    last: float
    duration: float
    corner: float
    growth: float

    def at(self, time: FloatArray) -> FloatArray:
        """Value at given times."""
        rate = np.log(self.last / self.first) / self.duration
        omega = self.first * np.exp(rate * time)
        phase = (omega - self.first) / rate
        fall = 1.0 / (1.0 + (omega / self.corner) ** 2)
        return np.asarray(self.amplitude * fall * np.sin(phase) * _growth(time, self.growth))

    def scaled(self, factor: float) -> "Sweep":
        """The same drive, larger."""
        return replace(self, amplitude=factor * self.amplitude)


@dataclass(frozen=True, eq=False)
class Release:
    """No drive: let go at a deflection, at rest."""

    deflection: float

    def at(self, time: FloatArray) -> FloatArray:
        """No force."""
        return np.zeros_like(time)

    def scaled(self, factor: float) -> "Release":
        """From further out."""
        return replace(self, deflection=factor * self.deflection)


Drive = Lines | Sweep | Release


def drawn_drives(
    rng: np.random.Generator,
    kind: str,
    *,
    omega: float,
    duration: float,
    growth: float,
    by_force: bool,
) -> tuple[Drive, ...]:
    """Drives of all runs, of no certain size but in the proportions of their levels.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    kind : str
        One of DRIVES.
    omega : float
        Natural frequency of the element [rad/s].
    duration : float
        Duration of a run [s].
    growth : float
        Time in which a drive grows [s].
    by_force : bool
        A flat force, or a deflection that falls above the natural frequency.

    Returns
    -------
    tuple of Drive
        One a run.
    """
    if kind == DECAY:
        n = int(rng.integers(*_DECAYS, endpoint=True))
        return tuple(Release(float(q)) for q in np.geomspace(rng.uniform(*_SMALLEST_START), 1.0, n))
    levels = _LEVELS[kind]
    if kind == SWEEPS:
        corner = np.inf if by_force else omega
        low, high = _BAND[0] * omega, _BAND[1] * omega
        return tuple(
            Sweep(level, *((low, high) if k % 2 == 0 else (high, low)), duration, corner, growth)
            for k, level in enumerate(levels)
        )
    if kind in (SINES, ONE_SINE):
        # Off the resonance, where a force drive would say nothing but its height.
        at = omega * rng.uniform(0.4, 0.85) if rng.integers(2) else omega * rng.uniform(1.1, 1.4)
        return tuple(
            Lines(np.array([level]), np.array([at]), rng.uniform(0.0, 6.3, 1), growth)
            for level in levels
        )
    return tuple(_wide_band(rng, kind, omega, growth, by_force).scaled(level) for level in levels)


def drive_motion(drive: Drive, step: float, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value of a drive and its first two derivatives at n steps, by central differences.

    Of fourth order: at 768 steps a period of the natural frequency the error is below 1e-7.
    """
    q = drive.at(step * np.arange(-2.0, n + 2.0))
    before_2, before, middle, after, after_2 = (q[k : k + n] for k in range(5))
    speed = (8.0 * (after - before) - (after_2 - before_2)) / (12.0 * step)
    acceleration = (16.0 * (after + before) - (after_2 + before_2) - 30.0 * middle) / (
        12.0 * step**2
    )
    return middle, speed, acceleration


def _wide_band(
    rng: np.random.Generator, kind: str, omega: float, growth: float, by_force: bool
) -> Lines:
    """Multisine of equal lines, or noise: lines of random height."""
    n = _LINES[kind]
    lines = omega * np.linspace(*_BAND, n) * (1.0 + 1e-3 * rng.standard_normal(n))
    amplitude = np.ones(n) if kind == MULTISINE else rng.rayleigh(size=n)
    if not by_force:
        amplitude = amplitude / (1.0 + (lines / omega) ** 2)
    return Lines(amplitude / np.sqrt(n), lines, rng.uniform(0.0, 2.0 * np.pi, n), growth)


def _growth(time: FloatArray, growth: float) -> FloatArray:
    s = np.clip(time / growth, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


@njit(cache=True)
def phasor_sum(turn: NDArray[np.complex128], advance: NDArray[np.complex128], n: int) -> FloatArray:
    """Real part of the sum of turning phasors at n steps.

    Parameters
    ----------
    turn, advance : ndarray, shape (n_lines,)
        Phasors at the first step and their turn in one step.
    n : int
        Steps.

    Returns
    -------
    ndarray, shape (n,)
        Sum.
    """
    result = np.zeros(n)
    for line in range(turn.size):
        z = turn[line]
        for k in range(n):
            result[k] += z.real
            z *= advance[line]
    return result


def largest_value(signals: Sequence[FloatArray]) -> float:
    """Largest absolute value of several signals."""
    return max(float(np.abs(signal).max()) for signal in signals)
