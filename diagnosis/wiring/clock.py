"""A clock that drifts: the delay between inputs and signals grows through a record.

In every block of a record the signal is moved along the prediction of the whole run until it fits
best; the delays of the blocks tell their drift.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar

from carrierflex.diagnosis.wiring.rivals import CLOCK, ClockDrift, PredictedRecord, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign.signals import mean_step
from carrierflex.identification.campaign_check.campaign_warning import sample_of
from carrierflex.simulation.sensing import at_other_times

FloatArray = NDArray[np.float64]

#: Blocks of a record, the share of a block that its delay may have, and the drift over its error
#: that is one.
_BLOCKS = 8
_LARGEST = 0.25
_SURE = 3.0
#: Drift over a record, or delay, in steps of time below which nothing is told.
SMALLEST_DRIFT = 0.05
#: Runs that are refitted, the surest first.
_MOST_RUNS = 3
#: Range of a first guess's factor in which refits are compared, how finely, and refits at most.
_FACTORS = (0.5, 1.5)
_FACTOR_STEP = 0.01
_MOST_REFITS = 12


@dataclass(frozen=True)
class _Drift:
    """Delay in the middle of a run and its growth over the run [s], and this over its error."""

    delay: float
    growth: float
    sure: float


def drifting_clocks(
    records: Sequence[PredictedRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
) -> tuple[WiringRival, ...]:
    """Baseline refitted with the signals of a run put back in time, where its delay drifts.

    Parameters
    ----------
    records : sequence of PredictedRecord
        All runs beside the fitted baseline.
    campaign : Campaign
        The same runs.
    refitted : callable
        ``campaign -> mean square`` that the baseline leaves once it is fitted to it.

    Returns
    -------
    tuple of WiringRival
        Runs whose drift is beyond doubt.
    """
    runs = {run.name: run for run in campaign.runs}
    found = []
    for record in records:
        drift = _drift(record)
        step = mean_step(record.time)
        if drift.sure > _SURE and abs(drift.growth) > SMALLEST_DRIFT * step:
            found.append((drift.sure, record.run, _refined(record, drift)))
    rivals = []
    for _, name, drift in sorted(found, key=lambda entry: -entry[0])[:_MOST_RUNS]:
        left = refitted(put_back(campaign, ClockDrift(name, drift.delay, drift.growth)))
        if np.isfinite(left):
            rivals.append(clock_rival(name, drift.growth, left, runs[name].file))
    return tuple(rivals)


def without_delay(campaign: Campaign, delay: float) -> Campaign:
    """Campaign whose signals are put back by a delay of all of them.

    Parameters
    ----------
    campaign : Campaign
        Records.
    delay : float
        Delay [s].
    """
    return put_back(campaign, ClockDrift("", delay, 0.0))


def put_back(campaign: Campaign, drift: ClockDrift) -> Campaign:
    """Campaign whose signals are where the inputs were when they were read.

    Parameters
    ----------
    campaign : Campaign
        Records.
    drift : ClockDrift
        How late the signals of its run, or of all runs, are.
    """
    runs = tuple(
        _put_back(run, drift.delay, drift.growth) if drift.run in ("", run.name) else run
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


def refitted_clock(
    campaign: Campaign,
    guess: ClockDrift,
    refitted: Callable[[Campaign], float],
    enough: float,
) -> tuple[ClockDrift, float]:
    """Delay and drift about a first guess with which the refitted baseline leaves least.

    A guess that comes from another measure than the refit (forces that a linear element leaves)
    may be off: where it does not explain the gap, its factor is sought by refits, within a bracket,
    by Brent's method.

    Parameters
    ----------
    campaign : Campaign
        Records.
    guess : ClockDrift
        First guess.
    refitted : callable
        ``campaign -> mean square`` that the baseline leaves once it is fitted to it.
    enough : float
        Mean square up to which the guess stands: it explains the gap.

    Returns
    -------
    tuple of (ClockDrift, float)
        The best of all that were tried, and what is left with it; infinite where every fit runs
        away.
    """
    tried: dict[float, float] = {}

    def left(factor: float) -> float:
        """Mean square with the guess times a factor."""
        if factor not in tried:
            mean_square = refitted(put_back(campaign, _times(guess, factor)))
            tried[factor] = mean_square if np.isfinite(mean_square) else np.inf
        return tried[factor]

    if left(1.0) <= enough:
        return guess, tried[1.0]
    minimize_scalar(
        lambda factor: left(float(factor)),
        bounds=_FACTORS,
        method="bounded",
        options={"xatol": _FACTOR_STEP, "maxiter": _MOST_REFITS},
    )
    best = min(tried, key=lambda factor: tried[factor])
    return _times(guess, best), tried[best]


def _times(drift: ClockDrift, factor: float) -> ClockDrift:
    return replace(drift, delay=factor * drift.delay, growth=factor * drift.growth)


def clock_rival(run: str, seconds: float, mean_square: float, file: str) -> WiringRival:
    """Rival that says that a clock drifts.

    Parameters
    ----------
    run, file : str
        Run and its file.
    seconds : float
        Drift over the run [s].
    mean_square : float
        What is left with it, over all records.
    """
    text = f"a clock that drifts by {abs(seconds) * 1e3:.3g} ms over run {run}"
    return WiringRival(CLOCK, run, text, mean_square, sample_of(file, 0))


def _drift(record: PredictedRecord) -> _Drift:
    """Straight line through the delays of the blocks."""
    n = record.time.size
    length = float(record.time[-1] - record.time[0])
    delays = []
    weights = []
    places = []
    for rows in np.array_split(np.arange(n), _BLOCKS):
        lag, curvature = _delay(record, rows)
        if curvature > 0.0:
            delays.append(lag * length / (n - 1))
            weights.append(curvature)
            places.append(float(rows.mean()) / (n - 1) - 0.5)
    if len(delays) < _BLOCKS // 2:
        return _Drift(0.0, 0.0, 0.0)
    tau = np.array(delays)
    weight = np.array(weights)
    place = np.array(places)
    middle = float(np.average(place, weights=weight))
    spread = float(np.sum(weight * (place - middle) ** 2))
    mean = float(np.average(tau, weights=weight))
    growth = float(np.sum(weight * (place - middle) * tau)) / spread
    scatter = tau - mean - growth * (place - middle)
    variance = float(np.sum(weight * scatter**2)) / (len(delays) - 2)
    error = float(np.sqrt(variance / spread))
    return _Drift(
        mean - growth * middle, growth, abs(growth) / max(error, float(np.finfo(float).tiny))
    )


def _refined(record: PredictedRecord, drift: _Drift) -> _Drift:
    """Delay and growth at which the whole run lies best on the prediction."""
    along = (record.time - record.time[0]) / (record.time[-1] - record.time[0]) - 0.5
    scale = np.array([drift.growth, drift.growth])

    def missed(factors: FloatArray) -> float:
        """Square that is left with a delay and a growth, over that of the drift."""
        delay, growth = factors * scale
        at = np.clip(record.time - delay - growth * along, record.time[0], record.time[-1])
        predicted = [np.interp(at, record.time, column) for column in record.predicted.T]
        return _missed(record.measured, np.array(predicted).T)

    start = np.array([drift.delay, drift.growth]) / scale
    best = minimize(missed, start, method="Nelder-Mead", options={"xatol": 1e-3, "maxiter": 100})
    delay, growth = best.x * scale
    return replace(drift, delay=float(delay), growth=float(growth))


def _delay(record: PredictedRecord, rows: NDArray[np.int64]) -> tuple[float, float]:
    """Lag [samples] at which a block lies best on the prediction, and its curvature there.

    Zero where no lag within the range is the best one.
    """
    largest = max(int(_LARGEST * rows.size), 1)
    lags = np.arange(-largest, largest + 1)
    first = int(rows[0])
    last = int(rows[-1])
    n = record.time.size
    inside = rows[(rows - largest >= 0) & (rows + largest < n)]
    measured = record.measured[inside]
    if first == last or not inside.size:
        return 0.0, 0.0
    squares = np.array([_missed(measured, record.predicted[inside - lag]) for lag in lags.tolist()])
    best = int(np.argmin(squares))
    if best in (0, squares.size - 1) or not np.isfinite(squares).all():
        return 0.0, 0.0
    before, here, after = squares[best - 1 : best + 2]
    curvature = float(before - 2.0 * here + after)
    if curvature <= 0.0:
        return 0.0, 0.0
    return float(lags[best]) + 0.5 * float(before - after) / curvature, curvature


def _missed(measured: FloatArray, predicted: FloatArray) -> float:
    """Square of what a prediction misses, offsets of the channels left out."""
    residual = measured - predicted
    known = np.isfinite(residual)
    residual = np.where(known, residual, 0.0)
    mean = residual.sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    return float((residual**2).sum() - (known.sum(axis=0) * mean**2).sum())


def _put_back(run: Run, delay: float, growth: float) -> Run:
    """Run with the signals where the inputs were when they were read."""
    along = (run.time - run.time[0]) / (run.time[-1] - run.time[0]) - 0.5
    at = run.time + delay + growth * along
    signals = {name: at_other_times(run.time, own, at) for name, own in run.signals.items()}
    return replace(run, signals=signals)
