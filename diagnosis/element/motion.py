"""The motion of a run nearest to the true one, and the band that it is known in.

A force of one frequency moves the element at multiples of it, whose heights change slowly. Least
squares over all of a record know each of them to the noise of thousands of samples, where a filter
lets the noise of all lines of its band through: of the harmonics that curved columns turn on it
leaves the largest alone, and the acceleration of the noise between them makes the mass too small.

A derivative in a band needs both sides of a sample. Where a drive sets in with the first sample,
the mass is at rest and accelerates at once; the band makes a speed of that, whose decay would be a
gap at the beginning of the run. The start is therefore chosen by what follows it.
"""

from dataclasses import replace
from functools import partial
from math import comb

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import detrend

from carrierflex.diagnosis.comparison.problem import BASELINE, FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.noise import REACH
from carrierflex.diagnosis.element.records import ElementRecord, Motion
from carrierflex.identification.campaign.signals import (
    HALF_WINDOW,
    pass_gain,
    trusted_frequency,
    with_gain,
)
from carrierflex.identification.estimation.scaled_least_squares import normal_solution

#: Lines of a spectrum that one sine takes at most: two through the Hann window, two more for what
#: grows at its beginning. Multisines and sweeps take a hundred.
_ONE_LINE = 10.0
#: Power of a line over the median of the noise's that noise alone reaches in one of a thousand
#: records of a thousand lines: powers are exponential, ``ln(1e6) / ln 2``.
_CLEAR_OF_NOISE = 20.0
#: Neighbouring lines over which the power of a motion is averaged.
_SMOOTHED_LINES = 9
_SMALLEST = np.finfo(float).tiny
#: Harmonics that are sought at most, and the share of half the sampling frequency below which.
_HARMONICS, _WIDEST = 12, 0.9
#: Heights of harmonics: polynomials of time of so many terms.
_TERMS = 3
#: Samples for each coefficient at least.
_SAMPLES_EACH = 8
#: Square of a harmonic over that of the noise in as many coefficients, from which it is taken:
#: noise reaches it once in two thousand harmonics (chi-squared of six degrees of freedom).
_CLEAR = 4.0
#: Square of what the harmonics leave, over that of the noise, up to which it is noise; beyond it
#: the frequencies that stand so many times above the noise are motion too.
_IS_NOISE, _OTHER_MOTION = 1.15, 3.0
#: Samples that are worked on at once: a long record is never all columns.
_AT_ONCE = 65_536
#: Corrections of the frequency by the turn of its phase between the halves of a record.
_PASSES = 4


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
    if participation(record)[0] < _ONE_LINE:
        return record.within(record.cutoff_hz)
    trusted = trusted_frequency(record.response, record.step, above_plateau=_CLEAR_OF_NOISE)
    return record if trusted <= record.flat_hz else record.within(trusted)


def nearest_motion(
    model: ElementModel, record: ElementRecord, *, clear: float = 1.0
) -> tuple[Motion, float]:
    """Deflection, speed and acceleration nearest to the true ones, and the error of the speed.

    Curved columns bend the noise of the motion with it, which no weight takes out again. Each
    frequency is taken by the share of the motion in the power that was measured there.

    A driven deflection and a release are taken as they are. `clear` is the power over that of the
    noise below which a frequency holds no motion.

    References
    ----------
    .. [1] N. Wiener, "Extrapolation, Interpolation, and Smoothing of Stationary Time Series"
       (1949).
    """
    if not model.by_force:
        return record.motion, 0.0
    if record.is_released or record.gap is not None:
        return record.motion, speed_noise(record)
    q, step, variance = record.response, record.step, record.noise
    window = np.hanning(q.size)
    power = np.abs(np.fft.rfft(detrend(q) * window)) ** 2 / np.square(window).sum()
    smooth = np.maximum(uniform_filter1d(power, _SMOOTHED_LINES, mode="nearest"), _SMALLEST)
    lines = np.asarray(np.fft.rfftfreq(q.size, step), dtype=np.float64)
    share = np.where(smooth > clear * variance, 1.0 - variance / smooth, 0.0)

    def gain(frequency_hz: FloatArray) -> FloatArray:
        """Share of the motion within its band."""
        return pass_gain(frequency_hz, record.cutoff_hz) * np.interp(frequency_hz, lines, share)

    def derivative(frequency_hz: FloatArray, order: int) -> NDArray[np.complex128]:
        """Gain of the derivative of an order."""
        return np.asarray(gain(frequency_hz) * (2j * np.pi * frequency_hz) ** order)

    reach = int(REACH / (record.cutoff_hz * step)) + 10
    slope = (q[-1] - q[0]) / (q.size - 1)
    # The straight line between the ends is taken out before the transform and put back.
    trend = (slope * np.arange(q.size), slope / step * np.ones(q.size), np.zeros(q.size))
    x, v, a = (
        with_gain(q, step, partial(derivative, order=order), reach=reach) + trend[order]
        for order in range(3)
    )
    error = variance * np.mean(gain(lines) * (2.0 * np.pi * lines) ** 2)
    return (x, v, a), float(np.sqrt(error))


def participation(record: ElementRecord) -> tuple[float, float]:
    """Lines that hold the energy of a motion, through the Hann window, and their distance [Hz]."""
    q = record.motion[0][record.block >= 0]
    power = np.abs(np.fft.rfft((q - q.mean()) * np.hanning(q.size))) ** 2
    lines = power.sum() ** 2 / np.square(power).sum()
    return float(lines), 1.0 / (q.size * record.step)


def speed_noise(record: ElementRecord) -> float:
    """Standard deviation of the noise of the deflection, differentiated in its band."""
    inside = min(2.0 * record.flat_hz * record.step, 1.0) / 3.0
    return float(np.sqrt(record.noise * inside) * 2.0 * np.pi * record.flat_hz)


def with_harmonics(
    model: ElementModel, record: ElementRecord, nearest: Motion
) -> tuple[ElementRecord, Motion, Motion | None]:
    """Run whose motion is that of its harmonics where a force of one line drives it.

    Gives the run, the motion nearest to the true one, and what was measured besides; run and
    `nearest` as they are, and None, under any other drive. Where the harmonics leave more than
    noise (a transient, a subharmonic) what stands clear of the noise is motion as well.
    """
    is_driven = model.by_force and not record.is_released and record.gap is None
    steady = None
    if is_driven and participation(record)[0] < _ONE_LINE:
        steady = _steady_motion(record)
    if steady is None:
        return record, nearest, None
    harmonics, inside = steady
    remainder = np.where(inside, record.response - harmonics[0], 0.0)
    moved = np.where(inside, harmonics, nearest)
    if np.mean(remainder[record.block >= 0] ** 2) > _IS_NOISE * record.noise:
        rest = replace(record, response=remainder)
        moved = moved + np.array(nearest_motion(model, rest, clear=_OTHER_MOTION)[0])
    motion = np.where(inside, moved, record.motion)
    return replace(record, motion=tuple(motion)), tuple(moved), tuple(record.motion - motion)


def _steady_motion(record: ElementRecord) -> tuple[FloatArray, NDArray[np.bool_]] | None:
    """Harmonics of the line that drives a run, by least squares over the samples that count.

    Their deflection, speed and acceleration, shape (3, n), and the samples in their span.
    """
    counted = np.flatnonzero(record.block >= 0)
    span = slice(int(counted[0]), int(counted[-1]) + 1)
    omega = _frequency_of_line(record.drive[span], record.step)
    highest = min(
        int(_WIDEST * np.pi / (record.step * omega)),
        counted.size // (2 * _TERMS * _SAMPLES_EACH),
        _HARMONICS,
    )
    if highest < 1:
        return None
    # A constant, and harmonics times powers of time from -1 to 1 over the samples that count.
    width = 2 * _TERMS
    harmonics = [slice(1 + k * width, 1 + (k + 1) * width) for k in range(highest)]
    half, middle = 0.5 * (counted[-1] - counted[0]), 0.5 * (counted[-1] + counted[0])
    rate = 1.0 / (half * record.step)

    def columns(samples: NDArray[np.int64], order: int = 0) -> FloatArray:
        """Derivative of some order of every column at some samples, shape (n_columns, n)."""
        u = (samples - middle) / half
        P = [polyval(u, polyder(np.eye(_TERMS), j)) * rate**j for j in range(order + 1)]
        rows = np.empty((1 + width * highest, u.size))
        rows[0] = 1.0 if order == 0 else 0.0
        for k, of_harmonic in enumerate(harmonics, start=1):
            turn = 1j * k * omega
            # Product rule: (P e)'' = P'' e + 2 P' e' + P e''.
            heights = sum(comb(order, j) * P[j] * turn ** (order - j) for j in range(order + 1))
            wave = heights * np.exp(turn * record.step * samples)
            rows[of_harmonic] = np.concatenate([wave.real, wave.imag])
        return rows

    def values(samples: NDArray[np.int64], c: FloatArray, order: int = 0) -> FloatArray:
        """Derivative of some order of what coefficients make at some samples, shape (n,)."""
        return np.concatenate([c @ columns(some, order) for some in _pieces(samples)])

    q = record.response
    gram, right = np.zeros((1 + width * highest,) * 2), np.zeros(1 + width * highest)
    for samples in _pieces(counted):
        rows = columns(samples)
        gram += rows @ rows.T
        right += rows @ q[samples]
    c = normal_solution(gram, right)
    noise = np.sum((q[counted] - values(counted, c)) ** 2) / counted.size
    is_clear = np.ones(right.size, dtype=bool)
    for of_harmonic in harmonics:
        square = float(c[of_harmonic] @ gram[of_harmonic, of_harmonic] @ c[of_harmonic])
        is_clear[of_harmonic] = square > _CLEAR * noise * width
    clear = np.zeros(right.size)
    clear[is_clear] = normal_solution(gram[np.ix_(is_clear, is_clear)], right[is_clear])
    inside = np.zeros(q.size, dtype=bool)
    inside[span] = True
    return np.array([values(np.arange(q.size), clear, order) for order in range(3)]), inside


def _frequency_of_line(drive: FloatArray, step: float) -> float:
    """Frequency [rad/s] of the strongest line of a drive."""
    n = drive.size
    level = drive - drive.mean()
    spectrum = np.abs(np.fft.rfft(level * np.hanning(n), 2 * n))
    omega = 2.0 * np.pi * int(np.argmax(spectrum[1:]) + 1) / (2 * n * step)
    half = n // 2
    time = step * np.arange(n)
    window = np.hanning(half)
    apart = step * (n - half)
    for _ in range(_PASSES):
        turning = level * np.exp(-1j * omega * time)
        first, second = window @ turning[:half], window @ turning[-half:]
        omega += float(np.angle(second * np.conj(first))) / apart
    return omega


def _pieces(samples: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    return [samples[k : k + _AT_ONCE] for k in range(0, samples.size, _AT_ONCE)]


#: Share of a period of the motion that a polynomial follows, and samples it needs.
_QUARTER = 0.25
_FEWEST_SAMPLES = 6
_FEWEST_COMPARED = 12
#: Periods of the motion over which starts are compared: a force that the element lacks hardly
#: moves it in half of one.
_COMPARED_PERIODS = 0.5
#: Weights of what the measured start, rest, and the starts of polynomials of degree two and three
#: leave: rest is likely where it leaves less than twice as much, polynomials follow noise.
_WEIGHTS = np.array([1.0, 0.5, 2.0, 2.0])


def with_likely_start(model: ElementModel, record: ElementRecord) -> ElementRecord:
    """Driven record with the start under which the linear element follows its beginning best.

    The measured one, rest, or that of a polynomial through the first samples.
    """
    if record.in_steady_state:
        return record
    q, v = record.motion[:2]
    period = 2.0 * np.pi * float(q.std() / v.std()) / record.step
    first = record.response[: max(_FEWEST_SAMPLES, round(_QUARTER * period))]
    t = record.step * np.arange(first.size)
    starts = [record.measured_start, (float(first[0]), 0.0)]
    for degree in (2, 3):
        columns = np.array([t**power for power in range(degree + 1)]).T
        q_0, v_0, *_ = np.linalg.lstsq(columns, first, rcond=None)[0].tolist()
        starts.append((q_0, v_0))
    plain = replace(model, contained=())
    values = {name: getattr(model.scale, name) for name in ("m", "K1", "C1", "f0")}
    parameters = [p for p in plain.parameters(()) if p.effect == BASELINE]
    theta = np.array([np.clip(values[p.name], p.lower, p.upper) for p in parameters])
    n = max(_FEWEST_COMPARED, int(_COMPARED_PERIODS * period))
    # The drive is known between its samples by those on either side.
    known = slice(n + HALF_WINDOW)
    early = replace(record, drive=record.drive[known], response=record.response[known])
    squares = []
    for start in starts:
        predicted = plain.predicted(replace(early, start=start), (), theta)
        residual = (early.response - predicted)[:n]
        # Infinite where the element runs away.
        squares.append(float(residual @ residual) if np.isfinite(residual).all() else np.inf)
    return replace(record, start=starts[int(np.argmin(_WEIGHTS * np.array(squares)))])
