from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.gap.in_time import block_rms, significant_drifts, sliding_rms, trend
from carrierflex.diagnosis.report.gap_words import scatter_words
from tests.diagnosis.carrier.carrier_twin import twin_problem
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign, no_law

QUIET = ((1.0, 0, 0), (0.5, 0, 0))


def findings_of(problem):
    return problem.gap((), problem.starts((), {})[-1]).findings()


def test_windows_hold_at_most_twenty_repetitions_and_follow_the_gap():
    time = 2.0 * np.arange(50.0)
    moments = sliding_rms("R", time, np.linspace(1.0, 4.0, 50) ** 2)
    assert len(moments) == 31
    assert_allclose(moments[0].time, time[:20].mean())
    assert_allclose(moments[0].rms, np.sqrt(np.mean(np.linspace(1.0, 4.0, 50)[:20] ** 2)))
    assert moments[-1].rms > 2.0 * moments[0].rms


def test_rms_by_block_counts_measured_samples_only():
    block = np.repeat([0, 1, -1], 4)
    is_measured = np.ones((12, 2), dtype=bool)
    is_measured[4:6] = False
    residual = np.where(is_measured, np.where(block == 1, 3.0, 2.0)[:, None], 0.0)
    record = SimpleNamespace(
        name="R", time=np.arange(12.0), block=block, n_blocks=2, is_measured=is_measured
    )
    moments = block_rms([record], [residual])
    assert [(moment.time, moment.rms) for moment in moments] == [(1.5, 2.0), (5.5, 3.0)]


def test_a_trend_has_its_change_and_noise_has_none():
    rng = np.random.default_rng(1)
    time = np.arange(24.0)
    noise = 0.1 * (rng.standard_normal((24, 400)) + 1j * rng.standard_normal((24, 400)))
    # Uniform without a trend: 5 % below 0.05, standard error 1.1 %.
    assert 0.015 < np.mean(trend(time, noise).p_value < 0.05) < 0.085
    rising = trend(time, noise + (1.0 + 2.0j) * time[:, None] / 23.0)
    assert_allclose(rising.change.mean(), np.sqrt(5.0), rtol=0.02)
    assert rising.p_value.max() < 1e-8


def test_few_repetitions_tell_no_trend():
    assert np.isnan(trend(np.arange(4.0), np.ones((4, 2), dtype=complex)).p_value).all()
    assert significant_drifts(()) == ()


def test_drift_of_the_offset_is_seen_in_time_and_said():
    findings = findings_of(twin_problem("thermal_drift", loads=QUIET))
    first = findings.drifts[0]
    assert (first.channel_pattern, first.order) == ("m=0", 0.0)
    # The law of the twin drifts by 40 um linearly and 20 um of the next form over a run.
    assert 2e-5 < first.change < 2e-4
    assert first.p_value < 1e-6
    text = scatter_words(findings, "m")
    assert f"the gap drifts in time: in {first.run} order 0, m=0 changes by" in text
    rms = [moment.rms for moment in findings.in_time if moment.run == first.run]
    assert max(rms) > 1.5 * min(rms)


def test_a_steady_gap_does_not_drift():
    findings = findings_of(
        twin_problem(None, loads=QUIET, contained=("axial_offset", "housing_tilt", "flexible_pins"))
    )
    assert "drifts" not in scatter_words(findings, "m")
    rms = [moment.rms for moment in findings.in_time if moment.run == "run1"]
    assert_allclose(rms, np.mean(rms), rtol=0.02)


@pytest.mark.parametrize("by_force", [True, False])
def test_an_element_whose_offset_wanders_drifts(by_force):
    campaign = (
        force_campaign(no_law) if by_force else displacement_campaign(lambda q, v: 0.0 * q, n=2000)
    )
    steady = findings_of(element_problem(campaign))
    assert steady.drifts == ()
    assert len(steady.in_time) >= 3
    name, size = ("q", 5e-5) if by_force else ("F", 1.0)
    for run in campaign.runs:
        run.signals[name] += size * np.linspace(-1.0, 1.0, run.time.size)
    findings = findings_of(element_problem(campaign))
    if by_force:
        # Three periods after settling are too few for a trend.
        assert findings.drifts == ()
    else:
        assert findings.drifts[0].order == 0.0
        assert " line 0, F changes by 1.5" in scatter_words(findings, "N")
