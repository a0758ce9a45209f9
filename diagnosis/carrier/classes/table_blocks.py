"""Into how many blocks the table of a carrier's classes is parted, and which are held out."""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.carrier.records.sums import CarrierSums
from carrierflex.diagnosis.classes.gram_table import IntArray

#: Conditions from which whole ones are held out; blocks of a run, and of all runs together, that
#: the table keeps, and folds of blocks where conditions are fewer.
_FEWEST_CONDITIONS = 3
_BLOCKS_A_RUN = 4
_MOST_BLOCKS = 96
#: The products of all blocks take so much memory [bytes], but blocks stay enough to tell how far a
#: score varies from one to the next.
_MOST_MEMORY = 150e6
_FEWEST_BLOCKS = 24


def block_of_each_segment(records: CarrierSums, n_columns: int) -> IntArray:
    """Block of the table of every segment, numbered as they come; as many as are kept.

    Neighbouring segments of a run, or, of more runs than blocks, neighbouring runs of a condition.

    Parameters
    ----------
    records : CarrierSums
        Segments, and the runs they are of.
    n_columns : int
        Columns of the table: every block keeps the product of any two of them.

    Returns
    -------
    ndarray of int, shape (n_segments,)
        Block of each segment.
    """
    n_runs = int(records.run_of_segment.max()) + 1
    n_blocks = _most_blocks(n_columns)
    if n_runs > n_blocks:
        return _numbered(_blocks_of_runs(records, n_runs, n_blocks)[records.run_of_segment])
    most = max(1, min(_BLOCKS_A_RUN, n_blocks // n_runs))
    blocks: list[IntArray] = []
    first = 0
    for run in range(n_runs):
        n_segments = int(np.count_nonzero(records.run_of_segment == run))
        parts = np.array_split(np.arange(n_segments), min(most, n_segments))
        blocks += [np.full(part.size, first + k) for k, part in enumerate(parts)]
        first += len(parts)
    return np.concatenate(blocks)


def _most_blocks(n_columns: int) -> int:
    """Most blocks whose products memory holds."""
    of_a_block = n_columns**2 * np.dtype(float).itemsize
    return int(np.clip(_MOST_MEMORY // of_a_block, _FEWEST_BLOCKS, _MOST_BLOCKS))


def _blocks_of_runs(records: CarrierSums, n_runs: int, most: int) -> IntArray:
    """Block of every run: each condition has its share of them, one at least."""
    first = np.searchsorted(records.run_of_segment, np.arange(n_runs))
    conditions = np.array([records.segments[p].condition for p in first.tolist()])
    blocks = np.empty(n_runs, dtype=np.int64)
    n_blocks = 0
    for condition in dict.fromkeys(conditions.tolist()):
        runs = np.flatnonzero(conditions == condition)
        parts = np.array_split(runs, max(1, most * runs.size // n_runs))
        for number, part in enumerate(parts):
            blocks[part] = n_blocks + number
        n_blocks += len(parts)
    return blocks


def _numbered(labels: IntArray) -> IntArray:
    """Labels as numbers in the order in which they first come."""
    _, first, places = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(first.size, dtype=np.int64)
    rank[np.argsort(first)] = np.arange(first.size)
    return np.asarray(rank[places])


def fold_of_each_block(conditions: Sequence[str], runs: IntArray, *, is_told: bool) -> IntArray:
    """Whole conditions, or every fourth block where conditions or torques are too few.

    Without the condition of one of two torques nothing tells what follows torque from what does
    not: only amplitudes at the torques that were fitted can be predicted.

    Parameters
    ----------
    conditions : sequence of str
        Condition of each block.
    runs : ndarray of int, shape (n_blocks,)
        Run with which each block begins.
    is_told : bool
        Whether the records hold torques enough to tell what a class follows.

    Returns
    -------
    ndarray of int, shape (n_blocks,)
        Fold in which each block is held out.
    """
    if holds_out_conditions(conditions, is_told=is_told):
        names = list(dict.fromkeys(conditions))
        return np.array([names.index(name) for name in conditions])
    first = np.searchsorted(runs, runs)
    return np.asarray((np.arange(runs.size) - first + runs) % _BLOCKS_A_RUN)


def holds_out_conditions(conditions: Sequence[str], *, is_told: bool) -> bool:
    """Whether each fold is a whole condition; the arguments are those of the folds."""
    return len(set(conditions)) >= _FEWEST_CONDITIONS and is_told
