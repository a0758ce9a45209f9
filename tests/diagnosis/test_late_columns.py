"""Columns of another simulator that are a step of time off, alone and beside a cause."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.element.element_campaigns import force_campaign, no_law
from tests.diagnosis.element.test_prediction import cubic, with_predictions


def shifted(campaign, steps):
    """Campaign whose columns are some steps late; its periods end where they begin."""
    runs = tuple(
        replace(run, predictions={k: np.roll(v, steps) for k, v in run.predictions.items()})
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


@pytest.mark.parametrize("steps", [1, -1])
@pytest.mark.parametrize(
    "law", [no_law, pytest.param(cubic, marks=pytest.mark.long)], ids=["nothing", "cubic"]
)
def test_columns_that_are_a_step_late_are_a_clock_and_no_damping(law, steps):
    beside = with_predictions(force_campaign(law), force_campaign(no_law, noise=1e-12))
    examination = examined(shifted(beside, steps))
    diagnosis = examination.diagnosis()
    assert diagnosis.reason_id == "wiring/clock"
    assert "wiring/clock" in [finding.id for finding in examination.findings()]
    way = "earlier" if steps > 0 else "later"
    assert f"the columns of the prediction 1 step of time (5 ms) {way}" in diagnosis.reason
    named = "the baseline with measured restoring_force" if law is cubic else "the baseline alone"
    assert named.replace("_", " ") in diagnosis.reason.replace("_", " ")


@pytest.mark.long
def test_columns_that_are_right_are_not_moved_whatever_is_missing():
    beside = with_predictions(force_campaign(cubic), force_campaign(no_law, noise=1e-12))
    examination = examined(beside)
    diagnosis = examination.diagnosis()
    assert examination.findings() == ()
    assert diagnosis.reason_id == ""
    assert diagnosis.attribution.effects == ("cubic_stiffness",)
