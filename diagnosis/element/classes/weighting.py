"""The common filter of all columns: band and noise weight, and the floor that it leaves.

Under a force the noise n of the deflection enters force space as ``D(w) n``,
``D = -w² m + j w C1 + K1``. Every column is weighted by ``|W|² = S_f / (S_f + |D|² S_n)`` without
phase: where the noise is low this is force space, where it is high it is the space of the measured
deflection.

References
----------
.. [1] P. C. Young, "Recursive Estimation and Time-Series Analysis" (2011), prefilter of SRIVC.
.. [2] K. Steiglitz, L. E. McBride, IEEE Trans. Automatic Control 10 (1965) 461.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.channel_noise import dynamic_stiffness
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord
from carrierflex.diagnosis.element.classes.noise_colour import noise_density
from carrierflex.diagnosis.element.model import ElementModel
from carrierflex.identification.campaign.signals import pass_gain, with_gain
from carrierflex.identification.estimation.scaled_least_squares import normal_solution

#: RMS of a force error that is allowed everywhere, over the RMS of the force.
_FORCE_ERROR = 0.003
#: Periods of the band's end by which records are continued before filtering.
_REACH = 20.0


@dataclass(frozen=True, eq=False)
class MotionNoise:
    """White noise of a driven deflection.

    Parameters
    ----------
    variance : float
        Variance of the noise.
    element : tuple of float
        m, C1, K1.
    band_hz : float
        End of the band that the motion is limited to.
    """

    variance: float
    element: tuple[float, float, float]
    band_hz: float

    def density(self, frequency_hz: FloatArray) -> FloatArray:
        """Variance of white noise of the force as dense as this at a frequency."""
        inside = pass_gain(frequency_hz, self.band_hz)
        return self.variance * (inside * dynamic_stiffness(self.element, frequency_hz)) ** 2


@dataclass(frozen=True, eq=False)
class NoiseWeight:
    """Band and weight of one run.

    Parameters
    ----------
    step : float
        Sampling interval [s].
    band_hz : float
        End of the band.
    element : tuple of float, optional
        m, C1, K1 of a force drive; None where the force is measured.
    variance : float
        Variance of the channel's noise.
    force : float
        RMS of the force.
    carried : MotionNoise, optional
        Noise of a driven deflection, which its element makes a force.
    correlation_time : float
        Of the channel's noise [s]; 0 where it is white.
    """

    step: float
    band_hz: float
    element: tuple[float, float, float] | None
    variance: float
    force: float
    carried: MotionNoise | None = None
    correlation_time: float = 0.0

    def noise_square(self, frequency_hz: FloatArray) -> FloatArray:
        """Variance of white noise of the channel as dense as its own at a frequency."""
        return self.variance * noise_density(frequency_hz, self.step, self.correlation_time)

    def noise_gain(self, frequency_hz: FloatArray) -> FloatArray:
        """|D|: what noise of the channel is multiplied by in force space."""
        if self.element is None:
            return np.ones_like(frequency_hz)
        return dynamic_stiffness(self.element, frequency_hz)

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
        frequency = np.linspace(0.0, 0.5 / self.step, 4097)
        density = self.noise_square(frequency) * self.noise_gain(frequency) ** 2
        if self.carried is not None:
            density = density + self.carried.density(frequency)
        return float(np.mean(self.gain(frequency) ** 2 * density))

    def filtered(self, columns: FloatArray) -> FloatArray:
        """Columns through the filter, shape (n_columns, n)."""
        reach = int(_REACH / (self.band_hz * self.step)) + 10
        kept = with_gain(columns, self.step, self.gain, reach=reach)
        n = columns.shape[-1]
        slope = (columns[..., -1:] - columns[..., :1]) / (n - 1)
        zero = self.gain(np.zeros(1))[0]
        return np.asarray(kept + zero * slope * np.arange(n))


def weighted_baseline(
    model: ElementModel, own: Sequence[ForceRecord], weights: Sequence[NoiseWeight]
) -> tuple[float, float, float] | None:
    """Baseline by least squares through the filter.

    Parameters
    ----------
    model : ElementModel
        Whether its mass is given.
    own : sequence of ForceRecord
        Runs.
    weights : sequence of NoiseWeight
        Filter of each.

    Returns
    -------
    tuple of float or None
        m [kg], C1 [N s/m], K1 [N/m]; None where they are no element.
    """
    n = len(own[0].base) + 1
    gram = np.zeros((n, n))
    for record, weight in zip(own, weights, strict=True):
        rows = weight.filtered(np.vstack([record.target, record.base]))[:, record.counts]
        gram += rows @ rows.T
    c = normal_solution(gram[1:, 1:], gram[1:, 0])
    m, first = (model.mass, 0) if model.mass is not None else (float(c[0]), 1)
    K1, C1 = float(c[first]), float(c[first + 1])
    # A drive that acts backwards turns the sign of all of them, and not the size of the stiffness.
    return (abs(m), max(float(C1 * np.sign(m)), 0.0), abs(K1)) if m * K1 > 0.0 else None
