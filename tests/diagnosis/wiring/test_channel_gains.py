"""A gain below the gap's limit is measured beside what the baseline gives way, with its error."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.wiring.channel_gains import channel_gains, off_gain
from carrierflex.diagnosis.wiring.linear_records import LinearRecord

STEP = 0.05
NOISE = 0.1
NONE = (0.0, 0.0, 0.0)


def record(seed, *, speed=20.0, gain=0.0, channel=1, n_channels=3, memory=0.0):
    """Waves of three channels, one size of the baseline for all and an offset for each."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(1500)
    phases = 2.0 * np.pi * np.arange(n_channels) / max(n_channels, 2)
    predicted = np.sin(speed * time[:, None] + phases) + 0.3 * np.sin(
        1.5 * speed * time[:, None] - phases
    )
    noise = NOISE * rng.standard_normal(predicted.shape)
    for k in range(1, time.size):
        noise[k] = memory * noise[k - 1] + np.sqrt(1.0 - memory**2) * noise[k]
    gains = np.where(np.arange(n_channels) == channel, gain, 0.0)
    offsets = np.broadcast_to(np.eye(n_channels)[:, None, :], (n_channels, *predicted.shape))
    columns = np.concatenate([predicted[None], offsets])
    return LinearRecord(str(seed), time, gains * predicted + noise, predicted, columns)


@pytest.mark.parametrize("gain", [0.04, -0.03])
def test_the_gain_of_one_channel_is_measured_and_told_of_that_one(gain):
    found = off_gain([record(seed, gain=gain) for seed in range(3)], NONE)
    assert found.channel == 1
    assert found.gain == pytest.approx(gain, abs=4.0 * found.std)
    assert found.std < 0.004


def test_nothing_is_told_of_true_gains_nor_below_what_a_calibration_gives():
    assert off_gain([record(seed) for seed in range(3)], NONE) is None
    assert off_gain([], NONE) is None
    off = [record(seed, gain=0.04) for seed in range(3)]
    assert off_gain(off, (0.0, 0.035, 0.0)) is not None
    assert off_gain(off, (0.0, 0.045, 0.0)) is None
    # The limit of another channel is none of this one's.
    assert off_gain(off, (0.045, 0.0, 0.045)) is not None


def test_parameters_of_one_run_fitted_out_first_give_what_all_together_give():
    runs = [record(seed, gain=0.04) for seed in range(2)]
    own = [replace(run, columns=np.roll(run.columns, -1, axis=0), n_own=3) for run in runs]
    shared = []
    for k, run in enumerate(runs):
        offsets = np.zeros((6, *run.residual.shape))
        offsets[3 * k : 3 * k + 3] = run.columns[1:]
        shared.append(replace(run, columns=np.concatenate([run.columns[:1], offsets])))
    for found, expected in zip(channel_gains(own), channel_gains(shared), strict=True):
        assert found.gain == pytest.approx(expected.gain, rel=1e-9)
        assert found.std == pytest.approx(expected.std, rel=1e-2)


def test_one_channel_alone_has_no_gain_of_its_own():
    """Its gain is the size of all that the baseline predicts."""
    assert off_gain([record(1, gain=0.3, channel=0, n_channels=1)], NONE[:1]) is None


def test_missing_samples_take_no_part():
    whole = record(1, gain=0.1)
    holed = whole.residual.copy()
    holed[::7, 1] = np.nan
    holed[3::11, 0] = np.nan
    found = off_gain([LinearRecord("a", whole.time, holed, whole.predicted, whole.columns)], NONE)
    assert found.gain == pytest.approx(0.1, abs=4.0 * found.std)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_errors_are_as_large_as_they_are_said_to_be(memory):
    """Of 200 runs of true gains, a gain over its deviation scatters by one."""
    ratios = []
    for seed in range(200):
        first, *_ = channel_gains([record(seed, memory=memory, speed=2.0)])
        ratios.append(first.gain / first.std)
    assert np.std(ratios) == pytest.approx(1.0, abs=0.2)
    assert np.mean(ratios) == pytest.approx(0.0, abs=0.3)
