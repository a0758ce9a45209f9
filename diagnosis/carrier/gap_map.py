"""Gap map of a carrier.

Residual by run, sensor pattern and shaft order, against its scatter over the revolutions.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.gap_map import N_DRAWS, CellTable, gap_cells
from carrierflex.identification.campaign.declarations import Channel
from carrierflex.identification.carrier.sensor_patterns import (
    ComplexArray,
    FloatArray,
    PatternSplit,
    pattern_split,
)
from carrierflex.identification.estimation.resampling import multinomial_counts

IntArray = NDArray[np.int64]

_SEED = 3


def carrier_gap_cells(
    channels: Sequence[Channel],
    residual_orders: ComplexArray,
    runs: Sequence[str],
    run_of_revolution: NDArray[np.int64],
    noise_of_mean: FloatArray,
    beside: Sequence[CellTable] = (),
) -> Sequence[GapCell]:
    """Gap map of a residual, largest cell first.

    ``coherent = w (|mean|² - s²/R)`` over the R complete revolutions of a run, test ``R |mean|²/s²
    ~ F(d, d (R - 1))``; with one revolution the noise of a channel's order stands for s.

    Parameters
    ----------
    channels : sequence of Channel
        Channels.
    residual_orders : ndarray of complex, shape (R, n_channels, n + 1)
        Order amplitudes of the residual by revolution, 0 to n.
    runs : sequence of str
        Names of the runs.
    run_of_revolution : ndarray of int, shape (R,)
        Run of every revolution.
    noise_of_mean : ndarray, shape (n_runs,)
        Noise variance of the mean over one revolution, itself a mean over the channels [m²].
    beside : sequence of CellTable
        Cells beside the orders.

    Returns
    -------
    tuple of GapCell
        Every cell of every run that has a complete revolution.
    """
    complete = np.isfinite(residual_orders).all(axis=(1, 2))
    revolutions = [np.flatnonzero(complete & (run_of_revolution == r)) for r in range(len(runs))]
    tables = [
        _run_table(run, partial(_split_of, channels, residual_orders, rows), noise)
        for run, rows, noise in zip(runs, revolutions, noise_of_mean.tolist(), strict=True)
        if rows.size
    ]
    return gap_cells([*tables, *beside])


def _split_of(channels: Sequence[Channel], orders: ComplexArray, rows: IntArray) -> PatternSplit:
    """Patterns of some revolutions: those of all runs would take four times as much as `orders`."""
    return pattern_split(channels, orders[rows])


def signed_orders(amplitudes: ComplexArray) -> FloatArray:
    """Orders -n to n of a pattern's amplitudes, shape (..., 2 n + 1)."""
    highest = amplitudes.shape[-1] // 2
    return np.arange(-highest, highest + 1, dtype=np.float64)


def degrees_of(amplitudes: ComplexArray) -> FloatArray:
    """Degrees of freedom of complex amplitudes, shape (R, ...), along the first axis.

    Two, or one where they are real throughout.
    """
    return np.where(np.abs(amplitudes.imag).max(axis=0) == 0.0, 1.0, 2.0)


def _run_table(run: str, split_of_run: Callable[[], PatternSplit], noise: float) -> CellTable:
    """Cells of one run with the patterns of its R revolutions."""
    split = split_of_run()
    weights = split.weights
    amplitudes = split.amplitudes
    n = len(amplitudes)
    mean = amplitudes.mean(axis=0)
    degrees = degrees_of(amplitudes)
    if n > 1:
        scatter = amplitudes.var(axis=0, ddof=1)
        ratio = n * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny)
        p_value = fisher_f.sf(ratio, degrees, degrees * (n - 1))
    else:
        scatter = noise * split.noise / np.maximum(weights, np.finfo(float).tiny)
        ratio = np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny)
        p_value = chi2.sf(degrees * ratio, degrees)
    mean_square = weights * np.abs(mean) ** 2
    noise_square = weights * scatter / n

    def draws() -> FloatArray:
        """Coherent part of every draw; the amplitudes of the run are not kept for it."""
        counts = multinomial_counts(n, N_DRAWS, seed=_SEED) / n
        drawn = np.einsum("dr,rmn->dmn", counts, split_of_run().amplitudes)
        return np.asarray(weights * np.abs(drawn) ** 2 - noise_square)[:, None]

    return CellTable(
        runs=(run,),
        patterns=split.names,
        orders=signed_orders(amplitudes),
        mean_square=mean_square[None],
        coherent=(mean_square - noise_square)[None],
        p_value=p_value[None],
        draws=draws,
        used=weights > 0.0,
    )
