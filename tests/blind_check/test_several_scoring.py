"""The score of several causes at once against answers made by hand."""

import pytest

from carrierflex.blind_check.labels import SEVERAL, Label
from carrierflex.blind_check.scoring.class_judging import cases_judged_by_class, judge_by_class
from carrierflex.blind_check.scoring.class_score import class_score
from carrierflex.blind_check.scoring.result import BlindCheck
from carrierflex.blind_check.sealing.verdicts import ERROR, Verdict
from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS
from carrierflex.blind_check.truth.mounting.other_forms import MOUNTING_FORMS, form_aliases
from carrierflex.workflows.diagnosis.score_page import score_page
from carrierflex.workflows.diagnosis.scored_check import scored

TILT, SADDLE, DRIFT = "housing/tilt/radial_load", "housing/saddle/torque", "housing/offset/time"
WAVES = "carrier/waves/none"
OF_CARRIER = ("bent_drift", "late_tilt", "torque_saddle")
F, G = "bushings/restoring_force", "bushings/dissipation"


def carrier(*gaps, number=1):
    """Drift, tilt and saddle that leave these gaps alone."""
    classes = [f"{OTHER_FORMS[name].shape}/{OTHER_FORMS[name].follows}" for name in OF_CARRIER]
    return label("carrier", OF_CARRIER, tuple(sorted(classes)), gaps, number)


def mounting(*gaps, present=("sensor_gain",)):
    """A stop, a damping and a lever of the load."""
    causes = ("two_stops", "power_damping", "load_lever")
    classes = tuple(sorted(MOUNTING_FORMS[name].class_id for name in causes))
    plain = label("mounting", causes, classes, gaps, 1)
    return Label(**{**vars(plain), "class_aliases": form_aliases(classes), "present": present})


def label(kind, causes, classes, gaps, number):
    return Label(
        case=f"{kind}-{number:04d}",
        kind=kind,
        family=SEVERAL,
        effects=causes,
        acceptable=tuple((name,) for name in causes),
        present=("sensor_gain", "sensor_angle"),
        gap_over_floor=6.0,
        floor=1e-6,
        rho=0.2,
        parameters={},
        where={},
        classes=classes,
        drive="six_loads",
        own_gaps=gaps,
    )


def answer(*classes, ties=(), word="class_named"):
    entries = [{"id": name, "share": 0.3, "law_share": None} for name in classes]
    ids = [list(tie) for tie in ties]
    return Verdict({"verdict": word, "classes": entries, "class_ties": ids, "effects": []}, 2.0)


def outcome(truth, verdict):
    judged = judge_by_class(truth, verdict)
    missed = [cause.class_id for cause in judged.causes.of_gap(2.0) if not cause.is_found]
    return judged.outcome, missed, list(judged.causes.false)


@pytest.mark.parametrize(
    ("gaps", "verdict", "expected"),
    [
        ((3.0, 3.0, 3.0), answer(DRIFT, TILT, SADDLE), ("right", [], [])),
        # What it follows is judged apart, and errors that the sensors have may stand beside.
        (
            (3.0, 3.0, 3.0),
            answer(DRIFT, "housing/tilt/torque", SADDLE, "channel/gain"),
            ("right", [], []),
        ),
        ((3.0, 3.0, 2.0), answer(DRIFT, TILT), ("wrong", ["housing/saddle"], [])),
        # A cause below two floors may be missing, and may be named.
        ((3.0, 3.0, 1.9), answer(DRIFT, TILT), ("right", [], [])),
        ((3.0, 3.0, 1.9), answer(DRIFT, TILT, SADDLE), ("right", [], [])),
        ((3.0, 1.0, 1.0), answer(DRIFT, WAVES), ("wrong", [], ["carrier/waves"])),
        # A tie leaves open which cause it is: it holds none surely, and one that is false.
        (
            (3.0, 3.0, 1.0),
            answer(DRIFT, TILT, ties=[(DRIFT, WAVES)]),
            ("tie", ["housing/tilt"], ["carrier/waves"]),
        ),
        (
            (3.0, 3.0, 1.0),
            answer(DRIFT, TILT, ties=[(TILT, "nonsynchronous/line/none")]),
            ("tie", ["housing/offset"], ["nonsynchronous/line"]),
        ),
        # None of the sets holds all, or each holds a false one.
        (
            (3.0, 3.0, 3.0),
            answer(DRIFT, TILT, ties=[(DRIFT, SADDLE)]),
            ("wrong", ["housing/tilt", "housing/saddle"], []),
        ),
        (
            (3.0, 1.0, 1.0),
            answer(DRIFT, WAVES, ties=[(DRIFT, "carrier/tilt/torque")]),
            ("wrong", [], ["carrier/tilt", "carrier/waves"]),
        ),
        (
            (3.0, 3.0, 3.0),
            answer(word="none_of_these"),
            ("abstained", ["housing/offset", "housing/tilt", "housing/saddle"], []),
        ),
        ((1.0, 1.0, 1.0), answer(word="at_noise_floor"), ("silent", [], [])),
    ],
)
def test_causes_of_a_carrier_are_judged_one_by_one(gaps, verdict, expected):
    assert outcome(carrier(*gaps), verdict) == expected


@pytest.mark.parametrize(
    ("verdict", "expected"),
    [
        # The table holds waves for the tilt: in a tie with it they are not false, alone it is
        # missed; for the saddle it holds none.
        (answer(DRIFT, TILT, SADDLE, ties=[(DRIFT, WAVES, SADDLE)]), ("right", [], [])),
        (answer(DRIFT, WAVES, SADDLE), ("wrong", ["housing/tilt"], [])),
        (
            answer(DRIFT, TILT, SADDLE, ties=[(DRIFT, TILT, WAVES)]),
            ("tie", ["housing/saddle"], []),
        ),
        (
            answer(DRIFT, TILT, SADDLE, ties=[(DRIFT, "carrier/tilt/torque", SADDLE)]),
            ("tie", ["housing/tilt"], ["carrier/tilt"]),
        ),
    ],
)
def test_frames_and_patterns_of_the_alias_table_stand_in_for_a_carriers_cause(verdict, expected):
    aliases = (("carrier/waves", "housing/offset", "housing/saddle"),)
    truth = Label(**{**vars(carrier(3.0, 3.0, 3.0)), "class_aliases": aliases})
    assert outcome(truth, verdict) == expected


@pytest.mark.parametrize(
    ("verdict", "expected"),
    [
        (answer(F, G, "input_map"), ("right", [], [])),
        # Slow loads do not tell the maps apart: a tie of them is right, another one alone is not.
        (answer(F, G, "input_map", ties=[(F, G, "stiffness_map")]), ("right", [], [])),
        (answer(F, G, "stiffness_map", ties=[(F, G, "input_map")]), ("right", [], [])),
        (answer(F, G, "stiffness_map"), ("wrong", ["input_map"], [])),
        (
            answer(F, "input_map", "bushings/memory"),
            ("wrong", [G], ["bushings/memory"]),
        ),
    ],
)
def test_maps_of_a_mounting_are_aliases_of_one_another(verdict, expected):
    assert outcome(mounting(3.0, 3.0, 3.0), verdict) == expected


def test_an_error_finds_nothing():
    judged = judge_by_class(carrier(3.0, 3.0, 3.0), Verdict({"verdict": ERROR, "reason": "x"}, 1.0))
    assert judged.outcome == "error"
    assert not any(cause.is_found for cause in judged.causes.causes)


@pytest.mark.parametrize(
    ("verdict", "in_every_set"),
    [
        (answer(DRIFT, TILT), False),
        (answer(DRIFT, TILT, WAVES), True),
        (answer(DRIFT, TILT, ties=[(DRIFT, WAVES)]), False),
        (answer(DRIFT, WAVES, ties=[(DRIFT, TILT)]), False),
        (answer(DRIFT, WAVES, ties=[(WAVES, TILT)]), True),
        (answer(word="at_noise_floor"), False),
    ],
)
def test_a_tie_of_what_is_there_with_what_is_not_is_told_apart(verdict, in_every_set):
    judged = judge_by_class(carrier(3.0, 5.0, 1.5), verdict)
    assert judged.causes.in_every_set is in_every_set


def cases():
    """Twenty: 17 right, one misses a tilt, one names waves, one has causes below two floors."""
    pairs = [(carrier(3.0, 5.0, 1.5, number=k), answer(DRIFT, TILT)) for k in range(16)]
    pairs += [(carrier(3.0, 5.0, 1.5, number=k), answer(DRIFT, TILT, SADDLE)) for k in (16,)]
    pairs += [(carrier(3.0, 5.0, 0.8, number=17), answer(DRIFT))]
    pairs += [(carrier(3.0, 5.0, 1.5, number=18), answer(DRIFT, "housing/tilt/torque", WAVES))]
    pairs += [(carrier(1.0, 1.5, 1.5, number=19), answer(word="at_noise_floor"))]
    return pairs


def test_figures_of_a_table_made_by_hand():
    labels = {truth.case: truth for truth, _ in cases()}
    verdicts = {truth.case: verdict for truth, verdict in cases()}
    result = class_score(cases_judged_by_class(labels, verdicts))
    figures = {figure.name: figure for figure in result.figures}
    expected = {
        "several causes: every one of 2 floors found": (18 / 19, 19, None),
        "several causes: none false": (19 / 20, 20, True),
        "several causes: none false in one at least of the sets that are not told apart": (
            19 / 20,
            20,
            None,
        ),
        "several causes: every one of 2 floors found and none false": (17 / 19, 19, None),
        "several causes: right": (17 / 20, 20, None),
        "several causes: tie": (0.0, 20, None),
        "several causes: wrong": (2 / 20, 20, None),
        "several causes: silent": (1 / 20, 20, None),
        "several causes, 3: every one of 2 floors found": (18 / 19, 19, None),
        "several causes: single ones of less than 1 floors found": (0.0, 1, None),
        "several causes: single ones of 1 to 2 floors found": (1 / 21, 21, None),
        "several causes: single ones of 2 to 4 floors found": (1.0, 19, None),
        "several causes: single ones of 4 and more floors found": (18 / 19, 19, None),
        "several causes: what a found one follows is right": (37 / 38, 38, None),
    }
    for name, (value, count, met) in expected.items():
        assert figures[name].value == pytest.approx(value), name
        assert (figures[name].cases, figures[name].met) == (count, met), name
    # No other figure of classes counts these cases.
    others = [name for name in figures if not name.startswith(("several", "seconds"))]
    assert not others
    rows = {row.name: row for row in result.confusion}
    tilt = rows["several causes: housing/tilt"]
    assert (tilt.cases, tilt.right, tilt.answers) == (19, 18, (("missed alone", 1),))
    waves = rows["several causes: no carrier/waves"]
    assert (waves.cases, waves.right, waves.answers) == (20, 19, (("none missed", 1),))


def test_a_case_in_the_score_tells_each_cause_and_what_is_false():
    labels = {truth.case: truth for truth, _ in cases()}
    verdicts = {truth.case: verdict for truth, verdict in cases()}
    result, rows = scored(labels, verdicts, "ab")
    row = next(row for row in rows if row["case"] == "carrier-0018")
    assert row["causes"][1] == {"class_id": "housing/tilt", "gap": 5.0, "is_found": True}
    assert row["false_classes"] == ("carrier/waves",)
    page = score_page(
        BlindCheck(None, result.class_score, "ab"), command="x", date="2026-01-01", software="x 1"
    )
    assert "| carrier | several causes: none false | >= 95 % | 95.0 % |" in page
