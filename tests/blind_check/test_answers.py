"""Answers of other tools: what is read is what was written, and what is no answer is refused."""

import json
import math

import pytest

from carrierflex.blind_check.labels import NOTHING, SINGLE, Label
from carrierflex.blind_check.scoring.class_judging import judge_by_class
from carrierflex.blind_check.scoring.judging import judge
from carrierflex.blind_check.sealing.answers import Answers, read_answers, write_answers
from carrierflex.blind_check.sealing.verdicts import Verdict

CASES = ("mounting-0001", "mounting-0002")


def label(*effects, kind="mounting", classes=(), drive=""):
    """Label with one effect or none."""
    family = SINGLE if effects else NOTHING
    members = tuple((effect,) for effect in effects)
    head = (f"{kind}-0001", kind, family, effects, members, (), 9.0, 1.0, 0.2, {}, {})
    return Label(*head, classes=classes, drive=drive)


def read(tmp_path, cases, **changes):
    """Answers read from a file of the right form but for some changes."""
    content = {"format": "carrierflex-answers", "version": 1, "tool": "other 2", "cases": cases}
    path = tmp_path / "answers.json"
    path.write_text(json.dumps(content | changes), encoding="utf-8")
    return read_answers(path, CASES)


def test_a_diagnosis_written_as_an_answer_is_judged_as_it_was(tmp_path):
    document = {
        "verdict": "aliased",
        "effects": ["backlash"],
        "aliases": [["backlash", "cubic_stiffness"]],
        "classes": [],
        "how_far": {"rho": 0.2, "rho_ci95": [0.1, 0.3]},
        "parameters": {"backlash": {"g": {"value": 1e-4, "std": 1e-5, "unit": "m", "scale": 1.0}}},
    }
    path = tmp_path / "answers.json"
    write_answers(path, Answers("carrierflex", {name: Verdict(document, 2.0) for name in CASES}))
    again = read_answers(path, CASES).cases[CASES[0]]
    assert again.seconds == 2.0
    assert again.document["how_far"] == document["how_far"]
    assert again.document["parameters"]["backlash"]["g"]["value"] == 1e-4
    for truth in (label("backlash"), label("cubic_stiffness"), label("quintic_stiffness"), label()):
        assert judge(truth, again).is_right == judge(truth, Verdict(document, 2.0)).is_right


def test_an_answer_may_be_as_short_as_its_effects(tmp_path):
    answers = read(tmp_path, {CASES[0]: {"effects": ["backlash"]}, CASES[1]: {}})
    assert answers.tool == "other 2"
    assert judge(label("backlash"), answers.cases[CASES[0]]).is_right
    assert not judge(label(), answers.cases[CASES[0]]).is_right
    assert judge(label(), answers.cases[CASES[1]]).is_right
    assert math.isnan(answers.cases[CASES[1]].seconds)


def test_laws_alone_answer_with_their_class(tmp_path):
    law = read(tmp_path, {CASES[0]: {"effects": ["cubic_stiffness"]}}).cases[CASES[0]]
    truth = label("cubic_spring", kind="element", classes=("restoring_force",), drive="noise")
    assert judge_by_class(truth, law).outcome == "right"
    other = label("coulomb", kind="element", classes=("dissipation",), drive="noise")
    assert judge_by_class(other, law).outcome == "wrong"
    pins = read(tmp_path, {CASES[0]: {"effects": ["stiff_pins"]}}).cases[CASES[0]]
    waves = label("bent_face", kind="carrier", classes=("carrier/waves/none",), drive="six_loads")
    assert judge_by_class(waves, pins).outcome == "right"


def test_a_class_of_a_carrier_is_judged_by_frame_and_pattern(tmp_path):
    entry = {"classes": ["carrier/waves/torque"]}
    answer = read(tmp_path, {CASES[0]: entry}).cases[CASES[0]]
    truth = label("bent_face", kind="carrier", classes=("carrier/waves/none",), drive="six_loads")
    judged = judge_by_class(truth, answer)
    assert (judged.outcome, judged.follows_right) == ("right", False)
    tilted = label("root_tilt", kind="carrier", classes=("housing/tilt/none",), drive="six_loads")
    assert judge_by_class(tilted, answer).outcome == "wrong"
    assert judge_by_class(tilted, answer).follows_right is None


def test_a_case_without_an_answer_is_an_error(tmp_path):
    answers = read(tmp_path, {CASES[0]: {}})
    assert answers.cases[CASES[1]].document["verdict"] == "error"
    assert not judge(label(), answers.cases[CASES[1]]).is_right


@pytest.mark.parametrize(
    ("cases", "changes", "message"),
    [
        ({}, {"format": "other"}, "not answers to a blind check; expected format"),
        ({}, {"version": 2}, "not answers to a blind check; expected format"),
        ({}, {"tool": 3}, "keys 'tool' and 'cases'; expected a name"),
        ({"mounting-0009": {}}, {}, "answers 'mounting-0009', which is no case of this check"),
        ({CASES[0]: []}, {}, r"mounting-0001: \[\]; expected a table of keys"),
        ({CASES[0]: {"effect": []}}, {}, "unknown key 'effect'; expected verdict, effects"),
        ({CASES[0]: {"effects": "backlash"}}, {}, "effects is 'backlash'; expected a list of nam"),
        ({CASES[0]: {"verdict": ["named"]}}, {}, r"verdict is \['named'\]; expected one of named"),
        ({CASES[0]: {"rho": 10**400}}, {}, "rho is 1000.*expected a number"),
        ({CASES[0]: {"rho_ci95": [0.1]}}, {}, "expected two numbers"),
        ({CASES[0]: {"parameters": {"a": {"b": {"value": 1}}}}}, {}, "expected value, std and"),
    ],
)
def test_what_is_no_answer_is_refused_in_one_line(cases, changes, message, tmp_path):
    with pytest.raises(ValueError, match=message) as caught:
        read(tmp_path, cases, **changes)
    assert str(tmp_path / "answers.json") in str(caught.value)
    assert "\n" not in str(caught.value)
