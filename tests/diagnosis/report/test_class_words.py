"""Words of an answer by class."""

import pytest

from carrierflex.diagnosis.element.laws import CLASSES_OF_LAW
from carrierflex.diagnosis.report.verdict_words import _share_words, class_sentence
from tests.diagnosis.class_answers import one_class


def sentence(name, law, **options):
    """Words of one class whose law is named."""
    return class_sentence(one_class(name, law, CLASSES_OF_LAW, **options))


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
    assert _share_words(share) == expected


def test_a_class_that_is_named_is_not_nothing():
    told = sentence("time_variation", "drifting_stiffness", share=0.0)
    assert told.startswith("Time variation (below 0.5 %;")


def test_a_law_of_the_speed_is_a_part_of_a_surface():
    told = sentence("force_surface", "coulomb_friction")
    assert told.endswith("; of it the library has the law Coulomb friction.")


@pytest.mark.parametrize("name", ["dissipation", "hysteresis"])
def test_a_class_of_which_a_law_holds_all_follows_it(name):
    told = sentence(name, "coulomb_friction")
    assert told.endswith("; law: Coulomb friction.")
