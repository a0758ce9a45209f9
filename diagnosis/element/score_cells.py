"""Cells of the score of an element: blocks of the runs by band of frequency."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.element.records import N_BANDS, ElementRecord
from carrierflex.diagnosis.gap.gap_map import band_edges_hz, block_counts, block_powers


@dataclass(frozen=True, eq=False)
class ScoreCells:
    """Bands of the score.

    Parameters
    ----------
    edges_hz : ndarray, shape (n_bands + 1,)
        Ends of the bands [Hz].
    counts, noise_square : ndarray, shape (n_segments, n_bands)
        Degrees of freedom, and the sum of squares of the noise.
    """

    edges_hz: FloatArray
    counts: FloatArray
    noise_square: FloatArray


def score_cells(records: Sequence[ElementRecord], noise: FloatArray) -> ScoreCells:
    """Bands common to all records, evenly wide on a logarithmic axis.

    Parameters
    ----------
    records : sequence of ElementRecord
        Runs.
    noise : ndarray, shape (n_runs,)
        Variance of the noise by run.

    Returns
    -------
    ScoreCells
        Bands with their counts.
    """
    longest = max((record.block == 0).sum() * record.step for record in records)
    highest_hz = max(0.5 / record.step for record in records)
    edges_hz = band_edges_hz(longest, 1.001 * highest_hz, N_BANDS)
    counts = np.concatenate(
        [
            block_counts((record.block >= 0)[:, None], record.block, record.step, edges_hz)[:, 0]
            for record in records
        ]
    )
    variance = np.repeat(noise, [record.n_blocks for record in records])
    return ScoreCells(edges_hz, counts, counts * variance[:, None])


def segment_squares(
    record: ElementRecord, residual: FloatArray, edges_hz: FloatArray
) -> FloatArray:
    """Sum of squares of a residual, shape (n,), by block and band, shape (n_blocks, n_bands).

    Infinite where it is.
    """
    return block_powers(residual[:, None], record.block, record.step, edges_hz)[:, 0]
