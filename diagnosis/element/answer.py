"""Class of the missing effect of an element: what the drive can show, decision, shapes."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from carrierflex.diagnosis.classes.answer import (
    class_answer,
    law_sets,
    without_classes,
)
from carrierflex.diagnosis.classes.columns import TIME_VARIATION, GroupColumns
from carrierflex.diagnosis.classes.decision import (
    Decision,
    Drive,
    changed_size,
    decide,
    is_short,
    state_of,
)
from carrierflex.diagnosis.classes.held_out import Classes, ClassScores, HeldOutSquares
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOT_VISIBLE,
    ClassAnswer,
)
from carrierflex.diagnosis.classes.shares import Shares
from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.element.columns import DELAY, DRIVE_SIDE
from carrierflex.diagnosis.element.force_records import (
    ForceRecord,
    has_one_frequency,
    is_separable_from_time,
)
from carrierflex.diagnosis.element.shapes import measured_shape
from carrierflex.diagnosis.element.smooth_loops import SmoothLoop, fitted_loop
from carrierflex.diagnosis.element.table import (
    CLASS_GROUPS,
    LOOP,
    ElementTable,
    group_columns_along,
    has_one_level,
    products_by_block,
    table_of,
)
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    HYSTERESIS,
    MEMORY,
    RESTORING_FORCE,
)

_DRIVE_NOTE = (
    "the drive itself changes with time: a slow change with time is not separable from it in these "
    "records"
)
_ONE_FREQUENCY_NOTE = (
    "one frequency drives all runs: a slow change with time is not separable from what it leaves "
    "in these records"
)
_MORE_FREQUENCIES = (
    "drive at many frequencies, at the same levels (a multisine, noise or a sweep): at a single "
    "frequency two causes can share the effect of one"
)
_CAUSES_APART = (
    "record small and large deflections, slow and fast motion, in separate runs: more than two "
    "effects act, or one that no class describes completely"
)
_STEADY = (
    "drive with constant amplitude and at the same frequencies throughout every run (noise or a "
    "multisine): a slow change with time shows under a drive that does not change"
)
_SHORT_NOTE = (
    "all classes together explain more than the best answer, by as much as a further cause would: "
    "no class is named"
)
_CHANGES = (
    "{} explains {:.0%} of the gap, but its size changes in the course of the records by {:.0%} "
    "(standard deviation), as by heat, wear or another load"
)
_ONE_STATE = (
    "record long runs at one level until nothing changes any more, and the same runs again at once:"
    " a force that heat or wear changes is another one then"
)
_NO_ELEMENT = (
    "the motion is not that of a mass, a spring and a damper under this drive (a mass that sticks, "
    "a sensor that does not see it, drive and motion of different runs): on held-out records the "
    "baseline's force leaves more than no force at all"
)
#: Passes from the first order of a delay to the delay itself.
_LAG_PASSES = 2
_WITH_LOOP = (*CLASS_GROUPS[HYSTERESIS], LOOP)


def answer_of_table(table: ElementTable, noise_note: str) -> ClassAnswer:
    """Class of the missing effect; `noise_note` is what the records cannot say of their noise."""
    drive, model = _drive_of(table), table.model
    if not _shows_element(table, drive):
        scores = table.scores
        shares = Shares(scores.of(()).squares, table.table.floor, scores.constants)
        sets = law_sets(scores, shares, (), model.cards)
        return without_classes(NOT_VISIBLE, table.table, _NO_ELEMENT, sets)
    floor_is_known = not noise_note
    drive = replace(drive, note="; ".join(text for text in (noise_note, drive.note) if text))

    shares, decision = decide(table.scores, drive, floor_is_known=floor_is_known)
    for _ in range(_LAG_PASSES):
        if DELAY not in decision.classes:
            break
        # Its first order alone leaves what looks like another cause beside a delay: the column is
        # made exact at the delay that the answer finds.
        column = int(table.table.groups["delay"].columns[0])
        lag = table.scores.amplitudes(decision.squares)[column]
        late = replace(table, records=tuple(replace(run, lag=lag) for run in table.records))
        table = table_of(late, table.scores.constants)
        shares, decision = decide(table.scores, drive, floor_is_known=floor_is_known)

    def falls_short(table: ElementTable, decision: Decision) -> bool:
        # Records that were filtered before follow no law and tell no floor: what all classes learn
        # beyond the cause is the filter's.
        return floor_is_known and is_short(table.scores, shares, decision)

    table, decision = _as_smooth_loop(
        table,
        shares,
        decision,
        drive=drive,
        falls_short=falls_short(table, decision),
    )
    is_cut = decision.state in (NAMED_CLASS, LEADING_CLASS) and falls_short(table, decision)
    changes = ""
    is_one = state_of(shares, decision.squares) != NO_CLASS and floor_is_known
    if is_one and decision.classes != (TIME_VARIATION,):
        deviation = changed_size(table.scores, shares, decision)
        if deviation:
            share = shares.of(decision.squares)
            changes = _CHANGES.format(plain_name(decision.classes[0]), share, deviation)
    if is_cut or changes:
        note = "; ".join(text for text in (decision.note, changes or _SHORT_NOTE) if text)
        decision = replace(decision, state=NO_CLASS, note=note, is_inseparable=True)
    answer = class_answer(
        table.scores,
        shares,
        decision,
        drive.candidates,
        shape_of=partial(measured_shape, table),
        simulated=model.cards,
        shows_laws=not (drive.is_one_line and has_one_level(table)),
    )
    if changes:
        return replace(answer, experiment=_ONE_STATE, changes=changes)
    experiment = _CAUSES_APART if is_cut and not drive.is_one_frequency else drive.experiment
    return replace(answer, experiment=experiment) if decision.is_inseparable else answer


def _shows_element(table: ElementTable, drive: Drive) -> bool:
    """Whether the baseline explains anything of the force on held-out records."""
    # The gap of another simulator is not its baseline's to explain.
    if any(run.record.gap is not None for run in table.records):
        return True
    scores = table.scores
    # A mass that sticks, or a sensor that sees something else, leaves a motion of noise alone.
    if scores.of(()).total < float(table.table.total[0, 0]):
        return True
    if DRIVE_SIDE not in drive.candidates:
        return False
    # Where little of the drive arrives (a wide dead band) the baseline explains nothing of all of
    # it, and takes half of what a function of the drive leaves.
    arriving, still = (each.of((DRIVE_SIDE,)) for each in (scores, scores.without_baseline))
    return arriving.total < (1.0 - scores.constants.gain_of_left) * still.total


def _drive_of(table: ElementTable) -> Drive:
    model = table.model
    is_steady = is_separable_from_time(table.records, table.scores.constants.separable_from_drive)
    is_one_frequency = is_steady and has_one_frequency(table.records)
    inseparable = {TIME_VARIATION} if is_one_frequency or not is_steady else set()
    is_one_line = is_one_frequency and model.by_force
    if is_one_line:
        # The drive is one line in each run: spring and damper take up what is linear at it.
        inseparable |= {DELAY, MEMORY}
        if has_one_level(table):
            # A function of the drive is any height of that line, and of its harmonics.
            inseparable |= {DRIVE_SIDE}
    excluded = set()
    if model.states:
        # After a release a delay is a shift of the clock, and nothing is applied.
        excluded |= {DELAY, DRIVE_SIDE}
        # A decay is one line, to which a relaxing branch is one spring and one damper.
        inseparable |= {MEMORY}
    return Drive(
        candidates=tuple(name for name in CLASS_GROUPS if name not in excluded | inseparable),
        inseparable=tuple(sorted(inseparable)),
        is_one_frequency=is_one_frequency,
        is_one_line=is_one_line,
        note=_DRIVE_NOTE if not is_steady else _ONE_FREQUENCY_NOTE if is_one_frequency else "",
        experiment=_MORE_FREQUENCIES if is_one_frequency or model.states else _STEADY,
    )


def _as_smooth_loop(
    table: ElementTable,
    shares: Shares,
    decision: Decision,
    *,
    drive: Drive,
    falls_short: bool,
) -> tuple[ElementTable, Decision]:
    """Table and decision, hysteresis in it where a smooth loop leaves far less than the answer."""
    surface = table.table.surface
    is_one = len(decision.classes) == 1 and decision.classes != (surface,)
    is_settled = is_one and decision.state == NAMED_CLASS and not falls_short
    may_be_loop = {HYSTERESIS, RESTORING_FORCE, MEMORY, surface}.intersection(decision.classes)
    if is_settled or not may_be_loop:
        return table, decision
    # A class that the drive mixes with others is not named, and may be the cause all the same.
    mixed = [table.scores.of((name,)) for name in drive.inseparable]
    least = min([decision.squares, *mixed], key=lambda squares: squares.total)
    # One cause that explains the gap better than any two, or than the coupled class, is the simpler
    # answer and the better one; so are two in place of two others.
    alone, loop = _remaining_with_loop(table, "")
    best = None
    if _is_answer(shares, alone, least, _without_memory(table, drive, "")):
        best = loop, _answered(decision, (HYSTERESIS,), alone, drive.note)
        least = alone
    pairs = []
    for other in _partners(decision, surface) if not (drive.is_one_line or is_one) else ():
        both, loop = _remaining_with_loop(table, other)
        is_cause = shares.is_clear_gain(both, alone, shares.constants.second_cause)
        if is_cause and _is_answer(shares, both, least, _without_memory(table, drive, other)):
            pair: Classes = tuple(sorted((HYSTERESIS, other)))
            pairs.append((loop, _answered(decision, pair, both, drive.note)))
    best = min(pairs, key=lambda entry: entry[1].squares.total, default=best)
    return (_with_loop(table, best[0]), best[1]) if best else (table, decision)


def _without_memory(table: ElementTable, drive: Drive, other: str) -> Iterator[HeldOutSquares]:
    """What causes leave that are no loop, with a class and fitted to all blocks as a loop is."""
    yield _remaining_with_loop(table, other, is_curve=True)[0]
    # Any force of deflection and speed holds the springs that a spline held out draws badly at
    # their ends; under one frequency such a force draws every loop.
    if not drive.is_one_frequency:
        others = () if not other or table.table.is_in_surface(other) else (other,)
        yield table.scores.fitted((table.table.surface, *others))


def _partners(decision: Decision, surface: str) -> list[str]:
    """Classes that may go with a smooth loop in place of two answered ones."""
    if HYSTERESIS in decision.classes:
        return []
    others = [name for name in decision.classes if name != surface]
    dampings = [DISSIPATION, COUPLED_DAMPING] if surface in decision.classes else []
    return others + dampings


def _is_answer(
    shares: Shares, squares: HeldOutSquares, least: HeldOutSquares, others: Iterable[HeldOutSquares]
) -> bool:
    """Whether a smooth loop explains the gap, far better than another answer and each of others."""
    return (
        state_of(shares, squares) == NAMED_CLASS
        and shares.leaves_far_less(squares, least)
        and all(shares.leaves_far_less(squares, other) for other in others)
    )


def _answered(decision: Decision, classes: Classes, squares: HeldOutSquares, note: str) -> Decision:
    """Decision for other classes, which are named."""
    return replace(
        decision,
        state=NAMED_CLASS,
        classes=classes,
        ties=(),
        squares=squares,
        note=note,
        is_inseparable=False,
    )


def _remaining_with_loop(
    table: ElementTable, other: str, *, is_curve: bool = False
) -> tuple[HeldOutSquares, SmoothLoop]:
    """What hysteresis with a smooth loop leaves, alone or with one class, and that loop."""
    # Nine values fitted to some thousand samples: what a held-out block gains of itself in them is
    # far below the ratios at which results are equal.
    key = (other, is_curve)
    if key not in table.loops:
        size = table.bases.size
        shared, sliders = (
            [group for group in table.groups if group.id in CLASS_GROUPS.get(name, ())]
            for name in (other, HYSTERESIS)
        )
        loop = fitted_loop(table.records, size, shared, is_curve=is_curve)
        groups = (*sliders, _column(loop), *shared)
        products, _ = products_by_block(
            table,
            lambda run, filtered: group_columns_along(run, filtered, groups),
            table.scores.constants.n_folds,
        )
        table.loops[key] = loop, products
    loop, products = table.loops[key]
    classes = {HYSTERESIS: _WITH_LOOP, other: CLASS_GROUPS.get(other, ())}
    gram_table = replace(products, classes=classes)
    scores = ClassScores(gram_table, table.scores.constants)
    return scores.of([name for name in (HYSTERESIS, other) if name]), loop


def _with_loop(table: ElementTable, loop: SmoothLoop) -> ElementTable:
    """Table of all classes in which that of hysteresis holds a smooth loop too."""
    constants = table.scores.constants
    looped = table_of(table, constants, (_column(loop),))
    gram_table = replace(
        looped.table,
        classes={**CLASS_GROUPS, HYSTERESIS: _WITH_LOOP},
        ceiling=(*looped.table.ceiling, LOOP),
    )
    return replace(looped, table=gram_table, loop=loop, scores=ClassScores(gram_table, constants))


def _column(loop: SmoothLoop) -> GroupColumns[ForceRecord]:
    return GroupColumns(
        LOOP,
        lambda run: loop.along(run.x, from_rest=run.from_rest)[None],
        np.zeros((1, 1)),
        is_nonnegative=True,
    )
