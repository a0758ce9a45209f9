"""S3 where no small set is supported.

Several causes of like size, none of which pays before the others are in.
"""

from carrierflex.diagnosis.comparison.problem import Effects, Signatures
from carrierflex.diagnosis.inference.forward_selection import (
    ForwardSelection,
    best_beside,
    explained_share,
)
from carrierflex.diagnosis.inference.screening import Screen

#: Sets of one size that are extended.
_BEAM = 3
#: A sum of laws of one motion fits any curve: several causes are told apart by the pattern they
#: make over channels.
_FEWEST_CHANNELS = 2
#: The search ends where the best set of a size explains less than this of what the best of the size
#: before it leaves.
_LEAST_STEP = 0.2


def select_jointly(search: ForwardSelection, screened: Screen, signatures: Signatures) -> None:
    """Extend sets by what they fit, not by what each step pays.

    Then drop what does not pay in the end.

    With three causes of like size each explains a third of the gap, and no pair explains most of
    what is left without one of its members; the whole set does. Every member of it must still pass
    the rules of :meth:`carrierflex.diagnosis.inference.forward_selection.ForwardSelection.rejection`.

    Parameters
    ----------
    search : ForwardSelection
        Grows by the sets tried; left alone where a set already explains enough to be named, and
        where one channel is measured.
    screened : Screen
        Force-space screen of the baseline's residual.
    signatures : Signatures
        Columns of the screen.
    """
    if search.problem.n_channels < _FEWEST_CHANNELS or _is_explained(search):
        return
    largest = _grown(search, screened, signatures)
    while len(largest) > 2 and (weakest := _weakest(search, largest)):
        largest = _without(largest, weakest)
        search.score(largest)


def _is_explained(search: ForwardSelection) -> bool:
    """Whether a supported set explains enough of the gap, or the gap is too near the floor for several causes."""
    limits, floor = search.thresholds, search.floor
    before = search.mean_square(())
    if before < limits.stands_out**2 * floor:
        return True
    left = min((search.mean_square(effects) for effects in search.supported_sets()), default=before)
    return (
        left <= limits.far**2 * floor
        or explained_share(before, left, floor) >= limits.named_share_far
    )


def _grown(search: ForwardSelection, screened: Screen, signatures: Signatures) -> Effects:
    """Best-fitting set of the largest size whose last effect still explains a part of what is left."""
    floor = float(search.problem.noise_square.sum())
    near = search.thresholds.far**2 * floor
    beam: list[Effects] = [()]
    while len(beam[0]) < search.thresholds.most_effects and _left(search, beam[0]) > near:
        larger = {
            _with(effects, further): None
            for effects in beam
            for further in best_beside(effects, screened, signatures)
        }
        grown = sorted(larger, key=lambda effects: _left(search, effects))[:_BEAM]
        if not grown:
            break
        grown[0] = _exchanged(search, grown[0], screened, signatures)
        if explained_share(_left(search, beam[0]), _left(search, grown[0]), floor) < _LEAST_STEP:
            break
        beam = grown
    search.score(beam[0])
    return beam[0]


def _exchanged(
    search: ForwardSelection, effects: Effects, screened: Screen, signatures: Signatures
) -> Effects:
    """The set after each member that another effect replaces with a better fit has been replaced."""
    for member in effects:
        rest = _without(effects, member)
        others = [_with(rest, other) for other in best_beside(rest, screened, signatures)]
        effects = min([effects, *others], key=lambda own: _left(search, own))
        if member in effects:
            continue
        return _exchanged(search, effects, screened, signatures)
    return effects


def _left(search: ForwardSelection, effects: Effects) -> float:
    """Sum of squares that a set leaves of the records it is fitted to."""
    return float(search.fit(effects).sums.square.sum())


def _with(effects: Effects, further: str) -> Effects:
    return tuple(sorted((*effects, further)))


def _without(effects: Effects, member: str) -> Effects:
    return tuple(own for own in effects if own != member)


def _weakest(search: ForwardSelection, effects: Effects) -> str:
    """Member that explains least of what is left without it, where that is too little.

    Else empty.
    """
    floor = float(search.problem.noise_square.sum())
    left = float(search.score(effects).square.sum())
    shares = {
        own: explained_share(float(search.score(_without(effects, own)).square.sum()), left, floor)
        for own in effects
    }
    weakest = min(shares, key=lambda own: shares[own])
    return weakest if shares[weakest] < search.thresholds.explained else ""
