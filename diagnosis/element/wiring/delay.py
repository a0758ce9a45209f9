"""Delay of an element's response, told without a fit of the baseline."""

import numpy as np

from carrierflex.diagnosis.element.problem import ElementProblem

#: Delays that are tried, in steps of time, to either side, and how finely.
_MOST_STEPS, _PER_STEP = 30, 4
#: Share of the square without a delay that the best one may leave.
_BETTER = 0.5


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
    left = [_left(problem, float(tau)) for tau in step * steps]
    best = int(np.argmin(left))
    if best in (0, len(left) - 1) or left[best] > _BETTER * left[steps.size // 2]:
        return 0.0
    return float(step * steps[best])


def _left(problem: ElementProblem, delay: float) -> float:
    """Square that a linear element leaves of all forces, their sizes taken as one."""
    rows = []
    forces = []
    for record in problem.records:
        window = np.hanning(record.response.size)
        drive = np.fft.rfft((record.drive - record.drive.mean()) * window)
        response = np.fft.rfft((record.response - record.response.mean()) * window)
        frequency = np.fft.rfftfreq(record.response.size, record.step)
        used = (frequency > 0.0) & (frequency < record.cutoff_hz)
        omega = 2.0 * np.pi * frequency[used]
        on_time = response[used] * np.exp(1j * omega * delay)
        by_force = problem.model.by_force
        force, motion = (drive[used], on_time) if by_force else (on_time, drive[used])
        size = float(np.sqrt(np.sum(np.abs(force) ** 2)))
        if size > 0.0:
            forces.append(force / size)
            rows.append(np.array([motion, 1j * omega * motion, -(omega**2) * motion]) / size)
    table = np.concatenate(rows, axis=1).T
    target = np.concatenate(forces)
    columns = np.concatenate([table.real, table.imag])
    values = np.concatenate([target.real, target.imag])
    scale = np.linalg.norm(columns, axis=0)
    solution = np.linalg.lstsq(columns / scale, values, rcond=None)[0]
    return float(np.sum((values - columns / scale @ solution) ** 2))
