"""A gain below the gap's limit is measured beside what the baseline gives way, with its error."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.wiring.linear_records import LinearRecord, _channel_gains, off_gains

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
    (result,) = off_gains([record(seed, gain=gain) for seed in range(3)], NONE)
    assert result.channel == 1
    assert result.gain == pytest.approx(gain, abs=4.0 * result.std)
    assert result.std < 0.004


def test_nothing_is_told_of_true_gains_nor_below_what_a_calibration_gives():
    assert off_gains([record(seed) for seed in range(3)], NONE) == ()
    assert off_gains([], NONE) == ()
    off = [record(seed, gain=0.04) for seed in range(3)]
    assert [gain.channel for gain in off_gains(off, (0.0, 0.035, 0.0))] == [1]
    assert off_gains(off, (0.0, 0.045, 0.0)) == ()
    # The limit of another channel is none of this one's.
    assert [gain.channel for gain in off_gains(off, (0.045, 0.0, 0.045))] == [1]


def test_of_two_channels_either_may_be_the_one():
    """The baseline fits their common size: one too much is the other too little."""
    too_much = record(3, gain=0.1, n_channels=2)
    first, second = off_gains([too_much], NONE[:2])
    assert {first.channel, second.channel} == {0, 1}
    assert first.gain == pytest.approx(-second.gain, rel=0.1)


def test_a_noisy_channel_takes_no_sureness_from_the_others():
    """Of 60 runs with one channel 20 times as noisy every gain scatters by its own deviation."""
    scatter = []
    for seed in range(60):
        plain = record(seed, speed=2.0, n_channels=4)
        loud = plain.residual * np.array([20.0, 1.0, 1.0, 1.0])
        gains = _channel_gains([replace(plain, residual=loud)])
        scatter.append([gain.gain / gain.std for gain in gains])
    assert np.std(scatter, axis=0) == pytest.approx(np.ones(4), abs=0.35)


def test_parameters_of_one_run_fitted_out_first_give_what_all_together_give():
    runs = [record(seed, gain=0.04) for seed in range(2)]
    of_run = [replace(run, columns=np.roll(run.columns, -1, axis=0), n_of_run=3) for run in runs]
    shared = []
    for k, run in enumerate(runs):
        offsets = np.zeros((6, *run.residual.shape))
        offsets[3 * k : 3 * k + 3] = run.columns[1:]
        shared.append(replace(run, columns=np.concatenate([run.columns[:1], offsets])))
    for result, expected in zip(_channel_gains(of_run), _channel_gains(shared), strict=True):
        assert result.gain == pytest.approx(expected.gain, rel=1e-9)
        assert result.std == pytest.approx(expected.std, rel=1e-2)


def test_one_channel_alone_has_no_gain_of_its_own():
    """Its gain is the size of all that the baseline predicts."""
    assert off_gains([record(1, gain=0.3, channel=0, n_channels=1)], NONE[:1]) == ()


def test_missing_samples_take_no_part():
    full = record(1, gain=0.1)
    holed = full.residual.copy()
    holed[::7, 1] = np.nan
    holed[3::11, 0] = np.nan
    (result,) = off_gains([LinearRecord("a", full.time, holed, full.predicted, full.columns)], NONE)
    assert result.gain == pytest.approx(0.1, abs=4.0 * result.std)


@pytest.mark.long
@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_errors_are_as_large_as_they_are_said_to_be(memory):
    """Of 200 runs of true gains, a gain over its deviation scatters by one."""
    ratios = []
    for seed in range(200):
        first, *_ = _channel_gains([record(seed, memory=memory, speed=2.0)])
        ratios.append(first.gain / first.std)
    assert np.std(ratios) == pytest.approx(1.0, abs=0.2)
    assert np.mean(ratios) == pytest.approx(0.0, abs=0.3)
