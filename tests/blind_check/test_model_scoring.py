"""Answers to carriers off their drawing, judged against tables made by hand."""

import pytest

from carrierflex.blind_check.labels import MODEL, Label
from carrierflex.blind_check.scoring.judging import judge, judged_cases
from carrierflex.blind_check.scoring.scoring import score
from carrierflex.blind_check.sealing.verdicts import Verdict
from carrierflex.blind_check.truth.carrier.off_drawing import BEYOND, class_of_value

RADIUS, MODULUS, PIN_MODULUS = "geometry/outer_radius", "material/E", "material/pin_E"


def label(*effects, number=1, gap=10.0, beyond=10.0, present=(), alone=()):
    of_model = [name for name in effects if "/" in name]
    return Label(
        f"carrier-{number:04d}",
        "carrier",
        MODEL,
        effects,
        tuple((effect,) for effect in effects),
        tuple(present),
        gap if effects else 0.0,
        1e-6,
        0.1,
        {name: {"change": -0.01} for name in of_model},
        {BEYOND: beyond if effects else 0.1},
        classes=tuple(sorted({class_of_value(name.partition("/")[2]) for name in of_model})),
        own_gaps=alone,
    )


def verdict(word, *effects, classes=None, aliases=(), change=-0.011, std=0.001):
    document = {
        "verdict": word,
        "effects": list(effects),
        "aliases": [list(members) for members in aliases],
        "parameters": {
            effect: {"change": {"value": change, "std": std, "unit": "m"}} for effect in effects
        },
    }
    if classes is not None:
        document["classes"] = [{"id": name, "share": 1.0} for name in classes]
    return Verdict(document, 1.0)


@pytest.mark.parametrize(
    ("truth", "answer", "is_right"),
    [
        (label(RADIUS), verdict("named", RADIUS), True),
        (label(RADIUS), verdict("class_named", classes=["model/carrier"]), True),
        # Another dimension of the same carrier: the class is right, the value is not.
        (label(RADIUS), verdict("named", "geometry/plate_gap"), True),
        (label(RADIUS), verdict("named", PIN_MODULUS), False),
        (label(PIN_MODULUS), verdict("named", PIN_MODULUS, classes=["model/pins"]), True),
        (label(RADIUS), verdict("named", "ring_pass", classes=["housing/waves/torque"]), False),
        (label(RADIUS), verdict("named", RADIUS, "ring_pass"), False),
        # A modulus that cannot be seen need not be named; one that can must be.
        (label(RADIUS, PIN_MODULUS, alone=(10.0, 0.3)), verdict("named", RADIUS), True),
        (label(RADIUS, PIN_MODULUS, alone=(10.0, 3.0)), verdict("named", RADIUS), False),
        (label(MODULUS, "ring_pass", alone=(0.2, 9.0)), verdict("named", "ring_pass"), True),
        (label(MODULUS, "ring_pass", alone=(0.2, 9.0)), verdict("named", PIN_MODULUS), False),
        (label(RADIUS, "ring_pass"), verdict("named", RADIUS, "ring_pass"), True),
        (label(RADIUS), verdict("at_noise_floor", classes=[]), False),
        (label(RADIUS, present=["sensor_gain"]), verdict("named", RADIUS, "sensor_gain"), True),
        (label(), verdict("at_noise_floor", classes=[]), True),
        (label(), verdict("named", RADIUS), False),
        (label("ring_pass"), verdict("named", "ring_pass", classes=["housing/waves/torque"]), True),
        (label("ring_pass"), verdict("named", MODULUS), False),
        (label(), verdict("error"), False),
    ],
)
def test_answers_are_judged_by_the_models_classes(truth, answer, is_right):
    assert judge(truth, answer).is_right is is_right


def figures(*pairs):
    labels = {truth.case: truth for truth, _ in pairs}
    verdicts = {truth.case: answer for truth, answer in pairs}
    result = score(judged_cases(labels, verdicts))
    return {figure.name.removeprefix("model: "): figure for figure in result.figures}


def test_figures_count_what_they_say():
    named = figures(
        (label(RADIUS, number=1), verdict("named", RADIUS)),
        (label(RADIUS, number=2), verdict("named", RADIUS, change=-0.02)),
        (label(RADIUS, number=3), verdict("aliased", RADIUS, aliases=[(RADIUS, MODULUS)])),
        (label(MODULUS, number=4), verdict("aliased", RADIUS, aliases=[(RADIUS, MODULUS)])),
        (label(MODULUS, number=5), verdict("named", "geometry/plate_gap")),
        (label(MODULUS, number=6), verdict("named", "ring_pass")),
        (label(MODULUS, number=7), verdict("at_noise_floor", classes=[])),
        (label(MODULUS, number=8, beyond=1.0), verdict("at_noise_floor", classes=[])),
        (label(number=9), verdict("named", RADIUS)),
        (label(number=10), verdict("at_noise_floor", classes=[])),
        (label("ring_pass", number=11), verdict("named", MODULUS)),
        (label("ring_pass", number=12), verdict("named", "ring_pass")),
    )
    shares = {name: (round(f.value * f.cases), f.cases) for name, f in named.items() if f.interval}
    assert shares == {
        "class right, gap >= 2 floors at the drawn sizes": (5, 8),
        "class right, gap >= 2 floors beyond the drawing": (5, 7),
        "values inside their 95 % interval": (2, 3),
        "a true value named, alone or in a tie, gap >= 2 floors beyond the drawing": (4, 7),
        "the true values named alone, gap >= 2 floors beyond the drawing": (2, 7),
        "a value named that is as drawn": (3, 12),
        "named for another cause": (1, 2),
        "named as drawn, any pin fit": (1, 2),
        "planet pass or another law named for it": (1, 8),
        "within the noise, gap >= 2 floors beyond the drawing": (1, 7),
    }


def test_few_cases_judge_no_figure_and_many_do():
    pairs = [(label(RADIUS, number=k), verdict("at_noise_floor", classes=[])) for k in range(1, 25)]
    silent = "within the noise, gap >= 2 floors beyond the drawing"
    assert figures(*pairs[:19])[silent].met is None
    assert figures(*pairs)[silent].met is False
