"""Errors of sign and clock of an element's records, and its records with their baseline.

A baseline that is fitted to signals many shares of a period late ends in another minimum, whose
prediction shows no delay. A linear element is least squares in force space, so that very many
delays can be tried there without a fit of the baseline.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, rfft
from scipy.optimize import minimize

from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.wiring.load_faults import corrected_rival, with_scaled_inputs
from carrierflex.diagnosis.wiring.refits import ClockDrift, Fault, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
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
class _Spectra:
    """Products of one run's spectra, the size of its force taken as one; cross is (n_lines, 3)."""

    n: int  # Samples
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
        """The same for all delays of whole steps, (n_delays, 3), by one inverse transform."""
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
    of_response = [_spectra(record, by_force) for record in records]
    spectra = [of(record.response) for of, record in zip(of_response, records, strict=True)]
    return (*_delay(records, spectra), *_drift(records, of_response, spectra))


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
    of_response: Sequence[Callable[[FloatArray], _Spectra]],
    spectra: Sequence[_Spectra],
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
    for record, of, run, product in zip(records, of_response, spectra, products, strict=True):
        others = gram - run.gram, cross - product, len(spectra) - 1
        # No clock of this run leaves less than the other runs do without it.
        if _squares(*others)[0] <= _BETTER * on_time:
            drifts.append(_best_drift(record, of, *others))
    square, drift = min(drifts, key=lambda pair: pair[0], default=(np.inf, None))
    if drift is not None and square <= _BETTER * on_time:
        yield drift


def _best_drift(
    record: ElementRecord,
    of_response: Callable[[FloatArray], _Spectra],
    gram: FloatArray,
    cross: FloatArray,
    n_others: int,
) -> tuple[float, ClockDrift]:
    """Square that the best clock of one run leaves beside products of the others, and the clock."""
    step, time = record.step, record.time
    along = time / time[-1] - 0.5

    def spectra(growth: float) -> _Spectra:
        """Those with the response where its inputs were, but for the delay in the middle."""
        return of_response(np.interp(time + step * growth * along, time, record.response))

    def squares(run: _Spectra, late: FloatArray) -> FloatArray:
        return _squares(gram + run.gram, cross + late, n_others + 1)

    def square(pair: FloatArray) -> float:
        """Square with a growth and a delay in steps of time."""
        run = spectra(pair[0])
        return float(squares(run, run.late(step * pair[1]))[0])

    steps = np.arange(-_MOST_STEPS, _MOST_STEPS + 1, dtype=np.float64)
    table = np.array([squares(run, run.late_by_steps()) for run in map(spectra, steps)])
    g, d = np.unravel_index(int(np.argmin(table)), table.shape)
    guess = np.array([steps[g], steps[d]])
    fine = minimize(square, guess, method="Nelder-Mead", options=_FINE)
    growth, delay = (step * fine.x).tolist()
    return float(fine.fun), ClockDrift(record.name, delay, growth)


def _spectra(record: ElementRecord, by_force: bool) -> Callable[[FloatArray], _Spectra]:
    """Gives the products of one run with a response, up to where its motion is trusted."""
    window = np.hanning(record.drive.size)
    frequency = np.fft.rfftfreq(record.drive.size, record.step)
    used = (frequency > 0.0) & (frequency < record.cutoff_hz)
    of_drive = np.fft.rfft((record.drive - record.drive.mean()) * window)[used]
    omega = np.asarray(2.0 * np.pi * frequency[used], dtype=np.float64)

    def products(response: FloatArray) -> _Spectra:
        level = (response - response.mean()) * window
        moved = np.asarray(rfft(level), dtype=np.complex128)[used]
        force, motion = (of_drive, moved) if by_force else (moved, of_drive)
        size = max(float(np.sqrt(np.sum(np.abs(force) ** 2))), np.finfo(float).tiny)
        columns = np.array([motion, 1j * omega * motion, -(omega**2) * motion]).T / size
        cross = np.conj(columns) * (force / size)[:, None]
        if not by_force:
            # The force is late: it turns the other way than the motion.
            cross = np.conj(cross)
        gram = np.asarray((np.conj(columns).T @ columns).real, dtype=np.float64)
        return _Spectra(response.size, omega, gram, cross)

    return products


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
    corrected = with_scaled_inputs(campaign, {name: (name, -1.0)})
    rival = corrected_rival(Fault.TORQUE_SIGN, name, f"'{name}' of the other sign", corrected)
    rival = rival.by(refitted)
    return (rival,) if np.isfinite(rival.mean_square) else ()
