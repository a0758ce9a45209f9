"""Result of a blind check."""

from dataclasses import dataclass

from carrierflex.blind_check.scoring.scoring import Score


@dataclass(frozen=True)
class BlindCheck:
    """Score of a blind check and the digest of its seals."""

    score: Score
    digest: str

    @property
    def met(self) -> bool:
        """Whether no wanted figure is missed."""
        return self.score.met
