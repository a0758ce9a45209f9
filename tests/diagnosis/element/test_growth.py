import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.element.gap import _block_forces, _growth_exponent
from carrierflex.diagnosis.element.problem import element_problem
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign

AMPLITUDES = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0)


def exponent(campaign):
    problem = element_problem(campaign)
    return _growth_exponent(_block_forces(problem.model, problem.records))


@pytest.mark.parametrize(
    ("law", "power"),
    [
        (lambda q, v: 4e5 * q**2, 2.0),
        (lambda q, v: 8e8 * q**3, 3.0),
        (lambda q, v: 1e14 * q**5, 5.0),
        (lambda q, v: 100.0 * v * np.abs(v), 2.0),
        (lambda q, v: 4e6 * q**2 * v, 3.0),
        (lambda q, v: np.tanh(v / 1e-4), 0.0),
    ],
)
def test_unexplained_force_grows_with_the_power_of_the_law(law, power):
    result = exponent(
        displacement_campaign(law, amplitudes=tuple(5e-4 * a for a in AMPLITUDES), n=2000)
    )
    # The lines of the drive scatter from block to block, and with them the peaks that a block's RMS
    # stands for.
    assert_allclose(result.value, power, atol=0.3)
    assert result.ci95[0] - 0.1 < power < result.ci95[1] + 0.1


def test_growth_is_told_under_a_force_too():
    result = exponent(force_campaign(lambda q, v: 8e8 * q**3, amplitudes=(1.0, 2.0, 4.0)))
    assert_allclose(result.value, 3.0, atol=0.3)
    assert result.ci95[1] - result.value < 1.5


def test_without_a_gap_or_with_one_amplitude_there_is_no_growth():
    silent = exponent(displacement_campaign(lambda q, v: 0.0 * q, n=2000))
    assert np.isnan(silent.value)
    assert silent.reason == "no unexplained force is above the noise"
    one = exponent(force_campaign(lambda q, v: 8e8 * q**3, amplitudes=(4.0, 4.0)))
    assert one.reason == "deflection does not vary"
