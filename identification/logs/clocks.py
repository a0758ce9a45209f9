"""Clocks of loggers: dates and counters as seconds, rows that are missing, one clock for all.

A faster record loses what the slower clock cannot show before it is sampled anew, so nothing folds
back (:func:`carrierflex.identification.campaign.signals.band_limited`).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly

from carrierflex.identification.campaign.signals import band_limited

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

#: Formats of dates that are tried, those with the day first before those with the month first.
DATE_FORMATS = (
    "%Y-%m-%d %H:%M:%S",
    "%Y-%m-%dT%H:%M:%S",
    "%Y/%m/%d %H:%M:%S",
    "%d.%m.%Y %H:%M:%S",
    "%d/%m/%Y %H:%M:%S",
    "%d-%m-%Y %H:%M:%S",
    "%m/%d/%Y %H:%M:%S",
    "%m/%d/%Y %I:%M:%S %p",
    "%H:%M:%S",
)
#: A step over the median step that is a gap, and the scatter of steps that is a clock's own.
_GAP, _JITTER = 1.6, 0.35
#: Last digit of rounded stamps over the step, from which on the clock behind them is taken as even.
_COARSE = 0.02
#: Share of rows that may stand still or go back.
_MOST_BACK = 0.01
#: A record is refined until the new clock has this many samples less, for splines to be exact.
_OVERSAMPLED = 8
#: Longest record on one clock: eight bytes each, several copies.
_MOST_SAMPLES = 200_000_000


def seconds_of_dates(texts: Sequence[str], format_: str, file: str) -> FloatArray:
    """Seconds since 1970, or since midnight, of dates in one format.

    Parameters
    ----------
    texts : sequence of str
        As they stand in the file; fractions of a second may follow, after a point or a comma.
    format_ : str
        Format without the fraction, as of :data:`DATE_FORMATS`; one of those is found where empty.
    file : str
        For the message.

    Raises
    ------
    ValueError
        Where the dates are not of the format, or of none that is known.
    """
    given = date_format(texts, file) if not format_ else format_
    values = _parsed(texts, given)
    if values is None:
        odd = next((text for text in texts if _parsed([text], given) is None), texts[0])
        raise ValueError(
            f"{file}: date '{odd}' is not of the format '{given}'; expected all dates of one format"
        )
    return values


def date_format(texts: Sequence[str], file: str) -> str:
    """Known format that all dates have, in which time goes on most evenly.

    Of day and month, the order in which the record is about as long as its rows at their typical
    step; the day first where both are.

    Raises
    ------
    ValueError
        Where there is none.
    """
    jumps: dict[str, float] = {}
    for known in DATE_FORMATS:
        values = _parsed([*texts[:200], *texts[-200:]], known)
        if values is not None and (step := float(np.median(np.diff(values)))) >= 0.0:
            jumps[known] = abs(float(values[-1] - values[0]) - (len(texts) - 1) * step)
    if jumps:
        return min(jumps, key=jumps.__getitem__)
    shown = ", ".join(DATE_FORMATS)
    raise ValueError(f"{file}: date '{texts[0]}' has none of the formats {shown}")


def _parsed(texts: Sequence[str], format_: str) -> FloatArray | None:
    """Seconds of dates; None where one is not of the format."""
    import pandas as pd

    seconds_format, fraction = format_, ""
    if "%S" in format_:
        pattern = r"(:\d{2})[.,](\d+)"
        series = pd.Series(texts, dtype="str")
        # A workbook writes the stamp at midnight without its time.
        series = series.where(series.str.contains(":"), series + " 00:00:00")
        digits = series.str.extract(pattern)[1]
        fraction = "0." + digits.fillna("0")
        texts = series.str.replace(pattern, r"\1", regex=True).str.removesuffix("Z").tolist()
    try:
        dates = pd.to_datetime(pd.Series(texts), format=seconds_format)
    except (ValueError, TypeError, OverflowError):
        return None
    if dates.isna().any():
        return None
    seconds = (dates - pd.Timestamp("1970-01-01")).dt.total_seconds().to_numpy(dtype=np.float64)
    if format_.startswith("%H"):
        seconds = seconds % 86400.0
        # A record over midnight.
        seconds += 86400.0 * np.concatenate([[0.0], np.cumsum(np.diff(seconds) < -43200.0)])
    return seconds + np.asarray(fraction, dtype=np.float64) if len(fraction) else seconds


def rows_in_order(time: FloatArray, file: str) -> BoolArray:
    """Rows that come later than all before them, shape (n,).

    Raises
    ------
    ValueError
        Where more than a few do not: the column is no time.
    """
    known = np.where(np.isfinite(time), time, -np.inf)
    highest = np.concatenate([[-np.inf], np.maximum.accumulate(known)[:-1]])
    later = known > highest
    back = int(np.count_nonzero(~later))
    if back > max(_MOST_BACK * time.size, 2.0):
        raise ValueError(
            f"{file}: time does not increase or is missing in {back} of {time.size} rows; "
            "expected the column of time in [time] column"
        )
    return later


def grid_with_gaps(time: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Even clock through a record with missing rows, and the place of every row in it.

    The record's own time where its steps are even or scatter beyond what a clock does.
    """
    step = np.diff(time)
    if step.size < 3:
        return time, np.arange(time.size)
    # Stamps of milliseconds make steps of one and two: their mean is the clock's.
    typical = float(np.mean(step[step < _GAP * np.median(step)]))
    jumps = step > _GAP * typical
    even = float(np.std(step[~jumps])) <= _JITTER * typical
    if not even or (time[-1] - time[0]) / typical > _MOST_SAMPLES:
        return time, np.arange(time.size)
    indices = np.concatenate([[0], np.cumsum(np.rint(step / typical))]).astype(np.int64)
    if len(np.unique(indices)) < indices.size:
        return time, np.arange(time.size)
    n = int(indices[-1]) + 1
    clock = np.linspace(time[0], time[-1], n)
    coarse = _resolution(time)
    if coarse > _COARSE * typical and float(np.abs(clock[indices] - time).max()) <= coarse:
        return clock, indices
    return (np.interp(np.arange(n), indices, time) if jumps.any() else time), indices


def _resolution(time: FloatArray) -> float:
    """Last digit of the stamps [s]; zero where they have more than six decimals."""
    for digits in range(7):
        if float(np.abs(time - np.round(time, digits)).max()) < 1e-9:
            return float(10.0**-digits)
    return 0.0


def even_step(time: FloatArray) -> float:
    """Typical step of a clock [s]."""
    return float(np.median(np.diff(time)))


def on_clock(values: FloatArray, time: FloatArray, clock: FloatArray) -> FloatArray:
    """Signal at the instants of another clock, without what that clock cannot show.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Signal; missing samples NaN.
    time : ndarray, shape (n,)
        Its instants [s], increasing.
    clock : ndarray, shape (m,)
        Instants wanted [s].

    Returns
    -------
    ndarray, shape (m,)
        NaN beyond the record, and where a sample beside the instant is missing.
    """
    present = np.isfinite(values)
    if np.count_nonzero(present) < 4:
        return np.full(clock.size, np.nan)
    wanted = even_step(clock)
    even = np.linspace(time[0], time[-1], round((time[-1] - time[0]) / even_step(time)) + 1)
    step = (time[-1] - time[0]) / (even.size - 1)
    signal = np.interp(even, time[present], values[present])
    at = np.searchsorted(time, clock - 1e-6 * step).clip(0, time.size - 1)
    if float(np.abs(time[at] - clock).max()) < 1e-6 * step and wanted < 1.001 * step:
        return values[at]
    if wanted > 1.001 * step:
        signal = band_limited(signal, step, 0.5 / wanted)
    fine, fine_step = _refined(signal, step, wanted)
    result = CubicSpline(even[0] + fine_step * np.arange(fine.size), fine)(clock)
    missing = np.interp(clock, time, (~present).astype(np.float64)) > 0.0
    outside = (clock < time[0] - 1e-9 * step) | (clock > time[-1] + 1e-9 * step)
    return np.where(missing | outside, np.nan, result)


def _refined(signal: FloatArray, step: float, wanted: float) -> tuple[FloatArray, float]:
    """Signal sampled so finely that splines between the samples are exact, and its step."""
    times = int(np.clip(np.ceil(_OVERSAMPLED * step / wanted), 1, _OVERSAMPLED))
    if times == 1 or signal.size < 20:
        return signal, step
    # The straight line between the ends leaves no jump where the filter meets them.
    line = np.linspace(signal[0], signal[-1], signal.size)
    fine = resample_poly(signal - line, times, 1, window=("kaiser", 9.0))
    fine_line = np.interp(
        np.arange(fine.size) / times, np.arange(signal.size, dtype=np.float64), line
    )
    return (fine + fine_line)[: (signal.size - 1) * times + 1], step / times
