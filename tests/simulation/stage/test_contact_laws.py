"""Contact laws: discrete gradients conserve energy, tangents are derivatives."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.simulation.stage.contact_laws import (
    mesh_stiffness_at,
    play_force,
    play_gradient,
    play_stiffness,
    squeeze_gradient,
)


@pytest.mark.parametrize(
    ("old", "new"), [(1e-5, 3e-5), (-1e-5, 3e-5), (2e-5, -1e-6), (-2e-5, -1e-5), (1e-5, 1e-5)]
)
def test_squeeze_does_the_work_that_it_stores(old, new):
    mean, slope = squeeze_gradient(old, new)
    stored = 0.5 * (max(new, 0.0) ** 2 - max(old, 0.0) ** 2)
    assert_allclose(mean * (new - old), stored, rtol=1e-12, atol=1e-25)
    if old != new:
        step = 1e-9
        ahead, behind = (squeeze_gradient(old, new + sign * step)[0] for sign in (1.0, -1.0))
        assert_allclose(slope, (ahead - behind) / (2.0 * step), rtol=1e-4, atol=1e-9)


def test_play_does_the_work_that_it_stores():
    rng = np.random.default_rng(3)
    for old, new in rng.normal(0.0, 1.2e-4, (200, 2, 2)):
        force = play_gradient(*old, *new, 1e-4)[:2]
        stored = play_force(*new, 1e-4)[2] - play_force(*old, 1e-4)[2]
        assert_allclose(np.dot(force, new - old), stored, rtol=1e-9, atol=1e-22)


def test_plays_tangent_is_the_derivative_of_its_discrete_gradient():
    rng, step = np.random.default_rng(5), 1e-9
    for old, new in rng.normal(0.0, 1.2e-4, (50, 2, 2)):
        ends = [
            (
                play_gradient(*old, *(new + step * e), 1e-4),
                play_gradient(*old, *(new - step * e), 1e-4),
            )
            for e in np.eye(2)
        ]
        slopes = np.array([(np.array(up[:2]) - down[:2]) / (2.0 * step) for up, down in ends]).T
        assert_allclose(play_gradient(*old, *new, 1e-4)[2:], slopes.ravel(), rtol=0.0, atol=2e-4)


def test_play_pushes_back_along_the_displacement_beyond_the_clearance():
    fy, fz, energy = play_force(3e-4, 4e-4, 1e-4)
    assert_allclose([fy, fz, energy], [2.4e-4, 3.2e-4, 0.5 * (4e-4) ** 2], rtol=1e-12)
    assert play_force(3e-5, 4e-5, 1e-4) == (0.0, 0.0, 0.0)
    step = 1e-10
    tangent = [
        (np.array(play_force(3e-4 + step * dy, 4e-4 + step * dz, 1e-4)[:2]) - [fy, fz]) / step
        for dy, dz in ((1.0, 0.0), (0.0, 1.0))
    ]
    yy, yz, zz = play_stiffness(3e-4, 4e-4, 1e-4)
    assert_allclose(tangent, [[yy, yz], [yz, zz]], rtol=0.0, atol=1e-5)


def test_mesh_stiffness_is_its_fourier_series():
    amplitudes = np.array([[3e9, 1e8 * np.exp(0.3j), 4e7j]])
    for angle in (0.0, 0.4, 5.0):
        expected = (amplitudes * np.exp(1j * angle * np.arange(3))).sum().real
        assert_allclose(
            mesh_stiffness_at(amplitudes.real.copy(), amplitudes.imag.copy(), angle),
            expected,
            rtol=1e-12,
        )
