"""What a diagnosis says.

Where the gap lies, which effect is missing, how far it shrinks, and the verdict.
"""

from dataclasses import dataclass

from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.overlay import Picture, SignalComparison
from carrierflex.diagnosis.gap.findings import GapDetail
from carrierflex.diagnosis.inference.effect_fit import EffectFit
from carrierflex.diagnosis.inference.results import (
    Attribution,
    GapReduction,
)
from carrierflex.identification.campaign.record_digests import RecordDigests
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning


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
    classes : ClassAnswer, optional
        Class of the missing effect; None where the kind has no classes.
    reduction_law : GapReduction, optional
        How far the nearest laws shrink the gap, where `reduction` is that of the class.
    warnings : tuple of CampaignWarning
        What does not look right in the campaign itself.
    baseline : EffectFit, optional
        Fit of the baseline alone; None where the records allow no diagnosis.
    signals : SignalComparison, optional
        Measured and simulated signals; None where the records allow no diagnosis.
    records : RecordDigests, optional
        Digests of the records and files; None where the campaign was not read from a folder.
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
    classes: ClassAnswer | None = None
    reduction_law: GapReduction | None = None
    warnings: tuple[CampaignWarning, ...] = ()
    baseline: EffectFit | None = None
    signals: SignalComparison | None = None
    records: RecordDigests | None = None

    @property
    def shrinks_by_class(self) -> bool:
        """Whether `reduction` is what the answer by class explains, not what laws alone do."""
        is_answered = self.classes is not None and bool(self.classes.classes)
        law = self.reduction_law
        return is_answered and law is not None and self.reduction is not law
