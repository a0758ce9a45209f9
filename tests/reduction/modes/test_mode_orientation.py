"""Signs of modes and directions of pairs follow the body, not the numbers that found them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.modes.mode_orientation import oriented


@pytest.fixture
def modes():
    """Orthonormal vectors: a single one, a pair, and a single one."""
    rng = np.random.default_rng(3)
    return np.linalg.qr(rng.standard_normal((30, 4)))[0], np.array([1.0, 2.0, 2.0, 3.0])


def turned(modes, angle, signs):
    Phi = modes * signs
    c, s = np.cos(angle), np.sin(angle)
    Phi[:, 1:3] = Phi[:, 1:3] @ np.array([[c, -s], [s, c]])
    return Phi


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, -3.0])
def test_turned_and_reversed_modes_come_back_the_same(modes, angle):
    Phi, omega = modes
    expected = oriented(Phi, omega)
    again = oriented(turned(Phi, angle, [-1.0, 1.0, -1.0, -1.0]), omega)
    assert_allclose(again, expected, atol=1e-14)
    assert_allclose(expected.T @ expected, np.eye(4), atol=1e-14)
    # Of the same spaces.
    assert_allclose(expected[:, 1:3] @ expected[:, 1:3].T, Phi[:, 1:3] @ Phi[:, 1:3].T, atol=1e-14)


def test_what_moves_most_moves_in_the_first_mode_alone_and_forwards(modes):
    Phi = oriented(*modes)
    assert Phi[np.abs(Phi[:, 0]).argmax(), 0] > 0.0
    most = np.linalg.norm(Phi[:, 1:3], axis=1).argmax()
    assert Phi[most, 1] > 0.0
    assert abs(Phi[most, 2]) < 1e-14


def test_modes_of_different_frequency_are_not_mixed(modes):
    Phi, _ = modes
    apart = oriented(Phi, np.array([1.0, 2.0, 2.0 + 1e-6, 3.0]))
    assert_allclose(np.abs(apart), np.abs(Phi))


@pytest.mark.long
def test_another_starting_block_gives_the_same_matrices(flexible_structure, flexible_reduction):
    other = craig_bampton(flexible_structure, 11, seed=5).model
    model = flexible_reduction.model
    scale = np.sqrt(np.outer(model.M.diagonal(), model.M.diagonal()))
    assert_allclose(other.M / scale, model.M / scale, rtol=0.0, atol=1e-10)
    size = np.abs(model.sensor_rows).max(axis=0)
    assert_allclose(other.sensor_rows / size, model.sensor_rows / size, rtol=0.0, atol=1e-9)
