"""A delay as a class: exact at its own size, whatever law stands beside it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.classes.results import NAMED_CLASS
from carrierflex.diagnosis.element import answer
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.identification.campaign.signals import change_over
from tests.diagnosis.element.element_campaigns import (
    STEP,
    displacement_campaign,
    force_campaign,
    late,
)


@pytest.mark.parametrize("lag", [0.0, 0.3, -2.5])
def test_the_change_over_a_lag_is_exact_up_to_a_tenth_of_the_sampling_frequency(lag):
    omega = 2.0 * np.pi * 0.1 / STEP
    t = STEP * np.arange(4000)
    result = change_over(np.sin(omega * t) + 7.0 * t, STEP, 0.45 / STEP, lag * STEP)
    exact = omega * np.cos(omega * t)
    if lag:
        exact = (np.sin(omega * t) - np.sin(omega * (t - lag * STEP))) / (lag * STEP)
    inner = slice(300, -300)
    assert_allclose(result[inner], 7.0 + exact[inner], atol=1e-3 * omega)


def cubic_damper(q, v):
    return 2e5 * v**3


def cubic_spring(q, v):
    return 3e9 * q**3


TWINS = {
    "dissipation": (displacement_campaign, cubic_damper),
    "restoring_force": (force_campaign, cubic_spring),
}


def class_answer_of(class_id, steps):
    campaign_of, law = TWINS[class_id]
    return element_problem(late(campaign_of(law), steps * STEP)).class_answer()


@pytest.mark.long
@pytest.mark.parametrize(
    ("class_id", "steps"),
    [
        ("dissipation", 0.5),
        ("dissipation", 2.0),
        pytest.param("restoring_force", 0.5, marks=pytest.mark.long),
        ("restoring_force", 1.0),
    ],
)
def test_a_late_channel_beside_a_law_is_told_from_another_cause(class_id, steps):
    result = class_answer_of(class_id, steps)
    assert (result.state, set(result.ids)) == (NAMED_CLASS, {"delay", class_id})
    assert result.share > 0.998


@pytest.mark.long
def test_its_first_order_leaves_what_looks_like_another_cause(monkeypatch):
    monkeypatch.setattr(answer, "_LAG_PASSES", 0)
    result = class_answer_of("dissipation", 2.0)
    assert set(result.ids) == {"delay", "force_surface"}
