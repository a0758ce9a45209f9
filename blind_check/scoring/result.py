"""Result of a blind check."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from carrierflex.blind_check.scoring.class_score import ClassScore
from carrierflex.blind_check.scoring.scoring import Score


@dataclass(frozen=True)
class BlindCheck:
    """Score of a blind check and the digest of its seals.

    `score` of the kinds judged by effect, `class_score` of those judged by class; None where the
    check holds none. `reference_checks`: scores of other answers to the same seals, by name.
    """

    score: Score | None
    class_score: ClassScore | None
    digest: str
    reference_checks: "Mapping[str, BlindCheck]" = field(default_factory=dict)

    @property
    def met(self) -> bool:
        """Whether no wanted figure is missed."""
        scores = (self.score, self.class_score)
        return all(score is None or score.met for score in scores)


@dataclass(frozen=True)
class ExportedCheck:
    """Folder of sealed campaigns for others to answer, their number and the digest of the seals."""

    folder: Path
    cases: int
    digest: str
