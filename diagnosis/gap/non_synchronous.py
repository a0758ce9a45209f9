"""What does not repeat.

Scatter of every cell over the repetitions against the noise, and what lies off the orders.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import chi2, false_discovery_control
from scipy.stats import f as fisher_f

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.gap.findings import SIGNIFICANCE, NonSynchronousCell, size_words

#: A part that does not repeat is said where it is this share of the repeating part; below it is
#: noted in the table only.
_NAMED_SHARE = 0.01


def scatter_p_values(scatter: FloatArray, noise: FloatArray, degrees: FloatArray) -> FloatArray:
    """Probability of a scatter under declared noise: ``dof scatter / noise ~ chi²(dof)``.

    Parameters
    ----------
    scatter, noise : ndarray, shape (...)
        Mean square that does not repeat, and that of the noise.
    degrees : ndarray, shape (...)
        Degrees of freedom.
    """
    return np.asarray(
        chi2.sf(degrees * scatter / np.maximum(noise, np.finfo(float).tiny), degrees),
        dtype=np.float64,
    )


def scatter_p_values_estimated(
    scatter: FloatArray, noise: FloatArray, degrees: FloatArray, noise_degrees: float
) -> FloatArray:
    """The same where the noise is estimated from other samples: ``scatter / noise ~ F``."""
    ratio = scatter / np.maximum(noise, np.finfo(float).tiny)
    return np.asarray(fisher_f.sf(ratio, degrees, noise_degrees), dtype=np.float64)


def significant_non_synchronous(
    cells: Sequence[NonSynchronousCell],
) -> tuple[NonSynchronousCell, ...]:
    """Cells whose scatter is beyond noise, and those off the orders whatever they are, largest excess first.

    Parameters
    ----------
    cells : sequence of NonSynchronousCell
        All cells, p-values not adjusted.
    """
    known = [cell for cell in cells if np.isfinite(cell.p_value)]
    adjusted = (
        false_discovery_control([cell.p_value for cell in known], method="by") if known else ()
    )
    found = [replace(cell, p_value=float(p)) for cell, p in zip(known, adjusted, strict=True)]
    found += [cell for cell in cells if not np.isfinite(cell.p_value)]
    kept = [cell for cell in found if cell.order is None or cell.p_value < SIGNIFICANCE]
    return tuple(sorted(kept, key=lambda cell: cell.noise - cell.gap))


def non_synchronous_words(
    cells: Sequence[NonSynchronousCell],
    coherent: float,
    unit: str,
    repeats: str,
    *,
    noun: str = "order",
) -> str:
    """One clause about what does not repeat.

    Parameters
    ----------
    cells : sequence of NonSynchronousCell
        Adjusted cells.
    coherent : float
        Mean square of the repeating gap, over all runs.
    unit : str
        Unit of the channels.
    repeats : str
        ``revolution to revolution``, ``period to period`` or ``repeat to repeat``.
    noun : str
        What cells are numbered by.
    """
    if not cells:
        return ""
    beyond = [cell for cell in cells if cell.p_value < SIGNIFICANCE and cell.gap > cell.noise]
    excess = sum(cell.gap - cell.noise for cell in beyond)
    if not beyond:
        tested = any(np.isfinite(cell.p_value) for cell in cells)
        return f"what does not repeat from {repeats} is noise" if tested else ""
    if excess < _NAMED_SHARE * coherent:
        return f"what does not repeat from {repeats} is below {100.0 * _NAMED_SHARE:.0f} % of what does"
    first = beyond[0]
    place = "off the shaft orders" if first.order is None else f"at {noun} {first.order:g}"
    runs = len({cell.run for cell in cells})
    size = np.sqrt(excess / max(runs, 1))
    return (
        f"beside it {size_words(size, unit)} RMS does not repeat from {repeats}, most of it {place} in {first.run} "
        f"({first.channel_pattern}, {np.sqrt(first.gap / first.noise) if first.noise > 0.0 else np.inf:.1f} times the noise)"
    )
