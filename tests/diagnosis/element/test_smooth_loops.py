"""Smooth loops of hysteresis: their state, their fit, and that they replace no two causes."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.decision import Decision
from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.memory_columns import stops
from carrierflex.diagnosis.classes.results import NAMED_CLASS
from carrierflex.diagnosis.classes.shares import PairedShares
from carrierflex.diagnosis.element.classes import answer as answers
from carrierflex.diagnosis.element.classes.measured.measured_laws import law_of_answer
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.simulation.element.loop_kernels import loop_states, moved_loop
from carrierflex.simulation.element.memory_kernels import forces_along
from carrierflex.simulation.element.memory_laws import (
    N_STIFFNESS,
    NO_PARTS,
    MemoryLaw,
    flat_parts,
    joined_parts,
)
from carrierflex.simulation.law_files import read_measured_law, write_measured_law
from tests.diagnosis.element.element_campaigns import bouc_wen, displacement_campaign
from tests.diagnosis.element.test_measured_laws import shrinkage

PLACES = np.linspace(-1.0, 1.0, N_STIFFNESS)
#: Turns back at once and a half of the stiffness that it slips at.
SOFTENING = 1.3 - PLACES


def test_a_straight_stiffness_grows_to_its_limit_by_the_exponential():
    # du/ds = 1.3 - u from u = 0, across three of the places.
    ways = np.array([0.01, 0.2, 0.7, 1.4])
    found = [moved_loop(0.0, way, SOFTENING) for way in ways]
    assert_allclose(found, 1.3 * (1.0 - np.exp(-ways)), rtol=1e-12)
    assert_allclose([moved_loop(0.0, -way, SOFTENING) for way in ways], -np.array(found))


def test_beyond_the_last_place_the_stiffness_is_that_of_the_last():
    assert moved_loop(1.0, 0.5, SOFTENING) == pytest.approx(1.0 + 0.5 * 0.3, rel=1e-12)
    # Turning back from there it is that of the first until the state comes to minus one.
    assert moved_loop(1.5, -0.1, SOFTENING) == pytest.approx(1.5 - 0.1 * 2.3, rel=1e-12)
    assert moved_loop(1.5, -0.5, SOFTENING) == pytest.approx(
        -(1.3 - 2.3 * np.exp(-(0.5 - 0.5 / 2.3))), rel=1e-12
    )


def test_the_state_hangs_on_the_way_alone_and_not_on_how_it_is_cut():
    q = np.cumsum(np.random.default_rng(2).uniform(-0.3, 0.3, 200))
    fine = np.interp(np.linspace(0, 199, 199 * 7 + 1), np.arange(200), q)
    coarse = loop_states(q, 0.7, SOFTENING, np.array([0.2]))
    assert_allclose(loop_states(fine, 0.7, SOFTENING, np.array([0.2]))[::7], coarse, atol=1e-12)


def test_a_stiffness_without_direction_has_no_loop():
    q = np.concatenate([np.linspace(0, 0.6, 50), np.linspace(0.6, -0.6, 100)])
    even = 1.0 + PLACES**2
    states = loop_states(q, 1.0, even, np.zeros(1))
    back = np.interp(q[:50], q[:49:-1], states[:49:-1])
    assert_allclose(back, states[:50], atol=2e-4)
    with_loop = loop_states(q, 1.0, SOFTENING, np.zeros(1))
    assert np.abs(np.interp(q[:50], q[:49:-1], with_loop[:49:-1]) - with_loop[:50]).max() > 0.2


def test_a_loop_among_the_parts_is_force_times_its_state():
    q = 1e-3 * np.sin(np.linspace(0.0, 12.0, 600))
    row = np.array([[2e-3, 3.0, *SOFTENING]])
    law = MemoryLaw(
        "own", "hysteresis", NO_PARTS.stops, NO_PARTS.branches, ("N", "m"), (-1, 1), loops=row
    )
    force = forces_along(q, 1e-3, flat_parts(joined_parts([(law, 2.0)])))
    assert_allclose(force, 6.0 * loop_states(q, 2e-3, SOFTENING, np.zeros(1)), atol=1e-12)


def hardening_loop(q, v):
    """Bouc-Wen loop that stiffens as it grows and turns back more than twice as stiff."""
    return 4.0 * bouc_wen(q, 8e-4, exponent=1.0, beta=0.4, gamma=-0.9, parts=8)


def hardening_spring_and_slider(q, v):
    return 4.0 * stops(q, np.array([2e-4]), from_rest=True)[0] + 1.5e9 * q**3


@cache
def answer_to(cause):
    return element_problem(displacement_campaign(cause, n=3000)).class_answer()


def test_a_loop_that_hardens_is_hysteresis_alone_and_not_a_spring_beside_it():
    found = answer_to(hardening_loop)
    assert (found.state, found.ids) == (NAMED_CLASS, ("hysteresis",))
    assert found.share > 0.99


def test_a_hardening_spring_beside_a_slider_is_two_causes():
    found = answer_to(hardening_spring_and_slider)
    assert (found.state, set(found.ids)) == (NAMED_CLASS, {"hysteresis", "restoring_force"})


def test_a_saved_loop_explains_its_class_on_new_records(tmp_path):
    path = tmp_path / "law.toml"
    write_measured_law(path, law_of_answer(answer_to(hardening_loop), "twin"))
    law = read_measured_law(path)
    assert law.loops.shape[0] == 1
    problem = element_problem(displacement_campaign(hardening_loop, n=3000, seed=7), (law,))
    assert shrinkage(problem, law) > 0.98 * problem.class_answer().share


N_BLOCKS = 12
BEFORE = np.full(N_BLOCKS, 100.0)
SURFACE = "force_surface"
PAIR = ("dissipation", "restoring_force")


def left(share):
    """Result that leaves a share of the gap in every block."""
    return HeldOutSquares(share * BEFORE, (), ())


def told(monkeypatch, classes, answer, loops, *, state=NAMED_CLASS, two=True, short=False):
    """Classes after the loop was asked; `loops` has what loop and curve leave, by partner."""
    monkeypatch.setattr(
        answers,
        "left_by_loop",
        lambda own, beside, is_curve=False: (left(loops[beside][is_curve]), None),
    )
    monkeypatch.setattr(answers, "with_loop", lambda model, own, loop: own)
    own = SimpleNamespace(table=SimpleNamespace(surface=SURFACE))
    shares = PairedShares(BEFORE, np.zeros(N_BLOCKS), ClassConstants())
    decision = Decision(state, classes, ((SURFACE,),), left(answer), PAIR)
    candidates = ["dissipation", "hysteresis", "memory", "restoring_force"]
    _, found = answers._as_smooth_loop(
        own, None, shares, decision, candidates, shows_two_causes=two, falls_short=short
    )
    assert found is decision or (found.ties == () and found.state == NAMED_CLASS)
    return found.classes


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
    assert told(monkeypatch, classes, answer, loops, state=state) == expected


def test_a_named_class_that_falls_short_is_held_against_a_loop(monkeypatch):
    spring, loops = ("restoring_force",), {"": (0.01, 0.4)}
    assert told(monkeypatch, spring, 0.10, loops) == spring
    assert told(monkeypatch, spring, 0.10, loops, short=True) == ("hysteresis",)
    assert told(monkeypatch, ("dissipation",), 0.10, loops, short=True) == ("dissipation",)


def test_a_second_cause_beside_the_loop_is_one_beside_any_class(monkeypatch):
    # Beside dissipation the loop gains 4 % of the gap, beside the restoring force 1 %.
    loops = {"": (0.06, 0.4), "dissipation": (0.02, 0.3), "restoring_force": (0.05, 0.3)}
    both = ("dissipation", "hysteresis")
    assert told(monkeypatch, PAIR, 0.10, loops) == both
    assert told(monkeypatch, PAIR, 0.05, loops) == both
    assert told(monkeypatch, PAIR, 0.10, loops, two=False) == ("hysteresis",)
    little = {**loops, "dissipation": (0.04, 0.3)}
    assert told(monkeypatch, PAIR, 0.10, little) == ("hysteresis",)
    curve = {**loops, "dissipation": (0.02, 0.03)}
    assert told(monkeypatch, PAIR, 0.10, curve) == ("hysteresis",)
    # A surface takes up a damping beside the loop, and a memory stands for the loop itself.
    beside = {"": (0.08, 0.4), "memory": (0.08, 0.3), "coupled_damping": (0.08, 0.3)}
    taken = {**beside, "dissipation": (0.02, 0.3)}
    assert told(monkeypatch, (SURFACE, "memory"), 0.06, taken) == both
    # Hysteresis is among the two already: only alone it is another answer.
    assert told(monkeypatch, ("dissipation", "hysteresis"), 0.05, loops) == both
