"""Runs whose signals belong to the inputs of another run: records filed under the wrong name.

The fitted baseline predicts the signals of a run from the inputs that belong to them, though not
always better than from the wrong ones, which it has been fitted to: runs that fit each other's
inputs up to half as well are exchanged and the baseline refitted, which tells.
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

#: Square of two exchanged runs over that of the stated ones up to which they are refitted, and the
#: pairs that are, the best first. Both bound the work alone: what a refit leaves decides.
_NEARLY_AS_GOOD = 2.0
_MOST_PAIRS = 3


def exchanged_runs(
    records: Sequence[PredictedRecord],
    campaign: Campaign,
    refitted: Callable[[Campaign], float],
) -> tuple[WiringRival, ...]:
    """Baseline refitted with the signals of runs exchanged, where that may be better.

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
        The exchange that leaves least, or none where every run fits its own inputs far better.
        Only runs of one length can be exchanged.
    """
    if {record.run for record in records} != {run.name for run in campaign.runs}:
        return ()
    tried = [(refitted(_exchanged(campaign, source)), source) for source in _sources(records)]
    tried = [(left, source) for left, source in tried if np.isfinite(left)]
    if not tried:
        return ()
    left, source = min(tried, key=lambda pair: pair[0])
    text = ", ".join(f"the signals of {other} as those of {name}" for name, other in source.items())
    return (WiringRival(RUN_ORDER, ", ".join(source), text, left, key_of("[[runs]]", "file")),)


def _exchanged(campaign: Campaign, source: Mapping[str, str]) -> Campaign:
    """Campaign with the signals of each run taken from its source."""
    runs = {run.name: run for run in campaign.runs}
    own = [(run, runs[source.get(run.name, run.name)]) for run in campaign.runs]
    return replace(
        campaign,
        runs=tuple(
            replace(run, signals=other.signals, predictions=other.predictions) for run, other in own
        ),
    )


def _sources(records: Sequence[PredictedRecord]) -> list[dict[str, str]]:
    """Run whose signals each run takes, for every exchange that is refitted."""
    lengths: dict[int, list[PredictedRecord]] = {}
    for record in records:
        lengths.setdefault(record.time.size, []).append(record)
    best: dict[str, str] = {}
    pairs: list[tuple[float, dict[str, str]]] = []
    for alike in lengths.values():
        square = np.array([[_square(inputs, signals) for signals in alike] for inputs in alike])
        if not np.isfinite(square).all():
            continue
        _, order = linear_sum_assignment(square)
        best |= {alike[k].run: alike[j].run for k, j in enumerate(order.tolist()) if j != k}
        stated = np.diag(square)
        ratio = (square + square.T) / np.maximum(stated[:, None] + stated, np.finfo(float).tiny)
        for i, j in zip(*np.triu_indices(len(alike), 1), strict=True):
            one, other = alike[i].run, alike[j].run
            pairs.append((float(ratio[i, j]), {one: other, other: one}))
    nearly = sorted((pair for pair in pairs if pair[0] < _NEARLY_AS_GOOD), key=lambda pair: pair[0])
    sources = [best, *(source for _, source in nearly[:_MOST_PAIRS])]
    return [own for k, own in enumerate(sources) if own and own not in sources[:k]]


def _square(inputs: PredictedRecord, signals: PredictedRecord) -> float:
    """Mean square of signals beside the prediction from inputs, offsets of a run left out."""
    residual = signals.measured - inputs.predicted
    known = np.isfinite(residual)
    count = np.maximum(known.sum(axis=0), 1)
    residual = np.where(known, residual, 0.0)
    mean = residual.sum(axis=0) / count
    return float(((residual**2).sum(axis=0) / count - mean**2).sum())
