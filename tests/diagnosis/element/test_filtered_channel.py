"""A channel behind a filter is neither a sensor that is late nor a relaxing branch."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from carrierflex.workflows.diagnosis.examination import examined

from .element_campaigns import STEP, force_campaign, no_law

NOISE = 2e-6


def low_passed(q, time):
    """First-order low-pass of 10 ms, two steps."""
    share = STEP / (0.01 + STEP)
    return lfilter([share], [1.0, share - 1.0], q, zi=[(1.0 - share) * q[0]])[0]


def mean_of_two(q, time):
    return 0.5 * (q + np.r_[q[0], q[:-1]])


def late(q, time):
    """1.3 steps ago."""
    return CubicSpline(time, q)(np.maximum(time - 1.3 * STEP, 0.0))


def filters_told(change):
    """Text of every filter that explains the gap of a linear element behind a change."""
    clean = force_campaign(no_law, noise=0.0)
    channels = (replace(clean.channels[0], noise_std=NOISE),)
    rng = np.random.default_rng(3)
    runs = tuple(
        replace(
            run,
            signals={
                "q": change(run.signals["q"], run.time) + NOISE * rng.standard_normal(run.time.size)
            },
        )
        for run in clean.runs
    )
    check = examined(replace(clean, channels=channels, runs=runs), None).baseline(None, ())
    return [rival.text for rival, _ in check.rivals if rival.id == "wiring/filtered_channel"]


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "size"),
    [
        pytest.param(low_passed, "q behind a filter of 0.01 s", marks=pytest.mark.long),
        (mean_of_two, "a mean of 2"),
    ],
)
def test_a_filter_is_named_with_its_size(change, size):
    (text,) = filters_told(change)
    assert text.endswith(size)


@pytest.mark.long
def test_a_delay_is_no_filter():
    assert filters_told(late) == []
