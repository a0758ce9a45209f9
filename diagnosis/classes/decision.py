"""The rule that names a class: nothing, one class, ties, pairs, a coupled surface."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOTHING,
)
from carrierflex.diagnosis.classes.shares import Shares

_MORE_NOTE = (
    "one frequency drives all runs: a second cause is not separable from what one class leaves "
    "in these records"
)

#: In a steady motion at one frequency deflection and speed tell where it stands, its level too.
_SURFACE_NOTE = (
    "one frequency drives all runs: every cause that repeats is a force of deflection and speed in "
    "these records"
)


@dataclass(frozen=True, eq=False)
class Decision:
    """Which classes the rule names.

    Parameters
    ----------
    state : str
        As :class:`carrierflex.diagnosis.classes.results.ClassAnswer`.
    classes : tuple of str
        Answer; empty for "nothing". Where no class is named, the best one all the same.
    ties : tuple of tuple of str
        Sets that are equal to the answer.
    held : HeldOutSquares
        Result of the answer.
    best_pair : tuple of str
        The pair that leaves least.
    note : str
        What is not separable in these records.
    is_inseparable : bool
        Whether a class would be named, did these records not hold its cause mixed with others.
    """

    state: str
    classes: Classes
    ties: tuple[Classes, ...]
    held: HeldOutSquares
    best_pair: Classes
    note: str = ""
    is_inseparable: bool = False


def decide(
    scores: ClassScores,
    shares: Shares,
    candidates: Sequence[str],
    *,
    inseparable: Sequence[str] = (),
    shows_two_causes: bool = True,
    shows_small_causes: bool = True,
    drive_note: str = "",
) -> Decision:
    """Name the class, or the pair, that the held-out blocks show.

    Parameters
    ----------
    scores : ClassScores
        Held-out squares of any set.
    shares : Shares
        Gap, floor and scatter.
    candidates : sequence of str
        Classes that the records can show, the coupled one left out.
    inseparable : sequence of str
        Classes that this drive shows only mixed with others: none of them is named, and where one
        explains clearly more than the answer, nothing is.
    shows_two_causes : bool
        Whether the drive tells two causes, or a coupled one, from another two; else none of them is
        named.
    shows_small_causes : bool
        Whether the drive moves at so many frequencies that a second cause is seen by how much it
        takes of what the first leaves, however little that is; else no class is named where one
        would be seen.
    drive_note : str
        What the drive does not separate.

    Returns
    -------
    Decision
        Answer with its ties.
    """
    singles, pairs = _singles(scores, candidates), _pairs(scores, candidates)
    best_pair = min(pairs, key=lambda pair: pairs[pair].total)
    if is_nothing(scores, shares, [*singles.values(), pairs[best_pair]]):
        return Decision(NOTHING, (), (), scores.of(()), best_pair)
    answer, ties = _answer(
        scores,
        shares,
        candidates,
        shows_two_causes=shows_two_causes,
        shows_small_causes=shows_small_causes,
    )
    result = scores.of(answer)
    limits = scores.constants
    is_single = len(answer) == 1 and answer != (scores.table.surface,)
    holds_all = scores.table.surface in answer and not shows_small_causes
    gains = (
        shares.is_clear_gain(scores.of((name,)), result, limits.second_cause)
        for name in inseparable
    )
    is_mixed = holds_all or not (shows_two_causes or is_single) or any(gains)
    # What a small cause would take: the drive does not tell it from what the answer lacks itself.
    is_more = not shows_small_causes and _answer(scores, shares, candidates)[0] != answer
    explained = state_of(shares, result)
    state = NO_CLASS if is_mixed or is_more else explained
    notes = (drive_note, _SURFACE_NOTE if holds_all else "", _MORE_NOTE if is_more else "")
    note = "; ".join(text for text in notes if text)
    return Decision(state, answer, ties, result, best_pair, note, state != explained)


def is_short(scores: ClassScores, shares: Shares, decision: Decision) -> bool:
    """Whether all classes together explain more than an answer by what a second cause would.

    No second class explains that much more by itself, else it would be in the answer: what is
    missing are more causes than two, or one that no class holds whole.
    """
    least = scores.constants.second_cause
    return shares.is_gain(scores.ceiling(), decision.held, least)


def _singles(scores: ClassScores, candidates: Sequence[str]) -> dict[str, HeldOutSquares]:
    return {name: scores.of((name,)) for name in candidates}


def _pairs(scores: ClassScores, candidates: Sequence[str]) -> dict[Classes, HeldOutSquares]:
    return {pair: scores.of(pair) for pair in combinations(sorted(candidates), 2)}


def _answer(
    scores: ClassScores,
    shares: Shares,
    candidates: Sequence[str],
    *,
    shows_two_causes: bool = True,
    shows_small_causes: bool = True,
) -> tuple[Classes, tuple[Classes, ...]]:
    """The class, pair or coupled class that explains the gap best, and its ties."""
    answer, ties = _single_or_pair(
        shares,
        _singles(scores, candidates),
        _pairs(scores, candidates),
        one_damping=scores.table.coupled_parts,
        shows_small_causes=shows_small_causes,
    )
    second_cause = scores.constants.second_cause
    coupled = _coupled(scores, shares, candidates, shows_small_causes=shows_small_causes)
    if coupled and shares.is_clear_gain(scores.of(coupled), scores.of(answer), second_cause):
        answer, ties = coupled, ()
    damping = _sum_or_product(scores, shares, answer, shows_small_causes=shows_small_causes)
    if damping != answer:
        answer, ties = damping, ()
    plain = _plain_first(scores, shares, answer, candidates) if shows_two_causes else answer
    if plain != answer:
        answer, ties = plain, ()
    return answer, ties


def state_of(shares: Shares, result: HeldOutSquares) -> str:
    """Whether an answer is named, leads, or is no class, by the share it explains."""
    limits, share = shares.constants, shares.of(result)
    if share >= 1.0 - limits.named_left:
        return NAMED_CLASS
    return LEADING_CLASS if share >= limits.leading_share else NO_CLASS


def _coupled(
    scores: ClassScores, shares: Shares, candidates: Sequence[str], *, shows_small_causes: bool
) -> Classes:
    """The coupled class, with a second cause that it does not hold where there is one."""
    table = scores.table
    if not table.surface:
        return ()
    partners = [name for name in candidates if not table.is_in_surface(name)]
    alone = (table.surface,)
    pairs: list[Classes] = [tuple(sorted((table.surface, name))) for name in partners]
    best = min(pairs, key=lambda pair: scores.of(pair).total, default=alone)
    is_cause = _is_cause(shares, scores.of(best), scores.of(alone), may_be_small=shows_small_causes)
    return best if is_cause else alone


def _is_cause(
    shares: Shares, richer: HeldOutSquares, simpler: HeldOutSquares, *, may_be_small: bool
) -> bool:
    """Whether what a richer answer adds is a second cause, however small where that is seen."""
    limits = shares.constants
    return shares.is_clear_gain(richer, simpler, limits.second_cause) or (
        may_be_small and shares.takes_of_left(richer, simpler, limits.small_cause_takes)
    )


def _sum_or_product(
    scores: ClassScores, shares: Shares, answer: Classes, *, shows_small_causes: bool
) -> Classes:
    """Answer in place of a damping of one argument or of a sum of two, where there is a better one.

    What damps by deflection and speed is a sum ``g(v) + h(x) v`` or a product ``h(x) g(v)``. Its
    products with the dry and with the quadratic damping have as many columns as the sum, neither
    set holds the other, and the one that leaves least is the answer. The coupled class says less:
    it leaves little of a sum too. A damping of the speed alone gives way to both arguments where
    they take half of what it leaves, in block after block, and to a product that gains what takes
    the name from a law of the speed.

    Returns
    -------
    tuple of str
        The coupled class with what stands beside it, the sum, or the answer itself.
    """
    table, limits = scores.table, scores.constants
    sum_classes = table.coupled_parts
    if not sum_classes:
        return answer
    if sum_classes == set(answer):
        is_product = _product(scores, ()).total < scores.of(answer).total
        return (table.surface,) if is_product else answer
    if not shows_small_causes or table.uncoupled_part not in answer:
        return answer
    partners = tuple(name for name in answer if name != table.uncoupled_part)
    surface_set = tuple(
        sorted({table.surface, *(n for n in partners if not table.is_in_surface(n))})
    )
    both, result = scores.of(surface_set), scores.of(answer)
    if any(map(table.is_in_surface, partners)):
        takes = shares.takes_of_left(both, result, limits.gain_of_left)
        return surface_set if takes else answer
    product, total = _product(scores, partners), scores.of((*sorted(sum_classes), *partners))
    least = min(both, product, total, key=lambda squares: squares.total)
    takes = shares.takes_of_left(least, result, limits.gain_of_left)
    if product.total < total.total:
        # A law of the speed loses its name to a product that gains as much: so does its class.
        takes = takes or shares.is_gain(product, result, limits.law_parameter)
        return surface_set if takes else answer
    # Beside another class the sum would be a third cause.
    return tuple(sorted(sum_classes)) if takes and not partners else answer


def _product(scores: ClassScores, partners: Classes) -> HeldOutSquares:
    """The product of the coupled class that leaves least beside another class."""
    products = scores.products
    return min(
        (products.of((name, *partners)) for name in scores.table.products),
        key=lambda result: result.total,
    )


def _plain_first(
    scores: ClassScores, shares: Shares, answer: Classes, candidates: Sequence[str]
) -> Classes:
    """Answer in which no class bends to what is another's."""
    for name in scores.table.plain:
        if answer == (name,):
            return _with_plain_law(scores, shares, name, candidates)
        if len(answer) == 2 and name in answer:
            return _without_other(scores, shares, name, answer)
    return answer


def _with_plain_law(
    scores: ClassScores, shares: Shares, bent: str, candidates: Sequence[str]
) -> Classes:
    """A class with the best one beside its plain law, where that explains what bending would."""
    pairs = [(bent, name) for name in candidates if name != bent]
    if not pairs:
        return (bent,)
    best = min(pairs, key=lambda pair: scores.plain.of(pair).total)
    pair_result, straight = scores.plain.of(best), scores.plain.of((bent,))
    is_cause = shares.is_clear_gain(pair_result, straight, scores.constants.second_cause)
    if is_cause and shares.leaves_less(pair_result, scores.of((bent,))):
        return tuple(sorted(best))
    return (bent,)


def _without_other(scores: ClassScores, shares: Shares, name: str, answer: Classes) -> Classes:
    """A class alone where it bends anyway, and what stands beside it gains little."""
    bent = scores.of((name,))
    needs_bending = shares.leaves_less(bent, scores.plain.of(answer))
    gains = shares.gain(scores.of(answer), bent) > scores.constants.beside_bent
    return answer if gains or not needs_bending else (name,)


def is_nothing(scores: ClassScores, shares: Shares, results: Sequence[HeldOutSquares]) -> bool:
    """Whether there is no gap above the floor, or one that looks like coloured noise.

    `results` are what single classes and the best pair leave.
    """
    limits = scores.constants
    before = scores.of(())
    if shares.is_at_floor(before):
        return True
    if before.total > limits.coloured_ratio * float(shares.floor.sum()):
        return False
    return not any(
        shares.gain(result, before)
        > max(limits.nothing_learnt, limits.standard_errors * shares.gain_error(result, before))
        for result in results
    )


def _single_or_pair(
    shares: Shares,
    singles: dict[str, HeldOutSquares],
    pairs: dict[Classes, HeldOutSquares],
    *,
    one_damping: frozenset[str],
    shows_small_causes: bool,
) -> tuple[Classes, tuple[Classes, ...]]:
    """The best class with its ties, or the best pair where it clearly gains."""
    best = min(singles, key=lambda name: singles[name].total)
    best_result = singles[best]
    tied = tuple(
        (name,)
        for name, other in singles.items()
        if name != best and shares.are_equal(other, best_result)
    )
    pair = _best_pair(shares, pairs, best)
    # Whether one damping has two parts, and whether they are a product, is asked apart.
    may_be_small = shows_small_causes and set(pair) != one_damping
    if not _is_cause(shares, pairs[pair], best_result, may_be_small=may_be_small):
        return (best,), tied
    equal = [
        other
        for other, result in pairs.items()
        if other != pair and shares.are_equal(result, pairs[pair])
    ]
    return pair, tuple(equal)


def _best_pair(shares: Shares, pairs: dict[Classes, HeldOutSquares], best: str) -> Classes:
    """The pair that leaves least; one that holds the best single class where that is equal."""
    first = min(pairs, key=lambda pair: pairs[pair].total)
    if best in first:
        return first
    holding = min((pair for pair in pairs if best in pair), key=lambda pair: pairs[pair].total)
    return holding if shares.are_equal(pairs[holding], pairs[first]) else first
