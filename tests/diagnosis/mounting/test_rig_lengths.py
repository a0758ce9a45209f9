"""A length of the rig that is not as stated in campaign.toml."""

from dataclasses import replace

import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.mounting.mounting_campaigns import RIG, mounting_campaign

LENGTH = "wiring/rig_length"


def findings(values, factor):
    """Findings where the main bearing is said to be so many times as far, by id: their texts."""
    made = mounting_campaign(values, seconds=60.0)
    rig = {**made.rig, "main_bearing_x": factor * RIG.main_bearing_x}
    warnings = examined(replace(made, rig=rig)).baseline().warnings
    return {one.id: one.text for one in warnings if one.id}


def test_a_main_bearing_that_is_elsewhere_is_told_with_its_place():
    text = findings({}, 1.2)[LENGTH]
    x = float(text.split("main bearing ")[1].split(" m ")[0])
    assert x == pytest.approx(RIG.main_bearing_x, rel=0.01)
    assert "explains 100%" in text


@pytest.mark.parametrize("values", [{}, {"main_bearing_compliance": 2e-9}])
def test_a_main_bearing_where_it_is_said_to_be_is_not_accused(values):
    assert LENGTH not in findings(values, 1.0)


@pytest.mark.long
def test_a_main_bearing_that_is_elsewhere_is_told_beside_a_cause():
    """A length beside a branch looks like a branch and two matrices, which explain all."""
    plans = case_plans("mounting", 60, 601)
    made, _ = case_campaign(next(one for one in plans if one.effects == ("fluid_branch",)))
    rig = {**made.rig, "main_bearing_x": 1.2 * RIG.main_bearing_x}
    diagnosis = examined(replace(made, rig=rig)).diagnosis()
    assert diagnosis.reason_id == LENGTH
    (text,) = [one.text for one in diagnosis.warnings if one.id == LENGTH]
    x = float(text.split("main bearing ")[1].split(" m ")[0])
    assert x == pytest.approx(RIG.main_bearing_x, rel=0.03)
    assert "measured memory of the bushings explains 100%" in text
