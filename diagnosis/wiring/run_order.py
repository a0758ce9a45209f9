"""Runs whose signals belong to the inputs of another run: records filed under the wrong name.

The fitted baseline, though it has met the wrong pairs, predicts the signals of a run better from
the inputs that belong to them. The best assignment of signals to inputs is refitted.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from carrierflex.diagnosis.wiring.rivals import RUN_ORDER, PredictedRecord, WiringRival
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign_check.campaign_warning import key_of

FloatArray = NDArray[np.float64]

#: Square that another assignment must leave of what the stated one leaves to be refitted.
_BETTER = 0.9


def exchanged_runs(
    records: Sequence[PredictedRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
) -> tuple[WiringRival, ...]:
    """Baseline refitted with the signals of runs exchanged, where that looks better.

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
        One, or none where every run fits its own inputs best. Only runs of one length can be
        exchanged.
    """
    if {record.run for record in records} != {run.name for run in campaign.runs}:
        return ()
    source = _better_sources(records)
    if not source:
        return ()
    runs = {run.name: run for run in campaign.runs}
    exchanged = replace(
        campaign,
        runs=tuple(
            replace(
                run,
                signals=runs[source.get(run.name, run.name)].signals,
                predictions=runs[source.get(run.name, run.name)].predictions,
            )
            for run in campaign.runs
        ),
    )
    text = ", ".join(f"the signals of {other} as those of {name}" for name, other in source.items())
    left = refitted(exchanged)
    rival = WiringRival(RUN_ORDER, ", ".join(source), text, left, key_of("[[runs]]", "file"))
    return (rival,) if np.isfinite(left) else ()


def _better_sources(records: Sequence[PredictedRecord]) -> Mapping[str, str]:
    """Run whose signals fit the inputs of each run better; empty where all stand right."""
    lengths: dict[int, list[PredictedRecord]] = {}
    for record in records:
        lengths.setdefault(record.time.size, []).append(record)
    source: dict[str, str] = {}
    for alike in lengths.values():
        square = np.array([[_square(inputs, signals) for signals in alike] for inputs in alike])
        if not np.isfinite(square).all():
            continue
        _, order = linear_sum_assignment(square)
        same = np.arange(order.size)
        if square[same, order].sum() < _BETTER * np.trace(square):
            source |= {alike[k].run: alike[order[k]].run for k in same if order[k] != k}
    return source


def _square(inputs: PredictedRecord, signals: PredictedRecord) -> float:
    """Mean square of signals beside the prediction from inputs, offsets of a run left out."""
    residual = signals.measured - inputs.predicted
    known = np.isfinite(residual)
    count = np.maximum(known.sum(axis=0), 1)
    residual = np.where(known, residual, 0.0)
    mean = residual.sum(axis=0) / count
    return float(((residual**2).sum(axis=0) / count - mean**2).sum())
