"""When a smooth loop of hysteresis takes the place of an element's answer."""

from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import Decision
from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.results import LEADING_CLASS, NAMED_CLASS
from carrierflex.diagnosis.classes.shares import PairedShares
from carrierflex.diagnosis.element import answer as answers

N_BLOCKS = 12
BEFORE = np.full(N_BLOCKS, 100.0)
SURFACE = "force_surface"
PAIR = ("dissipation", "restoring_force")


def leaving(share):
    """Result that leaves a share of the gap in every block."""
    return HeldOutSquares(share * BEFORE, (), ())


def decided(
    monkeypatch,
    classes,
    answer,
    loops,
    *,
    state=NAMED_CLASS,
    short=False,
    mixed=1.0,
    surface=None,
    is_one_line=False,
    is_one_frequency=False,
):
    """Decision after the loop was asked; `loops` has what loop and curve leave, by partner.

    `mixed` is what a class leaves that the drive mixes with others, `surface` what any force of
    deflection and speed does by the classes beside it, fitted to all blocks.
    """

    def left_by_loop(given, partner, is_curve=False):
        return leaving(loops[partner][is_curve]), f"loop beside {partner}"

    monkeypatch.setattr(answers, "_remaining_with_loop", left_by_loop)
    monkeypatch.setattr(answers, "_with_loop", lambda given, loop: loop)
    element = SimpleNamespace(
        table=SimpleNamespace(surface=SURFACE, is_in_surface=lambda name: name != "memory"),
        scores=SimpleNamespace(
            of={("time_variation",): leaving(mixed)}.__getitem__,
            fitted=lambda names: leaving((surface or {}).get(names, 1.0)),
        ),
    )
    drive = SimpleNamespace(
        inseparable=("time_variation",),
        is_one_line=is_one_line,
        is_one_frequency=is_one_frequency,
        note="time is not told",
    )
    shares = PairedShares(BEFORE, np.zeros(N_BLOCKS), ClassConstants())
    decision = Decision(state, classes, ((SURFACE,),), leaving(answer), PAIR, "short", True)
    table, result = answers._as_smooth_loop(
        element,
        shares,
        decision,
        drive=drive,
        falls_short=short,
    )
    if result is decision:
        assert table is element
        return result
    # The table holds the loop that was fitted beside the same class.
    assert table == f"loop beside {''.join(set(result.classes) - {'hysteresis'})}"
    assert (result.state, result.ties, result.is_inseparable) == (NAMED_CLASS, (), False)
    # Why the answer before was not named says nothing of the loop; what the drive hides does.
    assert result.note == "time is not told"
    return result


def classes_after(*args, **options):
    """Classes after the loop was asked."""
    return decided(*args, **options).classes


@pytest.mark.parametrize(
    ("classes", "state", "answer", "loop", "curve", "expected"),
    [
        (PAIR, NAMED_CLASS, 0.10, 0.06, 0.4, ("hysteresis",)),
        ((SURFACE,), NAMED_CLASS, 0.10, 0.06, 0.4, ("hysteresis",)),
        (("memory",), "leading", 0.40, 0.10, 0.4, ("hysteresis",)),
        (("dissipation",), "leading", 0.40, 0.10, 0.4, ("dissipation",)),
        (("hysteresis",), NAMED_CLASS, 0.10, 0.01, 0.4, ("hysteresis",)),
        # 1.56 times as much is asked, of the answer and of a curve; a fifth may be left.
        (PAIR, NAMED_CLASS, 0.10, 0.07, 0.4, PAIR),
        (PAIR, NAMED_CLASS, 0.10, 0.06, 0.09, PAIR),
        (("hysteresis",), "no_class", 0.68, 0.42, 0.9, ("hysteresis",)),
        (("hysteresis", "memory"), "no_class", 0.68, 0.21, 0.9, ("hysteresis", "memory")),
        (("hysteresis", "memory"), "no_class", 0.68, 0.19, 0.9, ("hysteresis",)),
    ],
)
def test_a_loop_takes_the_place_of_what_leaves_far_more(
    monkeypatch, classes, state, answer, loop, curve, expected
):
    loops = dict.fromkeys(("", "coupled_damping", *PAIR), (loop, curve))
    assert classes_after(monkeypatch, classes, answer, loops, state=state) == expected


def test_a_named_class_that_falls_short_is_held_against_a_loop(monkeypatch):
    spring, loops = ("restoring_force",), {"": (0.01, 0.4)}
    assert classes_after(monkeypatch, spring, 0.10, loops) == spring
    assert classes_after(monkeypatch, spring, 0.10, loops, short=True) == ("hysteresis",)
    assert classes_after(monkeypatch, ("dissipation",), 0.10, loops, short=True) == ("dissipation",)


def test_sliders_that_only_lead_are_named_with_a_smooth_loop_beside_them(monkeypatch):
    sliders = ("hysteresis",)
    result = decided(monkeypatch, sliders, 0.40, {"": (0.10, 0.4)}, state=LEADING_CLASS)
    assert (result.state, result.classes) == (NAMED_CLASS, sliders)
    assert result.squares.total == pytest.approx(0.10 * BEFORE.sum())
    result = decided(monkeypatch, sliders, 0.40, {"": (0.21, 0.4)}, state=LEADING_CLASS)
    assert result.state == LEADING_CLASS


def test_a_second_cause_beside_the_loop_is_one_beside_any_class(monkeypatch):
    # Beside dissipation the loop gains 4 % of the gap, beside the restoring force 1 %.
    loops = {"": (0.06, 0.4), "dissipation": (0.02, 0.3), "restoring_force": (0.05, 0.3)}
    both = ("dissipation", "hysteresis")
    assert classes_after(monkeypatch, PAIR, 0.10, loops) == both
    assert classes_after(monkeypatch, PAIR, 0.05, loops) == both
    assert classes_after(monkeypatch, PAIR, 0.10, loops, is_one_line=True) == ("hysteresis",)
    little = {**loops, "dissipation": (0.04, 0.3)}
    assert classes_after(monkeypatch, PAIR, 0.10, little) == ("hysteresis",)
    curve = {**loops, "dissipation": (0.02, 0.03)}
    assert classes_after(monkeypatch, PAIR, 0.10, curve) == ("hysteresis",)
    # A fiftieth of the gap is no cause, though it is most of what the loop leaves.
    small = {**loops, "": (0.03, 0.4), "dissipation": (0.01, 0.3)}
    assert classes_after(monkeypatch, PAIR, 0.10, small) == ("hysteresis",)
    # A surface takes up a damping beside the loop, and a memory stands for the loop itself.
    floors = {"": (0.08, 0.4), "memory": (0.08, 0.3), "coupled_damping": (0.08, 0.3)}
    taken = {**floors, "dissipation": (0.02, 0.3)}
    assert classes_after(monkeypatch, (SURFACE, "memory"), 0.06, taken) == both
    # A damping that changes along the way stands beside the loop as well.
    taken = {**floors, "dissipation": (0.08, 0.3), "coupled_damping": (0.02, 0.3)}
    assert classes_after(monkeypatch, (SURFACE,), 0.06, taken) == ("coupled_damping", "hysteresis")
    # Hysteresis is among the two already: only alone it is another answer.
    assert classes_after(monkeypatch, ("dissipation", "hysteresis"), 0.05, loops) == both
    assert classes_after(monkeypatch, ("dissipation", "hysteresis"), 0.10, loops) == ("hysteresis",)


def test_of_two_classes_beside_the_loop_the_one_that_leaves_less_is_named(monkeypatch):
    loops = {"": (0.09, 0.4), "dissipation": (0.03, 0.3), "restoring_force": (0.02, 0.3)}
    assert classes_after(monkeypatch, PAIR, 0.10, loops) == ("hysteresis", "restoring_force")
    other = {**loops, "dissipation": (0.02, 0.3), "restoring_force": (0.03, 0.3)}
    assert classes_after(monkeypatch, PAIR, 0.10, other) == ("dissipation", "hysteresis")


def test_a_loop_has_to_leave_far_less_than_what_the_drive_mixes_with_the_answer(monkeypatch):
    loops = dict.fromkeys(("", *PAIR), (0.06, 0.4))
    assert classes_after(monkeypatch, PAIR, 0.10, loops, mixed=0.10) == ("hysteresis",)
    assert classes_after(monkeypatch, PAIR, 0.10, loops, mixed=0.09) == PAIR
    floors = {"": (0.09, 0.4), "dissipation": (0.03, 0.3), "restoring_force": (0.08, 0.3)}
    assert classes_after(monkeypatch, PAIR, 0.10, floors, mixed=0.05) == (
        "dissipation",
        "hysteresis",
    )
    assert classes_after(monkeypatch, PAIR, 0.10, floors, mixed=0.04) == PAIR


def test_a_loop_has_to_leave_far_less_than_any_force_of_deflection_and_speed(monkeypatch):
    loops = dict.fromkeys(("", *PAIR), (0.06, 0.4))
    surface = {(SURFACE,): 0.10}
    assert classes_after(monkeypatch, PAIR, 0.10, loops, surface=surface) == ("hysteresis",)
    surface = {(SURFACE,): 0.09}
    assert classes_after(monkeypatch, PAIR, 0.10, loops, surface=surface) == PAIR
    # Under one frequency such a force draws every loop.
    steady = {"surface": surface, "is_one_frequency": True}
    assert classes_after(monkeypatch, PAIR, 0.10, loops, **steady) == ("hysteresis",)
    # Beside the loop stands what stands beside the force, unless the force holds it.
    floors = {"": (0.09, 0.4), "dissipation": (0.03, 0.3), "memory": (0.03, 0.3)}
    both = ("dissipation", "memory")
    surface = {(SURFACE,): 0.04, (SURFACE, "memory"): 0.05}
    assert classes_after(monkeypatch, both, 0.10, floors, surface=surface) == (
        "hysteresis",
        "memory",
    )
    surface = {(SURFACE,): 0.05, (SURFACE, "memory"): 0.04}
    assert classes_after(monkeypatch, both, 0.10, floors, surface=surface) == (
        "dissipation",
        "hysteresis",
    )
