"""Signals of an element run made ready.

Even steps, the trusted band, derivatives, the drive between the samples.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly, welch

FloatArray = NDArray[np.float64]

#: Time stamps off an even grid by more than this share of a step are interpolated.
_JITTER = 0.02
#: Widest band as a share of the Nyquist frequency.
_WIDEST = 0.95
#: Width of a band's roll-off over the frequency where it begins: a narrower one rings for longer
#: at the ends of a record, a wider one lets in more noise beyond what is trusted.
_ROLL_OFF = 0.25
#: The band ends where the deflection's spectrum falls to this many times its plateau: two
#: derivatives lift the noise at the end of a band by far more than this over that of its middle.
_ABOVE_PLATEAU = 1000.0
#: Samples of the window that interpolates the drive, each side.
HALF_WINDOW = 24


def mean_step(time: FloatArray) -> float:
    """Mean step of a record [s]; zero for a single sample."""
    return float(time[-1] - time[0]) / max(time.size - 1, 1)


def even_time(time: FloatArray) -> FloatArray:
    """Evenly spaced times from first to last, as many as there are.

    The same array where they are even already.
    """
    even = np.linspace(time[0], time[-1], time.size)
    return time if np.abs(time - even).max() <= _JITTER * mean_step(time) else even


def filled(values: FloatArray, time: FloatArray, even: FloatArray) -> FloatArray:
    """Signal at even times, missing samples interpolated by a straight line."""
    present = np.isfinite(values)
    if even is time and present.all():
        return values
    if even is not time and present.all():
        return np.asarray(CubicSpline(time, values)(even))
    return np.interp(even, time[present], values[present])


def trusted_frequency(
    signal: FloatArray,
    step: float,
    *,
    is_slow: bool = False,
    above_plateau: float | None = None,
) -> float:
    """Frequency [Hz] up to which a signal stands clear of its high-frequency plateau.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Deflection.
    step : float
        Sampling interval [s].
    is_slow : bool
        Whether the motion is known to be slow, as a decay is. Where nothing stands clear it then
        lies below the first lines of the spectrum; elsewhere it fills the whole of it.
    above_plateau : float, optional
        Power over the plateau's at which it stands clear; else that at which a search for laws
        believes it.

    Returns
    -------
    float
        At most 0.95 of the Nyquist frequency.
    """
    # Of the second difference, whose steep spectrum does not leak; its gain is taken out again.
    curvature = np.diff(signal, 2)
    segment = min(curvature.size, 2048)
    frequency, power = power_density(curvature, step, segment)
    frequency, power = frequency[3:], power[3:] / (2.0 * np.sin(np.pi * frequency[3:] * step)) ** 4
    plateau = float(np.median(power[int(0.85 * power.size) :]))
    least = _ABOVE_PLATEAU if above_plateau is None else above_plateau
    clear = np.flatnonzero(power > least * plateau)
    if clear.size:
        highest = frequency[clear[-1]]
    else:
        highest = frequency[0] if is_slow else frequency[-1]
    return float(min(max(highest, 4.0 * frequency[1]), _WIDEST * 0.5 / step))


def power_density(signal: FloatArray, step: float, segment: int) -> tuple[FloatArray, FloatArray]:
    """One-sided power density, the mean of segments that overlap by half.

    Each goes through the Blackman-Harris window, its straight line taken out.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Evenly sampled.
    step : float
        Sampling interval [s].
    segment : int
        Samples of a segment, n at most.

    Returns
    -------
    tuple of ndarray, shape (segment // 2 + 1,)
        Frequencies [Hz] and density [square of the signal's unit per Hz].

    References
    ----------
    .. [1] P. D. Welch, "The use of fast Fourier transform for the estimation of power spectra",
       IEEE Trans. Audio Electroacoust. 15 (1967) 70.
    """
    frequency, density = welch(
        signal, 1.0 / step, nperseg=segment, window="blackmanharris", detrend=_without_lines
    )
    return frequency, density


def _without_lines(pieces: FloatArray) -> FloatArray:
    """Pieces without their straight lines, shape (..., n), at once; scipy takes them singly."""
    n = pieces.shape[-1]
    along = np.arange(n) - 0.5 * (n - 1)
    slopes = pieces @ along / (along @ along)
    return pieces - pieces.mean(axis=-1, keepdims=True) - np.multiply.outer(slopes, along)


def band_limited(
    signal: FloatArray, step: float, cutoff_hz: float, *, derivative: int = 0
) -> FloatArray:
    """Signal, or its derivative, without what lies above a frequency; no phase shift.

    The record is continued at both ends by its point mirror, so that its ends do not ring;
    raised-cosine roll-off up to the cut-off.

    Parameters
    ----------
    signal : ndarray, shape (..., n)
        Evenly sampled.
    step : float
        Sampling interval [s].
    cutoff_hz : float
        End of the band [Hz].
    derivative : int
        How often to differentiate by time.

    Returns
    -------
    ndarray, shape (..., n)
        Filtered signal.
    """
    slope = (signal[..., -1:] - signal[..., :1]) / (signal.shape[-1] - 1)
    filtered = _in_band(
        signal, step, cutoff_hz, lambda f: np.asarray((2j * np.pi * f) ** derivative)
    )
    trend = {
        0: slope * np.arange(signal.shape[-1]),
        1: slope / step * np.ones(signal.shape[-1]),
    }.get(derivative, 0.0)
    return filtered + trend


def change_over(signal: FloatArray, step: float, cutoff_hz: float, lag: float) -> FloatArray:
    """Mean rate of a signal over a lag, ``(x(t) - x(t - lag)) / lag``, in a band.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Evenly sampled.
    step : float
        Sampling interval [s].
    cutoff_hz : float
        End of the band [Hz].
    lag : float
        Lag [s], of either sign; zero for the derivative.

    Returns
    -------
    ndarray, shape (n,)
        Rate [1/s].
    """
    if lag == 0.0:
        return band_limited(signal, step, cutoff_hz, derivative=1)
    slope = (signal[-1] - signal[0]) / (step * (signal.size - 1))
    change = _in_band(signal, step, cutoff_hz, lambda f: -np.expm1(-2j * np.pi * f * lag) / lag)
    return change + slope


def _in_band(
    signal: FloatArray,
    step: float,
    cutoff_hz: float,
    gain: Callable[[FloatArray], NDArray[np.complex128]],
) -> FloatArray:
    """Signal less the straight line between its ends, in a band, each frequency times a gain."""
    return with_gain(
        signal,
        step,
        lambda frequency: pass_gain(frequency, cutoff_hz) * gain(frequency),
        reach=int(20.0 / (cutoff_hz * step)) + 10,
    )


def with_gain(
    signal: FloatArray,
    step: float,
    gain: Callable[[FloatArray], NDArray[np.float64] | NDArray[np.complex128]],
    *,
    reach: int,
) -> FloatArray:
    """Signal less the straight line between its ends, each frequency multiplied by a gain.

    Parameters
    ----------
    signal : ndarray, shape (..., n)
        Evenly sampled.
    step : float
        Sampling interval [s].
    gain : callable
        Gain at frequencies [Hz].
    reach : int
        Samples by which the record is continued at both ends, by its point mirror.

    Returns
    -------
    ndarray, shape (..., n)
        Filtered signal, without the straight line, in the precision of the signal.
    """
    n = signal.shape[-1]
    pad = min(n - 1, reach)
    size = next_fast_len(n + 2 * pad, real=True)
    long = np.empty((*signal.shape[:-1], size), np.result_type(signal, np.float32))
    level = long[..., pad : pad + n]
    slope = (signal[..., -1:] - signal[..., :1]) / (n - 1)
    np.subtract(signal, slope * np.arange(n), out=level, casting="same_kind")
    np.subtract(2.0 * level[..., :1], level[..., pad:0:-1], out=long[..., :pad])
    tail = long[..., pad + n : n + 2 * pad]
    np.subtract(2.0 * level[..., -1:], level[..., -2 : -pad - 2 : -1], out=tail)
    # What is added for a fast transform lies beyond the mirrored end: it is cut off again.
    fill = long[..., n + 2 * pad :]
    fill[...] = np.linspace(tail[..., -1], long[..., 0], fill.shape[-1], axis=-1)
    frequency = np.asarray(np.fft.rfftfreq(size, step), dtype=np.float64)
    spectrum = rfft(long, overwrite_x=True)
    # In place, as precise as the signal.
    spectrum *= gain(frequency).astype(spectrum.dtype, copy=False)
    return np.asarray(irfft(spectrum, n=size, overwrite_x=True)[..., pad : pad + n])


def band_end(trusted_hz: float, step: float) -> float:
    """End [Hz] of a band whose roll-off begins where a signal is no longer trusted.

    A roll-off within the trusted band would take a part of the motion from one that ends sharply,
    and a force that is no straight line of the motion is then made of another motion.
    """
    return min((1.0 + _ROLL_OFF) * trusted_hz, _WIDEST * 0.5 / step)


def flat_end(cutoff_hz: float) -> float:
    """Frequency [Hz] up to which a band passes everything as it is."""
    return cutoff_hz / (1.0 + _ROLL_OFF)


def pass_gain(frequency_hz: FloatArray, cutoff_hz: float) -> FloatArray:
    """Gain of the trusted band.

    One where it is flat, a raised cosine from there to zero at the cut-off.
    """
    begin = flat_end(cutoff_hz)
    gain = (frequency_hz <= begin).astype(np.float64)
    rolls_off = (frequency_hz > begin) & (frequency_hz < cutoff_hz)
    position = (frequency_hz[rolls_off] - begin) / (cutoff_hz - begin)
    gain[rolls_off] = 0.5 * (1.0 + np.cos(np.pi * position))
    return gain


def half_step_values(drive: FloatArray, substeps: int, *, periodic: bool) -> FloatArray:
    """Drive at the beginning and in the middle of every step, band-limited between samples.

    A sample has `substeps` steps.

    Parameters
    ----------
    drive : ndarray, shape (n,)
        Samples.
    substeps : int
        Steps a sample.
    periodic : bool
        Whether the record continues with its first sample; held at its ends otherwise.

    Returns
    -------
    ndarray, shape (2 * n * substeps + 1,)
        Values at ``k / (2 substeps)`` samples.
    """
    pad = 2 * HALF_WINDOW
    ends = (
        (drive[-pad:], drive[:pad])
        if periodic
        else (np.full(pad, drive[0]), np.full(pad, drive[-1]))
    )
    long = np.concatenate([ends[0], drive, ends[1]])
    mean = long.mean()
    fine = resample_poly(long - mean, 2 * substeps, 1, window=("kaiser", 9.0)) + mean
    first = 2 * substeps * pad
    return np.ascontiguousarray(fine[first : first + 2 * substeps * drive.size + 1])
