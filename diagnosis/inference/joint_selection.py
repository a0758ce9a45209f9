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


def select_jointly(search: ForwardSelection, screened: Screen, signatures: Signatures) -> None:
    """Extend sets by what they fit, not by what each step pays.

    Then drop what does not pay in the end.

    With three causes of like size each explains a third of the gap, and no pair explains most of
    what is left without one of its members; the whole set does. Every member of it must still pass
    the rules of
    :meth:`carrierflex.diagnosis.inference.forward_selection.ForwardSelection.rejection`.

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
    if search.problem.n_channels < search.thresholds.fewest_channels or _is_explained(search):
        return
    largest = _grown(search, screened, signatures)
    while len(largest) > 2 and (weakest := _weakest(search, largest)):
        largest = _without(largest, weakest)
        search.score(largest)


def _is_explained(search: ForwardSelection) -> bool:
    """Whether a supported set explains enough of the gap.

    Also where the gap is too near the floor for several causes.
    """
    limits, floor = search.thresholds, search.floor
    before = search.mean_square(())
    if before < limits.stands_out**2 * floor:
        return True
    remaining = min(
        (search.mean_square(effects) for effects in search.supported_sets()), default=before
    )
    return (
        remaining <= limits.gap_beyond_floor**2 * floor
        or explained_share(before, remaining, floor) >= limits.named_share_beyond
    )


def _grown(search: ForwardSelection, screened: Screen, signatures: Signatures) -> Effects:
    """Best set of the largest size whose last effect still explains a part of the rest."""
    floor = float(search.problem.noise_square.sum())
    near = search.thresholds.gap_beyond_floor**2 * floor
    beam: list[Effects] = [()]
    while (
        len(beam[0]) < search.thresholds.most_effects and _remaining_square(search, beam[0]) > near
    ):
        larger = {
            _with(effects, further): None
            for effects in beam
            for further in best_beside(effects, screened, signatures)
        }
        grown = sorted(larger, key=lambda effects: _remaining_square(search, effects))[:_BEAM]
        if not grown:
            break
        grown[0] = _exchanged(search, grown[0], screened, signatures)
        share = explained_share(
            _remaining_square(search, beam[0]), _remaining_square(search, grown[0]), floor
        )
        if share < search.thresholds.least_step:
            break
        beam = grown
    search.score(beam[0])
    return beam[0]


def _exchanged(
    search: ForwardSelection, effects: Effects, screened: Screen, signatures: Signatures
) -> Effects:
    """The set with each member replaced where another effect fits better."""
    for member in effects:
        rest = _without(effects, member)
        others = [_with(rest, other) for other in best_beside(rest, screened, signatures)]
        best = min([effects, *others], key=lambda candidate: _remaining_square(search, candidate))
        if member not in best:
            return _exchanged(search, best, screened, signatures)
    return effects


def _remaining_square(search: ForwardSelection, effects: Effects) -> float:
    """Sum of squares that a set leaves of the records it is fitted to."""
    return float(search.fit(effects).sums.square.sum())


def _with(effects: Effects, further: str) -> Effects:
    return tuple(sorted((*effects, further)))


def _without(effects: Effects, member: str) -> Effects:
    return tuple(effect for effect in effects if effect != member)


def _weakest(search: ForwardSelection, effects: Effects) -> str:
    """Member that explains least of what is left without it, where that is too little.

    Else empty.
    """
    floor = float(search.problem.noise_square.sum())
    after = float(search.score(effects).square.sum())
    shares = {}
    for effect in effects:
        before = float(search.score(_without(effects, effect)).square.sum())
        shares[effect] = explained_share(before, after, floor)
    weakest = min(shares, key=lambda effect: shares[effect])
    return weakest if shares[weakest] < search.thresholds.explained else ""
