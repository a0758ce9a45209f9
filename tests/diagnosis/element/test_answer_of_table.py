"""What an element's answer names under each drive, and what it asks to be recorded."""

from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.results import LEADING_CLASS, NAMED_CLASS, NO_CLASS
from carrierflex.diagnosis.element import answer as answers
from carrierflex.diagnosis.element.answer import _drive_of, answer_of_table
from carrierflex.diagnosis.element.table import CLASS_GROUPS, has_one_level, is_one_curve
from tests.diagnosis.element.toy_element import (
    LAG,
    decay,
    growing_line,
    line,
    multisine,
    sweep,
    toy_element,
)

MOVED = SimpleNamespace(by_force=False, states={}, cards={})
FORCED = SimpleNamespace(by_force=True, states={}, cards={})
RELEASED = SimpleNamespace(by_force=True, states={"R0": (1e-3, 0.0)}, cards={})
WIDE_BAND = [multisine(level, seed) for seed, level in enumerate((1.0, 2.0, 4.0))]
ONE_FREQUENCY = [line(1.0), line(2.0), line(4.0)]
ONE_LEVEL = [line(1.0), line(1.05)]
SWEEPS = [sweep(1.0), sweep(2.0)]
GROWING = [growing_line(1.0), growing_line(2.0)]
DECAYS = [decay(1.0), decay(2.0)]

SPRING, FRICTION = {"restoring_force": {"spring": 0.0}}, {"dissipation": {"friction": 0.0}}
LOOP = {"hysteresis": {"loop": 0.0}}
BOTH = {**SPRING, **FRICTION}
#: A second cause of six tenths of the first.
TWO_CAUSES = {"spring": 100.0, "friction": 60.0}
#: Three equal causes: two of them explain two thirds.
THREE_CAUSES = {"spring": 60.0, "friction": 60.0, "loop": 60.0}

MORE_FREQUENCIES = (
    "drive at many frequencies, at the same levels (a multisine, noise or a sweep): at a single "
    "frequency two causes can share the effect of one"
)
CAUSES_APART = (
    "record small and large deflections, slow and fast motion, in separate runs: more than two "
    "effects act, or one that no class describes completely"
)
STEADY = (
    "drive with constant amplitude and at the same frequencies throughout every run (noise or a "
    "multisine): a slow change with time shows under a drive that does not change"
)
DRIVE_CHANGES = (
    "the drive itself changes with time: a slow change with time is not separable from it in these "
    "records"
)
ONE_DRIVES_ALL = (
    "one frequency drives all runs: a slow change with time is not separable from what it leaves "
    "in these records"
)
IS_SHORT = (
    "all classes together explain more than the best answer, by as much as a further cause would: "
    "no class is named"
)


@pytest.fixture(autouse=True)
def loops(monkeypatch):
    """Floors that a smooth loop and a rising curve leave, by the class beside them."""
    known = {}

    def left_by_loop(element, partner, *, is_curve=False):
        floors = known[partner][is_curve] if partner in known else element.scores.of(()).total
        return HeldOutSquares(
            np.full(element.table.floor.size, floors / element.table.floor.size), (), ()
        ), None

    monkeypatch.setattr(answers, "_remaining_with_loop", left_by_loop)
    monkeypatch.setattr(answers, "_with_loop", lambda element, loop: element)
    monkeypatch.setattr(answers, "measured_shape", lambda *_: (None, None))
    return known


def answered(records, causes, classes, *, model=MOVED, noise_note="", **known):
    """Answer of an element whose classes have no shape."""
    element = toy_element(records, causes, classes, model=model, **known)
    return answer_of_table(element, noise_note)


@pytest.mark.parametrize(
    ("records", "model", "mixed", "absent", "note", "experiment"),
    [
        (WIDE_BAND, FORCED, set(), set(), "", STEADY),
        (SWEEPS, FORCED, {"time_variation"}, set(), DRIVE_CHANGES, STEADY),
        # One frequency all the same: that it grows is what hides a change with time.
        (GROWING, FORCED, {"time_variation"}, set(), DRIVE_CHANGES, STEADY),
        (ONE_FREQUENCY, MOVED, {"time_variation"}, set(), ONE_DRIVES_ALL, MORE_FREQUENCIES),
        # A prescribed motion shows its force at all its harmonics, whatever the level.
        (ONE_LEVEL, MOVED, {"time_variation"}, set(), ONE_DRIVES_ALL, MORE_FREQUENCIES),
        (
            ONE_FREQUENCY,
            FORCED,
            {"delay", "memory", "time_variation"},
            set(),
            ONE_DRIVES_ALL,
            MORE_FREQUENCIES,
        ),
        (
            ONE_LEVEL,
            FORCED,
            {"delay", "drive_side", "memory", "time_variation"},
            set(),
            ONE_DRIVES_ALL,
            MORE_FREQUENCIES,
        ),
        (
            DECAYS,
            RELEASED,
            {"memory", "time_variation"},
            {"delay", "drive_side"},
            DRIVE_CHANGES,
            MORE_FREQUENCIES,
        ),
    ],
)
def test_a_drive_shows_the_classes_that_it_does_not_mix_with_what_it_does_itself(
    records, model, mixed, absent, note, experiment
):
    drive = _drive_of(toy_element(records, {}, {}, model=model))
    assert set(drive.inseparable) == mixed
    assert set(drive.candidates) == set(CLASS_GROUPS) - mixed - absent
    assert (drive.note, drive.experiment) == (note, experiment)


def test_under_a_force_one_frequency_is_one_line_of_the_motion():
    def lines(records, model):
        drive = _drive_of(toy_element(records, {}, {}, model=model))
        return drive.is_one_frequency, drive.is_one_line

    assert lines(ONE_FREQUENCY, FORCED) == (True, True)
    assert lines(ONE_FREQUENCY, MOVED) == (True, False)
    assert lines(WIDE_BAND, FORCED) == (False, False)
    # After a release none drives, though the motion has one.
    assert lines(DECAYS, RELEASED) == (False, False)
    assert lines([line(frequency_hz=5.0), line(frequency_hz=9.0)], FORCED) == (False, False)


def test_one_frequency_at_one_level_is_one_curve_of_deflection_and_speed():
    def is_curve(records):
        return is_one_curve(toy_element(records, {}, {}))

    assert is_curve(ONE_LEVEL)
    assert not is_curve(ONE_FREQUENCY)
    assert not is_curve([multisine(seed=1), multisine(seed=2)])
    # Levels that are meant to differ do so by a quarter and more.
    assert has_one_level(toy_element(ONE_LEVEL, {}, {}))
    assert not has_one_level(toy_element([line(1.0), line(1.25)], {}, {}))
    assert not has_one_level(toy_element([line(1.25), line(1.0)], {}, {}))


def test_two_causes_are_named_where_many_frequencies_drive():
    result = answered(WIDE_BAND, TWO_CAUSES, BOTH, model=FORCED)
    assert (result.state, result.ids) == (NAMED_CLASS, ("dissipation", "restoring_force"))
    assert (result.note, result.experiment) == ("", "")


def test_under_a_force_of_one_frequency_one_cause_is_named_and_two_are_not():
    result = answered(ONE_FREQUENCY, {"spring": 100.0}, BOTH, model=FORCED)
    assert (result.state, result.ids, result.experiment) == (NAMED_CLASS, ("restoring_force",), "")
    result = answered(ONE_FREQUENCY, TWO_CAUSES, BOTH, model=FORCED)
    assert (result.state, result.best) == (NO_CLASS, ("dissipation", "restoring_force"))
    assert result.experiment == MORE_FREQUENCIES


def test_a_small_second_cause_is_named_under_many_frequencies_and_silences_under_one():
    # 0.4 % of the gap, all but the noise of what the first leaves.
    causes = {"spring": 1000.0, "friction": 4.0}
    assert answered(WIDE_BAND, causes, BOTH).ids == ("dissipation", "restoring_force")
    result = answered(ONE_FREQUENCY, causes, BOTH)
    assert (result.state, result.best) == (NO_CLASS, ("restoring_force",))
    assert result.experiment == MORE_FREQUENCIES


def test_under_one_frequency_a_surface_is_not_named():
    causes, coupled = {"coupled": 100.0}, {"force_surface": {"coupled": 0.0}}
    assert answered(WIDE_BAND, causes, coupled).ids == ("force_surface",)
    result = answered(ONE_FREQUENCY, causes, coupled)
    assert (result.state, result.best) == (NO_CLASS, ("force_surface",))
    assert result.note.startswith(f"{ONE_DRIVES_ALL}; one frequency drives all runs: every cause")
    assert result.experiment == MORE_FREQUENCIES


def test_beside_a_sweep_a_change_with_time_silences_what_it_beats_and_a_steady_drive_is_asked():
    causes = {"drift": 100.0}
    classes = {"time_variation": {"drift": 0.0}, "restoring_force": {"drift": 0.15}}
    assert answered(WIDE_BAND, causes, classes).ids == ("time_variation",)
    # All classes together explain no more than the spring: it is mixed, not short.
    result = answered(SWEEPS, causes, classes, union={"drift": 0.15})
    assert (result.state, result.best) == (NO_CLASS, ("restoring_force",))
    assert (result.note, result.experiment) == (DRIVE_CHANGES, STEADY)


@pytest.mark.parametrize(("remaining", "state"), [(0.1, NAMED_CLASS), (0.4, LEADING_CLASS)])
def test_an_answer_that_all_classes_together_beat_by_a_second_cause_is_not_named(remaining, state):
    causes, classes = {"spring": 100.0}, {"restoring_force": {"spring": remaining}}
    within, beyond = {"spring": remaining - 0.02}, {"spring": remaining - 0.03}
    result = answered(WIDE_BAND, causes, classes, union=within)
    assert (result.state, result.ids, result.experiment) == (state, ("restoring_force",), "")
    result = answered(WIDE_BAND, causes, classes, union=beyond)
    assert (result.state, result.ids, result.best) == (NO_CLASS, (), ("restoring_force",))
    assert (result.note, result.experiment) == (IS_SHORT, CAUSES_APART)


def test_an_answer_that_falls_short_asks_for_many_frequencies_where_one_drives():
    causes, classes = {"spring": 100.0}, {"restoring_force": {"spring": 0.1}}
    result = answered(ONE_FREQUENCY, causes, classes)
    assert (result.state, result.best) == (NO_CLASS, ("restoring_force",))
    assert result.note == f"{ONE_DRIVES_ALL}; {IS_SHORT}"
    assert result.experiment == MORE_FREQUENCIES


def test_a_gap_that_no_class_explains_asks_for_no_other_records():
    # All classes together explain most of it, and none of them a half.
    result = answered(WIDE_BAND, {"spring": 100.0}, {"restoring_force": {"spring": 0.6}})
    assert (result.state, result.note, result.experiment) == (NO_CLASS, "", "")


def test_where_the_floor_cannot_be_known_no_answer_falls_short():
    short = {"restoring_force": {"spring": 0.1}}
    unknown = "the floor cannot be known"
    result = answered(ONE_FREQUENCY, {"spring": 100.0}, short, noise_note=unknown)
    assert (result.state, result.ids) == (NAMED_CLASS, ("restoring_force",))
    assert (result.note, result.experiment) == (f"{unknown}; {ONE_DRIVES_ALL}", "")
    # Shares are of all that the baseline leaves: 90 of 101 floors, and not of 100.
    assert result.share == pytest.approx(90.0 / 101.0)


@pytest.mark.parametrize(
    ("records", "model", "is_named"),
    [
        (WIDE_BAND, FORCED, True),
        ([multisine(seed=1), multisine(seed=2)], FORCED, True),
        (ONE_FREQUENCY, FORCED, True),
        (ONE_LEVEL, MOVED, True),
        (ONE_LEVEL, FORCED, False),
    ],
)
def test_a_law_is_not_named_where_one_line_of_one_level_shows_one_point_of_it(
    records, model, is_named
):
    laws = {"restoring_force": ("cubic_stiffness", {"spring": 0.0})}
    result = answered(records, {"spring": 100.0}, SPRING, model=model, laws=laws)
    (law,) = result.classes
    assert (law.id, law.law, law.law_named) == ("restoring_force", "cubic_stiffness", is_named)


def with_exact_delay(monkeypatch, exact):
    """Lags of the runs of each table that was made anew, its classes the exact ones."""
    made = []

    def table_of(runs, constants):
        made.append([record.lag for record in runs.records])
        return toy_element(runs.records, *exact, model=runs.model)

    monkeypatch.setattr(answers, "table_of", table_of)
    return made


def test_what_the_first_order_of_a_delay_leaves_is_no_second_cause(monkeypatch):
    late = {"delay": {"late": 0.0}}
    made = with_exact_delay(monkeypatch, ({"late": 100.0}, late))
    first_order = {**late, "memory": {"second order": 0.0}}
    result = answered(WIDE_BAND, {"late": 100.0, "second order": 5.0}, first_order)
    assert result.ids == ("delay",)
    # The second time from the delay itself.
    assert made == [[LAG] * len(WIDE_BAND)] * 2


def test_an_answer_that_the_whole_delay_leaves_without_one_stands(monkeypatch):
    made = with_exact_delay(monkeypatch, ({"spring": 100.0}, SPRING))
    result = answered(WIDE_BAND, {"late": 100.0}, {"delay": {"late": 0.0}})
    assert (result.ids, len(made)) == (("restoring_force",), 1)


def test_without_a_delay_the_table_stays_as_it_is(monkeypatch):
    made = with_exact_delay(monkeypatch, ({"spring": 100.0}, SPRING))
    assert answered(WIDE_BAND, TWO_CAUSES, BOTH).ids == ("dissipation", "restoring_force")
    assert made == []


def test_a_second_cause_beside_a_smooth_loop_is_named_where_many_frequencies_drive(loops):
    # Spring and friction leave 16 floors of 160, the loop 9, with friction beside it the noise.
    classes = {"restoring_force": {"spring": 0.1}, "dissipation": {"friction": 0.1}}
    union = {"spring": 0.1, "friction": 0.1}
    loops.update({"": (9.0, 99.0), "dissipation": (1.0, 99.0)})
    result = answered(WIDE_BAND, TWO_CAUSES, classes, model=FORCED, union=union)
    assert (result.state, result.ids) == (NAMED_CLASS, ("dissipation", "hysteresis"))
    result = answered(ONE_FREQUENCY, TWO_CAUSES, classes, model=FORCED, union=union)
    assert (result.state, result.ids, result.experiment) == (NAMED_CLASS, ("hysteresis",), "")


def test_a_loop_is_held_against_a_class_that_the_drive_mixes_with_others(loops):
    # After a release a memory is one spring and one damper: it explains all, and is not told.
    creep = {"memory": {"creep": 0.0}, "restoring_force": {"creep": 0.15}}
    union = {"creep": 0.14}
    loops[""] = (4.0, 99.0)
    result = answered(DECAYS, {"creep": 100.0}, creep, model=RELEASED, union=union)
    assert (result.state, result.best) == (NO_CLASS, ("restoring_force",))
    apart = {**creep, "memory": {"creep": 0.07}}
    result = answered(DECAYS, {"creep": 100.0}, apart, model=RELEASED, union=union)
    assert (result.state, result.ids) == (NAMED_CLASS, ("hysteresis",))


def test_a_class_that_falls_short_is_held_against_a_smooth_loop_of_which_the_shape_is_drawn(
    loops, monkeypatch
):
    loops[""] = (1.0, 99.0)
    drawn = []
    looped = toy_element(WIDE_BAND, {"spring": 100.0}, LOOP, model=FORCED)
    monkeypatch.setattr(answers, "_with_loop", lambda given, loop: looped)

    def measured_shape(table, *_):
        drawn.append(table)
        return None, None

    monkeypatch.setattr(answers, "measured_shape", measured_shape)
    remaining = {"spring": 0.1}
    causes, classes = {"spring": 100.0}, {"restoring_force": remaining}
    element = toy_element(WIDE_BAND, causes, classes, model=FORCED)
    result = answer_of_table(element, "")
    assert (result.state, result.ids) == (NAMED_CLASS, ("hysteresis",))
    assert drawn == [looped]
    # One beside which nothing is missing is not.
    complete = toy_element(WIDE_BAND, causes, classes, model=FORCED, union=remaining)
    result = answer_of_table(complete, "")
    assert (result.ids, drawn) == (("restoring_force",), [looped, complete])


def ties_of(classes, *, causes=None, law="dahl_friction", remaining=0.0):
    """Ties of an answer beside a loop of which a law leaves a share."""
    laws = {"hysteresis": (law, {"loop": remaining})}
    result = answered(WIDE_BAND, causes or {"loop": 100.0}, classes, laws=laws)
    assert result.state == NAMED_CLASS
    return result.ids, result.ties


#: Sliders of all strengths leave a share of a loop, dry friction more.
SLIDERS = {"hysteresis": {"loop": 0.02}}


def test_without_a_loop_or_beside_dry_friction_no_friction_is_a_further_tie():
    # A spring explains the gap, and the friction of a loop would explain more.
    no_loop = {"restoring_force": {"loop": 0.02}, "dissipation": {"loop": 0.15}}
    assert ties_of(no_loop) == (("restoring_force",), ())
    both = {**SLIDERS, **FRICTION}
    causes = {"loop": 100.0, "friction": 100.0}
    assert ties_of(both, causes=causes) == (("dissipation", "hysteresis"), ())


def test_a_loop_without_a_law_is_no_dry_friction():
    rubbing = {**SLIDERS, "dissipation": {"loop": 0.15}}
    result = answered(WIDE_BAND, {"loop": 100.0}, rubbing)
    assert (result.ids, result.ties) == (("hysteresis",), ())
