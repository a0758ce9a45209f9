"""Motion under one steady line: its harmonics, whose heights change slowly.

A force of one frequency moves the element at whole multiples of it. Least squares over a whole
record know each of them to the noise of thousands of samples, where a filter lets the noise of all
lines of its band through: of the harmonics that curved columns turn on it keeps the largest alone,
and the acceleration of the noise between them makes the mass too small.
"""

from dataclasses import dataclass, replace
from math import comb

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.motion.nearest_motion import (
    Motion,
    is_one_line,
    nearest_motion,
)
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.estimation.scaled_least_squares import normal_solution

#: Harmonics that are sought at most, and the share of half the sampling frequency below which.
_HARMONICS, _WIDEST = 12, 0.9
#: Heights of harmonics: polynomials of time of so many terms.
_TERMS = 3
#: Samples for each coefficient at least.
_SAMPLES_EACH = 8
#: Square of a harmonic over that of the noise in as many coefficients, from which it is kept: noise
#: reaches it once in two thousand harmonics (chi-squared of six degrees of freedom).
_CLEAR = 4.0
#: Square of what the harmonics leave, over that of the noise, up to which it is noise; beyond it
#: the frequencies that stand so many times above the noise are motion too.
_IS_NOISE, _BESIDE_HARMONICS = 1.15, 3.0
#: Samples that are worked on at once: a long record is not held as columns.
_AT_ONCE = 65_536
#: Corrections of the frequency by the turn of its phase between the halves of a record.
_PASSES = 4


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """Harmonics of a run.

    Parameters
    ----------
    motion : tuple of ndarray, shape (n,)
        Deflection, speed and acceleration of the harmonics.
    inside : ndarray of bool, shape (n,)
        Samples from the first to the last that counts; outside the heights are a guess.
    """

    motion: Motion
    inside: NDArray[np.bool_]


def with_harmonics(
    model: ElementModel, record: ElementRecord, nearest: Motion, variance: float
) -> tuple[ElementRecord, Motion, Motion | None]:
    """Run whose motion is that of its harmonics where a force of one line drives it.

    Where the harmonics leave more than noise (a transient, a subharmonic) what stands clear of the
    noise beside them is motion as well.

    Parameters
    ----------
    model : ElementModel
        Element.
    record : ElementRecord
        Run.
    nearest : tuple of ndarray, shape (n,)
        Motion nearest to the true one by frequencies alone.
    variance : float
        Variance of the channel's noise.

    Returns
    -------
    tuple of (ElementRecord, Motion, Motion or None)
        Run, motion, and what was measured beside it; the run and `nearest` as they are, and None,
        under any other drive.
    """
    is_driven = model.by_force and not record.is_released and record.gap is None
    steady = steady_motion(record) if is_driven and is_one_line(record) else None
    if steady is None:
        return record, nearest, None
    left = np.where(steady.inside, record.response - steady.motion[0], 0.0)
    found = _inside(steady, steady.motion, nearest)
    if np.mean(left[record.block >= 0] ** 2) > _IS_NOISE * variance:
        beside, _ = nearest_motion(
            model, replace(record, response=left), variance, clear=_BESIDE_HARMONICS
        )
        x, v, a = (own + more for own, more in zip(found, beside, strict=True))
        found = x, v, a
    motion = _inside(steady, found, record.motion)
    x, v, a = (measured - own for measured, own in zip(record.motion, motion, strict=True))
    return replace(record, motion=motion), found, (x, v, a)


def _inside(steady: SteadyMotion, values: Motion, others: Motion) -> Motion:
    """Values inside the span of the harmonics, others outside it."""
    x, v, a = (
        np.where(steady.inside, own, other) for own, other in zip(values, others, strict=True)
    )
    return x, v, a


def steady_motion(record: ElementRecord) -> SteadyMotion | None:
    """Harmonics of the line that drives a run, by least squares over the samples that count.

    Parameters
    ----------
    record : ElementRecord
        Run under a force of one line.

    Returns
    -------
    SteadyMotion or None
        Those that stand clear of the noise; None where the samples are too few for the first.
    """
    counted = np.flatnonzero(record.block >= 0)
    span = slice(int(counted[0]), int(counted[-1]) + 1)
    omega = frequency_of_line(record.drive[span], record.step)
    highest = min(
        int(_WIDEST * np.pi / (record.step * omega)),
        counted.size // (2 * _TERMS * _SAMPLES_EACH),
        _HARMONICS,
    )
    if highest < 1:
        return None
    basis = _Basis(omega, record.step, float(counted[0]), float(counted[-1]), highest)
    q = record.response
    gram, right = basis.products(q, counted)
    every = np.ones(right.size, dtype=bool)
    c = _solved(gram, right, every)
    noise = basis.square_left(q, counted, c) / counted.size
    kept = every.copy()
    for own in basis.harmonics():
        square = float(c[own] @ gram[own, own] @ c[own])
        kept[own] = square > _CLEAR * noise * (own.stop - own.start)
    inside = np.zeros(q.size, dtype=bool)
    inside[span] = True
    return SteadyMotion(basis.motion(q.size, _solved(gram, right, kept)), inside)


def _solved(gram: FloatArray, right: FloatArray, kept: NDArray[np.bool_]) -> FloatArray:
    """Coefficients of the columns that are kept; those of the others are zero."""
    c = np.zeros(right.size)
    c[kept] = normal_solution(gram[np.ix_(kept, kept)], right[kept])
    return c


def frequency_of_line(drive: FloatArray, step: float) -> float:
    """Frequency [rad/s] of the strongest line of a drive.

    The highest line of the spectrum, corrected until its phase is that of both halves.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Evenly sampled.
    step : float
        Sampling interval [s].
    """
    n = drive.size
    level = drive - drive.mean()
    spectrum = np.abs(np.fft.rfft(level * np.hanning(n), 2 * n))
    omega = 2.0 * np.pi * int(np.argmax(spectrum[1:]) + 1) / (2 * n * step)
    half = n // 2
    time = step * np.arange(n)
    window = np.hanning(half)
    apart = step * (n - half)
    for _ in range(_PASSES):
        turning = level * np.exp(-1j * omega * time)
        first, second = window @ turning[:half], window @ turning[-half:]
        omega += float(np.angle(second * np.conj(first))) / apart
    return omega


@dataclass(frozen=True)
class _Basis:
    """A constant and harmonics times powers of time from -1 to 1 over the samples that count.

    Parameters
    ----------
    omega, step : float
        Frequency [rad/s], sampling interval [s].
    first, last : float
        Samples that count, from and to.
    highest : int
        Number of harmonics.
    """

    omega: float
    step: float
    first: float
    last: float
    highest: int

    @property
    def size(self) -> int:
        """Number of columns."""
        return 1 + 2 * _TERMS * self.highest

    def harmonics(self) -> list[slice]:
        """Places of the columns of each harmonic."""
        width = 2 * _TERMS
        return [slice(1 + k * width, 1 + (k + 1) * width) for k in range(self.highest)]

    def columns(self, places: NDArray[np.int64], order: int = 0) -> FloatArray:
        """Derivative of some order of every column at some samples, shape (n_columns, n)."""
        half = 0.5 * (self.last - self.first)
        u = (places - 0.5 * (self.first + self.last)) / half
        rate = 1.0 / (half * self.step)
        P = [
            polyval(u, polyder(np.eye(_TERMS), derivative)) * rate**derivative
            for derivative in range(order + 1)
        ]
        rows = np.empty((self.size, u.size))
        rows[0] = 1.0 if order == 0 else 0.0
        for k, own in enumerate(self.harmonics(), start=1):
            turn = 1j * k * self.omega
            # Product rule: (P e)'' = P'' e + 2 P' e' + P e''.
            heights = sum(comb(order, j) * P[j] * turn ** (order - j) for j in range(order + 1))
            wave = heights * np.exp(turn * self.step * places)
            rows[own] = np.concatenate([wave.real, wave.imag])
        return rows

    def products(self, q: FloatArray, counted: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
        """Products of the columns with each other and with a signal, over what counts."""
        gram, right = np.zeros((self.size, self.size)), np.zeros(self.size)
        for places in _pieces(counted):
            rows = self.columns(places)
            gram += rows @ rows.T
            right += rows @ q[places]
        return gram, right

    def square_left(self, q: FloatArray, counted: NDArray[np.int64], c: FloatArray) -> float:
        """Square of a signal less its columns, over the samples that count."""
        return sum(
            float(np.sum((q[places] - c @ self.columns(places)) ** 2))
            for places in _pieces(counted)
        )

    def motion(self, n: int, c: FloatArray) -> Motion:
        """Deflection, speed and acceleration at n samples."""
        found = np.empty((3, n))
        for places in _pieces(np.arange(n)):
            for order in range(3):
                found[order, places] = c @ self.columns(places, order)
        return found[0], found[1], found[2]


def _pieces(places: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    return [places[k : k + _AT_ONCE] for k in range(0, places.size, _AT_ONCE)]
