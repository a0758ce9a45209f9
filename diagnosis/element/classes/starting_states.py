"""Where sliders and relaxing branches stand at the first sample of a run.

A record cut from a longer one begins where a motion like its own leaves a slider. A rig that is
switched on in the record may begin relaxed, or as an earlier motion left it; a slider that slips
once in a run keeps the difference until it does: the run itself tells.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import nnls

from carrierflex.diagnosis.classes.memory_columns import relaxing_branches, stops
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.columns import ElementBases
from carrierflex.diagnosis.element.classes.laws import yields
from carrierflex.diagnosis.element.classes.motion import ForceRecord
from carrierflex.diagnosis.element.classes.weighting import NoiseWeight

#: RMS of the first period of a drive that is switched on, over that of the whole: records cut from
#: longer ones have about one.
_STILL = 0.1


def with_starting_states(
    own: Sequence[ForceRecord], weights: Sequence[NoiseWeight], bases: ElementBases
) -> tuple[ForceRecord, ...]:
    """Runs, each with the start of its sliders and branches that leaves less of its force.

    Parameters
    ----------
    own : sequence of ForceRecord
        Runs.
    weights : sequence of NoiseWeight
        Filter of each run.
    bases : ElementBases
        Yield deflections and relaxation times.

    Returns
    -------
    tuple of ForceRecord
        Copies.
    """
    return tuple(
        replace(record, from_rest=_begins_relaxed(record, weight, bases))
        for record, weight in zip(own, weights, strict=True)
    )


def _begins_relaxed(own: ForceRecord, weight: NoiseWeight, bases: ElementBases) -> bool:
    if not is_switched_on(own):
        return False
    plain = weight.filtered(np.vstack([own.target, own.base]))[:, own.counts]
    left = [
        _left(plain, weight.filtered(_memory(own, bases, from_rest=start))[:, own.counts])
        for start in (False, True)
    ]
    return left[1] < left[0]


def is_switched_on(own: ForceRecord) -> bool:
    """Whether the drive of a run begins in it: its first period is all but still."""
    drive = own.record.drive
    omega = float(own.v[own.counts].std() / own.x[own.counts].std())
    first = drive[: max(int(2.0 * np.pi / (omega * own.step)), 2)]
    return bool(first.std() < _STILL * drive.std())


def _memory(own: ForceRecord, bases: ElementBases, *, from_rest: bool) -> FloatArray:
    sliders = stops(own.x, yields(bases.size), from_rest=from_rest)
    branches = relaxing_branches(own.x, bases.taus, own.step, from_rest=from_rest)
    return np.concatenate([sliders, branches])


def _left(plain: FloatArray, memory: FloatArray) -> float:
    """What baseline and memory, of weights of at least zero, leave of a run's force."""
    size = np.sqrt(np.square(memory).sum(axis=1, keepdims=True))
    # The baseline is free: what it explains of everything is taken out first.
    free, _ = np.linalg.qr((plain[1:] / np.linalg.norm(plain[1:], axis=1, keepdims=True)).T)
    rows = np.vstack([plain[:1], memory / np.maximum(size, np.finfo(float).tiny)])
    rows = rows - (rows @ free) @ free.T
    return float(nnls(rows[1:].T, rows[0])[1])
