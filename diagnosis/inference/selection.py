"""The set of effects that the held-out records support, its rivals and everybody's weight."""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.forward_selection import ForwardSelection
from carrierflex.diagnosis.inference.held_out import HeldOut, stacking_weights
from carrierflex.diagnosis.inference.results import RankedSet, Rejection


@dataclass(frozen=True, eq=False)
class Selection:
    """Outcome of the search.

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


def selected(search: ForwardSelection) -> Selection:
    """Accept the smallest supported set that predicts as well as the best.

    Parameters
    ----------
    search : ForwardSelection
        Scores of all sets.

    Returns
    -------
    Selection
        Accepted set, rivals, ranking.
    """
    problem = search.problem
    sets = [
        effects for effects in search.scores if not set(effects) & set(problem.negative_controls)
    ]
    rejections = {effects: search.rejection(effects) for effects in sets if effects}
    supported = [
        effects
        for effects in rejections
        if rejections[effects] is None and np.isfinite(search.mean_square(effects))
    ]
    accepted: Effects = ()
    rivals: list[Effects] = []
    if supported:
        # Supported sets shrink the gap whatever conditions are drawn; the densities of the smallest
        # residuals are overconfident.
        best = min(supported, key=search.mean_square)
        # The best is as good as itself, also where nothing is left and no ratio can be made.
        others = [effects for effects in supported if effects != best]
        equal = [best, *(effects for effects in others if _equal(search, effects, best))]
        accepted = min(
            equal, key=lambda effects: (*_size(search, effects), -search.scores[effects].elpd)
        )
        rivals = [e for e in equal if e != accepted and _size(search, e) <= _size(search, accepted)]
    return Selection(accepted, tuple(rivals), _ranking(search, sets, rejections))


def _equal(search: ForwardSelection, effects: Effects, best: Effects) -> bool:
    """Whether a set predicts as well as the best one.

    Its score is within one standard error of the best set's, or its held-out RMS within a few per
    cent.
    """
    difference = search.scores[best].log_density - search.scores[effects].log_density
    error = float(np.sqrt(difference.size) * difference.std(ddof=1))
    ratio = np.sqrt(search.mean_square(effects) / search.mean_square(best))
    return bool(difference.sum() <= error or ratio <= search.thresholds.equal_rms) and bool(
        ratio <= search.thresholds.never_equal_rms
    )


def _size(search: ForwardSelection, effects: Effects) -> tuple[int, int]:
    return len(effects), len(search.scores[effects].fit.parameters)


def _ranking(
    search: ForwardSelection, sets: list[Effects], rejections: dict[Effects, Rejection | None]
) -> tuple[RankedSet, ...]:
    scores: list[HeldOut] = [search.scores[effects] for effects in sets]
    weights = stacking_weights(scores)
    ranked = [
        RankedSet(
            effects,
            float(weight),
            float(np.sqrt(search.mean_square(effects))),
            score.elpd,
            _reason(effects, rejections.get(effects)),
        )
        for effects, weight, score in zip(sets, weights, scores, strict=True)
    ]
    return tuple(sorted(ranked, key=lambda entry: (-round(entry.weight, 3), entry.held_out_rms)))


def _reason(effects: Effects, rejection: Rejection | None) -> str:
    """Why a set is not among the supported ones; empty where it is."""
    if not effects:
        return "the baseline"
    return "" if rejection is None else rejection.text
