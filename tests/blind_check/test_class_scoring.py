"""The score by class against answers made by hand."""

import pytest

from carrierflex.blind_check.labels import NOTHING, OUTSIDE, PAIR, SINGLE, Label
from carrierflex.blind_check.scoring.class_judging import cases_judged_by_class, judge_by_class
from carrierflex.blind_check.scoring.class_score import class_score, covered_parameters
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.sealing.verdicts import ERROR, Verdict
from carrierflex.blind_check.truth.element.families import (
    CLASSES_OF_LAW,
    acceptable_laws,
    class_sets,
)
from carrierflex.diagnosis.element import columns
from carrierflex.workflows.diagnosis.score_page import score_page

F = "restoring_force"
G = "dissipation"
H = "hysteresis"
S = "force_surface"


def label(number, *causes, family=None, ratio=10.0, drive="noise", changes=None):
    family = family or {0: NOTHING, 1: SINGLE, 2: PAIR}[len(causes)]
    classes, aliases = class_sets(causes if family in (SINGLE, PAIR) else ())
    return Label(
        f"element-{number:04d}",
        "element",
        family,
        causes,
        tuple(acceptable_laws(name) for name in causes),
        (),
        ratio if causes else 0.0,
        1e-5,
        0.1,
        {},
        {},
        classes,
        aliases,
        drive,
        changes if changes is not None else tuple(0.2 for _ in causes),
    )


def verdict(word, *classes, ties=(), laws=(), law_share=0.95, parameters=None):
    entries = [{"id": name, "share": 0.9, "law_share": law_share} for name in classes]
    return Verdict(
        {
            "verdict": word,
            "classes": entries,
            "class_ties": [list(ids) for ids in ties],
            "effects": list(laws),
            "parameters": parameters or {},
        },
        2.0,
    )


@pytest.mark.parametrize(
    ("truth", "answer", "outcome"),
    [
        (label(1, "cubic_spring"), verdict("class_named", F), "right"),
        (label(1, "cubic_spring"), verdict("class_named", G), "wrong"),
        (label(1, "cubic_spring"), verdict("class_named", F, G), "wrong"),
        (label(1, "cubic_spring"), verdict("none_of_these"), "abstained"),
        (label(1, "cubic_spring"), verdict("at_noise_floor"), "silent"),
        (label(1, "cubic_spring"), verdict("not_diagnosable"), "silent"),
        (label(1, "cubic_spring"), verdict("aliased", F, ties=[(G,)]), "tie"),
        (label(1, "cubic_spring"), verdict("aliased", H, ties=[(G,)]), "wrong"),
        # Dry friction lies in two classes: the tie of both is right, the other one alone is not.
        (label(1, "coulomb"), verdict("aliased", G, ties=[(H,)]), "right"),
        (label(1, "coulomb"), verdict("aliased", H, ties=[(G,)]), "right"),
        (label(1, "coulomb"), verdict("class_named", H), "wrong"),
        (label(1, "coulomb"), verdict("aliased", G, ties=[(H,), (F,)]), "tie"),
        (label(1, "cubic_spring", "coulomb"), verdict("class_named", G, F), "right"),
        (label(1, "cubic_spring", "coulomb"), verdict("class_named", F), "wrong"),
        (label(1, "cubic_spring", "coulomb"), verdict("aliased", F, H, ties=[(G, F)]), "right"),
        (label(1), verdict("at_noise_floor"), "right"),
        (label(1), verdict("none_of_these"), "right"),
        (label(1), verdict("class_named", F), "wrong"),
        (label(1, "tuned_mass", family=OUTSIDE), verdict("none_of_these"), "right"),
        (label(1, "tuned_mass", family=OUTSIDE), verdict("class_named", F), "wrong"),
        (label(1, "cubic_spring"), Verdict({"verdict": ERROR, "reason": "no"}, 1.0), "error"),
    ],
)
def test_an_answer_is_judged_by_its_ids(truth, answer, outcome):
    assert judge_by_class(truth, answer).outcome == outcome


def test_an_answer_without_the_keys_of_version_2_names_no_class():
    old = Verdict({"verdict": "none_of_these", "effects": []}, 1.0)
    assert judge_by_class(label(1, "cubic_spring"), old).outcome == "abstained"


@pytest.mark.parametrize(
    ("truth", "laws", "false"),
    [
        (label(1, "cubic_spring"), ("quintic_stiffness",), ()),
        (label(1, "cubic_spring"), ("coulomb_friction",), ("coulomb_friction",)),
        (label(1, "slider"), ("coulomb_friction",), ()),
        (label(1, "hertz_contact"), ("backlash",), ()),
        (label(1, "coulomb"), ("elasto_plastic_friction",), ()),
        (label(1), ("backlash",), ("backlash",)),
        (label(1, "tuned_mass", family=OUTSIDE), ("backlash",), ("backlash",)),
    ],
)
def test_a_named_law_is_false_where_its_class_is_wrong(truth, laws, false):
    assert judge_by_class(truth, verdict("named", F, laws=laws)).false_laws == false


def scored(pairs):
    labels = {truth.case: truth for truth, _ in pairs}
    verdicts = {truth.case: answer for truth, answer in pairs}
    return class_score(cases_judged_by_class(labels, verdicts))


def table():
    """Wide-band: 20 right, one wrong, one tie, two silent, all clear; one small and silent.

    Sweeps: 20, of which seven abstain. 20 of nothing, one false; 20 outside, two classes, one law.
    """
    pairs = [(label(k, "cubic_spring"), verdict("class_named", F)) for k in range(20)]
    pairs += [(label(20, "cubic_spring"), verdict("named", G, laws=["coulomb_friction"]))]
    pairs += [(label(21, "cubic_spring"), verdict("aliased", F, ties=[(G,)]))]
    pairs += [(label(k, "iwan", ratio=2.0), verdict("at_noise_floor")) for k in (22, 23)]
    pairs += [(label(24, "iwan", ratio=1.9), verdict("at_noise_floor"))]
    for k in range(30, 50):
        answer = verdict("none_of_these") if k < 37 else verdict("class_named", H)
        pairs.append((label(k, "iwan", drive="sweeps"), answer))
    pairs += [(label(k), verdict("at_noise_floor")) for k in range(60, 79)]
    pairs += [(label(79), verdict("class_named", F))]
    for k in range(80, 100):
        answer = verdict("class_named", F) if k < 82 else verdict("none_of_these")
        answer = verdict("named", F, laws=["backlash"]) if k == 80 else answer
        pairs.append((label(k, "tuned_mass", family=OUTSIDE), answer))
    return pairs


def test_figures_of_a_table_made_by_hand():
    result = scored(table())
    figures = {figure.name: figure for figure in result.figures}
    expected = {
        "wide_band, gap >= 2: class right of those answered": (20 / 22, 22, False),
        "wide_band, gap >= 2: class right of all": (20 / 24, 24, None),
        "wide_band, gap >= 2: not answered": (2 / 24, 24, True),
        "wide_band, gap >= 2: wrong": (1 / 24, 24, None),
        "wide_band, gap >= 2: tie": (1 / 24, 24, None),
        "wide_band, gap < 2: right": (0.0, 1, None),
        "levels, gap >= 2: class right of those answered": (1.0, 13, None),  # too few to judge
        "levels, gap >= 2: not answered": (7 / 20, 20, False),
        "levels, gap >= 2: abstained": (7 / 20, 20, None),
        "nothing missing: false class or law": (1 / 20, 20, False),
        "outside: law named": (1 / 20, 20, False),
        "outside: class named": (2 / 20, 20, None),
        "law named, class wrong": (1 / 45, 45, False),
    }
    for name, (value, cases, met) in expected.items():
        assert figures[name].value == pytest.approx(value, rel=1e-9), name
        assert (figures[name].cases, figures[name].met) == (cases, met), name
    assert not result.met
    assert len(result.false_laws) == 2
    assert len(result.wrong) == 2 + 1 + 2


def test_decays_have_figures_of_their_own_and_no_target():
    before = {figure.name: figure for figure in scored(table()).figures}
    decays = [(label(k, "iwan", drive="decay"), verdict("class_named", F)) for k in (200, 201)]
    decays += [(label(202, "iwan", drive="decay"), verdict("named", H, laws=["backlash"]))]
    decays += [(label(203, drive="decay"), verdict("class_named", F))]
    decays += [(label(204, drive="decay"), verdict("at_noise_floor"))]
    outside = label(205, "tuned_mass", family=OUTSIDE, drive="decay")
    decays += [(outside, verdict("named", F, laws=["backlash"]))]
    figures = {figure.name: figure for figure in scored(table() + decays).figures}
    expected = {
        "decays, gap >= 2: class right of those answered": (1 / 3, 3),
        "decays, nothing missing: false class or law": (1 / 2, 2),
        "decays, outside: law named": (1.0, 1),
        "decays, outside: class named": (1.0, 1),
        "decays, law named, class wrong": (1 / 3, 3),
    }
    for name, (value, cases) in expected.items():
        assert figures[name].value == pytest.approx(value), name
        assert (figures[name].cases, figures[name].wanted) == (cases, ""), name
    # What has a target is judged without them.
    for name, figure in before.items():
        if not name.startswith("seconds"):
            assert (figures[name].value, figures[name].cases) == (figure.value, figure.cases), name


def test_page_lists_every_false_law_and_the_change_of_form():
    result = scored(table())
    page = score_page(
        BlindCheck(None, result, "ab"), command="carrierflex", date="2026-01-01", software="x 1"
    )
    row = "| element-0020 | noise | cubic_spring | restoring_force | 10.0 | 20 % | wrong "
    assert row + "| dissipation | coulomb_friction | coulomb_friction |" in page
    # All single causes with a class and a gap of two floors.
    assert "| 15 to 20 % | 44 | 33 |" in page
    assert "| no law of the library | 22 | 13 |" in page
    assert "| element | hysteresis | 22 | 13 |" in page


def test_true_parameters_are_looked_for_where_a_class_is_right():
    truth = label(1, "cubic_spring", changes=(0.0,))
    truth.parameters.update({"baseline": {"m": 2.0, "K1": 5.0}, "cubic_stiffness": {"K3": 7.0}})
    claimed = {
        "baseline": {
            "m": {"value": 2.1, "ci95": [1.9, 2.3]},
            "K1": {"value": 5.5, "std": 0.1},
            "C1": {"value": 1.0, "std": 0.1},
        },
        "cubic_stiffness": {"K3": {"value": 7.0, "std": None, "ci95": [6.0, 8.0]}},
    }
    right = judge_by_class(truth, verdict("named", F, parameters=claimed))
    hits = {hit.name: hit.is_covered for hit in covered_parameters(right)}
    assert hits == {"baseline.m": True, "baseline.K1": False, "cubic_stiffness.K3": True}
    assert not covered_parameters(judge_by_class(truth, verdict("named", G, parameters=claimed)))


def test_every_law_that_a_diagnosis_can_name_has_its_classes_in_the_score():
    assert set(CLASSES_OF_LAW) == {*columns.CLASSES_OF_LAW, columns.PRESLIDING}
    for law, classes in columns.CLASSES_OF_LAW.items():
        assert set(CLASSES_OF_LAW[law]) <= set(classes)
