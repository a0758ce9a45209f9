"""How far the gap is beyond its uncertainty: comparison error by cell, area metric of scalars."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import wasserstein_distance

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import CellValidation, Scalar, ScalarGap
from carrierflex.diagnosis.gap.gap_map import GapMap, map_of

#: Cells of hundreds of runs are some hundred thousand, and the first 200 are written.
_MOST_CELLS = 1000


def cell_validations(
    before: Sequence[GapCell], after: Sequence[GapCell], numerical: float
) -> tuple[CellValidation, ...]:
    """Comparison error and its uncertainty of every significant cell.

    ASME V&V 20-2009, section 1-5.
    """
    every = map_of(before)
    significant = every.chosen(every.are_significant)
    shown = significant.sorted_by(-np.sqrt(significant.mean_squares))[:_MOST_CELLS]
    rows = zip(
        shown,
        np.sqrt(shown.mean_squares).tolist(),
        np.sqrt(np.maximum(_mean_squares_after(shown, map_of(after)), 0.0)).tolist(),
        np.sqrt(numerical**2 + shown.noise).tolist(),
        strict=True,
    )
    return tuple(
        CellValidation(
            channel_pattern=cell.channel_pattern,
            order=cell.order,
            run=cell.run,
            error_before=error_before,
            error_after=error_after,
            u_val=u_val,
            is_beyond=error_before > u_val,
        )
        for cell, error_before, error_after, u_val in rows
    )


def _mean_squares_after(shown: GapMap, after: GapMap) -> list[float]:
    """Mean squares of the same cells in another map, which may hold a million."""
    sought = [(cell.run, cell.channel_pattern, cell.order) for cell in shown]
    wanted = set(sought)
    mean_squares = {}
    rows = zip(after.places, after.orders, after.mean_squares, strict=True)
    for (run, pattern), order, mean_square in rows:
        key = (after.runs[run], after.patterns[pattern], float(order))
        if key in wanted:
            mean_squares[key] = float(mean_square)
    return [mean_squares[key] for key in sought]


def scalar_gaps(before: Sequence[Scalar], after: Sequence[Scalar]) -> tuple[ScalarGap, ...]:
    """Area metric of every scalar, before and after.

    References
    ----------
    .. [1] S. Ferson, W. L. Oberkampf, L. Ginzburg, "Model validation and predictive capability for
       the thermal challenge problem", Comput. Methods Appl. Mech. Engrg. 197 (2008) 2408-2430.
    """
    return tuple(
        ScalarGap(
            name=old.name,
            unit=old.unit,
            measured_mean=float(np.mean(old.measured)),
            area_before=float(wasserstein_distance(old.measured, old.predicted)),
            area_after=float(wasserstein_distance(new.measured, new.predicted)),
        )
        for old, new in zip(before, after, strict=True)
    )
