"""What does not repeat.

Scatter of every cell over the repetitions against the noise, and what lies off the orders.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray
from carrierflex.diagnosis.gap.findings import NonSynchronousCell, Repeatability
from carrierflex.diagnosis.gap.significance import SIGNIFICANCE, adjusted_together


@dataclass(frozen=True, eq=False)
class ScatterTable:
    """Scatter of all cells of a run, or of runs of one condition.

    Parameters
    ----------
    run : str
        Name of the run or runs.
    patterns : tuple of str
        Channels or sensor patterns.
    orders : ndarray, shape (n_orders,)
        Orders, lines or middles of bands.
    measured, simulated, gap : ndarray, shape (n_patterns, n_orders)
        Mean square that does not repeat in the measured signal, the simulated one and the gap.
    noise : ndarray, shape (n_patterns, n_orders)
        What the noise alone leaves there.
    p_value : ndarray, shape (n_patterns, n_orders)
        Without more than noise, not adjusted; NaN where unknown.
    used : ndarray of bool, shape (n_patterns, n_orders), optional
        Cells that exist; all where it is left out.
    """

    run: str
    patterns: tuple[str, ...]
    orders: FloatArray
    measured: FloatArray
    simulated: FloatArray
    gap: FloatArray
    noise: FloatArray
    p_value: FloatArray
    used: BoolArray | None = None

    def is_used(self) -> BoolArray:
        """Cells that exist, shape (n_patterns, n_orders)."""
        return np.ones(self.gap.shape, dtype=bool) if self.used is None else self.used

    def beyond(self, p_values: FloatArray) -> list[NonSynchronousCell]:
        """Cells beyond noise, by the adjusted p-values of all that exist."""
        places = np.argwhere(self.is_used())
        is_beyond = p_values < SIGNIFICANCE
        return [
            NonSynchronousCell(
                run=self.run,
                channel_pattern=self.patterns[p],
                order=float(self.orders[n]),
                measured=float(self.measured[p, n]),
                simulated=float(self.simulated[p, n]),
                gap=float(self.gap[p, n]),
                noise=float(self.noise[p, n]),
                p_value=p_value,
            )
            for (p, n), p_value in zip(
                places[is_beyond].tolist(), p_values[is_beyond].tolist(), strict=True
            )
        ]


def scatter_p_values(scatter: FloatArray, noise: FloatArray, degrees: FloatArray) -> FloatArray:
    """Probability of a scatter under declared noise: ``dof scatter / noise ~ chi²(dof)``.

    Parameters
    ----------
    scatter, noise : ndarray, shape (...)
        Mean square that does not repeat, and that of the noise.
    degrees : ndarray, shape (...)
        Degrees of freedom.
    """
    ratio = scatter / np.maximum(noise, np.finfo(float).tiny)
    return np.asarray(chi2.sf(degrees * ratio, degrees), dtype=np.float64)


def scatter_p_values_estimated(
    scatter: FloatArray, noise: FloatArray, degrees: FloatArray, noise_degrees: float | FloatArray
) -> FloatArray:
    """Probability of a scatter under noise that other samples estimate: ``scatter / noise ~ F``.

    Parameters
    ----------
    scatter, noise : ndarray, shape (...)
        Mean square that does not repeat, and the estimate of that of the noise.
    degrees, noise_degrees : ndarray, shape (...)
        Degrees of freedom of both.
    """
    ratio = scatter / np.maximum(noise, np.finfo(float).tiny)
    return np.asarray(fisher_f.sf(ratio, degrees, noise_degrees), dtype=np.float64)


def significant_non_synchronous(
    tables: Sequence[ScatterTable], off_orders: Sequence[NonSynchronousCell] = ()
) -> tuple[NonSynchronousCell, ...]:
    """Cells whose scatter is beyond noise, and all cells off the orders, largest excess first.

    Parameters
    ----------
    tables : sequence of ScatterTable
        All cells by run, p-values not adjusted; those of hundreds of runs are a million, and few of
        them are beyond noise.
    off_orders : sequence of NonSynchronousCell
        Cells off the orders, p-values not adjusted, NaN where unknown.
    """
    raw = [table.p_value[table.is_used()] for table in tables]
    raw.append(np.array([cell.p_value for cell in off_orders]))
    *by_table, of_others = adjusted_together(raw)
    kept = [cell for table, own in zip(tables, by_table, strict=True) for cell in table.beyond(own)]
    kept += [
        replace(cell, p_value=p_value)
        for cell, p_value in zip(off_orders, of_others.tolist(), strict=True)
    ]
    return tuple(sorted(kept, key=lambda cell: cell.noise - cell.gap))


def repeatability(
    cells: Sequence[NonSynchronousCell], coherent: float, repetition: str
) -> tuple[Repeatability, ...]:
    """What the scatter amounts to; empty where nothing was tested.

    Parameters
    ----------
    cells : sequence of NonSynchronousCell
        Cells of :func:`significant_non_synchronous`.
    coherent : float
        Mean square of the repeating gap, over all runs.
    repetition : str
        ``revolution``, ``period`` or ``repeat``.

    Returns
    -------
    tuple of Repeatability
        One or none.
    """
    beyond = [cell for cell in cells if cell.p_value < SIGNIFICANCE and cell.gap > cell.noise]
    if not beyond:
        is_tested = any(np.isfinite(cell.p_value) for cell in cells)
        return (Repeatability(repetition, 0.0, 0.0, None),) if is_tested else ()
    excess = sum(cell.gap - cell.noise for cell in beyond)
    n_runs = len({cell.run for cell in cells})
    share = excess / coherent if coherent > 0.0 else float("inf")
    return (Repeatability(repetition, float(np.sqrt(excess / n_runs)), share, beyond[0]),)
