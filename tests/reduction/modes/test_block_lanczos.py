"""Block Lanczos against a dense eigenvalue problem with known, partly degenerate eigenvalues."""

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from carrierflex.fe.static import AccuracyError
from carrierflex.reduction.modes.block_lanczos import lowest_modes

N = 120


def problem(omega_squared, rng):
    """Dense K with the given eigenvalues for a diagonal M."""
    M = sp.diags_array(rng.uniform(0.5, 2.0, N), format="csr")
    Q, _ = np.linalg.qr(rng.standard_normal((N, N)))
    root = np.sqrt(M.diagonal())
    return (root[:, None] * Q * omega_squared) @ (Q.T * root), M


@pytest.mark.parametrize("block", [1, 3, 8])
def test_degenerate_and_close_eigenvalues_are_all_found(block):
    rng = np.random.default_rng(1)
    exact = np.sort(
        np.concatenate([[1.0, 1.0, 4.0, 4.000001, 9.0, 9.0], np.linspace(20.0, 500.0, N - 6)])
    )
    # A block of one sees a degenerate pair only through rounding: ask it for distinct ones.
    if block == 1:
        exact = np.linspace(1.0, 500.0, N)
    K, M = problem(exact, rng)
    inverse = np.linalg.inv(K)
    result, Phi = lowest_modes(
        lambda f: inverse @ f, M, inverse @ rng.standard_normal((N, block)), 8
    )
    assert_allclose(result, exact[:8], rtol=1e-9)
    assert_allclose(Phi.T @ (M @ Phi), np.eye(8), atol=1e-10)
    assert_allclose(K @ Phi, (M @ Phi) * result, atol=1e-5 * np.abs(K).max())


def test_more_modes_than_the_problem_has_are_refused():
    rng = np.random.default_rng(2)
    K, M = problem(np.linspace(1.0, 2.0, N), rng)
    inverse = np.linalg.inv(K)
    with pytest.raises(AccuracyError, match="fewer than 200 modes"):
        lowest_modes(lambda f: inverse @ f, M, rng.standard_normal((N, 4)), 200)
