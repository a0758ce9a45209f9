"""The set of effects that the held-out records support, its rivals and everybody's weight."""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.forward_selection import Ladder
from carrierflex.diagnosis.inference.held_out import HeldOut, stacking_weights
from carrierflex.diagnosis.inference.results import RankedSet


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of the ladder.

    Parameters
    ----------
    accepted : tuple of str
        Smallest supported set within one standard error of the best; empty where none is supported.
    rivals : tuple of tuple of str
        Other supported sets of as many parameters or fewer, equal to it within the standard error.
    ranking : tuple of RankedSet
        All sets, largest weight first, then smallest held-out RMS.
    """

    accepted: Effects
    rivals: tuple[Effects, ...]
    ranking: tuple[RankedSet, ...]

    def class_weight(self, classes: tuple[Effects, ...]) -> float:
        """Weight of all sets that hold a member of every class."""
        return sum(
            ranked.weight
            for ranked in self.ranking
            if classes and all(set(ranked.effects) & set(members) for members in classes)
        )


def selected(ladder: Ladder) -> Selection:
    """Accept the smallest supported set that predicts as well as the best.

    Parameters
    ----------
    ladder : Ladder
        Scores of all sets.

    Returns
    -------
    Selection
        Accepted set, rivals, ranking.
    """
    plant = ladder.plant
    sets = [effects for effects in ladder.scores if not set(effects) & set(plant.placebos)]
    refused = {effects: ladder.refusal(effects) if effects else "the baseline" for effects in sets}
    supported = [effects for effects in sets if not refused[effects]]
    accepted: Effects = ()
    rivals: list[Effects] = []
    if supported:
        # Supported sets shrink the gap whatever conditions are drawn; the densities of the smallest
        # residuals are overconfident.
        best = min(supported, key=ladder.mean_square)
        equal = [effects for effects in supported if _equal(ladder, effects, best)]
        accepted = min(
            equal, key=lambda effects: (*_size(ladder, effects), -ladder.scores[effects].elpd)
        )
        rivals = [e for e in equal if e != accepted and _size(ladder, e) <= _size(ladder, accepted)]
    return Selection(accepted, tuple(rivals), _ranking(ladder, sets, refused))


def _equal(ladder: Ladder, effects: Effects, best: Effects) -> bool:
    """Whether a set's score is within one standard error of the best set's, or its held-out RMS within a few per cent."""
    difference = ladder.scores[best].log_density - ladder.scores[effects].log_density
    error = float(np.sqrt(difference.size) * difference.std(ddof=1))
    ratio = np.sqrt(ladder.mean_square(effects) / ladder.mean_square(best))
    return bool(difference.sum() <= error or ratio <= ladder.thresholds.equal_rms) and bool(
        ratio <= ladder.thresholds.never_equal_rms
    )


def _size(ladder: Ladder, effects: Effects) -> tuple[int, int]:
    return len(effects), len(ladder.scores[effects].fit.parameters)


def _ranking(
    ladder: Ladder, sets: list[Effects], refused: dict[Effects, str]
) -> tuple[RankedSet, ...]:
    scores: list[HeldOut] = [ladder.scores[effects] for effects in sets]
    weights = stacking_weights(scores)
    ranked = [
        RankedSet(
            effects,
            float(weight),
            float(np.sqrt(ladder.mean_square(effects))),
            score.elpd,
            refused[effects],
        )
        for effects, weight, score in zip(sets, weights, scores, strict=True)
    ]
    return tuple(sorted(ranked, key=lambda own: (-round(own.weight, 3), own.held_out_rms)))
