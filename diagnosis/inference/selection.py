"""Which of the few sets of laws that were fitted the held-out records support."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import Effects
from carrierflex.diagnosis.inference.law_fits import LawFits
from carrierflex.diagnosis.inference.results import RankedSet, Rejection
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem

#: Sets of laws that are fitted in the simulator at most.
_MOST_SETS = 12


@dataclass(frozen=True, eq=False)
class Selection:
    """What the fits of the laws say.

    Parameters
    ----------
    accepted : tuple of str
        Smallest supported set within one standard error of the best; empty where none is supported.
    rivals : tuple of tuple of str
        Other supported sets, equal to it within the standard error, of as many parameters or fewer,
        or of laws that the cards call its aliases.
    ranking : tuple of RankedSet
        All sets that were fitted, smallest held-out RMS first.
    """

    accepted: Effects
    rivals: tuple[Effects, ...]
    ranking: tuple[RankedSet, ...]


def candidate_sets(
    problem: ComparisonProblem, of_table: Sequence[Effects] | None
) -> tuple[Effects, ...]:
    """Sets of laws that are fitted.

    Parameters
    ----------
    problem : ComparisonProblem
        Its cards are the laws on trial.
    of_table : sequence of tuple of str, optional
        Sets that the table of the classes proposes; None where the records are too short for a
        table, and every law is fitted by itself.
    """
    if of_table is None:
        return tuple((law,) for law in problem.cards)
    return tuple(laws for laws in of_table if set(laws) <= set(problem.cards))[:_MOST_SETS]


def selected(fits: LawFits, sets: Sequence[Effects]) -> Selection:
    """Fit sets of laws and accept the smallest supported one that predicts as well as the best.

    Parameters
    ----------
    fits : LawFits
        Fits and held-out scores; grows by the sets.
    sets : sequence of tuple of str
        Sets of laws, small ones first.

    Returns
    -------
    Selection
        Accepted set, rivals, ranking.
    """
    fits.score(())
    for size in sorted({len(laws) for laws in sets}):
        fits.score_all([laws for laws in sets if len(laws) == size])
    rejections = {laws: fits.rejection(laws) for laws in sets}
    supported = [
        laws
        for laws, rejection in rejections.items()
        if rejection is None and np.isfinite(fits.mean_square(laws))
    ]
    accepted: Effects = ()
    rivals: list[Effects] = []
    if supported:
        best = min(supported, key=fits.mean_square)
        # The best is as good as itself, also where nothing is left and no ratio can be made.
        equal = [laws for laws in supported if laws == best or _equal(fits, laws, best)]
        accepted = min(equal, key=lambda laws: (*_size(fits, laws), -fits.scores[laws].elpd))
        rivals = [laws for laws in equal if laws != accepted and _is_rival(fits, laws, accepted)]
    ranking = [
        RankedSet(laws, float(np.sqrt(fits.mean_square(laws))), _reason(rejections[laws]))
        for laws in sets
    ]
    ordered = sorted(ranking, key=lambda entry: entry.held_out_rms)
    return Selection(accepted, tuple(rivals), tuple(ordered))


def _equal(fits: LawFits, laws: Effects, best: Effects) -> bool:
    """Whether a set predicts as well as the best: within one standard error or a few per cent."""
    difference = fits.scores[best].log_density - fits.scores[laws].log_density
    error = float(np.sqrt(difference.size) * difference.std(ddof=1))
    ratio = float(np.sqrt(fits.mean_square(laws) / fits.mean_square(best)))
    limits = fits.thresholds
    is_near = float(difference.sum()) <= error or ratio <= limits.equal_rms
    return is_near and ratio <= limits.never_equal_rms


def _is_rival(fits: LawFits, laws: Effects, accepted: Effects) -> bool:
    """Whether laws that predict as well may be the cause instead.

    More parameters than those accepted speak against laws, unless these are known to pass for them:
    pins with clearance look like stiffer pins at one load.
    """
    if _size(fits, laws) <= _size(fits, accepted):
        return True
    others = [law for law in laws if law not in accepted]
    replaced = [law for law in accepted if law not in laws]
    return len(others) == len(replaced) and all(
        any(other in fits.problem.cards[law].aliases for other in others) for law in replaced
    )


def _size(fits: LawFits, laws: Effects) -> tuple[int, int]:
    return len(laws), len(fits.scores[laws].fit.parameters)


def _reason(rejection: Rejection | None) -> str:
    """Why a set is not among the supported ones; empty where it is."""
    return "" if rejection is None else rejection.text
