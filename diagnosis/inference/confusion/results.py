"""What a confusion matrix says."""

from dataclasses import dataclass
from functools import cached_property

from carrierflex.diagnosis.comparison.problem import Effects


@dataclass(frozen=True)
class Answer:
    """What a diagnosis answers: verdicts that say the same of the cause are one answer.

    ``named_with_remainder`` of a set is ``named`` of that set.

    Parameters
    ----------
    verdict : str
        A verdict.
    causes : tuple of str
        Named effects or classes, sorted; every member of the classes of "aliased".
    """

    verdict: str
    causes: tuple[str, ...] = ()


@dataclass(frozen=True)
class ConfusionRow:
    """Answers to a campaign that was simulated with a candidate as the truth.

    Parameters
    ----------
    effects : tuple of str
        The candidate; empty for the baseline alone.
    answers : tuple of Answer
        One a draw, in the order of the draws.
    seeds : tuple of tuple of int
        Seed of the noise of each draw.
    """

    effects: Effects
    answers: tuple[Answer, ...]
    seeds: tuple[tuple[int, ...], ...]

    def count(self, answer: Answer) -> int:
        """Draws with this answer."""
        return self.answers.count(answer)


@dataclass(frozen=True)
class Confusion:
    """The campaign simulated at each candidate's fit, diagnosed and counted.

    Parameters
    ----------
    answer : Answer
        Answer to the measured campaign.
    named : tuple of str
        Candidate that the held-out records support best; empty where they support none.
    rows : tuple of ConfusionRow
        Candidates, the baseline alone first.
    noise_of : tuple of str
        Candidate whose residual is the noise.
    """

    answer: Answer
    named: Effects
    rows: tuple[ConfusionRow, ...]
    noise_of: Effects

    @property
    def n_diagnoses(self) -> int:
        """Simulated campaigns that were diagnosed."""
        return sum(len(row.answers) for row in self.rows)

    @cached_property
    def columns(self) -> tuple[Answer, ...]:
        """Every answer: that of the measured campaign, then the others as they come up most."""
        others = [answer for row in self.rows for answer in row.answers if answer != self.answer]
        return (self.answer, *sorted(dict.fromkeys(others), key=lambda own: -others.count(own)))

    def counts(self, row: ConfusionRow) -> tuple[int, ...]:
        """Draws of a row by column."""
        return tuple(row.count(answer) for answer in self.columns)

    def row_of(self, effects: Effects) -> ConfusionRow | None:
        """Row of a candidate; None where it was not simulated."""
        wanted = tuple(sorted(effects))
        return next((row for row in self.rows if row.effects == wanted), None)
