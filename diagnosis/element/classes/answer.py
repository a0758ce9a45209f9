"""Class of the missing effect of an element: what the drive can show, decision, shapes."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from carrierflex.diagnosis.classes.answer import (
    ShapeOf,
    class_answer,
    class_decision,
    nearest_law,
    without_classes,
)
from carrierflex.diagnosis.classes.decision import Decision, is_short, state_of
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.law_sets import law_sets
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOT_VISIBLE,
    ClassAnswer,
)
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.element.classes.drive_in_time import (
    has_one_frequency,
    is_separable_from_time,
)
from carrierflex.diagnosis.element.classes.laws import (
    COUPLED_DAMPING,
    DELAY,
    DISSIPATION,
    DRIVE_SIDE,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
    TIME_VARIATION,
)
from carrierflex.diagnosis.element.classes.table import (
    CLASS_GROUPS,
    ElementTable,
    table_of,
)
from carrierflex.diagnosis.element.classes.table_columns import PRESLIDING
from carrierflex.diagnosis.element.classes.table_of_loop import left_by_loop, with_loop
from carrierflex.diagnosis.element.model import ElementModel

_DRIVE_NOTE = (
    "the drive itself changes with time: a slow change with time is not separable from it in these "
    "records"
)
_ONE_FREQUENCY_NOTE = (
    "one frequency drives all runs: a slow change with time is not separable from what it leaves "
    "in these records"
)
_MORE_FREQUENCIES = (
    "drive at many frequencies, at the same levels (a multisine, noise or a sweep): under one "
    "frequency two causes share out what one makes"
)
_CAUSES_APART = (
    "record small and large deflections, slow and fast motion, in runs of their own: more than two "
    "effects are at work, or one that no class holds whole"
)
_STEADY = (
    "drive as hard and at the same frequencies throughout every run (noise or a multisine): a slow "
    "change with time shows beside a drive that does not change"
)
_SHORT_NOTE = (
    "all classes together explain more than the best answer by what a further cause would: none is "
    "named"
)
_NO_ELEMENT = (
    "the motion is not that of a mass, a spring and a damper under this drive (a mass that sticks, "
    "a sensor that does not see it, drive and motion of different runs): on held-out records the "
    "baseline's force leaves more than no force at all"
)
#: Ratio of two levels that are one; levels that are meant to differ do so by a quarter and more.
_SAME_LEVEL = 1.1
#: Passes from the first order of a delay to the delay itself.
_LAG_PASSES = 2


def answer_of_table(
    own: ElementTable,
    model: ElementModel,
    noise_note: str,
    shape_of: Callable[[ElementTable], ShapeOf],
) -> ClassAnswer:
    """Class of the missing effect from the table.

    Parameters
    ----------
    own : ElementTable
        Products, and held-out squares with their limits.
    model : ElementModel
        Baseline.
    noise_note : str
        What the records cannot say of their noise.
    shape_of : callable
        Gives, for a table, the measured shape of a class.
    """
    drive = _drive_of(own, model)
    if not _shows_element(own, drive):
        table, scores = own.table, own.scores
        shares = Shares(scores.of(()).squares, table.floor, scores.constants)
        laws = law_sets(scores, shares, (), model.cards)
        return replace(without_classes(NOT_VISIBLE, table, _NO_ELEMENT), law_sets=laws)
    floor_is_known = not noise_note
    drive_note = "; ".join(text for text in (noise_note, drive.note) if text)

    def decided(own: ElementTable) -> tuple[Shares, Decision]:
        return class_decision(
            own.scores,
            drive.candidates,
            floor_is_known=floor_is_known,
            inseparable=drive.inseparable,
            # The band holds one line and its harmonics: two causes share out what one makes.
            shows_two_causes=not drive.is_one_line,
            shows_small_causes=not drive.is_one_frequency,
            drive_note=drive_note,
        )

    shares, decision = decided(own)
    for _ in range(_LAG_PASSES):
        if DELAY not in decision.classes:
            break
        # Its first order alone leaves what looks like another cause beside a delay.
        own = _with_lag(model, own, decision.held)
        shares, decision = decided(own)

    def falls_short(own: ElementTable, decision: Decision) -> bool:
        # Records that were filtered before follow no law and tell no floor: what all classes learn
        # beside the cause's own is the filter's.
        return floor_is_known and is_short(own.scores, shares, decision)

    own, decision = _as_smooth_loop(
        own,
        model,
        shares,
        decision,
        drive=drive,
        falls_short=falls_short(own, decision),
        drive_note=drive_note,
    )
    decision = _or_friction(own, shares, decision)
    is_cut = decision.state in (NAMED_CLASS, LEADING_CLASS) and falls_short(own, decision)
    if is_cut:
        decision = _unnamed(decision)
    answer = class_answer(
        own.scores,
        shares,
        decision,
        drive.candidates,
        shape_of=shape_of(own),
        shows_laws=not (drive.is_one_line and has_one_level(own)),
    )
    laws = law_sets(own.scores, shares, (decision.classes, *decision.ties), model.cards)
    answer = replace(answer, law_sets=laws)
    asked = _CAUSES_APART if is_cut and not drive.is_one_frequency else drive.experiment
    return replace(answer, experiment=asked) if decision.is_inseparable else answer


def _shows_element(own: ElementTable, drive: "_Drive") -> bool:
    """Whether the baseline explains anything of the force on held-out records.

    A mass that sticks, or a sensor that sees something else, leaves a motion of noise alone: no
    mass, damper and spring are found in it, and shares of a gap beyond them mean nothing. Where
    little of the drive arrives (a wide dead band) the baseline explains nothing of all of it, and
    takes half of what a function of the drive leaves. The gap of another simulator is none of its
    baseline's to explain.
    """
    if any(record.record.gap is not None for record in own.records):
        return True
    scores = own.scores
    if scores.of(()).total < float(own.table.total[0, 0]):
        return True
    if DRIVE_SIDE not in drive.candidates:
        return False
    arriving, still = (each.of((DRIVE_SIDE,)) for each in (scores, scores.without_baseline))
    return arriving.total < (1.0 - scores.constants.gain_of_left) * still.total


@dataclass(frozen=True)
class _Drive:
    """What the drive of the records can show.

    Parameters
    ----------
    candidates : tuple of str
        Classes that it shows apart.
    inseparable : tuple of str
        Classes that it shows only mixed with others.
    is_one_frequency, is_one_line : bool
        Whether one frequency drives all runs; and as a force, so that the motion is one line.
    note : str
        Why a slow change with time cannot be told; empty where it can.
    experiment : str
        What to record where causes are mixed.
    """

    candidates: tuple[str, ...]
    inseparable: tuple[str, ...]
    is_one_frequency: bool
    is_one_line: bool
    note: str
    experiment: str


def _drive_of(own: ElementTable, model: ElementModel) -> _Drive:
    is_steady = is_separable_from_time(own.records, own.scores.constants.separable_from_drive)
    is_one_frequency = is_steady and _has_one_frequency(own)
    inseparable = {TIME_VARIATION} if is_one_frequency or not is_steady else set()
    is_one_line = is_one_frequency and model.by_force
    if is_one_line:
        # The drive is one line in each run: spring and damper take up what is linear at it.
        inseparable |= {DELAY, MEMORY}
        if has_one_level(own):
            # A function of the drive is any height of that line, and of its harmonics.
            inseparable |= {DRIVE_SIDE}
    left_out = set()
    if model.states:
        # After a release a delay is a shift of the clock, and nothing is applied.
        left_out |= {DELAY, DRIVE_SIDE}
        # A decay is one line, to which a relaxing branch is one spring and one damper.
        inseparable |= {MEMORY}
    return _Drive(
        candidates=tuple(name for name in CLASS_GROUPS if name not in left_out | inseparable),
        inseparable=tuple(sorted(inseparable)),
        is_one_frequency=is_one_frequency,
        is_one_line=is_one_line,
        note=_note_of_time(is_steady=is_steady, is_one_frequency=is_one_frequency),
        experiment=_MORE_FREQUENCIES if is_one_frequency or model.states else _STEADY,
    )


def _with_lag(model: ElementModel, own: ElementTable, held: HeldOutSquares) -> ElementTable:
    """Table whose column of a delay is exact at the delay that a result finds."""
    column = int(own.table.groups["delay"].columns[0])
    lag = own.scores.amplitudes(held)[column]
    records = tuple(replace(record, lag=lag) for record in own.records)
    return table_of(model, replace(own.runs, records=records), own.scores.constants)


def _as_smooth_loop(
    own: ElementTable,
    model: ElementModel,
    shares: Shares,
    decision: Decision,
    *,
    drive: _Drive,
    falls_short: bool,
    drive_note: str,
) -> tuple[ElementTable, Decision]:
    """Table and decision, hysteresis in it where its smooth loop leaves far less than the answer.

    The loop is fitted to all blocks: that they agree on a small gain says little. One cause that
    explains the gap better than any two, or than the coupled class, is the simpler answer and the
    better one. So are two in place of two others, where the second one is a cause beside the loop
    as it is beside any class. A loop that hardens is taken for sliders, for a spring beside a loss,
    for a memory, or for a surface: other answers are not asked, nor is a single class that is named
    already and beside which nothing is missing.
    """
    surface = own.table.surface
    is_one = len(decision.classes) == 1 and decision.classes != (surface,)
    is_settled = is_one and decision.state == NAMED_CLASS and not falls_short
    may_be_loop = {HYSTERESIS, RESTORING_FORCE, MEMORY, surface}.intersection(decision.classes)
    if is_settled or not may_be_loop:
        return own, decision
    least = _least(own.scores, decision, drive)
    alone, loop = left_by_loop(own, "")
    found = None
    if _is_answer(shares, alone, least, _without_memory(own, drive, "")):
        found = loop, _answered(decision, (HYSTERESIS,), alone, drive_note)
        least = alone
    pairs = []
    for other in _partners(decision, surface) if not (drive.is_one_line or is_one) else ():
        both, loop = left_by_loop(own, other)
        is_cause = shares.is_clear_gain(both, alone, shares.constants.second_cause)
        if is_cause and _is_answer(shares, both, least, _without_memory(own, drive, other)):
            pair: Classes = tuple(sorted((HYSTERESIS, other)))
            pairs.append((loop, _answered(decision, pair, both, drive_note)))
    found = min(pairs, key=lambda entry: entry[1].held.total, default=found)
    return (with_loop(model, own, found[0]), found[1]) if found else (own, decision)


def _least(scores: ClassScores, decision: Decision, drive: _Drive) -> HeldOutSquares:
    """What the answer leaves, or a class that the drive mixes with others where that is less.

    Such a class is not named, and may be the cause all the same.
    """
    mixed = [scores.of((name,)) for name in drive.inseparable]
    return min([decision.held, *mixed], key=lambda held: held.total)


def _without_memory(own: ElementTable, drive: _Drive, beside: str) -> Iterator[HeldOutSquares]:
    """What causes leave that are no loop, beside a class and fitted to all blocks as a loop is.

    A rising curve; and any force of deflection and speed, which holds the springs that a spline
    held out draws badly at their ends. Under one frequency such a force draws every loop.
    """
    yield left_by_loop(own, beside, is_curve=True)[0]
    if not drive.is_one_frequency:
        others = () if not beside or own.table.is_in_surface(beside) else (beside,)
        yield own.scores.fitted((own.table.surface, *others))


def _partners(decision: Decision, surface: str) -> list[str]:
    """Classes that a smooth loop may stand beside in place of two answered ones.

    In place of the surface one of the dampings that it holds: beside a loop that damps, a surface
    takes both.
    """
    if HYSTERESIS in decision.classes:
        return []
    others = [name for name in decision.classes if name != surface]
    dampings = [DISSIPATION, COUPLED_DAMPING] if surface in decision.classes else []
    return others + dampings


def _is_answer(
    shares: Shares, held: HeldOutSquares, least: HeldOutSquares, others: Iterable[HeldOutSquares]
) -> bool:
    """Whether a smooth loop explains the gap, far better than another answer and each of others.

    The others are fitted only where they are asked for.
    """
    return (
        state_of(shares, held) == NAMED_CLASS
        and shares.leaves_far_less(held, least)
        and all(shares.leaves_far_less(held, other) for other in others)
    )


def _answered(decision: Decision, classes: Classes, held: HeldOutSquares, note: str) -> Decision:
    """Decision for other classes, which are named.

    Why the answer before was not named is no note of theirs; what the drive does not show is.
    """
    return replace(
        decision,
        state=NAMED_CLASS,
        classes=classes,
        ties=(),
        held=held,
        note=note,
        is_inseparable=False,
    )


def _or_friction(own: ElementTable, shares: Shares, decision: Decision) -> Decision:
    """Decision with dry friction as a tie of hysteresis where one friction explains more.

    Friction that turns over a length (Dahl) is a loop, and is dry friction. Where it leaves less
    than sliders of every strength, the records do not tell a loop from friction before it slides;
    where dry friction is no answer, its length is a loop's.
    """
    if HYSTERESIS not in decision.classes or DISSIPATION in decision.classes:
        return decision
    beside = tuple(name for name in decision.classes if name != HYSTERESIS)
    law = nearest_law(own.scores, shares, HYSTERESIS, beside)
    if law.id != PRESLIDING or law.held is None or law.held.total >= decision.held.total:
        return decision
    tied: Classes = tuple(sorted((DISSIPATION, *beside)))
    if state_of(shares, own.scores.of(tied)) != NAMED_CLASS:
        return decision
    return replace(decision, ties=tuple(dict.fromkeys((*decision.ties, tied))))


def _unnamed(decision: Decision) -> Decision:
    """Decision that names no class, since what it explains is short of what all explain."""
    note = "; ".join(text for text in (decision.note, _SHORT_NOTE) if text)
    return replace(decision, state=NO_CLASS, note=note, is_inseparable=True)


def _note_of_time(*, is_steady: bool, is_one_frequency: bool) -> str:
    """Why a slow change with time cannot be told in these records; empty where it can."""
    if not is_steady:
        return _DRIVE_NOTE
    return _ONE_FREQUENCY_NOTE if is_one_frequency else ""


def is_one_curve(own: ElementTable) -> bool:
    """Whether all runs go round one curve of deflection and speed: one frequency at one level."""
    return _has_one_frequency(own) and has_one_level(own)


def _has_one_frequency(own: ElementTable) -> bool:
    return has_one_frequency([(one.record.drive[one.counts], one.step) for one in own.records])


def has_one_level(own: ElementTable) -> bool:
    """Whether every run is driven as hard: a law is then a curve through one point."""
    sizes = [float(record.record.drive[record.counts].std()) for record in own.records]
    return max(sizes) <= _SAME_LEVEL * min(sizes)
