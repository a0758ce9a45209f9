"""Bootstrap draws against their moments."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from carrierflex.identification.estimation.resampling import (
    block_counts,
    circular_block_counts,
    multinomial_counts,
    two_level_counts,
)


@pytest.mark.parametrize("n", [3, 10, 31])
def test_every_sample_is_as_large_as_the_record(n):
    rng = np.random.default_rng(0)
    groups = [f"condition {k % 4}" for k in range(4 * n)]
    assert circular_block_counts(n, 3, rng).sum() == n
    assert block_counts(n, rng).sum() == n
    assert_array_equal(multinomial_counts(n, 20, seed=1).sum(axis=1), n)
    assert_array_equal(two_level_counts(groups, n_samples=20, rng=rng).sum(axis=1), 4 * n)


def test_the_mean_of_independent_draws_has_the_variance_of_the_mean():
    values = np.random.default_rng(2).standard_normal(40)
    expected = values.std() / np.sqrt(40.0)
    rng = np.random.default_rng(3)
    single = np.array([block_counts(40, rng) for _ in range(8000)])
    for counts in (single, multinomial_counts(40, 8000, seed=4)):
        # 8000 draws give a standard deviation to 0.8 %.
        assert_allclose((counts @ values / 40.0).std(), expected, rtol=0.03)


def test_blocks_keep_the_correlation_of_neighbours():
    # Runs of five equal values: a mean of 20 independent values, not of 100.
    values = np.repeat(np.random.default_rng(5).standard_normal(20), 5)
    rng = np.random.default_rng(6)
    means = [circular_block_counts(100, 25, rng) @ values / 100.0 for _ in range(4000)]
    alone = [circular_block_counts(100, 1, rng) @ values / 100.0 for _ in range(4000)]
    assert_allclose(np.std(alone), values.std() / 10.0, rtol=0.05)
    assert np.std(means) > 1.6 * np.std(alone)


def test_conditions_are_drawn_before_their_blocks():
    # Blocks of one condition are equal: all scatter is that between the four conditions.
    groups = [f"condition {k // 25}" for k in range(100)]
    values = np.repeat([0.0, 1.0, 2.0, 3.0], 25)
    counts = two_level_counts(groups, n_samples=8000, rng=np.random.default_rng(7))
    expected = np.std([0.0, 1.0, 2.0, 3.0]) / 2.0
    assert_allclose((counts @ values / 100.0).std(), expected, rtol=0.03)


def test_two_conditions_alone_are_never_left_out():
    groups = ["a"] * 5 + ["b"] * 7
    counts = two_level_counts(groups, n_samples=50, rng=np.random.default_rng(8))
    assert_array_equal(counts[:, :5].sum(axis=1), 5)
    assert_array_equal(counts[:, 5:].sum(axis=1), 7)


def test_the_same_seed_draws_the_same_blocks():
    assert_array_equal(multinomial_counts(9, 30, seed=5), multinomial_counts(9, 30, seed=5))
    assert (multinomial_counts(9, 30, seed=5) != multinomial_counts(9, 30, seed=6)).any()
