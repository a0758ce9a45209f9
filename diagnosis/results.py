"""What a diagnosis says.

Where the gap lies, which effect is missing, how far it shrinks, and the verdict.
"""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.pictures import Picture
from carrierflex.diagnosis.gap.findings import GapDetail
from carrierflex.diagnosis.inference.results import Attribution, GapReduction


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where the gap lies, which effect is missing, how far it shrinks.

    Parameters
    ----------
    campaign, kind : str
        Name and kind of the campaign.
    verdict : str
        One of VERDICTS.
    reason : str
        Why this verdict, in one sentence with its numbers.
    unit : str
        Unit of every RMS.
    where_text : str
        Where the gap lies.
    attribution : Attribution
        Which.
    reduction : GapReduction, optional
        How far; None where the records allow no diagnosis.
    pictures : tuple of Picture
        Gap along the motion, where the plant draws it.
    gap : GapDetail, optional
        The baseline's gap beyond its map, where the plant looks at it.
    """

    campaign: str
    kind: str
    verdict: str
    reason: str
    unit: str
    where_text: str
    attribution: Attribution
    reduction: GapReduction | None = None
    pictures: tuple[Picture, ...] = ()
    gap: GapDetail | None = None


def finite_or_none(value: float) -> float | None:
    """Number for a JSON file, which knows neither NaN nor infinity."""
    return float(value) if np.isfinite(value) else None
