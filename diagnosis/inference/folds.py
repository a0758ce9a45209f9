"""Which segments of the record are left out together.

Whole conditions where there are enough, blocks otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import BoolArray, Segment

#: With fewer conditions, leaving one out takes away the range of amplitude that the others cannot
#: replace.
_FEWEST_CONDITIONS = 3
#: Groups of blocks where there is one condition.
_BLOCK_GROUPS = 4


@dataclass(frozen=True, eq=False)
class Fold:
    """One split of the segments.

    Parameters
    ----------
    name : str
        What is left out, in words.
    training, own, held_out : ndarray of bool, shape (n_segments,)
        Segments that fit what runs share; segments of held-out runs that fit those runs' own
        parameters only; segments scored.
    """

    name: str
    training: BoolArray
    run_specific: BoolArray
    held_out: BoolArray


def held_out_folds(segments: Sequence[Segment], *, runs_have_own: bool) -> tuple[Fold, ...]:
    """Folds in which every segment is scored once.

    Three conditions or more: leave one condition out; where runs have parameters of their own,
    these are fitted on the even blocks of the held-out runs to score the odd ones, and the other
    way round. Two conditions: half of the blocks of one condition at a time. One condition: a
    quarter of the blocks at a time.

    Parameters
    ----------
    segments : sequence of Segment
        Segments of the comparison problem.
    runs_have_own : bool
        Whether a run has parameters that other runs do not share.

    Returns
    -------
    tuple of Fold
        At least two.
    """
    condition = np.array([segment.condition for segment in segments])
    block = np.array([segment.block for segment in segments])
    names = sorted(set(condition))
    if len(names) >= _FEWEST_CONDITIONS:
        folds = []
        for name in names:
            outside = condition == name
            for parity in (0, 1) if runs_have_own else (None,):
                scored = outside if parity is None else outside & (block % 2 == parity)
                if scored.any():
                    folds.append(Fold(f"condition {name}", ~outside, outside & ~scored, scored))
        return tuple(folds)
    groups = _BLOCK_GROUPS if len(names) == 1 else 2
    index = _numbers_in_condition(condition)
    folds = []
    for name in names:
        for k in range(groups):
            scored = (condition == name) & (index % groups == k)
            if scored.any():
                folds.append(
                    Fold(
                        f"blocks {k + 1} of {groups} of {name}",
                        ~scored,
                        np.zeros_like(scored),
                        scored,
                    )
                )
    return tuple(folds)


def _numbers_in_condition(condition: np.ndarray) -> np.ndarray:
    """Number of each segment within its condition."""
    index = np.zeros(condition.size, dtype=np.int64)
    for name in set(condition):
        members = np.flatnonzero(condition == name)
        index[members] = np.arange(members.size)
    return index
