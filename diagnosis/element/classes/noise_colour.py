"""Memory of a channel's noise, from what the channel holds above the band of its motion.

White noise of a declared size is spread evenly to the Nyquist frequency. Noise with a memory,
``e_k = a e_(k-1) + w_k``, holds more where the motion is: with a = 0.7 five times as much. Above
the band of the motion a record is all noise, and shows a twice: by the fall of its density, and by
its height beside the declared variance. A motion that reaches beyond its band makes the fall
steeper and the density higher; a wrong variance moves the height alone. The smaller of both values
is taken.

References
----------
.. [1] P. Whittle, "Estimation and information in stationary time series", Arkiv för Matematik 2
   (1953) 423.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import welch

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.records import ElementRecord

#: Values of a at the shortest step that are tried: beyond the last the noise is a drift.
_MEMORIES = np.linspace(0.0, 0.95, 96)
_SEGMENT = 512
#: Start above the end of the band, in ends of the band and in lines of the window's width.
_BEYOND, _LINES = 1.25, 3.0
_BELOW_NYQUIST = 0.99
#: Values of a density that tell of its fall.
_FEWEST = 16


def noise_density(frequency_hz: FloatArray, step: float, correlation_time: float) -> FloatArray:
    """Density of noise with a memory over that of white noise of the same variance.

    ``(1 - a²) / (1 + a² - 2 a cos(w dt))`` with ``a = exp(-dt / correlation_time)``.

    Parameters
    ----------
    frequency_hz : ndarray
        Frequencies [Hz].
    step : float
        Sampling interval dt [s].
    correlation_time : float
        Time [s] after which noise remembers a third of itself; 0 for white noise.
    """
    if correlation_time == 0.0:
        return np.ones_like(frequency_hz)
    a = np.exp(-step / correlation_time)
    return np.asarray(
        (1.0 - a**2) / (1.0 + a**2 - 2.0 * a * np.cos(2.0 * np.pi * frequency_hz * step))
    )


def noise_correlation_time(records: Sequence[ElementRecord], variance: Sequence[float]) -> float:
    """Correlation time of the noise of the channel, of all runs together.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs.
    variance : sequence of float
        Variance of the noise of the channel in each.

    Returns
    -------
    float
        Time [s]; 0 where the noise is white, or too little of a record lies above its band to tell.
    """
    spectra = [_above_band(record) for record in records]
    if sum(frequency.size for frequency, _, _ in spectra) < _FEWEST:
        return 0.0
    shortest = min(record.step for record in records)
    times = np.concatenate([[0.0], -shortest / np.log(_MEMORIES[1:])])
    weight = np.concatenate([np.full(own.size, averages) for own, _, averages in spectra])
    white = np.concatenate(
        [
            power * (0.5 / record.step) / own
            for record, own, (_, power, _) in zip(records, variance, spectra, strict=True)
        ]
    )
    by_fall = np.empty(times.size)
    by_height = np.empty(times.size)
    for place, time in enumerate(times):
        density = np.concatenate(
            [
                noise_density(own, record.step, float(time))
                for record, (own, _, _) in zip(records, spectra, strict=True)
            ]
        )
        # Whittle's likelihood, the size of the noise as declared and free.
        logs, square = weight @ np.log(density), weight @ (white / density)
        by_height[place] = logs + square
        by_fall[place] = logs + weight.sum() * np.log(square)
    return float(min(times[by_fall.argmin()], times[by_height.argmin()]))


def _above_band(record: ElementRecord) -> tuple[FloatArray, FloatArray, float]:
    """Frequencies above the band [Hz], the density there, and the averages of each value."""
    counted = record.response[record.counts]
    segment = min(counted.size, _SEGMENT)
    frequency, power = welch(
        counted, 1.0 / record.step, nperseg=segment, window="blackmanharris", detrend="linear"
    )
    first = _BEYOND * record.cutoff_hz + _LINES / (segment * record.step)
    chosen = (frequency > first) & (frequency < _BELOW_NYQUIST * 0.5 / record.step)
    return frequency[chosen], power[chosen], counted.size / segment
