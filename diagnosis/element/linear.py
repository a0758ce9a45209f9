"""Sizes of an element: where fits start, and the scale of every parameter.

Under a force mass, spring and damper are estimated from noisy deflections.

Least squares in force space is biased where the deflection is noisy: its second derivative is
mostly noise, and the mass comes out far too small. Instruments that follow from the measured force
alone carry none of that noise.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.signal import lfilter

from carrierflex.diagnosis.element.model import ElementModel, ElementScale
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.diagnosis.element.signatures import base_columns, known_force
from carrierflex.identification.campaign.signals import band_limited
from carrierflex.identification.estimation.scaled_least_squares import design_solution

FloatArray = NDArray[np.float64]

#: Rounds of instruments, of which the best is kept.
_ROUNDS = 6
#: Damping ratio of the first instrument, and the least one of any.
_FIRST_DAMPING, _LEAST_DAMPING = 0.5, 1e-3
#: Resonances over the frequency of the motion, and damping ratios, that are tried where no round
#: gives an element.
_RESONANCES = np.geomspace(0.1, 10.0, 25)
_DAMPINGS = (0.01, 0.05, 0.2)


def linear_element(
    records: Sequence[ElementRecord],
    start: tuple[float, float, float, float],
    *,
    mass: float | None,
) -> tuple[float, float, float, float]:
    """Mass, stiffness, damping and constant force that predict the deflections best.

    Refined instrumental variables: the response of the last estimate to the measured force is the
    instrument of the next.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs of a force drive.
    start : tuple of float
        Estimate by least squares in force space; stays where no round predicts the deflections
        better.
    mass : float, optional
        Given mass.

    Returns
    -------
    tuple of float
        m, K1, C1, f0.

    References
    ----------
    .. [1] P. C. Young, "Recursive Estimation and Time-Series Analysis" (2011), refined instrumental
       variable method.
    """
    frequency = _typical_frequency(records)
    first = (1.0, frequency**2, 2.0 * _FIRST_DAMPING * frequency, 0.0)
    best, least = _refined(records, first, start, mass)
    if not np.isfinite(least):
        # A drive of one line tells stiffness less inertia only: both came out as nothing.
        searched = _searched(records, frequency, mass)
        if searched is not None:
            best, _ = _refined(records, searched, searched, mass)
    return best


def _refined(
    records: Sequence[ElementRecord],
    instrument: tuple[float, float, float, float],
    start: tuple[float, float, float, float],
    mass: float | None,
) -> tuple[tuple[float, float, float, float], float]:
    """Best of a start and of what the rounds from an instrument give, and its misfit."""
    best, least = start, _misfit(records, start)
    for _ in range(_ROUNDS):
        found = _instrumental(records, instrument, mass)
        if found is None:
            break
        misfit = _misfit(records, found)
        if misfit < least:
            best, least = found, misfit
        instrument = found
    return best, least


def _searched(
    records: Sequence[ElementRecord], frequency: float, mass: float | None
) -> tuple[float, float, float, float] | None:
    """Element of some resonances and dampings about a frequency [rad/s] that predicts best.

    Where none is given the mass is what scales the response of one kilogram.
    """
    found = []
    measured = np.concatenate([own.response[own.block >= 0] for own in records])
    for resonance, damping in product(frequency * _RESONANCES, _DAMPINGS):
        m = mass or 1.0
        unit = (m, m * resonance**2, 2.0 * m * damping * resonance, 0.0)
        to_force = np.concatenate([_response(own, unit)[own.block >= 0] for own in records])
        # A constant force bends the spring, once it has come to rest.
        constant = np.full(to_force.size, -1.0 / unit[1])
        if mass is None:
            factor, bent = design_solution(np.column_stack([to_force, constant]), measured)
        else:
            factor, bent = 1.0, float(np.mean(to_force - measured)) * unit[1]
        if factor > 0.0:
            element = (m / factor, unit[1] / factor, unit[2] / factor, float(bent) / factor)
            found.append((_misfit(records, element), element))
    return min(found)[1] if found else None


def element_scale(model: ElementModel, records: Sequence[ElementRecord]) -> ElementScale:
    """Sizes of an element from its measured motion, and its baseline.

    From its response where it moves by a force.
    """
    plain = replace(model, contained=())
    rows = [
        record.where_flat(base_columns(plain, record))[:, record.block >= 0] for record in records
    ]
    force = [record.where_flat(known_force(model, record))[record.block >= 0] for record in records]
    design, target = np.concatenate(rows, axis=1), np.concatenate(force)
    solution = design_solution(design.T, target)
    mass = model.mass if model.mass is not None else max(float(solution[0]), 0.0)
    inertia = 0.0 if model.mass is not None else solution[0] * design[0]
    K1, C1, f0 = (float(value) for value in solution[-3:])
    restoring = target - inertia
    if model.by_force:
        mass, K1, C1, f0 = linear_element(records, (mass, K1, C1, f0), mass=model.mass)
    return ElementScale(
        force=float(restoring.std()) or float(target.std()),
        deflection=float(design[-3].std()),
        speed=float(np.sqrt(np.mean(design[-2] ** 2))),
        m=mass,
        K1=max(K1, 0.0),
        C1=max(C1, 0.0),
        f0=f0,
    )


def _typical_frequency(records: Sequence[ElementRecord]) -> float:
    q, v = (np.concatenate([own.motion[k][own.block >= 0] for own in records]) for k in (0, 1))
    return float(v.std() / q.std())


def _instrumental(
    records: Sequence[ElementRecord],
    instrument: tuple[float, float, float, float],
    mass: float | None,
) -> tuple[float, float, float, float] | None:
    """Solution of ``Zᵀ (A x - f) = 0``; None where it is no element."""
    products = np.zeros((4, 4))
    right = np.zeros(4)
    square = np.zeros(4)
    for record in records:
        inside = record.block >= 0
        q, v, a = (own[inside] for own in record.motion)
        A = np.array([a, v, q, np.ones_like(q)])
        response = _response(record, instrument)
        slope = np.gradient(response, record.step)
        Z = np.array([np.gradient(slope, record.step), slope, response, np.ones_like(response)])[
            :, inside
        ]
        products += Z @ A.T
        square += np.square(Z).sum(axis=1)
        # The motion is known in the usable band only: the force in the same band goes with it.
        right += Z @ band_limited(record.drive, record.step, record.cutoff_hz)[inside]
    if mass is not None:
        right, products = right[1:] - mass * products[1:, 0], products[1:, 1:]
    if not (square.all() and products.any(axis=0).all()):
        return None
    # Instruments of unit length: a deflection weighs as much as its second derivative.
    length = np.sqrt(square[-len(right) :])
    solution = design_solution(products / length[:, None], right / length)
    m, C1, K1, f0 = solution if mass is None else (mass, *solution)
    if not (m > 0.0 and K1 > 0.0):
        return None
    return float(m), float(K1), float(max(C1, 2.0 * _LEAST_DAMPING * np.sqrt(m * K1))), float(f0)


def _response(record: ElementRecord, element: tuple[float, float, float, float]) -> FloatArray:
    """Deflection of a linear element from rest, straight lines between the samples of the force."""
    m, K1, C1, f0 = element
    numerator, denominator = _difference_equation(m, K1, C1, record.step)
    return np.asarray(lfilter(numerator, denominator, record.drive - f0))


def _difference_equation(
    m: float, K1: float, C1: float, step: float
) -> tuple[FloatArray, FloatArray]:
    """Filter of force to deflection, exact for straight lines between the samples.

    With ``s = [q, v]`` the exponential of the element beside a force and its rise in a step gives
    ``s_(k+1) = A s_k + B_0 u_k + B_1 u_(k+1)``, and with ``C = [1, 0]``
    ``q = C adj(z - A) (B_0 + z B_1) / det(z - A) u``.

    References
    ----------
    .. [1] G. F. Franklin, J. D. Powell, M. L. Workman, "Digital Control of Dynamic Systems" (1998),
       triangle hold.
    """
    rates = np.zeros((4, 4))
    rates[0, 1] = step
    rates[1, :3] = -K1 / m * step, -C1 / m * step, step / m
    rates[2, 3] = 1.0
    ahead = expm(rates)
    (a, b), (c, d) = ahead[:2, :2].tolist()
    held, rising = ahead[:2, 2], ahead[:2, 3]
    (p0, r0), (p1, r1) = (held - rising).tolist(), rising.tolist()
    numerator = np.array([p1, p0 - d * p1 + b * r1, b * r0 - d * p0])
    return numerator, np.array([1.0, -(a + d), a * d - b * c])


def _misfit(records: Sequence[ElementRecord], element: tuple[float, float, float, float]) -> float:
    """Sum of squares of measured less predicted deflection; infinite for what is no element."""
    if not (min(element[:2]) > 0.0 and element[2] >= 0.0):
        return float("inf")
    left = [(own.response - _response(own, element))[own.block >= 0] for own in records]
    return float(sum(own @ own for own in left))
