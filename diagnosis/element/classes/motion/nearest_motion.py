"""The motion of a run nearest to the true one, and the band that it is known in."""

from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import detrend

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord
from carrierflex.identification.campaign.signals import (
    pass_gain,
    trusted_frequency,
    with_gain,
)

Motion = tuple[FloatArray, FloatArray, FloatArray]

#: Lines of a spectrum that one sine takes at most: two through the Hann window, two more for what
#: grows at its beginning. Multisines and sweeps take a hundred.
_ONE_LINE = 10.0
#: Power of a line over the median of the noise's that noise alone reaches in one of a thousand
#: records of a thousand lines: powers are exponential, ``ln(1e6) / ln 2``.
_CLEAR_OF_NOISE = 20.0
#: Neighbouring lines over which the power of a motion is averaged.
_SMOOTHED_LINES = 9
#: Periods of the band's end by which records are continued before filtering.
_REACH = 20.0
_SMALLEST = np.finfo(float).tiny


def with_all_lines(model: ElementModel, record: ElementRecord) -> ElementRecord:
    """Run whose motion under a force holds every line that noise alone does not make.

    Noise that the inertia multiplies is weighted down with the force it lies in; a line of the
    motion that is left out is a force that no function of the rest can hold. A motion of one
    line keeps its lines: its mass follows from the harmonics alone, and noise makes it too small.
    Its band ends at the last of them, which the roll-off would take away: it is moved beyond, where
    there is nothing up to the next.
    """
    if not model.by_force or record.is_released or record.gap is not None:
        return record
    if is_one_line(record):
        return record.within(record.cutoff_hz)
    trusted = trusted_frequency(record.response, record.step, above_plateau=_CLEAR_OF_NOISE)
    return record if trusted <= record.flat_hz else record.within(trusted)


def nearest_motion(
    model: ElementModel, record: ElementRecord, variance: float, *, clear: float = 1.0
) -> tuple[Motion, float]:
    """Deflection, speed and acceleration nearest to the true ones, and the error of the speed.

    Curved columns bend the noise of the motion with it, which no weight takes out again. Each
    frequency is taken by the share of the motion in the power that was measured there.

    Parameters
    ----------
    model : ElementModel
        Element; a driven deflection is taken as it is.
    record : ElementRecord
        Run; so is a release.
    variance : float
        Variance of the channel's noise.
    clear : float
        Power over that of the noise below which a frequency holds no motion.

    Returns
    -------
    tuple of (Motion, float)
        Motion, and the standard deviation of the error of its speed.

    References
    ----------
    .. [1] N. Wiener, "Extrapolation, Interpolation, and Smoothing of Stationary Time Series"
       (1949).
    """
    if not model.by_force:
        return record.motion, 0.0
    if record.is_released or record.gap is not None:
        return record.motion, speed_noise(variance, record.flat_hz, record.step)
    q, step = record.response, record.step
    window = np.hanning(q.size)
    power = np.abs(np.fft.rfft(detrend(q) * window)) ** 2 / np.square(window).sum()
    smooth = np.maximum(uniform_filter1d(power, _SMOOTHED_LINES, mode="nearest"), _SMALLEST)
    lines = np.asarray(np.fft.rfftfreq(q.size, step), dtype=np.float64)
    share = np.where(smooth > clear * variance, 1.0 - variance / smooth, 0.0)

    def kept(frequency_hz: FloatArray) -> FloatArray:
        """Share of the motion within its band."""
        return pass_gain(frequency_hz, record.cutoff_hz) * np.interp(frequency_hz, lines, share)

    def derivative(frequency_hz: FloatArray, order: int) -> NDArray[np.complex128]:
        """Gain of the derivative of an order."""
        return np.asarray(kept(frequency_hz) * (2j * np.pi * frequency_hz) ** order)

    reach = int(_REACH / (record.cutoff_hz * step)) + 10
    slope = (q[-1] - q[0]) / (q.size - 1)
    # The straight line between the ends is taken out before the transform and put back.
    trend = (slope * np.arange(q.size), slope / step * np.ones(q.size), np.zeros(q.size))
    x, v, a = (
        with_gain(q, step, partial(derivative, order=order), reach=reach) + trend[order]
        for order in range(3)
    )
    error = variance * np.mean(kept(lines) * (2.0 * np.pi * lines) ** 2)
    return (x, v, a), float(np.sqrt(error))


def is_one_line(record: ElementRecord) -> bool:
    """Whether one line of the spectrum holds the energy of a run's motion."""
    return participation(record)[0] < _ONE_LINE


def participation(record: ElementRecord) -> tuple[float, float]:
    """Lines that hold the energy of a motion, through the Hann window, and their distance [Hz]."""
    q = record.motion[0][record.block >= 0]
    power = np.abs(np.fft.rfft((q - q.mean()) * np.hanning(q.size))) ** 2
    lines = power.sum() ** 2 / np.square(power).sum()
    return float(lines), 1.0 / (q.size * record.step)


def speed_noise(variance: float, band_hz: float, step: float) -> float:
    """Standard deviation of noise of the deflection, differentiated in its band."""
    inside = min(2.0 * band_hz * step, 1.0) / 3.0
    return float(np.sqrt(variance * inside) * 2.0 * np.pi * band_hz)
