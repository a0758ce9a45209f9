"""The rule that names the classes which the held-out blocks show.

A class is ``shape/way``, or a shape that comes in one way alone: frame and pattern of a carrier and
what it follows, a force of bushings and whether both have the same, a force of an element. Sets of
classes of different shapes grow by the one that leaves least, as long as each is a gain and
together they are a clear one; then every member is replaced by the simplest way that the records
cannot tell from it. An element has two causes at most (:func:`decide`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOTHING,
)
from carrierflex.diagnosis.classes.shares import PairedShares, Shares

#: Classes of an answer at most: five causes and an error of the sensors.
_MOST_CLASSES = 6
#: Share of the gap that a further class must gain: a cause of two floors beside four of five is
#: 4 % of their gap by itself, and half of that once the others have taken what they can. Signals of
#: these kinds are linear in the columns, so that there is no second order of a first class to take
#: for a second one, as there is of an element's.
FURTHER_CAUSE = 0.01


#: Whether a simpler result may stand for the best one.
_AsGood = Callable[[Shares, HeldOutSquares, HeldOutSquares], bool]
_MORE_NOTE = (
    "one frequency drives all runs: in these records a second cause cannot be separated from the "
    "remainder of the first class"
)

#: In a steady motion at one frequency deflection and speed tell where it stands, its level too.
_SURFACE_NOTE = (
    "one frequency drives all runs: every cause that repeats is a force of deflection and speed in "
    "these records"
)


@dataclass(frozen=True, eq=False)
class Decision:
    """Which classes the rule names."""

    state: str  # As :class:`carrierflex.diagnosis.classes.results.ClassAnswer`
    #: Answer; empty for "nothing". Where no class is named, the best one all the same.
    classes: Classes
    ties: tuple[Classes, ...]  # Sets that are equal to the answer
    squares: HeldOutSquares  # Result of the answer
    best_pair: Classes  # The pair that leaves least
    note: str = ""  # What is not separable in these records
    #: Whether a class would be named, did these records not hold its cause mixed with others
    is_inseparable: bool = False

    def replaced(self, scores: ClassScores, classes: Iterable[str]) -> "Decision":
        """Decision for other classes; its ties are sought anew."""
        answer = tuple(sorted(classes))
        if answer == self.classes:
            return self
        return replace(self, classes=answer, ties=(), squares=scores.of(answer))


@dataclass(frozen=True)
class Drive:
    """What the drive of the records of an element can show."""

    candidates: tuple[str, ...]  # Classes that it shows, the coupled one left out or among them
    #: Classes that it shows only mixed with others: none of them is named, and where one explains
    #: clearly more than the answer, nothing is
    inseparable: tuple[str, ...] = ()
    #: Whether it moves at one frequency: a second cause is not seen then by how much it takes of
    #: what the first leaves, and no class is named where one would be seen
    is_one_frequency: bool = False
    #: Whether it is one line in each run: it does not tell two causes, or a coupled one, from
    #: another two, none of which is named
    is_one_line: bool = False
    note: str = ""  # What it does not separate
    experiment: str = ""  # What to record so that a class shows


def is_no_clear_gain(shares: Shares, simpler: HeldOutSquares, best: HeldOutSquares) -> bool:
    """Whether the best result gains no more over a simpler one than a small second cause would."""
    return not shares.is_clear_gain(best, simpler, shares.constants.second_cause)


def shape_of(class_name: str) -> str:
    """Shape of a class: all of its id but the last part."""
    return class_name.rsplit("/", 1)[0]


def way_of(class_name: str) -> str:
    """Way of a class: the last part of its id."""
    return class_name.rsplit("/", 1)[1]


@dataclass(frozen=True, eq=False)
class ClassesByShape:
    """Classes of several shapes, each in several ways, and the rule that names some of them."""

    scores: ClassScores  # Held-out squares of any set
    shares: Shares  # Gap, floor and scatter
    sizes: Mapping[str, int]  # Columns of each class
    as_good: _AsGood = Shares.are_equal  # Which simpler way of a shape takes the place of its best
    #: Whether sets grow by any way of a further shape, and all members' ways are chosen again
    #: beside it: alone a class follows the loads as what it imitates besides does. Of maps with a
    #: column for every pair of motions that is too much freedom: together they are a resonance at
    #: any frequency that one sensor shows by itself.
    chooses_anew: bool = False
    most_classes: int = _MOST_CLASSES  # Classes of an answer at most
    #: Error of the columns of a class over their size, where they are a derivative
    errors: Mapping[str, float] = field(default_factory=dict)

    def decision(self) -> Decision:
        """Classes that the held-out blocks show; ties are other shapes that leave as much."""
        first = self.best_of_shapes()
        singles = [(name,) for name in first]
        best_pair = self.best(combinations(sorted(first), 2))
        results = [self.scores.of(classes) for classes in (*singles, best_pair)]
        if _is_nothing(self.scores, self.shares, results):
            return Decision(NOTHING, (), (), self.scores.of(()), best_pair)
        single = self.best(singles)
        if self.chooses_anew:
            answer = self._grown(single, self._anew)
        else:
            answer = self._grown(single, lambda grown: self._with_one_more(grown, first), best_pair)
        answer = self._needed(self.simplest(answer))
        result = self.scores.of(answer)
        return Decision(state_of(self.shares, result), answer, self.ties(answer), result, best_pair)

    def best(self, sets: Iterable[Classes]) -> Classes:
        """Set that leaves least."""
        return min(sets, key=lambda classes: self.scores.of(classes).total)

    def best_of_shapes(self) -> list[str]:
        """Class that alone leaves least of every shape, the best shape first."""
        best: dict[str, str] = {}
        for name in sorted(self.sizes, key=lambda name: self.scores.of((name,)).total):
            best.setdefault(shape_of(name), name)
        return list(best.values())

    def rivals(self, decision: Decision) -> list[str]:
        """Best class of every shape that a decision does not name."""
        taken = {shape_of(name) for name in decision.classes}
        return [name for name in self.best_of_shapes() if shape_of(name) not in taken]

    def _grown(
        self,
        single: Classes,
        enlarged: Callable[[Classes], Classes | None],
        pair: Classes | None = None,
    ) -> Classes:
        """Set that further shapes do not clearly improve, one or several together.

        Of four causes of like size none takes half of what the first one leaves, all three together
        do. Every one must gain what a second cause has to; the answer is the last set that takes
        its part of what the answer before it leaves. The first pair need not hold the best single
        class.
        """
        scores, shares = self.scores, self.shares
        answer = grown = single
        larger = pair or enlarged(single)
        least = shares.constants.second_cause
        # A set that leaves nothing of the records once it is fitted to all of them lacks no cause:
        # what it leaves held out is how far its curves must reach beyond the other conditions.
        while larger is not None and not shares.is_at_floor(scores.fitted(grown)):
            if not shares.is_gain(scores.of(larger), scores.of(grown), least):
                break
            grown = larger
            if shares.is_clear_gain(scores.of(grown), scores.of(answer), least):
                answer = grown
            larger = enlarged(grown)
        return answer

    def _with_one_more(self, grown: Classes, names: Iterable[str]) -> Classes | None:
        """Best set with one class more of another shape; None where none may be added."""
        if len(grown) >= self.most_classes:
            return None
        taken = {shape_of(name) for name in grown}
        sets = [tuple(sorted((*grown, name))) for name in names if shape_of(name) not in taken]
        return self.best(sets) if sets else None

    def _anew(self, grown: Classes) -> Classes | None:
        """Best set with one shape more in any way, every member's way chosen again beside it."""
        larger = self._with_one_more(grown, self.sizes)
        if larger is None:
            return None
        for member in larger:
            larger = self.in_best_way(without(larger, member), member)
        return larger

    def in_best_way(self, others: Classes, member: str) -> Classes:
        """Some classes and, beside them, the way of another class's shape that leaves least."""
        ways = [name for name in self.sizes if shape_of(name) == shape_of(member)]
        return self.best([tuple(sorted((*others, way))) for way in ways])

    def simplest(self, answer: Classes) -> Classes:
        """Answer whose members follow the loads in the simplest way that leaves as much."""
        for member in answer:
            others = without(answer, member)
            ways = [name for name in self.sizes if shape_of(name) == shape_of(member)]
            ways.sort(key=lambda name: self.sizes[name])
            sets = [tuple(sorted((*others, way))) for way in ways]
            results = [self.scores.of(classes) for classes in sets]
            best = min(results, key=lambda result: result.total)
            answer = next(
                classes
                for classes, result in zip(sets, results, strict=True)
                if self.as_good(self.shares, result, best)
            )
        return answer

    def _needed(self, answer: Classes) -> Classes:
        """Answer without members that pay no more once the others follow the loads best."""
        if len(answer) == 1:
            return answer
        scores, shares, least = self.scores, self.shares, self.shares.constants.second_cause
        for member in answer:
            rest = self.simplest(without(answer, member))
            if not shares.is_gain(scores.of(answer), scores.of(rest), least):
                return self._needed(rest)
        single = self.best([self.simplest((member,)) for member in answer])
        is_several = shares.is_clear_gain(scores.of(answer), scores.of(single), least)
        return answer if is_several else single

    def ties(self, answer: Classes) -> tuple[Classes, ...]:
        """Sets with one member of another shape that leave as much with no more columns.

        Of the ways to follow the loads of a shape the simplest is listed. What leaves a little more
        in one condition after the other is no tie: of waves of which 96 % are alike 4 % tell.
        Columns that are wrong by a share e of their size may leave ``e^2`` of what they explain.
        """
        scores, sizes = self.scores, self.sizes
        result = scores.of(answer)
        taken = {shape_of(name) for name in answer}
        ties: dict[tuple[str, ...], Classes] = {}
        for member in answer:
            others = without(answer, member)
            for name in sorted(sizes, key=lambda n: sizes[n]):
                if shape_of(name) in taken or sizes[name] > sizes[member]:
                    continue
                rival = tuple(sorted((*others, name)))
                # A simpler way leaves more than its shape does: what would be equal to it alone is
                # not.
                best = [scores.of(self.in_best_way(others, way)) for way in (name, member)]
                pairs = [(result, scores.of(rival)), (best[1], best[0])]
                square = self.errors.get(name, 0.0) ** 2
                remaining = scores.of(others).total
                if all(
                    self.shares.are_equal(one, other)
                    or other.total - square * (remaining - other.total) <= one.total
                    for one, other in pairs
                ):
                    ties.setdefault(tuple(sorted(map(shape_of, rival))), rival)
        return tuple(ties.values())


def without(classes: Classes, member: str) -> Classes:
    """Classes but for one of them."""
    return tuple(name for name in classes if name != member)


def decide(
    scores: ClassScores, drive: Drive, *, floor_is_known: bool = True
) -> tuple[Shares, Decision]:
    """Class, or the two, of an element that the held-out blocks show, and shares that judge it.

    `floor_is_known`: whether shares are of the gap above the floor, or of all that the baseline
    leaves: a floor that was taken from what no class learns would make the best class right by
    definition.
    """
    table, limits = scores.table, scores.constants
    # Where one line drives all runs, blocks of one level go round one curve: their ratios are one
    # finding many times, and say nothing of how sure it is.
    shares_of = Shares if drive.is_one_line else PairedShares
    floor = table.floor if floor_is_known else np.zeros_like(table.floor)
    shares = shares_of(scores.of(()).squares, floor, limits)
    surface = table.surface
    candidates = [name for name in drive.candidates if name != surface]
    # Every class comes in one way, and none is simpler than another.
    ways = dict.fromkeys(candidates, 1)
    decision = ClassesByShape(scores, shares, ways, most_classes=2).decision()
    if decision.state == NOTHING:
        return shares, decision

    small = _with_surface(scores, shares, _with_small_cause(scores, shares, decision), candidates)
    with_small = _with_damping(scores, shares, small, shows_small_causes=True)
    if drive.is_one_frequency:
        decision = _with_surface(scores, shares, decision, candidates)
        decision = _with_damping(scores, shares, decision, shows_small_causes=False)
    else:
        decision = with_small
    result = decision.squares
    is_single = len(decision.classes) == 1 and decision.classes != (surface,)
    holds_all = surface in decision.classes and drive.is_one_frequency
    gains = (
        shares.is_clear_gain(scores.of((name,)), result, limits.second_cause)
        for name in drive.inseparable
    )
    is_mixed = holds_all or (drive.is_one_line and not is_single) or any(gains)
    # What a small cause would take: the drive does not tell it from what the answer lacks itself.
    is_more = drive.is_one_frequency and with_small.classes != decision.classes
    explained = state_of(shares, result)
    state = NO_CLASS if is_mixed or is_more else explained
    notes = (drive.note, _SURFACE_NOTE if holds_all else "", _MORE_NOTE if is_more else "")
    note = "; ".join(text for text in notes if text)
    is_inseparable = state != explained
    return shares, replace(decision, state=state, note=note, is_inseparable=is_inseparable)


def _with_small_cause(scores: ClassScores, shares: Shares, decision: Decision) -> Decision:
    """Decision for the best pair where the second class takes most of what the first leaves."""
    pair = decision.best_pair
    if len(decision.classes) > 1 or set(pair) == scores.table.coupled_parts:
        return decision
    takes = scores.constants.small_cause_takes
    if not shares.takes_of_remaining(scores.of(pair), decision.squares, takes):
        return decision
    return decision.replaced(scores, pair)


def _with_surface(
    scores: ClassScores, shares: Shares, decision: Decision, candidates: Sequence[str]
) -> Decision:
    """Decision for the coupled class, with a second cause beyond it where there is one."""
    table, second_cause = scores.table, scores.constants.second_cause
    if not table.surface:
        return decision
    classes: Classes = (table.surface,)
    pairs = [
        tuple(sorted((table.surface, name))) for name in candidates if not table.is_in_surface(name)
    ]
    if pairs:
        pair = min(pairs, key=lambda classes: scores.of(classes).total)
        is_cause = shares.is_clear_gain(scores.of(pair), scores.of(classes), second_cause)
        classes = pair if is_cause else classes
    is_gain = shares.is_clear_gain(scores.of(classes), decision.squares, second_cause)
    return decision.replaced(scores, classes) if is_gain else decision


def _with_damping(
    scores: ClassScores, shares: Shares, decision: Decision, *, shows_small_causes: bool
) -> Decision:
    """Decision whose damping of one argument, or sum of two, is what there is a better one of.

    What damps by deflection and speed is a sum ``g(v) + h(x) v`` or a product ``h(x) g(v)``. Its
    products with the dry and with the quadratic damping have as many columns as the sum, neither
    set holds the other, and the one that leaves least is the answer. The coupled class says less:
    it leaves little of a sum too. A damping of the speed alone gives way to both arguments where
    they take half of what it leaves, in block after block, and to a product that gains what takes
    the name from a law of the speed.
    """
    table, limits, answer = scores.table, scores.constants, decision.classes
    sum_classes = table.coupled_parts
    if not sum_classes:
        return decision
    if sum_classes == set(answer):
        is_product = _product(scores, ()).total < scores.of(answer).total
        return decision.replaced(scores, (table.surface,)) if is_product else decision
    if not shows_small_causes or table.uncoupled_part not in answer:
        return decision
    partners = without(answer, table.uncoupled_part)
    outside = [name for name in partners if not table.is_in_surface(name)]
    with_surface = decision.replaced(scores, {table.surface, *outside})
    both, result = with_surface.squares, scores.of(answer)
    if len(outside) < len(partners):
        takes = shares.takes_of_remaining(both, result, limits.gain_of_left)
        return with_surface if takes else decision
    product, total = _product(scores, partners), scores.of((*sorted(sum_classes), *partners))
    least = min(both, product, total, key=lambda squares: squares.total)
    takes = shares.takes_of_remaining(least, result, limits.gain_of_left)
    if product.total < total.total:
        # A law of the speed loses its name to a product that gains as much: so does its class.
        takes = takes or shares.is_gain(product, result, limits.law_parameter)
        return with_surface if takes else decision
    # Beside another class the sum would be a third cause.
    return decision.replaced(scores, sum_classes) if takes and not partners else decision


def _product(scores: ClassScores, partners: Classes) -> HeldOutSquares:
    """The product of the coupled class that leaves least beside another class."""
    products = scores.products
    return min(
        (products.of((name, *partners)) for name in scores.table.products),
        key=lambda result: result.total,
    )


def is_short(scores: ClassScores, shares: Shares, decision: Decision) -> bool:
    """Whether all classes together explain more than an answer by what a second cause would.

    No second class explains that much more by itself, else it would be in the answer: what is
    missing are more causes than two, or one that no class holds whole.
    """
    least = scores.constants.second_cause
    return shares.is_gain(scores.ceiling(), decision.squares, least)


def changed_size(scores: ClassScores, shares: Shares, decision: Decision) -> float:
    """How far the force of one class changes its size, where that is much of what it leaves.

    A force whose size changes in the course of the records (by heat, wear, another load) follows no
    law of its class. Relative standard deviation over the blocks; zero where it keeps its size, or
    a law could be all of the cause.
    """
    limits, result = shares.constants, decision.squares
    fitted = scores.fitted(decision.classes)
    is_whole = shares.is_at_floor(fitted) or shares.of(result) >= limits.law_explains
    if len(decision.classes) != 1 or is_whole:
        return 0.0
    deviation, taken = scores.size_change(result)
    above_floor = fitted.total - float(shares.floor.sum())
    return deviation if taken > limits.size_changes * above_floor else 0.0


def state_of(shares: Shares, result: HeldOutSquares) -> str:
    """Whether an answer is named, leads, or is no class, by the share it explains."""
    limits, share = shares.constants, shares.of(result)
    if share >= 1.0 - limits.named_left:
        return NAMED_CLASS
    return LEADING_CLASS if share >= limits.leading_share else NO_CLASS


def _is_nothing(scores: ClassScores, shares: Shares, results: Sequence[HeldOutSquares]) -> bool:
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
