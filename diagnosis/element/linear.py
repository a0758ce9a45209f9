"""Mass, spring and damper of an element under a force, found from noisy deflections.

Least squares in force space is biased where the deflection is noisy: its second derivative is
mostly noise, and the mass comes out far too small. Instruments that follow from the measured force
alone carry none of that noise.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.campaign.signals import band_limited

FloatArray = NDArray[np.float64]

_ROUNDS = 6
#: Damping ratio of the first instrument, and the least one of any.
_FIRST_DAMPING, _LEAST_DAMPING = 0.5, 1e-3


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
    best, least = start, _misfit(records, start)
    instrument = (1.0, frequency**2, 2.0 * _FIRST_DAMPING * frequency, 0.0)
    for _ in range(_ROUNDS):
        found = _instrumental(records, instrument, mass)
        if found is None:
            break
        misfit = _misfit(records, found)
        if misfit < least:
            best, least = found, misfit
        instrument = found
    return best


def _typical_frequency(records: Sequence[ElementRecord]) -> float:
    q, v = (np.concatenate([own.motion[k][own.block >= 0] for own in records]) for k in (0, 1))
    return float(v.std() / q.std())


def _instrumental(
    records: Sequence[ElementRecord],
    instrument: tuple[float, float, float, float],
    mass: float | None,
) -> tuple[float, float, float, float] | None:
    """Solution of ``Zᵀ (A x - f) = 0``; None where it is no element."""
    products, right = np.zeros((4, 4)), np.zeros(4)
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
        # The motion is known in the trusted band only: the force in the same band goes with it.
        right += Z @ band_limited(record.drive, record.step, record.cutoff_hz)[inside]
    if mass is not None:
        right, products = right[1:] - mass * products[1:, 0], products[1:, 1:]
    size = np.abs(products).max(axis=0)
    if not (size > 0.0).all():
        return None
    solution = np.linalg.lstsq(products / size, right, rcond=1e-12)[0] / size
    m, C1, K1, f0 = solution if mass is None else (mass, *solution)
    if not (m > 0.0 and K1 > 0.0):
        return None
    return float(m), float(K1), float(max(C1, 2.0 * _LEAST_DAMPING * np.sqrt(m * K1))), float(f0)


def _response(record: ElementRecord, element: tuple[float, float, float, float]) -> FloatArray:
    """Deflection of a linear element from rest, straight lines between the samples of the force."""
    m, K1, C1, f0 = element
    numerator, denominator, _ = cont2discrete(([1.0], [m, C1, K1]), record.step, method="foh")
    return np.asarray(lfilter(np.ravel(numerator), denominator, record.drive - f0))


def _misfit(records: Sequence[ElementRecord], element: tuple[float, float, float, float]) -> float:
    """Sum of squares of measured less predicted deflection; infinite for what is no element."""
    if not (min(element[:2]) > 0.0 and element[2] >= 0.0):
        return float("inf")
    left = [(own.response - _response(own, element))[own.block >= 0] for own in records]
    return float(sum(own @ own for own in left))
