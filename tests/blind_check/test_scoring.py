"""The score against tables made by hand."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.labels import ALIASED, NOTHING, OUTSIDE, PAIR, SINGLE, Label
from carrierflex.blind_check.scoring.judging import judge, judged_cases
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.scoring.scoring import score, wilson
from carrierflex.blind_check.sealing.verdicts import ERROR, Verdict
from carrierflex.workflows.diagnosis.score_page import score_page

FRICTION = ("coulomb_friction", "stribeck_friction")


def label(number, effects=(), family=None, *, ratio=10.0, present=(), acceptable=None, rho=0.1):
    family = family or (SINGLE if effects else NOTHING)
    members = acceptable or tuple((effect,) for effect in effects)
    where = {"run": "run1"} if effects else {}
    parameters = {effect: {"p": 2.0} for effect in effects}
    case = f"mounting-{number:04d}"
    return Label(
        case,
        "mounting",
        family,
        tuple(effects),
        members,
        tuple(present),
        ratio,
        1e-5,
        rho,
        parameters,
        where,
    )


def verdict(word, *effects, aliases=(), rho=0.12, interval=(0.08, 0.15), value=2.1, seconds=3.0):
    document = {
        "verdict": word,
        "effects": list(effects),
        "aliases": [list(alias_class) for alias_class in aliases],
        "parameters": {
            effect: {"p": {"value": value, "std": 0.1, "unit": "N"}} for effect in effects
        },
        "how_far": {"rho": rho, "rho_ci95": list(interval)},
        "where": [{"run": "run2", "share": 0.2}, {"run": "run1", "share": 0.7}],
    }
    return Verdict(document, seconds)


@pytest.mark.parametrize(
    ("truth", "answer", "is_right"),
    [
        (label(1, ["backlash"]), verdict("named", "backlash"), True),
        (label(1, ["backlash"]), verdict("named_with_remainder", "backlash"), True),
        (label(1, ["backlash"]), verdict("none_of_these", "backlash"), False),
        (label(1, ["backlash"]), verdict("named", "backlash", "sensor_delay"), False),
        (
            label(1, ["backlash"], present=["sensor_delay"]),
            verdict("named", "backlash", "sensor_delay"),
            True,
        ),
        (
            label(1, ["coulomb_friction"], acceptable=(FRICTION,)),
            verdict("named", "stribeck_friction"),
            True,
        ),
        (
            label(1, ["coulomb_friction"], acceptable=(FRICTION,)),
            verdict("named", *FRICTION),
            False,
        ),
        (
            label(1, ["backlash"]),
            verdict("aliased", "maxwell_branch", aliases=[("maxwell_branch", "backlash")]),
            True,
        ),
        (
            label(1, ["backlash"]),
            verdict("aliased", "maxwell_branch", aliases=[("cubic_damping", "backlash")]),
            False,
        ),
        (label(1, ["backlash"], ALIASED), verdict("at_noise_floor"), False),
        (
            label(1, ["backlash", "sensor_delay"], PAIR),
            verdict("named", "sensor_delay", "backlash"),
            True,
        ),
        (label(1, ["backlash", "sensor_delay"], PAIR), verdict("named", "backlash"), False),
        (label(1), verdict("at_noise_floor"), True),
        (label(1), verdict("none_of_these", "backlash"), True),
        (label(1), verdict("aliased", "backlash"), False),
        (label(1, family=OUTSIDE), verdict("not_diagnosable"), True),
        (label(1, family=OUTSIDE), verdict("named_with_remainder", "backlash"), False),
        (label(1), Verdict({"verdict": ERROR, "reason": "ValueError: no"}, 1.0), False),
    ],
)
def test_an_answer_is_judged_by_its_family(truth, answer, is_right):
    assert judge(truth, answer).is_right is is_right


def test_one_name_does_not_meet_both_effects_of_a_pair():
    truth = label(1, ["backlash", "maxwell_branch"], PAIR)
    both = ("backlash", "maxwell_branch")
    assert not judge(truth, verdict("aliased", "backlash", aliases=[both])).is_right
    assert judge(truth, verdict("aliased", *both, aliases=[both])).is_right


def test_wilson_interval_has_textbook_values():
    # Newcombe 1998, Statistics in Medicine 17, 857-872, table I: 81 of 263, 15 of 148, 0 of 20, 1
    # of 29.
    for hits, cases, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        np.testing.assert_allclose(
            wilson(hits, cases), (low, high), atol=5e-5
        )  # four digits are printed
    assert wilson(0, 0) == (0.0, 1.0)


def scored(pairs):
    labels = {case_label.case: case_label for case_label, _ in pairs}
    return score(judged_cases(labels, {case_label.case: answer for case_label, answer in pairs}))


def table():
    """Twenty clear cases, two of them wrong.

    Four below 5 floors; 20 of nothing, one named; 20 outside, four named.
    """
    clear = [(label(k, ["backlash"]), verdict("named", "backlash")) for k in range(1, 19)]
    clear += [
        (label(k, ["backlash"]), verdict("named", "cubic_damping", rho=0.9)) for k in (19, 20)
    ]
    small = [(label(k, ["backlash"], ratio=1.5), verdict("at_noise_floor")) for k in range(21, 24)]
    small += [
        (
            label(24, ["backlash"], ratio=1.5),
            verdict("named", "backlash", interval=(0.2, 0.3), value=3.0),
        )
    ]
    empty = [(label(k), verdict("at_noise_floor")) for k in range(25, 44)] + [
        (label(44), verdict("named", "backlash"))
    ]
    outside = [(label(k, family=OUTSIDE), verdict("none_of_these")) for k in range(45, 61)]
    outside += [
        (label(k, family=OUTSIDE), verdict("named", "backlash", seconds=130.0))
        for k in range(61, 65)
    ]
    return clear + small + empty + outside


def test_figures_of_a_table_made_by_hand():
    figures = {figure.name: figure for figure in scored(table()).figures}
    expected = {
        "class right, gap >= 5 floors": (18 / 20, 20, True),
        'false naming, "nothing"': (1 / 20, 20, True),
        'false naming, "outside"': (4 / 20, 20, False),
        "rho inside its 95 % interval": (18 / 19, 19, None),  # too few to judge
        "parameters inside their 95 % interval": (18 / 19, 19, None),
        "median |rho claimed - rho true|": (0.02, 19, None),
        "largest cell right, gap >= 5 floors": (1.0, 20, None),
        "class right, gap 1 to 2 floors": (1 / 4, 4, None),
        "class right, gap 10 to 20 floors": (18 / 20, 20, None),
        "seconds a case, median": (3.0, 64, None),
        "seconds a case, longest": (130.0, 64, False),
    }
    for name, (value, cases, met) in expected.items():
        assert figures[name].value == pytest.approx(value, rel=1e-9), name
        assert (figures[name].cases, figures[name].met) == (cases, met), name
    assert not scored(table()).met


def test_confusion_and_wrong_cases_of_a_table_made_by_hand():
    result = scored(table())
    rows = {row.name: (row.cases, row.right, dict(row.answers)) for row in result.confusion}
    assert rows == {
        "backlash": (20, 18, {"backlash": 18, "cubic_damping": 2}),
        NOTHING: (20, 19, {"no effect": 19, "backlash": 1}),
        OUTSIDE: (20, 16, {"no effect": 16, "backlash": 4}),
    }
    assert len(result.wrong) == 2 + 1 + 4
    page = score_page(
        BlindCheck(result, None, "ab"),
        command="carrierflex blind-check",
        date="2026-01-01",
        software="x 1",
    )
    assert "| mounting | backlash | 20 | 18 | 70 to 97 % | backlash: 18, cubic_damping: 2 |" in page
    assert '| mounting | false naming, "outside" | <= 15 % | 20.0 % | 8 to 42 % | 20 | no |' in page


def test_few_cases_judge_nothing():
    assert scored([(label(1, ["backlash"]), verdict("none_of_these"))]).met


def test_shuffled_labels_destroy_the_score():
    names = (
        "backlash",
        "maxwell_branch",
        "sensor_delay",
        "quadratic_stiffness",
        "coulomb_friction",
    )
    pairs = [(label(k, [names[k % 5]]), verdict("named", names[k % 5])) for k in range(60)]
    right = scored(pairs).figures[0].value
    order = np.random.default_rng(1).permutation(60)
    mixed = [
        (replace(pairs[k][0], case=case_label.case), answer)
        for k, (case_label, answer) in zip(order, pairs, strict=True)
    ]
    assert right == 1.0
    # One in five by chance; 60 draws scatter by 0.05.
    assert scored(mixed).figures[0].value == pytest.approx(0.2, abs=0.16)


def test_a_case_without_verdict_is_refused():
    with pytest.raises(ValueError, match=r"other cases \(mounting-0001\)"):
        judged_cases({"mounting-0001": label(1)}, {})
