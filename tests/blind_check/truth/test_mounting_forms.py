"""Causes of a mounting in forms of no law: their forces, classes and plans."""

from copy import deepcopy
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import FORM, NOTHING, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.mounting import other_forms
from carrierflex.blind_check.truth.mounting.form_laws import (
    AMOUNT,
    DEFLECTION,
    FIRST,
    LOOP,
    N_PARAMETERS,
    N_STATES,
    NUMBER,
    ONE_SIDED,
    PLANE_LOOP,
    POWER_DAMPING,
    RUBBER,
    SECOND,
    SHARES,
    SPEED,
    TWO_STOPS,
    form_force,
)
from carrierflex.blind_check.truth.mounting.other_forms import (
    CLASSES_OF_LAW,
    MOUNTING_FORMS,
    form_aliases,
    with_form,
)
from carrierflex.blind_check.truth.mounting.state import MountingState
from carrierflex.blind_check.truth.mounting.time_integration import Bushings
from carrierflex.blind_check.truth.mounting.truth import withheld
from carrierflex.diagnosis.mounting.answer import contract_id
from carrierflex.diagnosis.mounting.table import SHAPE_OF_LAW


def form(number, first, second=0.0):
    """A form of unit amount and size without distortion, the port bushing twice as strong."""
    p = np.zeros(N_PARAMETERS)
    p[[NUMBER, AMOUNT, FIRST, SECOND, DEFLECTION, SPEED]] = number, 1.0, first, second, 1.0, 1.0
    p[SHARES : SHARES + 2] = 1.0, 2.0
    return p


def force(p, u, v=(0.0, 0.0), bushing=0, memory=None):
    states = np.zeros(N_STATES) if memory is None else memory
    rate = np.zeros(N_STATES)
    result = np.array(form_force(p, bushing, u, v, 0.0, states, rate))
    return result, rate


def driven(p, path, step):
    """Force along a path of deflections in y and z, by small steps of its states."""
    memory, forces = np.zeros(N_STATES), []
    for before, now in pairwise(path):
        v = tuple((now - before) / step)
        result, rate = force(p, tuple(now), v, memory=memory)
        memory = memory + step * rate
        forces.append(result)
    return np.array(forces)


def test_stops_act_along_the_deflection_beyond_their_gap_and_by_bushing():
    p = form(TWO_STOPS, 0.4, 1.0)
    assert not force(p, (0.2, 0.2))[0].any()
    result = force(p, (0.6, 0.8))[0]
    np.testing.assert_allclose(result, (0.6 + 0.35) * np.array([0.6, 0.8]), rtol=1e-12)
    np.testing.assert_allclose(force(p, (0.6, 0.8), bushing=1)[0], 2.0 * result, rtol=1e-12)


def test_one_sided_stop_acts_upwards_alone():
    p = form(ONE_SIDED, 0.3)
    np.testing.assert_allclose(force(p, (5.0, 0.8))[0], [0.0, 0.5])
    assert not force(p, (5.0, -0.8))[0].any()


def test_power_damping_grows_by_its_power_along_the_speed():
    p = form(POWER_DAMPING, 2.0)
    slow, fast = (force(p, (0.0, 0.0), (0.0, w))[0][1] for w in (0.2, 0.4))
    assert fast / slow == pytest.approx(4.0)


@pytest.mark.parametrize(("number", "second"), [(LOOP, 1.0), (PLANE_LOOP, 0.0)])
def test_loops_stay_within_their_limit_and_take_energy(number, second):
    angle = np.linspace(0.0, 4.0 * np.pi, 4000)
    path = np.array([np.zeros_like(angle), np.sin(angle)]).T
    forces = driven(form(number, 0.2, second), path, angle[1])
    assert np.abs(forces[:, 1]).max() == pytest.approx(0.2, rel=0.05)
    assert np.sum(forces[2000:, 1] * np.diff(path[:, 1])[2000:]) > 0.3


def test_rubber_is_stiffer_where_it_moves_faster():
    p = form(RUBBER, 0.05, 0.3)
    sizes = []
    for frequency in (0.2, 5.0):
        time = np.linspace(0.0, 3.0 / frequency, 6000)
        path = np.array([np.zeros_like(time), np.sin(2.0 * np.pi * frequency * time)]).T
        sizes.append(np.abs(driven(p, path, time[1])[3000:, 1]).max())
    assert sizes[1] > 1.3 * sizes[0]


def test_plans_turn_through_every_form_with_a_sixth_of_pairs_and_of_nothing():
    plans = case_plans("mounting", 120, 5, ("form",))
    counts = [len(plan.effects) for plan in plans]
    assert (counts.count(0), counts.count(2)) == (20, 20)
    assert {name for plan in plans for name in plan.effects} == set(MOUNTING_FORMS)


def test_the_diagnosis_and_the_truth_place_every_law_alike():
    placed = {law: (contract_id(f"{shape}/all"),) for law, shape in SHAPE_OF_LAW.items()}
    assert placed == dict(CLASSES_OF_LAW)


def test_static_maps_are_aliases_of_one_another_and_forces_of_none():
    assert form_aliases(("bushings/memory",)) == ()
    assert form_aliases(("bushings/memory", "input_map")) == (
        ("bushings/memory", "sensor_map"),
        ("bushings/memory", "stiffness_map"),
    )


@pytest.mark.long
@pytest.mark.parametrize("name", ["two_stops", "soft_bearing", "late_signals"])
def test_a_case_has_the_wanted_gap_and_its_class(name):
    _, label = case_campaign(CasePlan("mounting", 3, 8, "form", (name,), 6.0))
    assert label.classes == (MOUNTING_FORMS[name].class_id,)
    assert label.gap_over_floor == pytest.approx(6.0, rel=1e-6)
    assert label.drive in ("gusts", "levels")


@pytest.mark.long
def test_a_case_without_a_cause_is_judged_as_nothing_missing():
    _, label = case_campaign(CasePlan("mounting", 4, 8, "form", (), 0.0))
    assert label.family == NOTHING
    assert label.drive


def pair_of(seed, names=("load_lever", "uneven_bushings"), share=1.0):
    """Pair whose gaps are its arm and its excess: their sizes are read off the state."""
    plan = CasePlan("mounting", 1, seed, FORM, names, 6.0)
    known = MountingState(Bushings(1.0, 1.0))
    return withheld(
        plan,
        np.random.default_rng(seed),
        known,
        np.array([1.0, 1.0]),
        gap=lambda state, fine: np.hypot(state.P_T, state.bushings.excess),
        share=share,
    )


def test_second_cause_of_a_pair_leaves_alone_six_tenths_to_sixteen_of_the_first():
    ratios = []
    for seed in range(60):
        pair = pair_of(seed)
        first, second = pair.own_gaps
        assert (abs(pair.state.P_T), abs(pair.state.bushings.excess)) == (first, second)
        assert pair.floor == 0.0
        ratios.append(second / first)
    # Sizes are met within 7 % each.
    assert 0.6 * 0.93**2 < min(ratios) < 0.75
    assert 1.4 < max(ratios) < 1.6 * 1.07**2


def test_one_cause_of_a_pair_is_as_large_as_it_is_drawn_and_the_other_smaller():
    sizes = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        rng.uniform()
        known = MountingState(Bushings(1.0, 1.0))
        size = np.array([1.0, 1.0])
        lever, _ = with_form(known, "load_lever", deepcopy(rng), size)
        with_form(known, "load_lever", rng, size)
        uneven, _ = with_form(known, "uneven_bushings", rng, size)
        state = pair_of(seed).state
        sizes.append(
            [state.P_T / lever.P_T, state.bushings.excess / uneven.bushings.excess],
        )
        half = pair_of(seed, share=0.5).state
        assert half.P_T == pytest.approx(0.5 * state.P_T, rel=0.15)
    assert np.max(sizes, axis=1) == pytest.approx(np.ones(20))
    assert np.min(sizes) > 0.0


def test_one_cause_alone_has_the_size_that_it_had_before_pairs_were_balanced():
    plan = CasePlan("mounting", 1, 7, FORM, ("two_stops",), 6.0)
    known = MountingState(Bushings(1.0, 1.0))
    size = np.array([1.0, 1.0])
    alone = withheld(plan, np.random.default_rng(7), known, size, gap=lambda state, fine: 1.0)
    drawn, change = with_form(known, "two_stops", np.random.default_rng(7), size)
    np.testing.assert_array_equal(alone.state.bushings.forms, drawn.bushings.forms)
    assert (alone.changes, alone.own_gaps) == ((change,), ())


@pytest.mark.long
def test_each_of_two_causes_has_a_gap_of_its_own_and_neither_is_small_beside_the_other():
    # Before the sizes were balanced the axial stiffness left a third of the other's gap.
    plan = CasePlan("mounting", 1, 11003, FORM, ("hyperbolic_bushing", "stiff_axis"), 6.0)
    _, label = case_campaign(plan)
    first, second = label.own_gaps
    assert 0.6 * 0.93**2 < second / first < 1.6 * 1.07**2
    assert label.gap_over_floor == pytest.approx(plan.ratio)
    # Forces add up, motions nearly: the sides of a triangle.
    assert abs(first - second) < label.gap_over_floor < 1.05 * (first + second)
    _, alone = case_campaign(replace(plan, effects=("hyperbolic_bushing",)))
    assert alone.own_gaps == ()


@pytest.mark.long
def test_a_form_whose_motion_would_run_away_is_drawn_smaller():
    """Warming that takes the whole stiffness away moved a housing by 1e30 m."""
    plan = case_plans("mounting", 380, 12007, (FORM,))[199]
    assert plan.effects == ("warming",)
    campaign, label = case_campaign(plan)
    largest = max(
        float(np.abs(signal).max()) for run in campaign.runs for signal in run.signals.values()
    )
    assert largest < 0.05
    assert label.gap_over_floor == pytest.approx(plan.ratio)


@pytest.mark.long
@pytest.mark.parametrize("names", [("softening_rubber",), ("load_lever", "softening_rubber")])
def test_a_form_whose_motion_leaves_all_numbers_is_drawn_smaller(names, monkeypatch):
    # A rubber that takes away six times the stiffness: the motion grows past the largest number.
    monkeypatch.setattr(other_forms, "_SHARE", (3.0, 3.0))
    campaign, label = case_campaign(CasePlan("mounting", 1, 5, FORM, names, 6.0))
    largest = max(
        float(np.abs(signal).max()) for run in campaign.runs for signal in run.signals.values()
    )
    assert largest < 0.05
    assert label.gap_over_floor == pytest.approx(6.0)
