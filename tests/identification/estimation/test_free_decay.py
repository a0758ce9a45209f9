"""First swings of a release: exact for a linear decay, whatever its phase, noise or rest."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.identification.estimation.free_decay import _first_swings, released_motion

STEP, OMEGA = 0.01, 12.0
TIME = STEP * np.arange(600)


def decay(ratio, phase, order=0):
    """Deflection of a linear decay, or a derivative of it."""
    s = OMEGA * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
    return np.real(s**order * np.exp(1j * phase + s * TIME))


@pytest.mark.parametrize("ratio", [0.0, 0.01, 0.08, 0.3])
@pytest.mark.parametrize("phase", [0.0, 1.0, 4.0])
def test_a_linear_decay_is_differentiated_to_its_first_sample(ratio, phase):
    result = _first_swings(decay(ratio, phase) + 0.3, STEP)
    for order, values in enumerate(result):
        assert_allclose(values, decay(ratio, phase, order), atol=1e-4 * OMEGA**order)


def test_noise_moves_the_first_swings_by_less_than_itself():
    noise = 0.01 * np.random.default_rng(5).standard_normal(TIME.size)
    result = _first_swings(decay(0.02, 0.5) + noise, STEP)
    first = TIME < 2.0 * np.pi / OMEGA
    for order, values in enumerate(result):
        error = (values - decay(0.02, 0.5, order))[first]
        assert np.sqrt(np.mean(error**2)) < 0.01 * OMEGA**order


def test_no_decay_grows():
    result = _first_swings(np.exp(0.5 * TIME) * np.cos(OMEGA * TIME), STEP)
    assert np.abs(result[0]).max() < 2.0


def test_a_decay_below_a_frequency_begins_without_ringing():
    # Ten times the decay's own frequency: a mirror before the release is a step of 2 w².
    result = released_motion(decay(0.02, 0.0), STEP, 10.0 * OMEGA / (2.0 * np.pi))
    for order, values in enumerate(result):
        exact = decay(0.02, 0.0, order)
        assert np.abs(values - exact).max() < 1e-3 * OMEGA**order
