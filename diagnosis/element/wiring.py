"""Errors of sign and clock of an element's records, and its records with their baseline.

A baseline that is fitted to signals many shares of a period late ends in another minimum, whose
prediction shows no delay. A linear element is least squares in force space, so that very many
delays can be tried there without a fit of the baseline.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, rfft
from scipy.optimize import minimize

from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.wiring.refits import (
    TORQUE_SIGN,
    ClockDrift,
    WiringRival,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import sample_of
from carrierflex.identification.estimation.scaled_least_squares import normal_inverse

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Delays and drifts that are tried, in steps of time, to either side; of a delay that all runs
#: share how finely.
_MOST_STEPS, _PER_STEP = 30, 4
#: How finely the best of them is sought, in steps, and values at most.
_FINE = {"xatol": 1e-2, "maxiter": 80}
#: Share of the square without a delay that the best one may leave.
_BETTER = 0.5


@dataclass(frozen=True, eq=False)
class _DriveLines:
    """Lines of one run's drive that are used, which no delay of the response changes."""

    window: FloatArray  # Shape (n,)
    used: NDArray[np.bool_]  # Shape (n // 2 + 1,)
    omega: FloatArray  # [rad/s], shape (n_lines,)
    spectrum: ComplexArray  # Shape (n_lines,)


@dataclass(frozen=True, eq=False)
class _Spectra:
    """Products of one run's spectra, the size of its force taken as one; lines 1 to n_lines.

    `n` samples make the spectra; `cross` has shape (n_lines, 3).
    """

    n: int
    omega: FloatArray
    gram: FloatArray
    cross: ComplexArray

    def late(self, delay: float) -> FloatArray:
        """Products with the force where the response was late by a delay [s], shape (1, 3)."""
        return np.asarray((np.exp(-1j * delay * self.omega) @ self.cross).real)[None]

    def late_by_each(self, delays: FloatArray) -> FloatArray:
        """The same for evenly spaced delays [s], shape (n_delays, 3)."""
        phase = np.exp(-1j * delays[0] * self.omega)
        turn = np.exp(-1j * (delays[1] - delays[0]) * self.omega)
        products = np.empty((delays.size, 3))
        for product in products:
            product[:] = (phase @ self.cross).real
            phase *= turn
        return products

    def late_by_steps(self) -> FloatArray:
        """The same for delays of whole steps, as many as are tried, shape (n_delays, 3).

        The sums over the lines are then one inverse transform.
        """
        lines = np.zeros((3, self.n // 2 + 1), dtype=np.complex128)
        lines[:, 1 : len(self.cross) + 1] = self.cross.T
        sums = irfft(lines, self.n, overwrite_x=True)
        return 0.5 * self.n * sums[:, np.arange(_MOST_STEPS, -_MOST_STEPS - 1, -1)].T


def element_clocks(records: Sequence[ElementRecord], *, by_force: bool) -> tuple[ClockDrift, ...]:
    """Delay of all responses, and the run whose clock drifts, that explain a linear element best.

    With the spectra X of the motion, F of the force and the phase ``e^(i w tau)`` on the one that
    is measured, mass, damping and stiffness of ``F = (K + i w C - w² m) X`` are least squares.
    Each is given where it leaves at most half of the gap left without it.
    """
    if any(record.base is not None or record.is_released for record in records):
        return ()
    lines = [_drive_lines(record) for record in records]
    spectra = [
        _spectra(of_drive, record.response, by_force)
        for of_drive, record in zip(lines, records, strict=True)
    ]
    return (*_delay(records, spectra), *_drift(records, lines, spectra, by_force))


def _delay(records: Sequence[ElementRecord], spectra: Sequence[_Spectra]) -> Iterator[ClockDrift]:
    """Delay that all runs share."""
    steps = np.arange(-_MOST_STEPS * _PER_STEP, _MOST_STEPS * _PER_STEP + 1) / _PER_STEP
    delays = float(np.median([record.step for record in records])) * steps
    cross = np.sum([run.late_by_each(delays) for run in spectra], axis=0)
    squares = _squares(np.sum([run.gram for run in spectra], axis=0), cross, len(spectra))
    best = int(np.argmin(squares))
    is_inner = best not in (0, squares.size - 1)
    if is_inner and squares[best] <= _BETTER * squares[steps.size // 2]:
        yield ClockDrift("", float(delays[best]), 0.0)


def _drift(
    records: Sequence[ElementRecord],
    lines: Sequence[_DriveLines],
    spectra: Sequence[_Spectra],
    by_force: bool,
) -> Iterator[ClockDrift]:
    """Run whose delay grows, with the delay in its middle; the others are on time."""
    # A single run cannot be distinguished from an element that is late itself.
    if len(records) < 2:
        return
    gram = np.sum([run.gram for run in spectra], axis=0)
    products = [run.late(0.0) for run in spectra]
    cross = np.sum(products, axis=0)
    on_time = float(_squares(gram, cross, len(spectra))[0])
    drifts = []
    for record, drive, run, product in zip(records, lines, spectra, products, strict=True):
        # No clock of this run leaves less than the other runs do without it.
        others = _squares(gram - run.gram, cross - product, len(spectra) - 1)
        if others[0] > _BETTER * on_time:
            continue
        late = _LateRun(record, drive, by_force, gram - run.gram, cross - product, len(records))
        growth, delay, square = late.best()
        drifts.append((square, ClockDrift(record.name, delay, growth)))
    square, drift = min(drifts, key=lambda pair: pair[0], default=(np.inf, None))
    if drift is not None and square <= _BETTER * on_time:
        yield drift


@dataclass(frozen=True, eq=False)
class _LateRun:
    """One run whose clock drifts, and the products of the others."""

    record: ElementRecord
    drive: _DriveLines
    by_force: bool
    gram: FloatArray
    cross: FloatArray
    n_runs: int

    def best(self) -> tuple[float, float, float]:
        """Growth of the delay and delay in the middle [s], and the square that they leave."""
        steps = np.arange(-_MOST_STEPS, _MOST_STEPS + 1, dtype=np.float64)
        step = self.record.step
        runs = (self._spectra(growth) for growth in step * steps)
        table = np.array([self._squares(run, run.late_by_steps()) for run in runs])
        g, d = np.unravel_index(int(np.argmin(table)), table.shape)

        def square(pair: FloatArray) -> float:
            """Square with a growth and a delay in steps of time."""
            run = self._spectra(step * pair[0])
            return float(self._squares(run, run.late(step * pair[1]))[0])

        guess = np.array([steps[g], steps[d]])
        fine = minimize(square, guess, method="Nelder-Mead", options=_FINE)
        growth, delay = (step * fine.x).tolist()
        return growth, delay, float(fine.fun)

    def _spectra(self, growth: float) -> _Spectra:
        """Spectra with the response where its inputs were, but for the delay in the middle."""
        time = self.record.step * np.arange(self.record.response.size)
        along = time / time[-1] - 0.5
        response = np.interp(time + growth * along, time, self.record.response)
        return _spectra(self.drive, response, self.by_force)

    def _squares(self, run: _Spectra, late: FloatArray) -> FloatArray:
        """Squares that all runs leave with the products of this one at some delays."""
        return _squares(self.gram + run.gram, self.cross + late, self.n_runs)


def _drive_lines(record: ElementRecord) -> _DriveLines:
    """Spectrum of a run's drive up to where its motion is trusted."""
    window = np.hanning(record.drive.size)
    frequency = np.fft.rfftfreq(record.drive.size, record.step)
    used = (frequency > 0.0) & (frequency < record.cutoff_hz)
    spectrum = np.fft.rfft((record.drive - record.drive.mean()) * window)[used]
    omega = np.asarray(2.0 * np.pi * frequency[used], dtype=np.float64)
    return _DriveLines(window, used, omega, spectrum)


def _spectra(drive: _DriveLines, response: FloatArray, by_force: bool) -> _Spectra:
    """Products of one run with a response."""
    level = (response - response.mean()) * drive.window
    moved = np.asarray(rfft(level), dtype=np.complex128)[drive.used]
    force, motion = (drive.spectrum, moved) if by_force else (moved, drive.spectrum)
    size = max(float(np.sqrt(np.sum(np.abs(force) ** 2))), np.finfo(float).tiny)
    omega = drive.omega
    columns = np.array([motion, 1j * omega * motion, -(omega**2) * motion]).T / size
    cross = np.conj(columns) * (force / size)[:, None]
    if not by_force:
        # The force is late: it turns the other way than the motion.
        cross = np.conj(cross)
    gram = np.asarray((np.conj(columns).T @ columns).real, dtype=np.float64)
    return _Spectra(response.size, omega, gram, cross)


def _squares(gram: FloatArray, cross: FloatArray, n_runs: int) -> FloatArray:
    """Squares that a linear element leaves of the forces of all runs, each of size one."""
    return np.asarray(n_runs - np.einsum("di,ij,dj->d", cross, normal_inverse(gram), cross))


def element_rivals(
    campaign: Campaign, refitted: Callable[[Campaign], float]
) -> tuple[WiringRival, ...]:
    """Baseline with the drive of the other sign; `refitted` is what it leaves of a campaign."""
    if not campaign.contract.inputs:
        return ()
    name = next(iter(campaign.contract.inputs))
    runs = tuple(
        replace(run, inputs={**run.inputs, name: -run.inputs[name]}) for run in campaign.runs
    )
    square = refitted(replace(campaign, runs=runs))
    line = sample_of(campaign.runs[0].file, 0)
    rival = WiringRival(TORQUE_SIGN, name, f"'{name}' of the other sign", square, line)
    return (rival,) if np.isfinite(square) else ()
