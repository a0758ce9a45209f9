"""Noise of channels that declare none: its size and memory beside motion."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from carrierflex.diagnosis.mounting.records import _difference_noise, _Noise

STD = 3e-6
RATE = 50.0
N_SAMPLES = 6000


def noises(memory, count=6, seed=1):
    """Records of noise of one size with a memory."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal((count, N_SAMPLES + 200))
    return STD * lfilter([np.sqrt(1.0 - memory**2)], [1.0, -memory], white)[:, 200:]


def motion(frequency_hz, amplitude):
    return amplitude * np.sin(2.0 * np.pi * frequency_hz * np.arange(N_SAMPLES) / RATE)


@pytest.mark.parametrize("memory", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("amplitude", [0.0, 100.0 * STD])
def test_noise_is_as_large_whatever_its_memory_and_the_motion_beneath_it(memory, amplitude):
    result = _difference_noise(noises(memory) + motion(2.0, amplitude))
    assert_allclose([channel.variance for channel in result], STD**2, rtol=0.25)
    assert result[0].memory == pytest.approx(memory, abs=0.08)


def test_differences_of_neighbours_alone_see_two_fifths_of_noise_that_remembers_half():
    (white,) = _difference_noise(noises(0.5, 1) + motion(4.0, 50.0 * STD))
    # Motion as quick as this hides the memory, and nothing is made up in its place.
    assert white.memory == 0.0
    assert white.variance == pytest.approx(0.365 * STD**2, rel=0.3)


def test_a_quick_record_takes_the_memory_of_the_slow_ones():
    records = noises(0.5)
    records[0] += motion(4.0, 50.0 * STD)
    result = _difference_noise(records)
    assert result[0].memory == pytest.approx(0.5, abs=0.08)
    assert result[0].variance == pytest.approx(STD**2, rel=0.3)


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_the_mean_of_neighbours_varies_as_their_memory_says(memory):
    n = 8
    rows = noises(memory, 40).reshape(-1, n)
    result = _Noise(STD**2, memory).of_mean(n)
    assert result == pytest.approx(rows.mean(axis=1).var(), rel=0.1)


def test_missing_samples_are_passed_over_and_none_in_a_row_is_an_error():
    record = noises(0.3, 1)[0]
    record[::50] = np.nan
    (result,) = _difference_noise([record])
    assert result.variance == pytest.approx(STD**2, rel=0.25)
    record[::5] = np.nan
    with pytest.raises(ValueError, match="noise_std"):
        _difference_noise([record])
