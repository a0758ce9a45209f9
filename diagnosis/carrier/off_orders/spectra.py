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
    """Power of all runs and channels over one common axis.

    Parameters
    ----------
    axis : ndarray, shape (n,)
        Orders [per turn], or frequency [Hz].
    resolution : float
        Distance of lines that the longest record resolves, on the axis.
    power : ndarray, shape (n_runs, C, n)
        Power over that of the surroundings: of mean one where there is noise alone.
    allowed : ndarray of bool, shape (n_runs, n)
        Lines of a run that lie off its orders and below its highest frequency.
    """

    axis: FloatArray
    resolution: float
    power: FloatArray
    allowed: NDArray[np.bool_]

    def best_line(self) -> tuple[float, float]:
        """Line that is least like noise, and its p-value.

        Powers of noise are ``Exp(1)``, their sums over runs, over channels and over both
        ``Gamma(number)``; the smallest p-value counts, times the number of lines and of sums.

        Returns
        -------
        tuple of float
            Position on the axis, probability that noise alone makes such a line anywhere.
        """
        used = np.where(self.allowed[:, None, :], self.power, 0.0)
        n_runs = self.allowed.sum(axis=0)
        n_channels = self.power.shape[1]
        sums = [(used.sum(axis=(0, 1)), n_runs * n_channels)]
        sums += [(used[:, c].sum(axis=0), n_runs) for c in range(n_channels)]
        sums += [
            (of_run.sum(axis=0), n_channels * is_allowed)
            for of_run, is_allowed in zip(used, self.allowed, strict=True)
        ]
        log_p = np.array([_log_tail(number, total / _UNSURE) for total, number in sums]).min(axis=0)
        surest = int(np.argmin(log_p))
        n_tests = self.axis.size / _FINER * len(sums)
        return float(self.axis[surest]), float(np.exp(min(log_p[surest] + np.log(n_tests), 0.0)))


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
    shape = (len(runs), len(runs[0].values), n_lines)
    power = np.zeros(shape)
    allowed = np.zeros((len(runs), n_lines), dtype=bool)
    for r, (run, place) in enumerate(zip(runs, places, strict=True)):
        spacing = order_spacing[r]
        from_order = np.abs(axis - spacing * np.round(axis / spacing))
        is_off = (from_order > _BESIDE_AN_ORDER / lengths[r]) & (axis > FROM_ZERO / lengths[r])
        allowed[r] = is_off & (axis < highest[r])
        for c, values in enumerate(run.values):
            power[r, c] = _relative_power(values, place, axis, allowed[r])
    return Spectra(np.asarray(axis, dtype=np.float64), resolution, power, allowed)


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
