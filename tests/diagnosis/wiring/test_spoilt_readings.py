"""Readings off their time or saturating, a load with noise or drifting gain: named, told apart."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.workflows.diagnosis.examination import examined

from ..element.element_campaigns import STEP, force_campaign, no_law

NOISE = 2e-6
#: Above the band of the drive (31 Hz) the sampling leaves two thirds of the lines.
JITTER, LOAD_NOISE, GROWTH = "wiring/jitter", "wiring/load_noise", "wiring/input_gain"
CURVED = "wiring/curved_channel"


def rivals(change, law=no_law):
    """Share of the gap that every fault explains, and its text, by id; `change` alters a run."""
    clean = force_campaign(law, noise=0.0)
    rng = np.random.default_rng(5)

    def changed(run):
        load, q = change(run.inputs["force"], run.signals["q"], run.time, rng)
        q = q + NOISE * rng.standard_normal(q.size)
        return replace(run, inputs={"force": load}, signals={"q": q})

    channels = (replace(clean.channels[0], noise_std=NOISE),)
    campaign = replace(clean, channels=channels, runs=tuple(map(changed, clean.runs)))
    check = examined(campaign, None).baseline()
    return {rival.id: (share, rival.text) for rival, share in check.rivals}


def off_time(load, q, time, rng):
    """Samples up to half a step before or after their time."""
    at = time + STEP * rng.uniform(-0.5, 0.5, time.size)
    return load, CubicSpline(time, q)(np.clip(at, 0.0, time[-1]))


def late(load, q, time, rng):
    """All samples 0.3 steps late: the error follows the slope as well, and is not white."""
    return load, CubicSpline(time, q)(np.maximum(time - 0.3 * STEP, 0.0))


def noisier(load, q, time, rng):
    """Noise of the signal that is three times the declared one and follows no slope."""
    return load, q + 3.0 * NOISE * rng.standard_normal(q.size)


def load_read_with_noise(load, q, time, rng):
    return load + 0.1 * np.abs(load).max() * rng.standard_normal(load.size), q


def load_that_grows(load, q, time, rng):
    """A gain of the load's reading that rises by 8 % over the run."""
    return load * (1.0 + 0.08 * (time / time[-1] - 0.5)), q


def saturating(load, q, time, rng):
    """An amplifier that ends at 1.2 times the largest deflection."""
    end = 1.2 * np.abs(force_campaign(no_law, noise=0.0).runs[-1].signals["q"]).max()
    return load, end * np.tanh(q / end)


def cubic(q, v):
    return 3e8 * q**3


def test_samples_off_their_time_are_told_with_their_size():
    share, text = rivals(off_time)[JITTER]
    assert share > 0.9
    assert float(text.split(" up to ")[1].split(" steps")[0]) == pytest.approx(0.5, abs=0.05)


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "law"), [(late, no_law), (noisier, no_law), (lambda load, q, *_: (load, q), cubic)]
)
def test_a_delay_noise_and_a_law_are_no_jitter(change, law):
    assert JITTER not in rivals(change, law)


def test_noise_of_the_signal_is_told_with_the_factor():
    share, text = rivals(noisier)["wiring/declared_noise"]
    assert share > 0.9
    # Its own and three times as much.
    assert float(text.split("(q ")[1].split()[0]) == pytest.approx(np.sqrt(10.0), rel=0.05)


def test_noise_of_a_load_that_the_machine_does_not_feel_is_told():
    share, text = rivals(load_read_with_noise)[LOAD_NOISE]
    assert share > 0.7
    assert "readings of force" in text


def test_noise_of_a_load_that_leads_the_fit_astray_is_told():
    # About the fit the resonance is too high: it passes on more of the noise than the gap holds.
    def noisy(load, q, time, rng):
        draws = np.random.default_rng([0, int(1e6 * load.std())])
        return load + 0.02 * np.abs(load).max() * draws.standard_normal(load.size), q

    share, text = rivals(noisy)[LOAD_NOISE]
    assert share > 0.6
    assert "readings of force" in text


def test_noise_of_a_drive_that_spoils_the_fit_is_reported_however_small_its_share():
    # A deflection that is read with noise is differentiated twice: the fitted mass is far off.
    clean, label = case_campaign(case_plans("element", 64, 73)[7])
    assert ("displacement" in clean.contract.inputs, label.drive) == (True, "multisine")
    rng = np.random.default_rng(3)

    def noisy(run):
        x = run.inputs["displacement"]
        spoilt = x + 0.15 * x.std() * rng.standard_normal(x.size)
        return replace(run, inputs={"displacement": spoilt})

    def findings(campaign):
        return {one.id: one.text for one in examined(campaign, None).findings()}

    assert LOAD_NOISE not in findings(clean)
    spoilt = findings(replace(clean, runs=tuple(map(noisy, clean.runs))))
    assert "readings of displacement have noise of 15% (RMS)" in spoilt[LOAD_NOISE]


def test_a_gain_of_the_load_that_drifts_is_told_with_its_size():
    share, text = rivals(load_that_grows)[GROWTH]
    assert share > 0.9
    assert float(text.split(" by ")[1].split("%")[0]) == pytest.approx(8.0, abs=0.5)


@pytest.mark.long
def test_a_channel_that_saturates_is_told_with_its_end():
    share, text = rivals(saturating)[CURVED]
    assert share > 0.9
    largest = np.abs(force_campaign(no_law, noise=0.0).runs[-1].signals["q"]).max()
    end, unit = text.split(" at ")[1].rstrip(",").split()
    factor = {"mm": 1e-3, "µm": 1e-6}[unit]
    assert factor * float(end) == pytest.approx(1.2 * largest, rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("law", [no_law, cubic])
def test_a_load_as_it_was_has_neither_noise_nor_a_drifting_gain(law):
    findings = rivals(lambda load, q, *_: (load, q), law)
    assert not {LOAD_NOISE, GROWTH, CURVED} & set(findings)
