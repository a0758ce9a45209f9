"""Which cells of a gap map are beyond chance, and which of them hold most of the gap."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import false_discovery_control

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell

#: A cell counts as beyond chance where its adjusted p-value is below this: one false cell in a
#: hundred at most among those that are shown.
SIGNIFICANCE = 0.01
#: The position of the gap is that of the cells that hold this share of what is significant.
_MOST_OF_THE_GAP = 0.8


def adjusted(p_values: ArrayLike) -> FloatArray:
    """P-values adjusted for their number under any dependence, same shape.

    References
    ----------
    .. [1] Y. Benjamini, D. Yekutieli, "The control of the false discovery rate in multiple testing
       under dependency", Ann. Statist. 29 (2001) 1165-1188.
    """
    values = np.clip(np.asarray(p_values, dtype=np.float64), 0.0, 1.0)
    if not values.size:
        return values
    return np.asarray(false_discovery_control(values, axis=None, method="by"), dtype=np.float64)


def adjusted_together(tables: Sequence[FloatArray]) -> list[FloatArray]:
    """P-values of several tables adjusted for the number of all that are known; NaN stays."""
    p_values = np.concatenate(tables)
    known = np.isfinite(p_values)
    p_values[known] = adjusted(p_values[known])
    return np.split(p_values, np.cumsum([own.size for own in tables])[:-1])


def is_significant(cell: GapCell) -> bool:
    """Whether a cell holds more than noise, beyond chance."""
    return cell.p_value < SIGNIFICANCE and cell.coherent > 0.0


def significant(cells: Iterable[GapCell]) -> list[GapCell]:
    """Cells beyond chance, in their order."""
    return [cell for cell in cells if is_significant(cell)]


def largest_cells(cells: Sequence[GapCell]) -> list[GapCell]:
    """First cells of a list that together hold 80 % of its gap.

    Parameters
    ----------
    cells : sequence of GapCell
        Significant cells, largest first.

    Returns
    -------
    list of GapCell
        At least one where there is any.
    """
    required = _MOST_OF_THE_GAP * sum(cell.coherent for cell in cells)
    covered = 0.0
    chosen: list[GapCell] = []
    for cell in cells:
        chosen.append(cell)
        covered += cell.coherent
        if covered >= required:
            break
    return chosen
