"""Records in which the motion is not that of an element under its drive."""

import pytest

from carrierflex.blind_check.case_plans import case_plans, full_size
from carrierflex.blind_check.labels import OUTSIDE, CasePlan
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOT_VISIBLE, NOTHING
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.identification.campaign import signals
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign, no_law


def state(campaign):
    return element_problem(campaign).class_answer().state


@pytest.mark.long
@pytest.mark.parametrize(
    "factor",
    [pytest.param(0.8, marks=pytest.mark.long), 1.0, pytest.param(1.2, marks=pytest.mark.long)],
)
def test_a_mass_that_sticks_shows_no_class_whatever_the_band_of_its_noise(factor, monkeypatch):
    # Friction holds the mass in all four runs: the sensor shows its noise, which is coloured.
    plan = CasePlan("element", 18, 7411, OUTSIDE, ("heated_friction",), 1.109, "sines")
    campaign, _ = case_campaign(plan)
    monkeypatch.setattr(signals, "_ROLL_OFF", factor * signals._ROLL_OFF)
    assert state(campaign) == NOT_VISIBLE


@pytest.mark.long
def test_a_drive_of_which_little_arrives_is_a_drive_side():
    # The baseline leaves 1.01 of the force's square, and beside the drive side next to nothing.
    plan = case_plans("element", full_size("element"), 13025)[107]
    assert (plan.effects, plan.drive) == (("saturation",), "sines")
    result = element_problem(case_campaign(plan)[0]).class_answer()
    assert (result.state, [entry.id for entry in result.classes]) == (NAMED_CLASS, ["drive_side"])


def test_an_element_under_much_noise_is_seen():
    assert state(force_campaign(no_law, noise=2e-4)) == NOTHING


def test_a_law_that_holds_most_of_the_force_is_seen():
    # The cubic spring carries ten times the linear one at the ends of the motion.
    assert state(displacement_campaign(lambda q, v: 4e11 * q**3)) == NAMED_CLASS
