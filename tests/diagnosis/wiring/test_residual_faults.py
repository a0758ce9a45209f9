"""What stands out only beside the prediction is told; what an effect of the machine does is not."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.baseline_check import _residual_findings
from carrierflex.diagnosis.wiring.refits import PredictedRecord
from tests.diagnosis.element.element_campaigns import force_campaign, no_law

NOISE = 2e-6


@pytest.fixture(scope="module")
def campaign():
    return force_campaign(no_law)


def checks_with_findings(campaign, change):
    """Checks that find something in records whose prediction misses ``change(time, signal)``."""
    rng = np.random.default_rng(5)
    records = []
    for run in campaign.runs:
        signal = run.signals["q"]
        measured = signal + change(run.time, signal) + NOISE * rng.standard_normal(signal.size)
        records.append(PredictedRecord(run.name, run.time, measured[:, None], signal[:, None]))
    return [finding.check for finding in _residual_findings(records, campaign, NOISE**2)]


def test_noise_alone_says_nothing(campaign):
    assert checks_with_findings(campaign, lambda time, signal: 0.0 * time) == []


@pytest.mark.parametrize("floors", [2.0, 10.0])
def test_a_tone_as_large_in_every_run_is_told(campaign, floors):
    def hum(time, signal):
        return floors * NOISE * np.sin(2.0 * np.pi * 7.37 * time)

    assert checks_with_findings(campaign, hum) == ["tone"]


def test_a_line_that_grows_with_the_motion_is_the_machine(campaign):
    def overtone(time, signal):
        return 0.2 * np.std(signal) * np.sin(2.0 * np.pi * 7.37 * time)

    assert checks_with_findings(campaign, overtone) == []


def test_a_line_at_the_drives_frequency_is_the_machine(campaign):
    """Dry friction answers a drive of one frequency as large at every amplitude."""
    one_line = replace(
        campaign,
        runs=tuple(
            replace(run, inputs={"force": np.std(run.inputs["force"]) * np.sin(46.3 * run.time)})
            for run in campaign.runs
        ),
    )

    def friction(time, signal):
        return 10.0 * NOISE * np.sin(3.0 * 46.3 * time)

    assert checks_with_findings(campaign, friction) == ["tone"]
    assert checks_with_findings(one_line, friction) == []


def test_few_samples_that_make_the_gap_are_told(campaign):
    def dropouts(time, signal):
        change = np.zeros_like(signal)
        change[[700, 1400]] = 50.0 * NOISE
        return change

    assert checks_with_findings(campaign, dropouts) == ["outliers"]


def test_a_gap_of_many_samples_is_none_of_them(campaign):
    """Dry friction: a jump at every turn of the motion, which lasts."""
    assert (
        checks_with_findings(
            campaign, lambda time, signal: 20.0 * NOISE * np.sign(np.gradient(signal))
        )
        == []
    )


def test_the_worst_sample_is_where_it_is_said_to_be(campaign):
    records = []
    for number, run in enumerate(campaign.runs):
        measured = run.signals["q"].copy()
        measured[900] += 1e-3 * (number == 1)
        noise = NOISE * np.random.default_rng(number).standard_normal(measured.size)
        predicted = run.signals["q"] + noise
        records.append(PredictedRecord(run.name, run.time, measured[:, None], predicted[:, None]))
    (finding,) = _residual_findings(records, replace(campaign), NOISE**2)
    assert finding.check == "outliers"
    assert campaign.runs[1].name in finding.text
    assert "900" in finding.line or "902" in finding.line
