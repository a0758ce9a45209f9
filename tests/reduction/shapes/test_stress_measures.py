"""Equivalent stress and critical plane against closed forms."""

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.reduction.shapes.stress_measures import critical_plane, von_mises


def test_equivalent_stress_of_shear_and_of_pressure():
    shear, pressure = np.zeros((6, 1)), np.zeros((6, 1))
    shear[4], pressure[:3] = 2.0, 7.0
    assert_allclose(von_mises(shear), 2.0 * np.sqrt(3.0))
    assert_allclose(von_mises(pressure), 0.0, atol=1e-12)


def test_the_critical_plane_of_alternating_shear_lies_under_45_degrees():
    t = np.linspace(0.0, 4.0 * np.pi, 200)
    stress = np.zeros((6, 200))
    # Shear in x and z that never changes its sign, beside a steady pull along y.
    stress[4], stress[1] = 2.0 + np.sin(t), 50.0
    n, normal = critical_plane(stress)
    assert_allclose(np.abs(n), [np.sqrt(0.5), 0.0, np.sqrt(0.5)], atol=0.06)
    assert_allclose(np.ptp(normal), 2.0, rtol=0.01)
