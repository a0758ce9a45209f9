"""Smooth loops of hysteresis: their state, their fit, and that they replace no two causes."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.columns import stops
from carrierflex.diagnosis.classes.results import NAMED_CLASS
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.shapes import law_of_answer
from carrierflex.simulation.element.loop_kernels import loop_states, moved_loop
from carrierflex.simulation.element.memory_kernels import forces_along
from carrierflex.simulation.element.memory_laws import (
    N_STIFFNESS,
    flat_parts,
    joined_parts,
    memory_parts,
)
from carrierflex.simulation.law_files import read_law, write_law
from carrierflex.simulation.laws import ELEMENT, Law, Loop
from tests.diagnosis.element.element_campaigns import bouc_wen, displacement_campaign
from tests.diagnosis.element.test_measured_laws import shrinkage

STATES = np.linspace(-1.0, 1.0, N_STIFFNESS)
#: Turns back at once and a half of the stiffness that it slips at.
SOFTENING = 1.3 - STATES


def test_a_straight_stiffness_grows_to_its_limit_by_the_exponential():
    # du/ds = 1.3 - u from u = 0, across three of the places.
    ways = np.array([0.01, 0.2, 0.7, 1.4])
    result = [moved_loop(0.0, way, SOFTENING) for way in ways]
    assert_allclose(result, 1.3 * (1.0 - np.exp(-ways)), rtol=1e-12)
    assert_allclose([moved_loop(0.0, -way, SOFTENING) for way in ways], -np.array(result))


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
    even = 1.0 + STATES**2
    states = loop_states(q, 1.0, even, np.zeros(1))
    back = np.interp(q[:50], q[:49:-1], states[:49:-1])
    assert_allclose(back, states[:50], atol=2e-4)
    with_loop = loop_states(q, 1.0, SOFTENING, np.zeros(1))
    assert np.abs(np.interp(q[:50], q[:49:-1], with_loop[:49:-1]) - with_loop[:50]).max() > 0.2


def test_a_loop_among_the_parts_is_force_times_its_state():
    q = 1e-3 * np.sin(np.linspace(0.0, 12.0, 600))
    loop = Loop(ELEMENT, 2e-3, 3.0, SOFTENING)
    memory = memory_parts(Law("own", ELEMENT, "hysteresis", ("N", "m"), (loop,)))
    force = forces_along(q, 1e-3, flat_parts(joined_parts([(memory, 2.0)])))
    assert_allclose(force, 6.0 * loop_states(q, 2e-3, SOFTENING, np.zeros(1)), atol=1e-12)


def hardening_loop(q, v):
    """Bouc-Wen loop that stiffens as it grows and turns back more than twice as stiff."""
    return 4.0 * bouc_wen(q, 8e-4, exponent=1.0, beta=0.4, gamma=-0.9, substeps=8)


def hardening_spring_and_slider(q, v):
    return 4.0 * stops(q, np.array([2e-4]), from_rest=True)[0] + 1.5e9 * q**3


@cache
def answer_to(cause):
    return element_problem(displacement_campaign(cause, n=3000)).class_answer()


@pytest.mark.long
def test_a_loop_that_hardens_is_hysteresis_alone_and_not_a_spring_beside_it():
    result = answer_to(hardening_loop)
    assert (result.state, result.ids) == (NAMED_CLASS, ("hysteresis",))
    assert result.share > 0.99


@pytest.mark.long
def test_a_hardening_spring_beside_a_slider_is_two_causes():
    result = answer_to(hardening_spring_and_slider)
    assert (result.state, set(result.ids)) == (NAMED_CLASS, {"hysteresis", "restoring_force"})


@pytest.mark.long
def test_a_saved_loop_explains_its_class_on_new_records(tmp_path):
    path = tmp_path / "law.toml"
    write_law(path, law_of_answer(answer_to(hardening_loop), "twin"))
    law = read_law(path)
    assert len(law.of(Loop)) == 1
    problem = element_problem(displacement_campaign(hardening_loop, n=3000, seed=7), (law,))
    assert shrinkage(problem, law) > 0.98 * problem.class_answer().share
