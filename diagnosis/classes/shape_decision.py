"""Which classes the held-out blocks show, of shapes that come in several ways.

A class is ``shape/way``: frame and pattern of a carrier and what it follows, a force of bushings
and whether both have the same. Sets of classes of different shapes grow by the one that leaves
least, as long as each is a gain and together they are a clear one; then every member is replaced by
the simplest way that the records cannot tell from it.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import combinations

from carrierflex.diagnosis.classes.decision import Decision, is_nothing, state_of
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import NOTHING
from carrierflex.diagnosis.classes.shares import Shares

#: Classes of an answer at most: five causes and an error of the sensors.
_MOST_CLASSES = 6
#: Share of the gap that a further class must gain: a cause of two floors beside four of five is
#: 4 % of their gap by itself, and half of that once the others have taken what they can. Signals of
#: these kinds are linear in the columns, so that there is no second order of a first class to take
#: for a second one, as there is of an element's.
FURTHER_CAUSE = 0.01


#: Whether a simpler result may stand for the best one.
_AsGood = Callable[[Shares, HeldOutSquares, HeldOutSquares], bool]


def _is_equal(shares: Shares, simpler: HeldOutSquares, best: HeldOutSquares) -> bool:
    """Whether the records cannot tell a simpler result from the best."""
    return shares.are_equal(simpler, best)


def is_no_clear_gain(shares: Shares, simpler: HeldOutSquares, best: HeldOutSquares) -> bool:
    """Whether the best result gains no more over a simpler one than a small second cause would."""
    return not shares.is_clear_gain(best, simpler, shares.constants.second_cause)


def decide_by_shape(
    scores: ClassScores,
    shares: Shares,
    sizes: Mapping[str, int],
    *,
    as_good: _AsGood = _is_equal,
    chooses_anew: bool = False,
) -> Decision:
    """Name the classes that the held-out blocks show.

    Parameters
    ----------
    scores : ClassScores
        Held-out squares of any set.
    shares : Shares
        Gap, floor and scatter.
    sizes : mapping of str to int
        Columns of each class.
    as_good : callable
        Which simpler way of a shape takes the place of its best.
    chooses_anew : bool
        Whether sets grow by any way of a further shape, and all members' ways are chosen again
        beside it: alone a class follows the loads as what it imitates besides does. Of maps with a
        column for every pair of motions that is too much freedom: together they are a resonance at
        any frequency that one sensor shows by itself.

    Returns
    -------
    Decision
        Answer; its ties are other shapes of no more columns that leave as much.
    """
    first = _best_of_shapes(scores, sizes)
    singles = [(name,) for name in first]
    pairs = list(combinations(sorted(first), 2))
    best_pair = _best(scores, pairs)
    results = [scores.of(classes) for classes in (*singles, best_pair)]
    if is_nothing(scores, shares, results):
        return Decision(NOTHING, (), (), scores.of(()), best_pair)
    if chooses_anew:
        answer = _grown(scores, shares, _best(scores, singles), partial(_anew, scores, sizes))
    else:
        enlarged = partial(_with_one_more, scores, first)
        answer = _grown(scores, shares, _best(scores, singles), enlarged, best_pair)
    answer = simplest(scores, shares, answer, sizes, as_good)
    answer = _needed(scores, shares, answer, sizes, as_good)
    result = scores.of(answer)
    ties = ties_of(scores, shares, answer, sizes)
    return Decision(state_of(shares, result), answer, ties, result, best_pair)


def shape_of(class_name: str) -> str:
    """Shape of a class: all of its id but the last part."""
    return class_name.rsplit("/", 1)[0]


def way_of(class_name: str) -> str:
    """Way of a class: the last part of its id."""
    return class_name.rsplit("/", 1)[1]


def _best_of_shapes(scores: ClassScores, names: Iterable[str]) -> list[str]:
    """Class that alone leaves least of every shape, the best shape first."""
    best: dict[str, str] = {}
    for name in sorted(names, key=lambda name: scores.of((name,)).total):
        best.setdefault(shape_of(name), name)
    return list(best.values())


def rivals_of(scores: ClassScores, decision: Decision, names: Iterable[str]) -> list[str]:
    """Best class of every shape that a decision does not name."""
    taken = {shape_of(name) for name in decision.classes}
    return [name for name in _best_of_shapes(scores, names) if shape_of(name) not in taken]


def _best(scores: ClassScores, sets: Iterable[Classes]) -> Classes:
    """Set that leaves least."""
    return min(sets, key=lambda classes: scores.of(classes).total)


def _grown(
    scores: ClassScores,
    shares: Shares,
    single: Classes,
    enlarged: Callable[[Classes], Classes | None],
    pair: Classes | None = None,
) -> Classes:
    """Set that further shapes do not clearly improve, one or several together.

    Of four causes of like size none takes half of what the first one leaves, all three together do.
    Every one must gain what a second cause has to, or with the next one what two have to; the
    answer is the last set that takes its part of what the answer before it leaves. The first pair
    need not hold the best single class.
    """
    answer = grown = single
    larger = pair or enlarged(single)
    least = shares.constants.second_cause
    while larger is not None and not _fits_all(scores, shares, grown):
        if not shares.is_gain(scores.of(larger), scores.of(grown), least):
            larger = _two_more(scores, shares, grown, larger, enlarged)
        if larger is None:
            break
        grown = larger
        if shares.is_clear_gain(scores.of(grown), scores.of(answer), least):
            answer = grown
        larger = enlarged(grown)
    return answer


def _two_more(
    scores: ClassScores,
    shares: Shares,
    grown: Classes,
    larger: Classes,
    enlarged: Callable[[Classes], Classes | None],
) -> Classes | None:
    """Set with one shape beyond a larger one that is no gain, where both together are two gains.

    What one cause gains scatters with what another one leaves: beside it, it stands clear.
    """
    both = enlarged(larger)
    if both is None:
        return None
    least = shares.constants.second_cause
    is_next = shares.is_gain(scores.of(both), scores.of(larger), least)
    are_two = shares.is_gain(scores.of(both), scores.of(grown), 2.0 * least)
    return both if is_next and are_two else None


def _with_one_more(scores: ClassScores, names: Iterable[str], grown: Classes) -> Classes | None:
    """Best set with one class more of another shape; None where none may be added."""
    if len(grown) >= _MOST_CLASSES:
        return None
    taken = {shape_of(name) for name in grown}
    sets = [tuple(sorted((*grown, name))) for name in names if shape_of(name) not in taken]
    return _best(scores, sets) if sets else None


def _anew(scores: ClassScores, sizes: Mapping[str, int], grown: Classes) -> Classes | None:
    """Best set with one shape more in any way, the way of every member chosen again beside it."""
    larger = _with_one_more(scores, sizes, grown)
    if larger is None:
        return None
    for member in larger:
        others = tuple(name for name in larger if name != member)
        larger = _in_best_way(scores, others, member, sizes)
    return larger


def _fits_all(scores: ClassScores, shares: Shares, answer: Classes) -> bool:
    """Whether a set leaves nothing of the records once it is fitted to all of them.

    It lacks no cause then: what it leaves held out is how far its curves must reach beyond the
    other conditions.
    """
    return shares.is_at_floor(scores.fitted(answer))


def simplest(
    scores: ClassScores,
    shares: Shares,
    answer: Classes,
    sizes: Mapping[str, int],
    as_good: _AsGood,
) -> Classes:
    """Answer whose members follow the loads in the simplest way that leaves as much."""
    for member in answer:
        others = tuple(name for name in answer if name != member)
        ways = [name for name in sizes if shape_of(name) == shape_of(member)]
        sets = [tuple(sorted((*others, way))) for way in sorted(ways, key=lambda n: sizes[n])]
        best = scores.of(_best(scores, sets))
        answer = next(one for one in sets if as_good(shares, scores.of(one), best))
    return answer


def _needed(
    scores: ClassScores,
    shares: Shares,
    answer: Classes,
    sizes: Mapping[str, int],
    as_good: _AsGood,
) -> Classes:
    """Answer without members that pay no more once the others follow the loads as they do best.

    As in its growth each has to gain, and all together to take their part of what the best of them
    leaves alone.
    """
    if len(answer) == 1:
        return answer
    least = shares.constants.second_cause
    for member in answer:
        others = tuple(name for name in answer if name != member)
        rest = simplest(scores, shares, others, sizes, as_good)
        if not shares.is_gain(scores.of(answer), scores.of(rest), least):
            return _needed(scores, shares, rest, sizes, as_good)
    single = _best(
        scores, [simplest(scores, shares, (member,), sizes, as_good) for member in answer]
    )
    return answer if shares.is_clear_gain(scores.of(answer), scores.of(single), least) else single


def ties_of(
    scores: ClassScores, shares: Shares, answer: Classes, sizes: Mapping[str, int]
) -> tuple[Classes, ...]:
    """Sets with one member of another shape that leave as much with no more columns.

    Of the ways to follow the loads of a shape the simplest is listed. What leaves a little more in
    one condition after the other is no tie: of waves of which 96 % are alike 4 % tell.
    """
    result = scores.of(answer)
    taken = {shape_of(name) for name in answer}
    ties: dict[tuple[str, ...], Classes] = {}
    for member in answer:
        others = tuple(name for name in answer if name != member)
        for name in sorted(sizes, key=lambda n: sizes[n]):
            if shape_of(name) in taken or sizes[name] > sizes[member]:
                continue
            rival = tuple(sorted((*others, name)))
            # A simpler way leaves more than its shape does: what would be equal to it alone is not.
            best = [scores.of(_in_best_way(scores, others, way, sizes)) for way in (name, member)]
            pairs = [(result, scores.of(rival)), (best[1], best[0])]
            if all(_is_tie(scores, shares, *pair) for pair in pairs):
                ties.setdefault(tuple(sorted(map(shape_of, rival))), rival)
    return tuple(ties.values())


def _is_tie(
    scores: ClassScores, shares: Shares, result: HeldOutSquares, rival: HeldOutSquares
) -> bool:
    """Whether the records do not tell a result from a rival.

    Folds of blocks of every condition lack the same and agree on anything.
    """
    table = scores.table
    is_distinguished = table.has_whole_conditions and shares.folds_prefer(
        result, rival, table.folds
    )
    return shares.are_equal(result, rival) and not is_distinguished


def _in_best_way(
    scores: ClassScores, others: Classes, member: str, sizes: Mapping[str, int]
) -> Classes:
    """Some classes and, beside them, the way of another class's shape that leaves least."""
    ways = [name for name in sizes if shape_of(name) == shape_of(member)]
    return _best(scores, [tuple(sorted((*others, way))) for way in ways])
