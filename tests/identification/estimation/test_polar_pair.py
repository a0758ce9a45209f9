"""Size and angle of a vector with their errors."""

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.identification.estimation.polar_pair import polar_values
from carrierflex.simulation.effect_parameters import PolarPair

COVARIANCE = np.array([[4e-12, 1e-12], [1e-12, 9e-12]])


def test_components_are_named_after_the_vector():
    assert PolarPair("phi", "theta").components == ("phi cos theta", "phi sin theta")


def test_derivatives_are_those_of_size_and_angle():
    point = np.array([-3e-4, 4e-4])
    values, derivatives = polar_values(point, COVARIANCE)
    assert_allclose(values, [5e-4, np.arctan2(4.0, -3.0)])
    step = 1e-9
    for k in range(2):
        moved = point.copy()
        moved[k] += step
        quotient = (polar_values(moved, COVARIANCE)[0] - values) / step
        # One-sided quotients: the curvature over the step is left, 1e-9 / 5e-4.
        assert_allclose(derivatives[:, k], quotient, rtol=1e-5)


def test_no_vector_has_no_direction():
    values, derivatives = polar_values(np.zeros(2), COVARIANCE)
    assert_allclose(values, 0.0)
    errors = np.sqrt(np.diag(derivatives @ COVARIANCE @ derivatives.T))
    assert_allclose(errors[0], 2e-6)
    assert errors[1] > 1e5


def test_a_vector_of_unknown_error_keeps_its_direction():
    values, derivatives = polar_values(np.array([0.0, 2.0]), np.full((2, 2), np.nan))
    assert_allclose(values, [2.0, np.pi / 2.0])
    assert_allclose(derivatives, [[0.0, 1.0], [-0.5, 0.0]], atol=1e-15)
