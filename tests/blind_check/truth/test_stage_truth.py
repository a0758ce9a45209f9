"""Truth from the whole stage: the shipped table is the stage's, and cases are as planned."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import STAGE, CasePlan
from carrierflex.blind_check.truth.alias_table import STAGE_EFFECTS
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.blind_check.truth.carrier import stage
from carrierflex.reduction.pin_joints import PAPER_STIFFNESS, carrier_with_pins
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft, joined_to_shaft
from studies.tabulate_stage_readings import (
    LOADS,
    readings,
    stage_truths,
)


@pytest.fixture(scope="module")
def coarse_body(flexible_reduction, pin_reduction):
    carrier = carrier_with_pins(flexible_reduction.model, pin_reduction.model, PAPER_STIFFNESS)
    return joined_to_shaft(carrier, beam_shaft(ShaftData(), carrier.pilots["shaft_face"]))


@pytest.mark.parametrize("name", ["bearing_clearance 2", "carrier_tilt 2"])
def test_the_shipped_table_is_what_the_stage_reads(coarse_body, name):
    assert LOADS == stage.LOADS
    orders = readings(coarse_body, stage_truths()[name])
    shipped, _ = stage.stage_readings(name)
    assert_allclose(shipped[:, :, 0], orders[:, :, 0].real, atol=2e-6)
    # Order 1 comes from a kink alone; the test's carrier is coarser than the table's.
    first = np.hypot(shipped[:, :, 1], shipped[:, :, 2])
    assert_allclose(first, np.abs(orders[:, :, 1]), atol=2e-6)
    assert (first.max() > 5e-5) == (name == "carrier_tilt 2")


def test_zeroed_readings_of_a_clearance_rise_alike_under_both_signs_of_the_load():
    # Rest counts as zero and torque alone moves nothing: the law that the diagnosis has to know.
    shipped, nominal = stage.stage_readings("bearing_clearance 2")
    static = (shipped - nominal)[:, :, 0]
    assert np.abs(static[:2]).max() < 0.03 * np.abs(static[2]).max()


@pytest.mark.parametrize("effects", STAGE_EFFECTS)
def test_a_case_has_the_gap_that_was_planned_or_tells_what_it_has(effects):
    plan = CasePlan("carrier", 3, 7, STAGE, effects, 8.0)
    campaign, label = case_campaign(plan)
    assert label.effects == effects
    assert [members[0] for members in label.acceptable] == list(effects)
    gaps, noises = [], []
    for run in campaign.runs:
        for channel, signal in run.signals.items():
            gaps.append(signal - run.predictions[channel])
            noises.append(label.floor)
    rms = np.sqrt(np.mean(np.concatenate(gaps) ** 2))
    # Gains of 0.3 % of the whole signal beside noise and gap.
    expected = label.floor * np.hypot(label.gap_over_floor, 1.0)
    assert rms == pytest.approx(expected, rel=0.05)
    assert 0.0 < label.rho < 0.3
    again, _ = case_campaign(plan)
    assert_allclose(again.runs[0].signals["s047"], campaign.runs[0].signals["s047"], rtol=0)


def test_every_effect_of_the_stage_is_drawn_in_a_full_check():
    plans = [plan for plan in case_plans("carrier", 300, 2) if plan.family == STAGE]
    assert {plan.effects for plan in plans} == set(STAGE_EFFECTS)


def test_a_check_of_one_family_holds_no_other():
    plans = case_plans("carrier", 26, 4, (STAGE,))
    assert {plan.family for plan in plans} == {STAGE}
    assert {plan.effects for plan in plans} == set(STAGE_EFFECTS)
    with pytest.raises(ValueError, match="kind mounting has no family stage; it has single, pair"):
        case_plans("mounting", 5, 4, (STAGE,))
