"""Classes of an element under forces of one frequency at several levels."""

from functools import cache

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS, NOTHING
from carrierflex.diagnosis.element.problem import element_problem
from tests.diagnosis.element.element_campaigns import PERIOD, STEP, force_campaign

#: 7.8 Hz, below the resonance at 10 Hz.
LINE = 20
LEVELS = (1.0, 2.0, 4.0, 8.0)
NOISE = 5e-6


def dry(q, v):
    return 0.4 * np.tanh(v / 1e-3)


def hard(q, v):
    return 1e10 * q**3


def nothing(q, v):
    return 0.0 * v


def both(q, v):
    return dry(q, v) + hard(q, v)


@cache
def answered(law):
    """Problem of a law under one line and its classes."""
    campaign = force_campaign(law, amplitudes=LEVELS, lines=(LINE,), noise=NOISE, seed=3)
    problem = element_problem(campaign)
    return problem, problem.class_answer()


@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "state", "classes"),
    [
        (dry, NAMED_CLASS, ["dissipation"]),
        (hard, NAMED_CLASS, ["restoring_force"]),
        (nothing, NOTHING, []),
    ],
)
def test_a_line_that_changes_with_the_level_shows_the_class(law, state, classes):
    # A force of the deflection changes the stiffness with the level, one of the speed the damping.
    problem, answer = answered(law)
    assert answer.state == state
    assert [entry.id for entry in answer.classes] == classes
    # Noise leaves no harmonic of the lowest level, and its line is compared all the same.
    lowest = problem.class_table.records[0]
    line_hz = LINE / (PERIOD * STEP)
    assert 1.2 * line_hz < lowest.band_hz < 2.0 * line_hz


@pytest.mark.long
def test_two_causes_under_one_line_ask_for_more_frequencies():
    _, result = answered(both)
    assert result.state == NO_CLASS
    assert result.share > 0.95
    assert result.experiment.startswith("drive at many frequencies")
    assert result.best == ("restoring_force",)
    # One cause is named, and nothing has to be recorded anew for it.
    _, alone = answered(hard)
    assert alone.experiment == ""
