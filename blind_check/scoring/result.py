"""Result of a blind check."""

from dataclasses import dataclass

from carrierflex.blind_check.scoring.class_score import ClassScore
from carrierflex.blind_check.scoring.scoring import Score


@dataclass(frozen=True)
class BlindCheck:
    """Score of a blind check and the digest of its seals.

    `score` of the kinds judged by effect, `class_score` of those judged by class; None where the
    check holds none.
    """

    score: Score | None
    class_score: ClassScore | None
    digest: str

    @property
    def met(self) -> bool:
        """Whether no wanted figure is missed."""
        scores = (self.score, self.class_score)
        return all(score is None or score.met for score in scores)
