import numpy as np
import pytest
from scipy.signal import cont2discrete

from carrierflex.blind_check.truth.mounting.refit import oscillator_filters

_STEP = 0.02


@pytest.mark.parametrize("damping_ratio", [0.001, 0.1, 0.9, 3.0])
def test_filters_are_bit_by_bit_those_of_the_general_conversion(damping_ratio: float) -> None:
    M = np.array([1e3, 5e4, 9e4])
    K = np.array([2e7, 3e8, 1e6])
    C = 2.0 * damping_ratio * np.sqrt(K * M)
    for result, *oscillator in zip(oscillator_filters(M, C, K, _STEP), M, C, K, strict=True):
        expected = cont2discrete(([1.0], oscillator), _STEP, method="foh")
        # Sealed labels hang on every bit.
        assert np.array_equal(result[0], expected[0].reshape(-1))
        assert np.array_equal(result[1], expected[1])


def test_a_lasting_force_ends_in_its_static_deflection() -> None:
    M, C, K = np.array([1e3]), np.array([1e4]), np.array([2e7])
    [(numerator, denominator)] = oscillator_filters(M, C, K, _STEP)
    assert numerator.sum() / denominator.sum() == pytest.approx(1.0 / K[0], rel=1e-9)
