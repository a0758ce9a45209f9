"""A clock that runs apart in every run, a channel late or out of its place, a noisier one."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.simulation.sensing import delayed
from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.carrier.carrier_twin import CHANNELS, CURVES, NOISE, twin_campaign

#: Torques over nominal, radial loads [N]; the second run is slower than the others.
LOADS = ((1.0, 0, 0), (0.5, 0, 0), (1.0, 0, -2e5), (0.75, 0, 5e4), (0.25, 0, -1e5))
LATE, MISPLACED = "wiring/late_channel", "wiring/channel"


def campaign(change=lambda run: run, effect=None):
    """Nothing missing at four axial sensors; `change` alters a run."""
    clean = twin_campaign(effect, loads=LOADS, channels=CHANNELS[:4])
    return replace(clean, runs=tuple(map(change, clean.runs)))


def rivals(records):
    """Text of every fault that explains the gap, by id and what it is about."""
    check = examined(records, CURVES).baseline()
    return {(one.id, one.about): one.text for one, share in check.rivals if share > 0.95}


@pytest.mark.long
@pytest.mark.parametrize("rate", [2e-3, -2e-3])
def test_a_clock_that_drifts_in_every_run_is_told_with_its_rate(rate):
    def fast(run):
        angle = run.inputs["carrier_angle"]
        return replace(run, inputs={**run.inputs, "carrier_angle": (1.0 + rate) * angle})

    clocks = {
        about: text for (id_, about), text in rivals(campaign(fast)).items() if "clock" in id_
    }
    ((about, text),) = clocks.items()
    assert sorted(about.split(", ")) == [f"run{k}" for k in range(1, 6)]
    assert float(text.split(" by ")[1].split(" ppm")[0]) == pytest.approx(2000.0, rel=0.05)


def test_a_clock_of_all_columns_moves_nothing():
    slow = campaign(lambda run: replace(run, time=1.002 * run.time))
    diagnosis = examined(slow, CURVES).diagnosis()
    assert (diagnosis.verdict, diagnosis.warnings) == ("at_noise_floor", ())


@pytest.mark.parametrize(("name", "delay"), [("s137", 0.04), ("s227", -0.04)])
def test_one_channel_that_is_late_is_told_with_its_delay(name, delay):
    def late(run):
        moved = delayed(run.time, run.signals[name], delay)
        return replace(run, signals={**run.signals, name: moved})

    text = rivals(campaign(late))[LATE, name]
    assert f"is {abs(delay) * 1e3:.0f} ms {'behind' if delay > 0.0 else 'before'}" in text


def test_a_misplaced_sensor_is_none_that_is_late():
    findings = rivals(campaign(effect="sensor_angle"))
    assert "2.3 degrees from its place" in findings[MISPLACED, "s137"]
    assert (LATE, "s137") not in findings


@pytest.mark.long
def test_white_noise_above_the_declared_is_told_with_the_factor():
    channels = tuple(replace(one, noise_std=0.5 * NOISE) for one in CHANNELS[:4])
    diagnosis = examined(replace(campaign(), channels=channels), CURVES).diagnosis()
    assert diagnosis.verdict == "none_of_these"
    assert diagnosis.reason_id == "wiring/declared_noise"
    factors = diagnosis.reason.split("declared (")[1].split(" times)")[0].split(", ")
    values = [float(one.split()[1]) for one in factors]
    np.testing.assert_allclose(values, 2.0, rtol=0.1)
