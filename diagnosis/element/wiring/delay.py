"""Delay of an element's response, told without a fit of the baseline."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.element.problem import ElementProblem
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.estimation.scaled_least_squares import design_solution

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

#: Delays that are tried, in steps of time, to either side, and how finely.
_MOST_STEPS, _PER_STEP = 30, 4
#: Share of the square without a delay that the best one may leave.
_BETTER = 0.5


@dataclass(frozen=True, eq=False)
class _Spectra:
    """Circular frequencies [rad/s] of a run, and drive and response there."""

    omega: FloatArray
    drive: ComplexArray
    response: ComplexArray


def element_delay(problem: ElementProblem) -> float:
    """Delay of all responses [s] at which a linear element explains them best; zero otherwise.

    With the spectra X of the motion, F of the force and the phase ``e^(i w tau)`` on the one that
    is measured, mass, damping and stiffness of ``F = (K + i w C - w² m) X`` are least squares, so
    that many delays can be tried: a fit that begins without the delay ends in another minimum.

    Parameters
    ----------
    problem : ElementProblem
        Campaign, driven by force or displacement.
    """
    if any(own.base is not None or own.is_released for own in problem.records):
        return 0.0
    steps = np.arange(-_MOST_STEPS * _PER_STEP, _MOST_STEPS * _PER_STEP + 1) / _PER_STEP
    step = float(np.median([record.step for record in problem.records]))
    spectra = [_spectra(record) for record in problem.records]
    left = [_left(spectra, float(tau), problem.model.by_force) for tau in step * steps]
    best = int(np.argmin(left))
    if best in (0, len(left) - 1) or left[best] > _BETTER * left[steps.size // 2]:
        return 0.0
    return float(step * steps[best])


def _spectra(record: ElementRecord) -> _Spectra:
    """Spectra of one run, up to where its motion is trusted."""
    window = np.hanning(record.response.size)
    frequency = np.fft.rfftfreq(record.response.size, record.step)
    used = (frequency > 0.0) & (frequency < record.cutoff_hz)
    drive = np.fft.rfft((record.drive - record.drive.mean()) * window)[used]
    response = np.fft.rfft((record.response - record.response.mean()) * window)[used]
    omega = np.asarray(2.0 * np.pi * frequency[used], dtype=np.float64)
    return _Spectra(omega, drive, response)


def _left(spectra: Sequence[_Spectra], delay: float, by_force: bool) -> float:
    """Square that a linear element leaves of all forces, their sizes taken as one."""
    rows = []
    forces = []
    for own in spectra:
        on_time = own.response * np.exp(1j * own.omega * delay)
        force, motion = (own.drive, on_time) if by_force else (on_time, own.drive)
        size = float(np.sqrt(np.sum(np.abs(force) ** 2)))
        if size > 0.0:
            forces.append(force / size)
            rows.append(
                np.array([motion, 1j * own.omega * motion, -(own.omega**2) * motion]) / size
            )
    design = np.concatenate(rows, axis=1).T
    target = np.concatenate(forces)
    columns = np.concatenate([design.real, design.imag])
    values = np.concatenate([target.real, target.imag])
    return float(np.sum((values - columns @ design_solution(columns, values)) ** 2))
