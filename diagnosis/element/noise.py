"""Noise and gains of the signals of an element, and the filter that weighs by the noise.

Noise is declared, of what repeats, or of the spectrum's top; gains are declared. Noise with a
memory, ``e_k = a e_(k-1) + w_k``, holds more where the motion is than white noise of its variance:
with a = 0.7 five times as much. Above the band of the motion a record is all noise, and shows a
twice: by the fall of its density, and by its height over the declared variance. A motion that
reaches beyond its band makes the fall steeper and the density higher; a wrong variance moves the
height alone. The smaller of both values is taken.

Under a force the noise n of the deflection enters force space as ``D(w) n``,
``D = -w² m + j w C1 + K1``. Every column is weighted by ``|W|² = S_f / (S_f + |D|² S_n)`` without
phase: where the noise is low this is force space, where it is high it is the space of the measured
deflection.

References
----------
.. [1] P. Whittle, "Estimation and information in stationary time series", Arkiv för Matematik 2
   (1953) 423.
.. [2] P. C. Young, "Recursive Estimation and Time-Series Analysis" (2011), prefilter of SRIVC.
.. [3] K. Steiglitz, L. E. McBride, IEEE Trans. Automatic Control 10 (1965) 461.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.stats import chi2

from carrierflex.diagnosis.comparison.known_physics import DeclaredGains
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.diagnosis.element.records import ElementRecord, noise_of_steps, run_in_use
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.signals import pass_gain, power_density, with_gain
from carrierflex.simulation.element.drives import BY_FORCE, FREE_DECAY

#: Frequencies at which the gain of noise is averaged.
_FREQUENCIES = 4097
#: Smallest dynamic stiffness: the square of its inverse is a number, beyond any noise.
_LEAST_STIFFNESS = 1e-150
#: Values of a at the shortest step that are tried: beyond the last the noise is a drift.
_MEMORIES = np.linspace(0.0, 0.95, 96)
#: Samples of a segment of the spectrum's estimate: shorter ones average more of a record.
_SEGMENT = 512
#: Start above the end of the band, in ends of the band and in lines of the window's width.
_BEYOND, _LINES = 1.25, 3.0
_BELOW_NYQUIST = 0.99
#: Values of a density that tell of its fall.
_FEWEST = 16
#: RMS of a force error that is allowed everywhere, over the RMS of the force.
_FORCE_ERROR = 0.003
#: Periods of the band's end by which records are continued before filtering.
REACH = 20.0


def noise_variance(campaign: Campaign, records: Sequence[ElementRecord]) -> tuple[FloatArray, bool]:
    """Variance of the noise of the channel by run, and whether it was measured rather than guessed.

    Declared noise first; then the scatter over periods at the same phase; else the plateau of the
    spectrum above the band of the signal, taken as white. Never less than the steps in which the
    channel was written make: a record that repeats exactly repeats its rounding too.
    """
    channel = campaign.channels[0]
    least = np.array(
        [noise_of_steps(run_in_use(run).signals[channel.name]) for run in campaign.runs]
    )
    if channel.noise_std is not None:
        return np.maximum(channel.noise_std**2, least), True
    repeated = []
    for record in records:
        values, counts = record.by_period(record.response), record.by_period(record.counts)
        if values is not None and counts is not None and counts.all(axis=0).any():
            repeated.append(values[:, counts.all(axis=0)].var(axis=0, ddof=1).mean())
    if len(repeated) == len(records):
        return np.maximum(np.array(repeated, dtype=np.float64), least), True
    return np.maximum([_plateau(record) for record in records], least), False


def scatter_is_noise(records: Sequence[ElementRecord]) -> bool:
    """Whether what does not repeat is as high as the noise above the band of the motion.

    A stiffness that changes in time, or a load that no period has twice, does not repeat either,
    and lies where the motion is.
    """
    plateau = float(np.mean([_plateau(record) for record in records]))
    variance = float(np.mean([record.noise for record in records]))
    return variance <= Thresholds().most_coloured * plateau


def _plateau(record: ElementRecord) -> float:
    """Variance of white noise as high as the spectrum's top.

    The mean of k periodograms of white noise is chi² with 2k degrees of freedom over 2k, whose
    median lies below its mean: by 31 % for one segment, by 1 / (3k) for many.
    """
    segment = min(record.response.size, _SEGMENT)
    _, power = power_density(record.response, record.step, segment)
    top = power[int(0.85 * power.size) :]
    dof = 2 * (1 + (record.response.size - segment) // (segment - segment // 2))
    return float(np.median(top) * dof / chi2.median(dof) * 0.5 / record.step)


def _dynamic_stiffness(element: tuple[float, float, float], frequency_hz: FloatArray) -> FloatArray:
    """|K1 - w² m + j w C1| of an element m, C1, K1, shape of `frequency_hz`."""
    m, C1, K1 = element
    w = 2.0 * np.pi * frequency_hz
    return np.abs(-(w**2) * m + 1j * w * C1 + K1)


def carried_noise(model: ElementModel, record: ElementRecord) -> float:
    """Variance in the channel of the white noise of the measured force or deflection.

    Through the linear baseline, whose dynamic stiffness is ``D = K1 - w² m + j w C1``: ``sigma²
    mean |1/D|²`` under a force, ``sigma² mean |D|²`` over the usable band under a deflection.
    """
    if record.drive_noise == 0.0:
        return 0.0
    frequency = np.linspace(0.0, 0.5 / record.step, _FREQUENCIES)
    scale = model.scale
    stiffness = _dynamic_stiffness((scale.m, scale.C1, scale.K1), frequency)
    if model.by_force:
        # Nothing holds an element that was fitted to a drive of the other sign.
        gain = 1.0 / np.maximum(stiffness, _LEAST_STIFFNESS)
    else:
        gain = stiffness * pass_gain(frequency, record.cutoff_hz)
    return float(record.drive_noise * np.mean(gain**2))


def declared_gains(campaign: Campaign) -> DeclaredGains:
    """What a campaign of kind ``element`` declares of the gains of force and deflection.

    Of a moving base, the input is the force that drives the element; where its channel reads the
    deflection in space, that of the base is taken as small beside it.
    """
    drive, channel = campaign.rig["drive"], campaign.channels[0].gain_std
    if drive == FREE_DECAY:
        return DeclaredGains(deflection=channel, force_is_inertia=True)
    driven = campaign.input_of(next(iter(campaign.contract.inputs))).gain_std
    if drive in BY_FORCE:
        return DeclaredGains(force=driven, deflection=channel)
    return DeclaredGains(force=channel, deflection=driven)


def _noise_density(frequency_hz: FloatArray, step: float, correlation_time: float) -> FloatArray:
    """Density of noise with a memory over that of white noise of the same variance.

    ``(1 - a²) / (1 + a² - 2 a cos(w dt))`` with ``a = exp(-dt / correlation_time)``.
    """
    if correlation_time == 0.0:
        return np.ones_like(frequency_hz)
    a = np.exp(-step / correlation_time)
    return np.asarray(
        (1.0 - a**2) / (1.0 + a**2 - 2.0 * a * np.cos(2.0 * np.pi * frequency_hz * step))
    )


def noise_correlation_time(records: Sequence[ElementRecord], variance: Sequence[float]) -> float:
    """Correlation time [s] of the noise of the channel, of all runs together.

    0 where the noise is white, or too little of a record lies above its band to tell.
    """
    spectra = [_above_band(record) for record in records]
    if sum(frequency.size for frequency, _, _ in spectra) < _FEWEST:
        return 0.0
    shortest = min(record.step for record in records)
    times = np.concatenate([[0.0], -shortest / np.log(_MEMORIES[1:])])
    weight = np.concatenate([np.full(f.size, averages) for f, _, averages in spectra])
    white = np.concatenate(
        [
            power * (0.5 / record.step) / square
            for record, square, (_, power, _) in zip(records, variance, spectra, strict=True)
        ]
    )
    by_fall = np.empty(times.size)
    by_height = np.empty(times.size)
    for k, time in enumerate(times):
        density = np.concatenate(
            [
                _noise_density(f, record.step, float(time))
                for record, (f, _, _) in zip(records, spectra, strict=True)
            ]
        )
        # Whittle's likelihood, the size of the noise as declared and free.
        logs, square = weight @ np.log(density), weight @ (white / density)
        by_height[k] = logs + square
        by_fall[k] = logs + weight.sum() * np.log(square)
    return float(min(times[by_fall.argmin()], times[by_height.argmin()]))


def _above_band(record: ElementRecord) -> tuple[FloatArray, FloatArray, float]:
    """Frequencies above the band [Hz], the density there, and the averages of each value."""
    counted = record.response[record.counts]
    segment = min(counted.size, _SEGMENT)
    frequency, power = power_density(counted, record.step, segment)
    first = _BEYOND * record.cutoff_hz + _LINES / (segment * record.step)
    chosen = (frequency > first) & (frequency < _BELOW_NYQUIST * 0.5 / record.step)
    return frequency[chosen], power[chosen], counted.size / segment


@dataclass(frozen=True, eq=False)
class MotionNoise:
    """White noise of a driven deflection: variance, m, C1, K1, end of the motion's band."""

    variance: float
    element: tuple[float, float, float]
    band_hz: float

    def density(self, frequency_hz: FloatArray) -> FloatArray:
        """Variance of white noise of the force as dense as this at a frequency."""
        inside = pass_gain(frequency_hz, self.band_hz)
        return self.variance * (inside * _dynamic_stiffness(self.element, frequency_hz)) ** 2


@dataclass(frozen=True, eq=False)
class NoiseWeight:
    """Band and weight of one run."""

    step: float  # Sampling interval [s]
    band_hz: float  # End of the band
    #: m, C1, K1 of a force drive; None where the force is measured
    element: tuple[float, float, float] | None = None
    variance: float = 0.0  # Variance of the channel's noise
    force: float = 0.0  # RMS of the force
    #: Noise of a driven deflection, which its element makes a force
    carried: MotionNoise | None = None
    correlation_time: float = 0.0  # Of the channel's noise [s]; 0 where it is white

    def noise_square(self, frequency_hz: FloatArray) -> FloatArray:
        """Variance of white noise of the channel as dense as that at a frequency."""
        return self.variance * _noise_density(frequency_hz, self.step, self.correlation_time)

    def noise_gain(self, frequency_hz: FloatArray) -> FloatArray:
        """|D|: what noise of the channel is multiplied by in force space."""
        if self.element is None:
            return np.ones_like(frequency_hz)
        return _dynamic_stiffness(self.element, frequency_hz)

    def gain(self, frequency_hz: FloatArray) -> FloatArray:
        """Gain of the common filter."""
        inside = pass_gain(frequency_hz, self.band_hz)
        if self.element is None:
            return inside
        S_f = (_FORCE_ERROR * self.force) ** 2 / self.band_hz
        S_n = self.noise_square(frequency_hz) / (0.5 / self.step)
        return inside * np.sqrt(S_f / (S_f + self.noise_gain(frequency_hz) ** 2 * S_n))

    def floor(self) -> float:
        """Mean square that the noise of channel and driven deflection leaves after the filter."""
        frequency = np.linspace(0.0, 0.5 / self.step, _FREQUENCIES)
        density = self.noise_square(frequency) * self.noise_gain(frequency) ** 2
        if self.carried is not None:
            density = density + self.carried.density(frequency)
        return float(np.mean(self.gain(frequency) ** 2 * density))

    def filtered(self, columns: FloatArray) -> FloatArray:
        """Columns through the filter, shape (n_columns, n)."""
        reach = int(REACH / (self.band_hz * self.step)) + 10
        rows = with_gain(columns, self.step, self._gain_once, reach=reach)
        n = columns.shape[-1]
        slope = (columns[..., -1:] - columns[..., :1]) / (n - 1)
        zero = self.gain(np.zeros(1))[0]
        rows += zero * slope * np.arange(n)
        return rows

    def _gain_once(self, frequency_hz: FloatArray) -> FloatArray:
        """Gain at the lines of a transform, which all columns of a run share."""
        n = frequency_hz.size
        if n not in self._gains:
            self._gains[n] = self.gain(frequency_hz)
        return self._gains[n]

    @cached_property
    def _gains(self) -> dict[int, FloatArray]:
        return {}
