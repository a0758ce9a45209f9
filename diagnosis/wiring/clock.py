"""A clock that drifts: the delay between inputs and signals grows through a record.

About a delay tau the signal is ``y(t) - tau dy/dt``, so that the residual of a block over the slope
of the prediction tells its delay.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.wiring.rivals import CLOCK, PredictedRecord, WiringRival
from carrierflex.identification.campaign_check.campaign_warning import sample_of

FloatArray = NDArray[np.float64]

#: Blocks of a record, and the drift over its error that is one.
_BLOCKS = 8
_SURE = 6.0
#: Drift over a record in steps of time below which nothing is told.
_SMALLEST = 0.1


def drifting_clocks(
    records: Sequence[PredictedRecord], files: Sequence[str]
) -> tuple[WiringRival, ...]:
    """Runs whose delay drifts, each with what a constant delay and drift of its own would leave.

    Parameters
    ----------
    records : sequence of PredictedRecord
        All runs.
    files : sequence of str
        Their files.

    Returns
    -------
    tuple of WiringRival
        Runs whose drift is beyond doubt.
    """
    residuals = [record.measured - record.predicted for record in records]
    total = sum(float(np.nansum(residual**2)) for residual in residuals)
    count = sum(int(np.isfinite(residual).sum()) for residual in residuals)
    rivals = []
    for record, residual, file in zip(records, residuals, files, strict=True):
        drift, sure, explained = _drift(record, residual)
        length = float(record.time[-1] - record.time[0])
        step = length / max(record.time.size - 1, 1)
        if sure > _SURE and abs(drift) * length > _SMALLEST * step:
            rivals.append(
                WiringRival(
                    CLOCK,
                    record.run,
                    f"a clock that drifts by {abs(drift) * length * 1e3:.3g} ms over run "
                    f"{record.run}",
                    (total - explained) / max(count, 1),
                    sample_of(file, 0),
                )
            )
    return tuple(rivals)


def _drift(record: PredictedRecord, residual: FloatArray) -> tuple[float, float, float]:
    """Drift [s/s], its size over its error, and the sum of squares that delay and drift explain."""
    slope = -np.gradient(record.predicted, record.time, axis=0)
    known = np.isfinite(residual) & np.isfinite(slope)
    middle = 0.5 * (record.time[0] + record.time[-1])
    delays = []
    weights = []
    times = []
    for rows in np.array_split(np.arange(record.time.size), _BLOCKS):
        use = known[rows]
        weight = float(np.sum(slope[rows][use] ** 2))
        if weight > 0.0:
            delays.append(float(np.sum((slope * residual)[rows][use])) / weight)
            weights.append(weight)
            times.append(float(record.time[rows].mean()) - middle)
    if len(delays) < _BLOCKS // 2:
        return 0.0, 0.0, 0.0
    t = np.array(times)
    tau = np.array(delays)
    w = np.array(weights)
    t = t - np.average(t, weights=w)
    mean = float(np.average(tau, weights=w))
    drift = float(np.sum(w * t * tau) / np.sum(w * t**2))
    scatter = tau - mean - drift * t
    variance = float(np.sum(w * scatter**2)) / (len(delays) - 2)
    error = np.sqrt(variance / np.sum(w * t**2))
    return (
        drift,
        abs(drift) / max(float(error), np.finfo(float).tiny),
        _explained(record, residual, slope),
    )


def _explained(record: PredictedRecord, residual: FloatArray, slope: FloatArray) -> float:
    """Sum of squares that a delay and its drift explain, both fitted to every sample."""
    known = np.isfinite(residual) & np.isfinite(slope)
    time = (record.time - record.time[0])[:, None] / (record.time[-1] - record.time[0])
    columns = np.array([slope[known], (slope * time)[known]])
    solution = np.linalg.lstsq(columns.T, residual[known], rcond=None)[0]
    return float(np.sum((solution @ columns) ** 2))
