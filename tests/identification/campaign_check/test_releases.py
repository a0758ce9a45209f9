"""Releases of free decays: found to the sample, never in a beat; runs are cut there."""

import numpy as np
import pytest

from carrierflex.identification.campaign.records import Run
from carrierflex.identification.campaign_check.releases import cut_at_releases, releases

TIME = np.arange(0.0, 60.0, 0.01)


def decay(start, size, frequency=2.0, damping=0.25):
    """Free decay that begins at a time with a deflection of its full size."""
    t = TIME - start
    shape = size * np.exp(-damping * t) * np.cos(2.0 * np.pi * frequency * t)
    return np.where(t >= 0.0, shape, 0.0)


def noisy(values, std=1e-3):
    return values + std * np.random.default_rng(2).standard_normal(values.size)


def test_a_release_after_a_rest_is_found_to_the_sample():
    for start in (5.0, 31.0):
        (sample,) = releases(noisy(decay(start, 1.0)))
        assert TIME[sample] == pytest.approx(start, abs=0.011)


def test_several_releases_are_each_found_and_a_smaller_one_too():
    record = decay(0.0, 1.0) + decay(22.0, 0.4) + decay(40.0, 1.3)
    assert TIME[list(releases(noisy(record)))] == pytest.approx([0.0, 22.0, 40.0], abs=0.011)


@pytest.mark.parametrize("second", [2.05, 2.3, 2.6, 3.9])
def test_two_modes_that_beat_are_one_release(second):
    record = decay(0.0, 1.0, damping=0.1) + decay(0.0, 1.0, second, 0.1)
    assert releases(noisy(record)) == (0,)


def test_noise_and_a_still_record_hold_at_most_their_beginning():
    assert releases(np.zeros(1000)) == ()
    assert releases(noisy(np.zeros(5000))) in ((), (0,))


def test_a_record_is_cut_into_runs_that_begin_with_their_releases():
    record = noisy(decay(5.0, 1.0) + decay(30.0, 0.8))
    run = Run("d", "d.parquet", "c", TIME, {}, {"x": record})
    first, second = cut_at_releases(run)
    assert (first.name, second.file) == ("d-1", "d-2.parquet")
    assert first.time[0] == pytest.approx(5.0, abs=0.011)
    assert first.time[-1] < second.time[0]
    assert np.concatenate([first.time, second.time])[-1] == TIME[-1]
    # A run that begins with its only release is the run itself.
    uncut = Run("d", "d.parquet", "c", TIME, {}, {"x": noisy(decay(0.0, 1.0))})
    assert cut_at_releases(uncut) == (uncut,)
