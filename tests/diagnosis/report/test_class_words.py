"""Words of an answer by class in the table of causes."""

from dataclasses import replace

import pytest

from carrierflex.diagnosis.report.cause_rows import _shape_values
from carrierflex.diagnosis.report.verdict_words import _class_words, share_words
from tests.diagnosis.class_answers import one_class


@pytest.mark.parametrize(
    ("share", "expected"),
    [
        (-0.2, "0 %"),
        (0.0, "0 %"),
        (0.0021, "below 0.5 %"),
        (0.0051, "1 %"),
        (0.974, "97 %"),
        (0.9944, "99.4 %"),
        (3.234, "100 %"),
        (float("nan"), "–"),
    ],
)
def test_a_share_is_never_rounded_to_nothing_nor_above_the_whole(share, expected):
    assert share_words(share) == expected


def test_a_class_is_told_with_its_law_or_the_nearest_and_its_share_of_it():
    named = one_class("dissipation", "coulomb_friction", {}).classes[0]
    assert _shape_values(named) == [("", "law: Coulomb friction")]
    near = replace(named, law_named=False, law_share=0.25, share=0.5)
    assert _shape_values(near) == [
        ("", "no law of the library, nearest Coulomb friction: 50 % of it")
    ]
    most = replace(named, law_named=False, law_share=0.48, share=0.5)
    assert _shape_values(most) == [("", "nearest law Coulomb friction: 96 % of it")]
    assert _shape_values(replace(named, law="")) == []
    unknown = replace(near, id="housing/tilt/undetermined", law_share=0.5)
    assert [words for _, words in _shape_values(unknown)] == [
        "nearest law Coulomb friction: 100 % of it",
        "its load dependence cannot be determined from these records",
    ]


def test_a_law_is_no_unknown_one_where_the_loads_do_not_determine_it():
    answer = one_class("dissipation", "coulomb_friction", {})
    assert _class_words(answer, ()).endswith(", nearest law Coulomb friction")
    far = replace(answer, classes=(replace(answer.classes[0], law_share=0.8),))
    assert _class_words(far, ()).endswith("by no law of the library")
    classes = (replace(answer.classes[0], id="housing/tilt/undetermined"),)
    of_one_load = replace(answer, classes=classes)
    assert _class_words(of_one_load, ()).endswith("; the loads of the records determine no law")
