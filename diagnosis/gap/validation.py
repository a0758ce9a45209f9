"""How far the gap is beyond its uncertainty: comparison error by cell, area metric of scalars."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import wasserstein_distance

from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import CellValidation, Scalar, ScalarGap
from carrierflex.diagnosis.gap.significance import significant


def cell_validations(
    before: Sequence[GapCell], after: Sequence[GapCell], numerical: float
) -> tuple[CellValidation, ...]:
    """Comparison error and its uncertainty of every significant cell.

    ASME V&V 20-2009, section 1-5.

    Parameters
    ----------
    before, after : sequence of GapCell
        Map of the baseline and of the accepted model.
    numerical : float
        RMS error of the integration.

    Returns
    -------
    tuple of CellValidation
        Largest error before first.
    """
    shown = significant(before)
    sought = {(cell.run, cell.channel_pattern, cell.order) for cell in shown}
    places = ((cell.run, cell.channel_pattern, cell.order) for cell in after)
    later = {place: after[number] for number, place in enumerate(places) if place in sought}
    result = []
    for cell in shown:
        same = later[cell.run, cell.channel_pattern, cell.order]
        error = float(np.sqrt(cell.mean_square))
        noise_square = max(cell.mean_square - cell.coherent, 0.0)
        u_val = float(np.sqrt(numerical**2 + noise_square))
        result.append(
            CellValidation(
                channel_pattern=cell.channel_pattern,
                order=cell.order,
                run=cell.run,
                error_before=error,
                error_after=float(np.sqrt(max(same.mean_square, 0.0))),
                u_val=u_val,
                is_beyond=error > u_val,
            )
        )
    return tuple(sorted(result, key=lambda row: -row.error_before))


def scalar_gaps(before: Sequence[Scalar], after: Sequence[Scalar]) -> tuple[ScalarGap, ...]:
    """Area metric of every scalar, before and after.

    Parameters
    ----------
    before, after : sequence of Scalar
        The same scalars of the baseline and of the accepted model.

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
