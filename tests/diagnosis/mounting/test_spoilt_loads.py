"""A torque whose readings have noise, or whose gain drifts, beside radial loads read rightly."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, mounting_campaign


def with_torque(change, values=None):
    """Campaign whose torque is changed."""
    made = mounting_campaign(values, conditions=CONDITIONS[:3], seconds=60.0)
    runs = tuple(
        replace(run, inputs={**run.inputs, "torque": change(run.inputs["torque"], run.time)})
        for run in made.runs
    )
    return replace(made, runs=runs)


def findings(change, values=None):
    """Findings about a campaign whose torque is changed, by id: input and text."""
    warnings = examined(with_torque(change, values)).baseline().warnings
    return {one.id: (one.about, one.text) for one in warnings if one.id}


def drifting(torque, time):
    """Right where the run begins, a tenth too large where it ends."""
    return torque * (1.0 + 0.1 * (time - time[0]) / np.ptp(time))


def noisy(torque, time):
    rng = np.random.default_rng(int(abs(torque).sum()))
    return torque + 1e4 * rng.standard_normal(torque.size)


def late(torque, time):
    """Behind a low-pass of 0.3 s, and 0.2 s late."""
    step = time[1] - time[0]
    share = step / (0.3 + step)
    slow = lfilter([share], [1.0, share - 1.0], torque)
    return np.interp(time - 0.2, time, slow)


def as_read(torque, time):
    return torque


def test_a_gain_of_the_torque_that_drifts_is_told_with_its_size():
    about, text = findings(drifting)["wiring/input_gain"]
    assert about == "torque"
    assert "explains 100%" in text or "explains 99%" in text
    assert float(text.split(" by ")[1].split("%")[0]) == pytest.approx(9.5, abs=0.5)


def test_noise_of_the_torque_that_the_machine_does_not_feel_is_told():
    about, text = findings(noisy)["wiring/load_noise"]
    assert about == "torque"
    assert "in the readings of torque" in text


def test_a_torque_behind_the_radial_loads_is_told_with_its_delay_and_its_filter():
    about, text = findings(late)["wiring/filtered_channel"]
    assert about == "torque"
    delay, filtering = map(
        float, re.search(r"(\S+) s late and filtered with (\S+) s", text).groups()
    )
    assert delay == pytest.approx(0.2, abs=0.05)
    assert filtering == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize("values", [{}, {"starboard_excess": 0.2}])
def test_a_torque_as_it_was_is_not_accused(values):
    faults = {"wiring/load_noise", "wiring/input_gain", "wiring/filtered_channel"}
    assert not faults & set(findings(as_read, values))


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "fault"), [(noisy, "wiring/load_noise"), (drifting, "wiring/input_gain")]
)
def test_a_spoilt_torque_beside_a_law_accuses_no_sensor(change, fault):
    made = with_torque(change, {"starboard_excess": 0.2})
    diagnosis = examined(made).diagnosis()
    assert diagnosis.verdict == "named_with_remainder"
    assert diagnosis.attribution.effects == ("unequal_bushings",)
    assert [one.id for one in diagnosis.warnings if one.id] == [fault]
    # What the fault takes of the remainder is told with the law.
    assert "of torque" in diagnosis.reason
