"""What a diagnosis says.

Where the gap lies, which effect is missing, how far it shrinks, and the verdict.
"""

from dataclasses import dataclass
from typing import Annotated

from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.overlay import Picture, SignalComparison
from carrierflex.diagnosis.gap.findings import GapDetail
from carrierflex.diagnosis.inference.effect_fit import EffectFit
from carrierflex.diagnosis.inference.results import Attribution, GapReduction
from carrierflex.identification.campaign.record_digests import RecordDigests
from carrierflex.identification.campaign_check.campaign_warning import CampaignWarning


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where the gap lies, which effect is missing, how far it shrinks."""

    campaign: Annotated[str, "Name of the campaign"]
    kind: Annotated[str, "Its kind"]
    verdict: Annotated[str, "One of VERDICTS"]
    reason: Annotated[str, "Why this verdict, in one sentence with its numbers"]
    unit: Annotated[str, "Unit of every RMS"]
    attribution: Annotated[Attribution, "Which"]
    reduction: Annotated[
        GapReduction | None, "How far; None where the records allow no diagnosis"
    ] = None
    reason_id: Annotated[
        str,
        "`floor_unknown` where a gap cannot be distinguished from noise of unknown size; the id "
        "of a fault of the measurement that explains as much as what is named; else empty",
    ] = ""
    pictures: Annotated[tuple[Picture, ...], "Gap along the motion, where the kind draws it"] = ()
    gap: Annotated[
        GapDetail | None, "Gap of the baseline beyond its map; None where nothing was diagnosed"
    ] = None
    classes: Annotated[
        ClassAnswer | None, "Class of the missing effect; None where the kind has no classes"
    ] = None
    reduction_law: Annotated[
        GapReduction | None,
        "How far the nearest laws shrink the gap, where `reduction` is that of the class",
    ] = None
    warnings: Annotated[
        tuple[CampaignWarning, ...], "What does not look right in the campaign itself"
    ] = ()
    baseline: Annotated[
        EffectFit | None, "Fit of the baseline alone; None where the records allow no diagnosis"
    ] = None
    signals: Annotated[
        SignalComparison | None,
        "Measured and simulated signals; None where the records allow no diagnosis",
    ] = None
    records: Annotated[
        RecordDigests | None,
        "Digests of the records and files; None where the campaign was not read from a folder",
    ] = None

    @property
    def class_ids(self) -> tuple[str, ...]:
        """Classes of the answer; none where the kind has no classes."""
        return self.classes.ids if self.classes else ()

    @property
    def shrinks_by_class(self) -> bool:
        """Whether `reduction` is what the answer by class explains, not what laws alone do."""
        is_answered = self.classes is not None and bool(self.classes.classes)
        law = self.reduction_law
        return is_answered and law is not None and self.reduction is not law
