"""Every constant of the decision is found with its reason, moved where it is read, and put back."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from carrierflex.blind_check.labels import NOTHING, SINGLE, CasePlan
from carrierflex.blind_check.sensitivity import moved_constants
from carrierflex.blind_check.sensitivity.listed_constants import listed_constants
from carrierflex.blind_check.sensitivity.moved_constants import (
    FACTORS,
    answers_of_case,
    changed_answers,
    moved,
)
from carrierflex.blind_check.sensitivity.read_steps import OF_SCORES, OF_TABLE
from carrierflex.blind_check.sensitivity.sameness import equal_groups, is_same
from carrierflex.blind_check.sensitivity.usual_case import (
    NO_ANSWER,
    UsualCase,
    are_opposed,
    element_problem_of,
    in_words,
    usual_case,
)
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.element.classes import limits, table
from carrierflex.diagnosis.element.classes.motion import force_records
from carrierflex.diagnosis.element.classes.table import element_table
from carrierflex.diagnosis.element.problem import element_problem
from tests.diagnosis.classes.toy_table import N_BLOCKS, N_SAMPLES, toy_columns, toy_table
from tests.diagnosis.element.element_campaigns import displacement_campaign

CONSTANTS = {f"{own.module.rpartition('.')[2]}.{own.name}": own for own in listed_constants()}


def plain_answer(campaign):
    """Answer of a campaign as a diagnosis makes it, all of it."""
    try:
        own = element_problem_of(campaign).class_answer()
    except (ValueError, ArithmeticError, AssertionError):
        return NO_ANSWER
    return in_words(own) if own else NO_ANSWER


def test_every_constant_has_a_reason():
    assert [name for name, own in CONSTANTS.items() if not own.reason] == []


def test_a_private_constant_is_moved_in_its_own_module_alone():
    assert force_records._WIDEST == 0.95
    with moved(CONSTANTS["force_records._WIDEST"], 1.2):
        assert pytest.approx(1.0 - 1.2 * 0.05) == force_records._WIDEST
    assert force_records._WIDEST == 0.95


def test_a_public_constant_is_moved_where_it_is_read_too():
    before = table.IN_TIME
    with moved(CONSTANTS["force_records.IN_TIME"], 0.8):
        assert table.IN_TIME == force_records.IN_TIME == before - 1
    assert table.IN_TIME == force_records.IN_TIME == before


def test_a_limit_of_the_comparison_is_moved():
    with moved(CONSTANTS["constants.named_left"], 0.8):
        assert limits.element_limits().named_left == pytest.approx(0.16)
    assert limits.element_limits().named_left == 0.2


class Limits(ClassConstants):
    """Limits that tell which of them were read."""

    read: ClassVar[set[str]] = set()

    def __getattribute__(self, name):
        if not name.startswith("_"):
            Limits.read.add(name)
        return super().__getattribute__(name)


def test_the_table_reads_no_limits_but_those_that_are_said_to_be_its_own():
    problem = element_problem(displacement_campaign(lambda q, v: 5e9 * q**3))
    Limits.read.clear()
    made = element_table(problem.model, problem.records, problem.noise, Limits())
    assert Limits.read - {"read"} == set(OF_TABLE)
    Limits.read.clear()
    made.scores.of(("dissipation", "memory"))
    assert Limits.read - {"read"} == set(OF_SCORES)


def test_the_answer_that_is_compared_is_that_of_a_diagnosis():
    campaign = displacement_campaign(lambda q, v: 5e9 * q**3)
    assert usual_case(campaign).answer == plain_answer(campaign)
    assert plain_answer(campaign).startswith("named: restoring_force")


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ("named: memory", "named: dissipation", True),
        ("named: memory", "leading: dissipation + memory", True),
        ("named: memory: maxwell_branch", "named: delay or memory", False),
        ("leading: delay or dissipation", "named: coupled_damping or delay: sensor_delay", False),
        ("named: memory", "leading: memory", False),
        ("named: memory", "no_class", False),
        ("nothing", "no_class", False),
    ],
)
def test_answers_are_opposed_where_they_share_no_set_of_classes(first, second, expected):
    assert are_opposed(first, second) is are_opposed(second, first) is expected


def test_constants_that_were_moved_from_the_same_values_are_not_moved_again():
    campaign = displacement_campaign(lambda q, v: 5e9 * q**3)
    chosen = [CONSTANTS["constants.named_left"], CONSTANTS["constants.bootstrap_samples"]]
    first = changed_answers(campaign, chosen)
    assert first["changed"] == {}
    own, other = (constant.path for constant in chosen)
    kept = {**first, "changed": {f"{own} x0.8": "kept", f"{other} x0.8": "kept", "gone x0.8": "x"}}
    assert changed_answers(campaign, chosen, kept)["changed"] == {
        f"{own} x0.8": "kept",
        f"{other} x0.8": "kept",
    }
    of_another_value = {**kept, "moved": {**first["moved"], other: 1.0}}
    assert changed_answers(campaign, chosen, of_another_value)["changed"] == {f"{own} x0.8": "kept"}
    of_another_answer = {**kept, "answer": "nothing"}
    assert changed_answers(campaign, chosen, of_another_answer) == first


def test_a_case_is_repeated_with_other_noise_while_its_answer_is_another(monkeypatch):
    answers = {0: "nothing", 1: "no_class", 2: "nothing"}
    monkeypatch.setattr(moved_constants, "listed_constants", lambda: ())
    monkeypatch.setattr(moved_constants, "case_campaign", lambda plan, repeat=0: (repeat, None))
    monkeypatch.setattr(
        moved_constants, "usual_case", lambda campaign: UsualCase(campaign, answers[campaign])
    )
    plan = CasePlan("element", 3, 7411, NOTHING, (), 0.0, "noise")
    found = answers_of_case(plan)
    assert found == {**found, "answer": "nothing", "repeated": ["no_class", "nothing"]}
    kept = {**found, "repeated": ["of before", "of before"]}
    assert answers_of_case(plan, kept) == kept
    assert answers_of_case(plan, {**kept, "answer": "no_class"}) == found
    assert answers_of_case(plan, {**kept, "repeated": ["of before"]}) == found


#: Of each way that a constant takes to an answer; all but three change one of the answers below.
WAYS = (
    *("constants.n_folds", "constants.ridges", "constants.standard_errors"),
    *("signals._ROLL_OFF", "records._PIECES", "force_records._BLOCKS", "noise_colour._BEYOND"),
    *("weighting._FORCE_ERROR", "columns._N_FORCE", "laws._TAUS", "answer._SAME_LEVEL"),
)
#: Cases whose answers hang on much: causes beside one another under noise, and a slow change.
_DELICATE = (
    (4, "visco_elastic_stop", 5.183, "noise"),
    (12, "visco_elastic_stop", 39.58, "sines"),
    (21, "visco_elastic_stop", 5.746, "sweeps"),
    (47, "drifting_preload", 0.7593, "noise"),
    (69, "rubber", 9.264, "noise"),
)


@pytest.mark.long
def test_what_is_not_made_again_changes_no_answer():
    chosen = [CONSTANTS[name] for name in WAYS]
    changing = set()
    for number, cause, ratio, drive in _DELICATE:
        plan = CasePlan("element", number, 7411, SINGLE, (cause,), ratio, drive)
        campaign, _ = case_campaign(plan)
        found = changed_answers(campaign, chosen)
        plain = {}
        for constant in chosen:
            for factor in FACTORS:
                with moved(constant, factor):
                    other = plain_answer(campaign)
                if other != found["answer"]:
                    plain[f"{constant.path} x{factor}"] = other
        assert found["changed"] == plain
        changing |= {name.partition(" ")[0] for name in plain}
    assert len(changing) == len(WAYS) - 3


def test_columns_that_are_equal_keep_what_they_leave_and_others_do_not():
    first = toy_table(np.zeros(N_BLOCKS * N_SAMPLES), toy_columns())
    other = replace(first, gram=first.gram.copy())
    assert is_same(first, other)
    places = first.groups["b"].columns
    other.gram[:, places[0], places[0]] += 1e-15
    assert not is_same(first, other)
    assert equal_groups(first, other) == {"a", "c", "more"}
    assert equal_groups(first, replace(first, floor=2.0 * first.floor)) is None
