"""Power density against scipy's, and the precision of filters."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import welch

from carrierflex.identification.campaign.signals import pass_gain, power_density, with_gain

STEP = 5e-3


@pytest.fixture(scope="module")
def signal():
    rng = np.random.default_rng(0)
    # A drift, which the straight lines take out, and motion far above the noise.
    return np.cumsum(rng.standard_normal(3000)) + 0.1 * np.arange(3000.0)


@pytest.mark.parametrize("segment", [512, 511, 3000])
def test_power_density_is_that_of_scipy(signal, segment):
    frequency, density = power_density(signal, STEP, segment)
    expected = welch(signal, 1.0 / STEP, nperseg=segment, window="blackmanharris", detrend="linear")
    assert_allclose(frequency, expected[0])
    assert_allclose(density, expected[1], rtol=1e-9)


def test_a_signal_in_single_precision_is_filtered_in_it(signal):
    def gain(frequency):
        return pass_gain(frequency, 20.0) * 2j * np.pi * frequency

    filtered = with_gain(signal, STEP, gain, reach=300)
    single = with_gain(signal.astype(np.float32), STEP, gain, reach=300)
    assert single.dtype == np.float32
    # Rounding of the signal, at the highest frequency that passes.
    assert_allclose(single, filtered, atol=40.0 * np.pi * 1e-6 * np.abs(signal).max())


def test_the_pass_band_falls_from_one_to_zero_as_a_raised_cosine():
    frequency = np.array([0.0, 16.0, 18.0, 20.0, 30.0])
    assert_allclose(pass_gain(frequency, 20.0), [1.0, 1.0, 0.5, 0.0, 0.0], atol=1e-15)
