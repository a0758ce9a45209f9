"""A fault of the measurement beside a cause: columns a step late, an angle, a place of the rig."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.report.verdict_words import verdict_heading
from carrierflex.workflows.diagnosis.examination import examined
from carrierflex.workflows.fe.default_curves import default_curves
from tests.diagnosis.element.element_campaigns import force_campaign, no_law
from tests.diagnosis.element.test_prediction import cubic, with_predictions


def shifted(campaign, steps):
    """Campaign whose columns are some steps late; its periods end where they begin."""
    runs = tuple(
        replace(run, predictions={k: np.roll(v, steps) for k, v in run.predictions.items()})
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


@pytest.mark.long
@pytest.mark.parametrize("steps", [1, -1])
@pytest.mark.parametrize("law", [no_law, cubic], ids=["nothing", "cubic"])
def test_columns_that_are_a_step_late_are_a_clock_and_no_damping(law, steps):
    predicted = with_predictions(force_campaign(law), force_campaign(no_law, noise=1e-12))
    examination = examined(shifted(predicted, steps))
    diagnosis = examination.diagnosis()
    assert diagnosis.reason_id == "wiring/clock"
    assert "wiring/clock" in [finding.id for finding in examination.findings()]
    way = "earlier" if steps > 0 else "later"
    assert f"the columns of the prediction 1 step of time (5 ms) {way}" in diagnosis.reason
    named = "the baseline with measured restoring_force" if law is cubic else "the baseline alone"
    assert named.replace("_", " ") in diagnosis.reason.replace("_", " ")


@pytest.mark.long
def test_columns_that_are_right_are_not_moved_whatever_is_missing():
    predicted = with_predictions(force_campaign(cubic), force_campaign(no_law, noise=1e-12))
    examination = examined(predicted)
    diagnosis = examination.diagnosis()
    assert examination.findings() == ()
    assert diagnosis.reason_id == ""
    assert diagnosis.attribution.effects == ("cubic_stiffness",)


def carrier_of(effect):
    """Campaign of six runs at four sensors, with one effect missing of three floors and more."""
    plans = (one for one in case_plans("carrier", 1260, 8) if one.effects == (effect,))
    return case_campaign(next(plan for plan in plans if plan.ratio > 3.0))[0]


def with_zero_of_angle(campaign, degrees):
    """Campaign whose angle is counted from elsewhere."""
    runs = tuple(
        replace(
            run,
            inputs={
                **run.inputs,
                "carrier_angle": run.inputs["carrier_angle"] + np.deg2rad(degrees),
            },
        )
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


@pytest.mark.long
def test_the_zero_of_the_angle_is_told_beside_a_cause_that_it_hides():
    """With the angle 10 degrees off the nearest law is another one, and leaves half of the gap."""
    campaign = with_zero_of_angle(carrier_of("stiff_pins"), 10.0)
    diagnosis = examined(campaign, default_curves()).diagnosis()
    heading = "Check carrier_angle first (angle zero): once it is put right, 100 % of the gap is"
    assert verdict_heading(diagnosis).startswith(heading)
    # A run that is left out takes something of any cause.
    runs = [replace(finding, id="wiring/run") for finding in diagnosis.warnings]
    assert verdict_heading(replace(diagnosis, warnings=tuple(runs))).startswith("The gap is")
    (text,) = [one.text for one in diagnosis.warnings if one.id == "wiring/angle_zero"]
    degrees = float(text.split("moved by ")[1].split(" degrees")[0])
    # Sought without the cause, which hides half a degree of it.
    assert degrees == pytest.approx(-10.0, abs=0.6)
    assert "measured waves fixed to the carrier" in text


@pytest.mark.long
def test_no_zero_of_the_angle_is_told_beside_a_cause_alone():
    findings = examined(carrier_of("stiff_pins"), default_curves()).diagnosis().warnings
    assert [one.id for one in findings if one.id.startswith("wiring/")] == []
