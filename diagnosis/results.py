"""What a diagnosis says.

Where the gap lies, which effect is missing, how far it shrinks, and the verdict.
"""

from dataclasses import dataclass

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
    attribution : Attribution
        Which.
    reduction : GapReduction, optional
        How far; None where the records allow no diagnosis.
    pictures : tuple of Picture
        Gap along the motion, where the kind draws it.
    gap : GapDetail, optional
        Gap of the baseline beyond its map; None where nothing was diagnosed.
    """

    campaign: str
    kind: str
    verdict: str
    reason: str
    unit: str
    attribution: Attribution
    reduction: GapReduction | None = None
    pictures: tuple[Picture, ...] = ()
    gap: GapDetail | None = None
