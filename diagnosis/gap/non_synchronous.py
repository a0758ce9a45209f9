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
from carrierflex.diagnosis.gap.significance import SIGNIFICANCE, adjusted


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

    def cells(self) -> tuple[NonSynchronousCell, ...]:
        """Its cells one by one."""
        used = np.ones(self.gap.shape, dtype=bool) if self.used is None else self.used
        return tuple(
            NonSynchronousCell(
                run=self.run,
                channel_pattern=self.patterns[p],
                order=float(self.orders[n]),
                measured=float(self.measured[p, n]),
                simulated=float(self.simulated[p, n]),
                gap=float(self.gap[p, n]),
                noise=float(self.noise[p, n]),
                p_value=float(self.p_value[p, n]),
            )
            for p, n in np.argwhere(used)
        )


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
    cells: Sequence[NonSynchronousCell],
) -> tuple[NonSynchronousCell, ...]:
    """Cells whose scatter is beyond noise, and all cells off the orders, largest excess first.

    Parameters
    ----------
    cells : sequence of NonSynchronousCell
        All cells, p-values not adjusted.
    """
    known = [cell for cell in cells if np.isfinite(cell.p_value)]
    p_values = adjusted([cell.p_value for cell in known])
    tested = [replace(cell, p_value=float(p)) for cell, p in zip(known, p_values, strict=True)]
    untested = [cell for cell in cells if not np.isfinite(cell.p_value)]
    kept = [
        cell for cell in (*tested, *untested) if cell.order is None or cell.p_value < SIGNIFICANCE
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
