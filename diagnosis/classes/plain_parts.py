"""Whether a class that bends needs to, or another class beside its plain law explains the gap.

Members that bend a law (sliders whose strength or spring changes with deflection) let a class
imitate others. A set with them and a set with another class in their place are two sets of two
parts each: neither holds the other, and the one that leaves less is the answer.
"""

from collections.abc import Sequence

from carrierflex.diagnosis.classes.held_out import Classes, ClassScores
from carrierflex.diagnosis.classes.shares import Shares


def plain_first(
    scores: ClassScores, shares: Shares, answer: Classes, candidates: Sequence[str]
) -> Classes:
    """Answer in which no class bends to what is another's.

    Parameters
    ----------
    scores, shares
        Held-out squares, gap and floor.
    answer : tuple of str
        Class, or pair, so far.
    candidates : sequence of str
        Classes that the records can show, the coupled one left out.

    Returns
    -------
    tuple of str
        A class that bends with another one beside it, where that one beside the plain law leaves
        less than the bent class. The bent class alone, where the other one of a pair leaves more
        beside the plain law and gains no more than a bent class leaves of its own. Else the answer.
    """
    for own in scores.table.plain:
        if answer == (own,):
            return _beside_plain(scores, shares, own, candidates)
        if len(answer) == 2 and own in answer:
            return _without_other(scores, shares, own, answer)
    return answer


def _beside_plain(
    scores: ClassScores, shares: Shares, own: str, candidates: Sequence[str]
) -> Classes:
    """A class with the best one beside its plain law, where that explains what bending would."""
    pairs = [(own, name) for name in candidates if name != own]
    if not pairs:
        return (own,)
    best = min(pairs, key=lambda pair: scores.plain.of(pair).total)
    beside, straight = scores.plain.of(best), scores.plain.of((own,))
    is_cause = shares.is_clear_gain(beside, straight, scores.constants.second_cause)
    if is_cause and shares.leaves_less(beside, scores.of((own,))):
        return tuple(sorted(best))
    return (own,)


def _without_other(scores: ClassScores, shares: Shares, own: str, answer: Classes) -> Classes:
    """A class alone where it bends anyway, and what stands beside it gains little."""
    bent = scores.of((own,))
    needs_bending = shares.leaves_less(bent, scores.plain.of(answer))
    gains = shares.gain(scores.of(answer), bent) > scores.constants.beside_bent
    return answer if gains or not needs_bending else (own,)
