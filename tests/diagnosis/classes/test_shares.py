"""Shares of the gap, what is left, and when two results are equal, on blocks of known squares."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.shares import PairedShares, Shares

N_BLOCKS = 24
LIMITS = ClassConstants()
#: Blocks of very different size: a mean over them has a scatter, a share of each has none.
BEFORE = 10.0 + 9.0 * np.sin(np.arange(N_BLOCKS))
FLOOR = np.ones(N_BLOCKS)
ABOVE = BEFORE - FLOOR
SHARES = Shares(BEFORE, FLOOR, LIMITS)


def held_out(squares):
    return HeldOutSquares(np.broadcast_to(squares, (N_BLOCKS,)).astype(float), (), ())


#: Beside all of BEFORE the logarithm of the ratio is 4 and 0 in turn: its mean is 2, its standard
#: error 2 / sqrt(24).
BY_TURNS = held_out(np.where(np.arange(N_BLOCKS) % 2, BEFORE, np.exp(-4.0) * BEFORE))


def leaving(share):
    """Result that explains the same share of every block."""
    return held_out(BEFORE - share * ABOVE)


def test_a_share_is_of_the_gap_above_the_floor():
    assert SHARES.of(held_out(FLOOR)) == pytest.approx(1.0)
    assert SHARES.of(held_out(BEFORE)) == pytest.approx(0.0)
    assert SHARES.of(held_out(BEFORE + 0.5 * ABOVE)) == pytest.approx(-0.5)


def test_what_leaves_little_more_than_the_noise_is_at_the_floor():
    assert SHARES.is_at_floor(held_out(FLOOR))
    assert SHARES.is_at_floor(held_out(1.14 * FLOOR))
    assert not SHARES.is_at_floor(held_out(1.16 * FLOOR))


def test_a_share_that_is_the_same_in_every_block_has_no_scatter():
    assert SHARES.interval(leaving(0.5)) == pytest.approx((0.5, 0.5))
    low, high = SHARES.interval(held_out(BEFORE - 0.5 * ABOVE[::-1]))
    assert low < 0.5 < high


def test_a_part_is_the_mean_of_what_a_class_explains_alone_and_second():
    share, interval = SHARES.contribution(
        held_out(BEFORE), leaving(0.4), leaving(0.3), leaving(0.6)
    )
    assert share == pytest.approx(0.25)
    assert interval == pytest.approx((0.25, 0.25))


def test_a_gain_that_is_the_same_in_every_block_has_no_error():
    worse, better = held_out(BEFORE), held_out(BEFORE - 0.8)
    assert SHARES.gain(better, worse) == pytest.approx(0.8 * N_BLOCKS / ABOVE.sum())
    assert SHARES.gain_error(better, worse) == pytest.approx(0.0, abs=1e-12)
    assert SHARES.gain_error(held_out(0.5 * BEFORE), worse) > 0.01


def test_what_is_left_counts_from_the_floor_and_never_less_than_it_is_known_to():
    floor = FLOOR.sum()
    assert SHARES.remaining(held_out(3.0)) == pytest.approx((2.0 + LIMITS.floor_error) * floor)
    assert SHARES.remaining(held_out(0.2)) == pytest.approx(
        (LIMITS.least_left + LIMITS.floor_error) * floor
    )


def test_results_are_equal_up_to_a_ratio_and_beyond_it_where_the_blocks_scatter():
    scatter = 1.5 * np.resize([1.0, -1.0], N_BLOCKS)
    assert SHARES.are_equal(held_out(3.0), held_out(3.1))
    assert not SHARES.are_equal(held_out(3.0), held_out(3.7))
    assert SHARES.are_equal(held_out(3.0 + scatter), held_out(3.7 - scatter))
    assert not SHARES.are_equal(held_out(3.0 + 4.0 * scatter), held_out(6.0 - 4.0 * scatter))


def test_a_clear_gain_is_both_a_part_of_the_gap_and_half_of_what_is_left():
    gap = ABOVE.mean()
    assert SHARES.is_clear_gain(held_out(2.0), held_out(4.0), 0.1)
    # Half of what is left, and less of the gap than is asked.
    assert not SHARES.is_clear_gain(held_out(2.0), held_out(4.0), 1.01 * 2.0 / gap)
    # More of the gap than is asked, and less than half of what is left.
    assert not SHARES.is_clear_gain(held_out(4.0), held_out(6.0), 0.1)
    # What is learnt below the floor is none: half of 0.9 and 0.05 floors from there.
    assert not SHARES.is_clear_gain(held_out(0.2), held_out(1.9), 0.1)
    # Within the scatter over the blocks there is none.
    scatter = 30.0 * np.resize([1.0, -1.0], N_BLOCKS)
    assert not SHARES.is_clear_gain(held_out(2.0 + scatter), held_out(4.0 - scatter), 0.1)


def test_two_results_are_equal_in_either_order_within_a_tenth_of_what_they_leave():
    assert not SHARES.are_equal(held_out(3.0), held_out(3.7))
    assert not SHARES.are_equal(held_out(3.7), held_out(3.0))
    assert SHARES.are_equal(held_out(3.0), held_out(3.1))


def test_far_less_is_left_beyond_the_ratio_of_results_that_may_be_equal():
    # Without the error of the floor the ratio is that of what is left: 1.56 and no scatter.
    sure = Shares(BEFORE, FLOOR, replace(LIMITS, floor_error=0.0))
    assert sure.leaves_far_less(leaving(0.9), leaving(1.0 - 0.157))
    assert not sure.leaves_far_less(leaving(0.9), leaving(1.0 - 0.155))
    assert not sure.leaves_far_less(leaving(0.5), leaving(0.9))


PAIRED = PairedShares(BEFORE, FLOOR, LIMITS)


def test_a_gain_in_every_block_is_one_though_one_block_holds_most_of_it():
    one_block = np.where(np.arange(N_BLOCKS) == 7, 400.0, 4.0)
    worse, better = held_out(one_block), held_out(2.0)
    # The difference scatters as much as it is: a block of a hundred times the others.
    assert not SHARES.is_gain(better, worse, 0.01)
    assert PAIRED.is_gain(better, worse, 0.01)
    assert PAIRED.is_clear_gain(better, worse, 0.01)
    assert not PAIRED.is_gain(worse, better, 0.0)


def test_a_gain_in_one_block_alone_is_none_however_large():
    one_block = np.where(np.arange(N_BLOCKS) == 7, 400.0, 2.0)
    assert not PAIRED.is_gain(held_out(2.0), held_out(one_block), 0.01)


def test_results_are_equal_where_the_ratio_of_their_blocks_scatters():
    scatter = 1.5 * np.resize([1.0, -1.0], N_BLOCKS)
    assert PAIRED.are_equal(held_out(3.0), held_out(3.1))
    assert not PAIRED.are_equal(held_out(3.0), held_out(3.7))
    assert PAIRED.are_equal(held_out(3.0 + scatter), held_out(3.7 - scatter))
    # Of blocks of 2, 20 and 200 the ratios tell a tenth, the differences do not.
    blocks = np.resize([2.0, 20.0, 200.0], N_BLOCKS)
    large = PairedShares(100.0 * blocks, FLOOR, LIMITS)
    assert not large.are_equal(held_out(blocks), held_out(1.2 * blocks))


def test_without_a_floor_and_without_noise_a_ratio_is_a_number():
    silent = PairedShares(BEFORE, np.zeros(N_BLOCKS), LIMITS)
    assert silent.is_gain(held_out(0.0), held_out(1.0), 0.01)
    assert not silent.is_gain(held_out(1e-14 * BEFORE), held_out(1e-13 * BEFORE), 0.0)


def test_a_result_takes_a_share_of_what_is_left():
    # What the floor is not known to is a ninth of what is left of a tenth of the gap.
    worse = leaving(0.9)
    assert SHARES.takes_of_remaining(leaving(0.96), worse, 0.5)
    assert not SHARES.takes_of_remaining(leaving(0.95), worse, 0.5)
    assert SHARES.takes_of_remaining(leaving(0.98), worse, 0.67)
    assert not SHARES.takes_of_remaining(leaving(0.96), worse, 0.67)
    assert not SHARES.takes_of_remaining(worse, leaving(0.98), 0.67)


def test_what_is_taken_is_a_part_of_the_gap_and_counts_down_to_the_floor():
    exact = Shares(BEFORE, FLOOR, replace(LIMITS, floor_error=0.0, least_left=1e-9))
    assert exact.takes_of_remaining(leaving(1.0), leaving(1.0 - 0.0016), 0.67)
    assert not exact.takes_of_remaining(leaving(1.0), leaving(1.0 - 0.0014), 0.67)
    assert not exact.takes_of_remaining(leaving(1.1), leaving(1.0 - 0.0014), 0.67)


def test_what_is_taken_is_taken_in_block_after_block():
    worse = held_out(BEFORE)
    assert SHARES.errors_of_ratio(BY_TURNS, worse) == pytest.approx(np.sqrt(24.0))
    assert SHARES.errors_of_ratio(worse, BY_TURNS) == pytest.approx(-np.sqrt(24.0))
    for errors, is_seen in ((4.89, True), (4.91, False)):
        limits = replace(LIMITS, small_cause_errors=errors)
        shares = Shares(BEFORE, 0.01 * FLOOR, limits)
        assert shares.takes_of_remaining(BY_TURNS, worse, 0.4) == is_seen


def test_paired_gains_are_beyond_scatter_by_the_ratio_of_each_block():
    worse = held_out(BEFORE)
    for errors, is_beyond in ((4.89, True), (4.91, False)):
        shares = PairedShares(BEFORE, FLOOR, replace(LIMITS, standard_errors=errors))
        assert shares.is_beyond_scatter(0.0, BY_TURNS, worse) == is_beyond
