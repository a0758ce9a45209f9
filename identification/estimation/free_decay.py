"""Linear free decay nearest to the first swings of a release, and its derivatives."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from carrierflex.identification.campaign.signals import band_limited

FloatArray = NDArray[np.float64]

#: Periods that are fitted: a law of the element bends more of them.
_PERIODS, _FEWEST_SAMPLES = 2.5, 16
#: Lines between two of the spectrum in which the frequency is sought, and the first of them: half a
#: period a record.
_PADDED, _FIRST = 8, 4
#: Frequency over the one that was found, and damping ratio, within which the fit looks.
_FREQUENCIES, _RATIOS = (0.5, 2.0), (0.0, 0.5)
_FIRST_RATIO = 0.02


def _first_swings(deflection: FloatArray, step: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Deflection, speed and acceleration of the linear decay that a release begins with.

    ``Re c exp(s t)``, ``s = -zeta w + j w sqrt(1 - zeta²)``, fitted beside a position of rest to
    the first periods and continued over the whole record. What a record leaves beside it begins
    smoothly: before a release there is no motion, and a filter rings of what it takes for one.
    """
    c, s = _first_decay(deflection.tobytes(), step)
    swing = c * np.exp(s * step * np.arange(deflection.size))
    q, v, a = (np.real(s**order * swing) for order in range(3))
    return q, v, a


# A release is looked at again in every campaign whose other runs were changed.
@lru_cache(maxsize=16)
def _first_decay(samples: bytes, step: float) -> tuple[complex, complex]:
    """Size c and exponent s [1/s] of the decay that a release begins with."""
    deflection = np.frombuffer(samples, dtype=np.float64)
    n = deflection.size
    # No window: it would take the beginning, where the decay is largest.
    power = np.abs(np.fft.rfft(deflection - deflection[-(n // 4 + 1) :].mean(), _PADDED * n))
    line = int(np.argmax(power[_FIRST:])) + _FIRST
    omega = 2.0 * np.pi * line / (_PADDED * n * step)
    fitted = round(_PERIODS * 2.0 * np.pi / (omega * step))
    first = deflection[: min(n, max(fitted, _FEWEST_SAMPLES))]
    scale = deflection.std()

    def residual(shape: FloatArray) -> FloatArray:
        return _fitted(first, _exponent(omega, shape) * step)[1] / scale

    low, high = zip(_FREQUENCIES, _RATIOS, strict=True)
    shape = least_squares(residual, [1.0, _FIRST_RATIO], bounds=(low, high)).x
    s = _exponent(omega, shape)
    c, _ = _fitted(first, s * step)
    return c, s


def released_motion(
    deflection: FloatArray, step: float, cutoff_hz: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Deflection, speed and acceleration below a frequency, after a release.

    The first swings are differentiated as the decay that they are. The mirror that continues a
    record before its first sample would accelerate the other way, and the band's filter ring of
    that step: with nothing missing the first blocks held hundreds of floors.
    """
    swings = _first_swings(deflection, step)
    q, v, a = (
        swing + band_limited(deflection - swings[0], step, cutoff_hz, derivative=order)
        for order, swing in enumerate(swings)
    )
    return q, v, a


def _exponent(omega: float, shape: FloatArray) -> complex:
    """Exponent s of a frequency, over the one that was found, and a damping ratio."""
    factor, ratio = shape
    return complex(factor * omega * (-ratio + 1j * np.sqrt(1.0 - ratio**2)))


def _fitted(first: FloatArray, advance: complex) -> tuple[complex, FloatArray]:
    """Size c of a decay of exp(s dt) a sample, and what it leaves of the first swings."""
    turn = np.exp(advance * np.arange(first.size))
    columns = np.array([turn.real, -turn.imag, np.ones(first.size)]).T
    c = np.linalg.lstsq(columns, first, rcond=None)[0]
    return complex(c[0], c[1]), first - columns @ c
