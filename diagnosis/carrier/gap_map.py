"""Gap map of a carrier.

Residual by run, sensor pattern and shaft order, against its scatter over the revolutions.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, false_discovery_control
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.carrier.patterns import (
    ComplexArray,
    FloatArray,
    PatternSplit,
    pattern_split,
)
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.identification.campaign.campaign import Channel
from carrierflex.identification.campaign.order_analysis import MAX_ORDER

_Table = tuple[FloatArray, FloatArray, FloatArray, FloatArray]

_DRAWS = 200
_SEED = 3


def carrier_gap_cells(
    channels: Sequence[Channel],
    residual_orders: ComplexArray,
    runs: Sequence[str],
    run_of_revolution: NDArray[np.int64],
    noise_of_mean: FloatArray,
) -> tuple[GapCell, ...]:
    """Gap map of a residual, largest share first.

    ``coherent = w (|mean|² - s²/R)`` over the R complete revolutions of a run, test ``R |mean|²/s²
    ~ F(d, d (R - 1))``; with one revolution the noise of a channel's order stands for s.

    Parameters
    ----------
    channels : sequence of Channel
        Channels.
    residual_orders : ndarray of complex, shape (R, n_channels, MAX_ORDER + 1)
        Order amplitudes of the residual by revolution.
    runs : sequence of str
        Names of the runs.
    run_of_revolution : ndarray of int, shape (R,)
        Run of every revolution.
    noise_of_mean : ndarray, shape (n_runs,)
        Noise variance of the mean over one revolution, itself a mean over the channels [m²].

    Returns
    -------
    tuple of GapCell
        Every cell of every run that has a complete revolution.
    """
    split = pattern_split(channels, residual_orders)
    tables: list[tuple[int, _Table]] = []
    for r in range(len(runs)):
        own = split.amplitudes[run_of_revolution == r]
        own = own[np.isfinite(own).all(axis=(1, 2))]
        if len(own):
            tables.append((r, _run_table(own, split, float(noise_of_mean[r]))))
    if not tables:
        return ()
    total = sum(float(table[1].sum()) for _, table in tables)
    adjusted = false_discovery_control(
        np.concatenate([table[2][split.weights > 0.0] for _, table in tables]), method="by"
    )
    cells = []
    for k, (r, (square, coherent, _, draws)) in enumerate(tables):
        drawn_total = draws.sum(axis=(1, 2)) + total - float(coherent.sum())
        used = np.argwhere(split.weights > 0.0)
        p_own = adjusted[k * len(used) : (k + 1) * len(used)]
        for (m, n), p_value in zip(used, p_own, strict=True):
            low, high = np.quantile(draws[:, m, n] / _safe(drawn_total), (0.025, 0.975))
            cells.append(
                GapCell(
                    split.names[m],
                    float(n - MAX_ORDER),
                    runs[r],
                    float(square[m, n]),
                    float(coherent[m, n]),
                    float(coherent[m, n] / total) if total else float("nan"),
                    (float(low), float(high)),
                    float(p_value),
                )
            )
    return tuple(sorted(cells, key=lambda cell: -cell.coherent))


def _safe(total: FloatArray) -> FloatArray:
    return np.where(total == 0.0, np.nan, total)


def _run_table(own: ComplexArray, split: PatternSplit, noise: float) -> _Table:
    """Mean square, coherent part, p-value and draws of the coherent part of every cell of one run."""
    n, mean = len(own), own.mean(axis=0)
    real = np.abs(own.imag).max(axis=0) == 0.0
    degrees = np.where(real, 1.0, 2.0)
    if n > 1:
        scatter = own.var(axis=0, ddof=1)
        p_value = fisher_f.sf(
            n * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny),
            degrees,
            degrees * (n - 1),
        )
    else:
        scatter = noise * split.noise / np.maximum(split.weights, np.finfo(float).tiny)
        p_value = chi2.sf(
            degrees * np.abs(mean) ** 2 / np.maximum(scatter, np.finfo(float).tiny), degrees
        )
    square = split.weights * np.abs(mean) ** 2
    counts = np.random.default_rng(_SEED).multinomial(n, np.full(n, 1.0 / n), _DRAWS) / n
    draws = split.weights * (np.abs(np.einsum("dr,rmn->dmn", counts, own)) ** 2 - scatter / n)
    return square, square - split.weights * scatter / n, p_value, draws
