"""Spectra beside the orders, over turns and over time, each against its own surroundings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.special import gammaincc, gammaln

from carrierflex.diagnosis.carrier.off_orders.records import BesideOrders, FloatArray

#: Lines of the spectrum for each line that the longest record resolves.
_FINER = 4
#: Resolved lines off the orders that stand for the surroundings of one, and the factor by which
#: their median may be too low.
_SURROUNDINGS = 60
_UNSURE = 1.5
#: Resolved lines beside an order, and from zero on, that are not looked at.
_BESIDE_AN_ORDER = 2.0
FROM_ZERO = 4.0
#: Share of the highest frequency of a record that is looked at.
_USABLE = 0.9
#: Lines of a spectrum at most: longer records are searched at low frequencies only.
_MOST_LINES = 200_000


@dataclass(frozen=True, eq=False)
class Spectra:
    """How unlike noise every line of one common axis is.

    Powers of noise over that of their surroundings are ``Exp(1)``, their sums over runs, over
    channels and over both ``Gamma(number)``.

    Parameters
    ----------
    axis : ndarray, shape (n,)
        Orders [per turn], or frequency [Hz].
    resolution : float
        Distance of lines that the longest record resolves, on the axis.
    log_p : ndarray, shape (n,)
        Log of the smallest p-value of all sums.
    n_sums : int
        How many sums there are.
    """

    axis: FloatArray
    resolution: float
    log_p: FloatArray
    n_sums: int

    def best_line(self) -> tuple[float, float]:
        """Line that is least like noise, and its p-value.

        The smallest p-value counts, times the number of lines and of sums.

        Returns
        -------
        tuple of float
            Position on the axis, probability that noise alone makes such a line anywhere.
        """
        surest = int(np.argmin(self.log_p))
        n_tests = self.axis.size / _FINER * self.n_sums
        smallest = self.log_p[surest] + np.log(n_tests)
        return float(self.axis[surest]), float(np.exp(min(smallest, 0.0)))


def _log_tail(number: NDArray[np.int64], total: FloatArray) -> FloatArray:
    """Log of the probability that ``Gamma(number)`` exceeds `total`; 0 where number is zero."""
    shape = np.maximum(number, 1).astype(np.float64)
    with np.errstate(divide="ignore"):
        exact = np.log(gammaincc(shape, total))
    # Beyond the smallest number of the machine the first term of the series is near enough.
    far = (shape - 1.0) * np.log(np.maximum(total, 1.0)) - total - gammaln(shape)
    log_p = np.where(np.isfinite(exact), exact, far)
    return np.asarray(np.where(number > 0, log_p, 0.0), dtype=np.float64)


def spectra_over_turns(runs: Sequence[BesideOrders]) -> Spectra:
    """Spectra over the carrier's angle: what keeps its order whatever the speed."""
    return _spectra(runs, [run.turns for run in runs], [1.0] * len(runs))


def spectra_over_time(runs: Sequence[BesideOrders]) -> Spectra:
    """Spectra over time: what keeps its frequency whatever the speed."""
    return _spectra(runs, [run.time for run in runs], [run.speed for run in runs])


def _spectra(
    runs: Sequence[BesideOrders], places: Sequence[FloatArray], order_spacing: Sequence[float]
) -> Spectra:
    """Spectra over `places`; the orders of a run lie at multiples of its `order_spacing`."""
    lengths = [float(place[-1] - place[0]) for place in places]
    resolution = 1.0 / max(lengths)
    highest = [
        _USABLE * 0.5 * (place.size - 1) / length
        for place, length in zip(places, lengths, strict=True)
    ]
    n_lines = int(min(np.ceil(_FINER * max(highest) / resolution), _MOST_LINES))
    axis: FloatArray = resolution / _FINER * np.arange(n_lines, dtype=np.float64)
    # Sums as the runs come: powers of all runs and channels would be several times the records.
    n_channels = len(runs[0].values)
    of_channel = np.zeros((n_channels, n_lines))
    n_runs = np.zeros(n_lines, dtype=np.int64)
    log_p = np.zeros(n_lines)
    for r, (run, place) in enumerate(zip(runs, places, strict=True)):
        spacing = order_spacing[r]
        from_order = np.abs(axis - spacing * np.round(axis / spacing))
        is_off = (from_order > _BESIDE_AN_ORDER / lengths[r]) & (axis > FROM_ZERO / lengths[r])
        allowed = is_off & (axis < highest[r])
        power = np.array([_relative_power(values, place, axis, allowed) for values in run.values])
        log_p = np.minimum(log_p, _log_tail(n_channels * allowed, power.sum(axis=0) / _UNSURE))
        of_channel += power
        n_runs += allowed
    for total in of_channel:
        log_p = np.minimum(log_p, _log_tail(n_runs, total / _UNSURE))
    log_p = np.minimum(log_p, _log_tail(n_runs * n_channels, of_channel.sum(axis=0) / _UNSURE))
    return Spectra(axis, resolution, log_p, 1 + n_channels + len(runs))


def _relative_power(
    values: FloatArray, place: FloatArray, axis: FloatArray, allowed: NDArray[np.bool_]
) -> FloatArray:
    """Power of a signal at the allowed lines over the median of their surroundings."""
    result = np.zeros(axis.size)
    if not allowed.any():
        return result
    n = place.size
    length = float(place[-1] - place[0])
    even = np.linspace(float(place[0]), float(place[-1]), n)
    level = np.interp(even, place, values) * np.hanning(n)
    n_fft = int(2 ** np.ceil(np.log2(2 * _FINER * n)))
    lines = np.fft.rfftfreq(n_fft, length / (n - 1))
    power = np.interp(axis, lines, np.abs(np.fft.rfft(level, n_fft)) ** 2)[allowed]
    # Lines of this axis for each that the record resolves; medians of every second are as good.
    finer = max(int(1.0 / length / axis[1]), 1)
    step = max(finer // 2, 1)
    width = 2 * (_SURROUNDINGS * finer // step // 2) + 1
    typical = median_filter(power[::step], width, mode="nearest") / np.log(2.0)
    places = np.arange(power.size)
    surroundings = np.interp(places, places[::step], typical)
    result[allowed] = power / np.maximum(surroundings, np.finfo(float).tiny)
    return result
