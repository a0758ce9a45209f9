import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import Segment
from carrierflex.diagnosis.inference.gap_reduction import _extrapolation_fold
from carrierflex.diagnosis.inference.law_fits import held_out_folds
from carrierflex.identification.estimation.resampling import two_level_counts


def segments(conditions, blocks=4):
    return [Segment(f"R{c}", c, block, 100) for c in conditions for block in range(blocks)]


def test_every_segment_is_scored_once_and_never_trains_its_own_fold():
    for conditions in ("A", "AB", "ABC", "ABCD"):
        for runs_have_own in (False, True):
            folds = held_out_folds(segments(conditions), runs_have_own=runs_have_own)
            assert len(folds) >= 2
            assert_allclose(np.sum([fold.held_out for fold in folds], axis=0), 1)
            for fold in folds:
                assert_allclose(np.sum(fold.scored, axis=0), fold.held_out)
                assert not fold.held_out.all()


def test_with_three_conditions_a_whole_condition_is_left_out():
    blocks = segments("ABC")
    for fold in held_out_folds(blocks, runs_have_own=False):
        left_out = {blocks[k].condition for k in np.flatnonzero(fold.held_out)}
        trained = {blocks[k].condition for k in np.flatnonzero(~fold.held_out)}
        assert len(left_out) == 1
        assert not left_out & trained


def test_runs_own_parameters_are_fitted_on_the_other_blocks_of_the_held_out_run():
    for fold in held_out_folds(segments("ABC"), runs_have_own=True):
        assert [scored.sum() for scored in fold.scored] == [2, 2]


def test_extrapolation_leaves_out_the_largest_gap():
    blocks = segments("ABC")
    fold = _extrapolation_fold(
        blocks, [3.0 if segment.condition == "B" else 1.0 for segment in blocks]
    )
    assert {blocks[k].condition for k in np.flatnonzero(fold.held_out)} == {"B"}
    assert _extrapolation_fold(segments("A"), [1.0] * 4) is None


def test_bootstrap_covers_the_ratio():
    # 200 repetitions: exponential block energies, true ratio one half; nominal 95 %.
    rng = np.random.default_rng(5)
    hits = 0
    for _ in range(200):
        before = rng.gamma(20.0, 1.0, 24)
        after = 0.25 * rng.gamma(20.0, 1.0, 24)
        counts = two_level_counts(["A"] * 24, n_samples=200, rng=rng)
        draws = np.sqrt((counts @ after) / (counts @ before))
        low, high = np.quantile(draws, (0.025, 0.975))
        hits += low <= 0.5 <= high
    assert 175 <= hits <= 200


def test_two_levels_are_drawn_where_there_are_three_conditions():
    counts = two_level_counts(
        [segment.condition for segment in segments("ABC")],
        n_samples=400,
        rng=np.random.default_rng(0),
    )
    assert_allclose(counts.sum(axis=1), 12.0)
    by_condition = counts.reshape(400, 3, 4).sum(axis=2)
    assert (by_condition == 0.0).any()  # a condition may be missing from a draw
    assert_allclose(by_condition.mean(axis=0), 4.0, rtol=0.15)
