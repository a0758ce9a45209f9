"""Delay and drifting clocks of an element's response, told without a fit of the baseline.

A baseline that is fitted to signals many parts of a period late ends in another minimum, whose
prediction tells no delay. A linear element is least squares in force space, so that very many
delays can be tried there instead.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from carrierflex.diagnosis.element.problem import ElementProblem
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.wiring.rivals import ClockDrift
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
    """Products of one run's spectra, the size of its force taken as one; n frequencies.

    Parameters
    ----------
    omega : ndarray, shape (n,)
        Circular frequencies [rad/s].
    gram : ndarray, shape (3, 3)
        Products of motion, speed and acceleration.
    cross : ndarray of complex, shape (n, 3)
        The same with the force, frequency by frequency; a delay turns them.
    """

    omega: FloatArray
    gram: FloatArray
    cross: ComplexArray

    def delayed(self, delays: FloatArray) -> FloatArray:
        """Products with the force where the response was late, shape (n_delays, 3)."""
        return np.asarray((np.exp(-1j * np.outer(delays, self.omega)) @ self.cross).real)


def element_clocks(problem: ElementProblem) -> tuple[ClockDrift, ...]:
    """Delay of all responses, and the run whose clock drifts, that explain a linear element best.

    With the spectra X of the motion, F of the force and the phase ``e^(i w tau)`` on the one that
    is measured, mass, damping and stiffness of ``F = (K + i w C - w² m) X`` are least squares.

    Parameters
    ----------
    problem : ElementProblem
        Campaign, driven by force or displacement.

    Returns
    -------
    tuple of ClockDrift
        None, one or both: each where it leaves at most half of what is left without.
    """
    if any(own.base is not None or own.is_released for own in problem.records):
        return ()
    by_force = problem.model.by_force
    spectra = [_spectra(record, record.response, by_force) for record in problem.records]
    return (*_delay(problem.records, spectra), *_drift(problem.records, spectra, by_force))


def _delay(records: Sequence[ElementRecord], spectra: Sequence[_Spectra]) -> Iterator[ClockDrift]:
    """Delay that all runs share."""
    steps = np.arange(-_MOST_STEPS * _PER_STEP, _MOST_STEPS * _PER_STEP + 1) / _PER_STEP
    delays = float(np.median([record.step for record in records])) * steps
    cross = np.sum([own.delayed(delays) for own in spectra], axis=0)
    left = _left(np.sum([own.gram for own in spectra], axis=0), cross, len(spectra))
    best = int(np.argmin(left))
    if best not in (0, left.size - 1) and left[best] <= _BETTER * left[steps.size // 2]:
        yield ClockDrift("", float(delays[best]), 0.0)


def _drift(
    records: Sequence[ElementRecord], spectra: Sequence[_Spectra], by_force: bool
) -> Iterator[ClockDrift]:
    """Run whose delay grows, with the delay in its middle; the others are on time.

    A single run cannot be told from an element that is late itself.
    """
    if len(records) < 2:
        return
    gram = np.sum([own.gram for own in spectra], axis=0)
    products = [own.delayed(np.zeros(1)) for own in spectra]
    cross = np.sum(products, axis=0)
    on_time = float(_left(gram, cross, len(spectra))[0])
    found = []
    for record, own, product in zip(records, spectra, products, strict=True):
        late = _LateRun(record, by_force, gram - own.gram, cross - product, len(records))
        growth, delay, square = late.best()
        found.append((square, ClockDrift(record.name, delay, growth)))
    square, drift = min(found, key=lambda pair: pair[0])
    if square <= _BETTER * on_time:
        yield drift


@dataclass(frozen=True, eq=False)
class _LateRun:
    """One run whose clock drifts, beside the products of the others.

    Parameters
    ----------
    record : ElementRecord
        Run.
    by_force : bool
        Whether the response is the motion.
    gram, cross : ndarray, shape (3, 3) and (1, 3)
        Products of the other runs.
    n_runs : int
        All runs.
    """

    record: ElementRecord
    by_force: bool
    gram: FloatArray
    cross: FloatArray
    n_runs: int

    def best(self) -> tuple[float, float, float]:
        """Growth of the delay and delay in the middle [s], and the square that they leave."""
        steps = np.arange(-_MOST_STEPS, _MOST_STEPS + 1, dtype=np.float64)
        step = self.record.step
        table = np.array([self.left(growth, step * steps) for growth in step * steps])
        g, d = np.unravel_index(int(np.argmin(table)), table.shape)

        def left(own: FloatArray) -> float:
            """Square with a growth and a delay in steps of time."""
            return float(self.left(step * own[0], step * own[1:])[0])

        guess = np.array([steps[g], steps[d]])
        fine = minimize(left, guess, method="Nelder-Mead", options=_FINE)
        growth, delay = (step * fine.x).tolist()
        return growth, delay, float(fine.fun)

    def left(self, growth: float, delays: FloatArray) -> FloatArray:
        """Square that is left of all runs with a growth and some delays of this one."""
        own = _spectra(self.record, _put_back(self.record, growth), self.by_force)
        return _left(self.gram + own.gram, self.cross + own.delayed(delays), self.n_runs)


def _put_back(record: ElementRecord, growth: float) -> FloatArray:
    """Response of a run where its inputs were, but for the delay in its middle."""
    time = record.step * np.arange(record.response.size)
    along = time / time[-1] - 0.5
    return np.interp(time + growth * along, time, record.response)


def _spectra(record: ElementRecord, response: FloatArray, by_force: bool) -> _Spectra:
    """Products of one run up to where its motion is trusted."""
    window = np.hanning(response.size)
    frequency = np.fft.rfftfreq(response.size, record.step)
    used = (frequency > 0.0) & (frequency < record.cutoff_hz)
    drive = np.fft.rfft((record.drive - record.drive.mean()) * window)[used]
    moved = np.fft.rfft((response - response.mean()) * window)[used]
    force, motion = (drive, moved) if by_force else (moved, drive)
    size = max(float(np.sqrt(np.sum(np.abs(force) ** 2))), np.finfo(float).tiny)
    omega = np.asarray(2.0 * np.pi * frequency[used], dtype=np.float64)
    columns = np.array([motion, 1j * omega * motion, -(omega**2) * motion]).T / size
    cross = np.conj(columns) * (force / size)[:, None]
    if not by_force:
        # The force is late: it turns the other way beside the motion.
        cross = np.conj(cross)
    gram = np.asarray((np.conj(columns).T @ columns).real, dtype=np.float64)
    return _Spectra(omega, gram, cross)


def _left(gram: FloatArray, cross: FloatArray, n_runs: int) -> FloatArray:
    """Square that a linear element leaves of the forces of all runs, each of size one."""
    return np.asarray(n_runs - np.einsum("di,ij,dj->d", cross, normal_inverse(gram), cross))
