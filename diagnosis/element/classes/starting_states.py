"""Where sliders and relaxing branches stand at the first sample of a run.

A record cut from a longer one begins where a motion like its own leaves a slider. A rig that is
switched on in the record may begin relaxed, or as an earlier motion left it; a slider that slips
once in a run keeps the difference until it does: the runs themselves tell.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.columns import relaxing_branches
from carrierflex.diagnosis.classes.held_out import ClassModel, coefficients, squares_left
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.classes.columns import ElementBases, stops_columns
from carrierflex.diagnosis.element.classes.motion.force_records import ForceRecord
from carrierflex.diagnosis.element.classes.weighting import NoiseWeight

#: RMS of the first quarter of a period of a drive that is switched on, over that of the whole: of a
#: record cut from a longer one it is 0.6 at least where one sine drives it.
_STILL = 0.1
#: Ridge on columns of unit energy: keeps those singular that a run does not move.
_ROUNDING = 1e-10


def with_starting_states(
    own: Sequence[ForceRecord], weights: Sequence[NoiseWeight], bases: ElementBases
) -> tuple[ForceRecord, ...]:
    """Runs, each with the start of its sliders and branches that leaves less of the force.

    Sliders and branches are those of all runs together: a run by itself, in which few of them
    slip, shares its force out among the others whichever way it began.

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
    may_be_relaxed = [is_switched_on(record) for record in own]
    if not any(may_be_relaxed):
        return tuple(own)
    starts = [
        [_products(record, weight, bases, from_rest=start) for start in (False, True)[: 1 + may_be]]
        for record, weight, may_be in zip(own, weights, may_be_relaxed, strict=True)
    ]
    relaxed = _best_starts(starts, len(own[0].base))
    return tuple(
        replace(record, from_rest=start) for record, start in zip(own, relaxed, strict=True)
    )


def _best_starts(starts: Sequence[Sequence[FloatArray]], n_base: int) -> list[bool]:
    """Whether each run begins relaxed: all that may or none, then one by one while it gains.

    Parameters
    ----------
    starts : sequence of sequence of ndarray, shape (n, n)
        Products of each run: as a motion like its own leaves it, and relaxed where it may be.
    n_base : int
        Columns of the baseline.
    """
    may_be = [len(products) > 1 for products in starts]
    best = min(
        (may_be, [False] * len(starts)),
        key=lambda relaxed: _left(_total(starts, relaxed), n_base),
    )
    left = _left(_total(starts, best), n_base)
    for number in np.flatnonzero(may_be).tolist():
        # Summed anew: of a column that moves in this run alone a difference leaves rounding, whose
        # square may be negative.
        other = [*best[:number], not best[number], *best[number + 1 :]]
        left_of_other = _left(_total(starts, other), n_base)
        if left_of_other < left:
            best, left = other, left_of_other
    return best


def _total(starts: Sequence[Sequence[FloatArray]], relaxed: Sequence[bool]) -> FloatArray:
    """Products of all runs together."""
    chosen = [products[start] for products, start in zip(starts, relaxed, strict=True)]
    return np.asarray(np.sum(chosen, axis=0), dtype=np.float64)


def is_switched_on(own: ForceRecord) -> bool:
    """Whether the drive of a run begins in it: a quarter of its first period is all but still."""
    x, v = own.x[own.counts], own.v[own.counts]
    # One sample may be all that is left of a run where the folds overlap.
    if x.size < 2:
        return False
    drive = own.record.drive - own.record.drive.mean()
    omega = float(v.std() / x.std())
    first = drive[: max(int(0.5 * np.pi / (omega * own.step)), 2)]
    return bool(np.sqrt(np.mean(first**2)) < _STILL * drive.std())


def _products(
    own: ForceRecord, weight: NoiseWeight, bases: ElementBases, *, from_rest: bool
) -> FloatArray:
    """Products of target, baseline and memory of a run, shape (n, n)."""
    memory = np.concatenate(
        [
            stops_columns(own.x, bases.size, from_rest=from_rest),
            relaxing_branches(own.x, bases.taus, own.step, from_rest=from_rest),
        ]
    )
    rows = weight.filtered(np.concatenate([own.target[None], own.base, memory]))[:, own.counts]
    return np.asarray(rows @ rows.T)


def _left(products: FloatArray, n_base: int) -> float:
    """Square that baseline and memory, of weights of at least zero, leave of the force."""
    square = float(products[0, 0])
    size = np.sqrt(np.maximum(np.diag(products), np.finfo(float).tiny))
    scaled = products / np.outer(size, size)
    n = len(products) - 1
    model = ClassModel(np.arange(1, n + 1), _ROUNDING * np.eye(n), np.arange(n) >= n_base)
    return square * float(squares_left(scaled, coefficients(scaled, model)))
