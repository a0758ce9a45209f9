"""Gap reduction on held-out records against sums of squares that are known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.problem import BASELINE
from carrierflex.diagnosis.inference.gap_reduction import gap_reduction
from carrierflex.diagnosis.inference.law_fits import law_fits
from carrierflex.diagnosis.inference.thresholds import Thresholds
from tests.diagnosis.inference.toy_problem import CellsAlone, linear_problem

LIMITS = Thresholds(bootstrap_samples=40)
#: Directions of effects a and b, one outside the library, and noise.
A = 6.0
B = 4.0
OUTSIDE = 1.5
NOISE = 0.5
TRUTH = {BASELINE: 7.0, "a": A, "b": B, "outside": OUTSIDE}
BEFORE = A**2 + B**2 + OUTSIDE**2 + NOISE**2
AFTER = OUTSIDE**2 + NOISE**2


def reduced(problem, accepted, limits=LIMITS):
    return gap_reduction(law_fits(problem, limits), accepted)


@pytest.fixture(scope="module")
def reduction():
    return reduced(linear_problem(TRUTH, noise_std=NOISE), ("a", "b"))


def test_rms_and_their_ratio_are_the_roots_of_the_known_sums(reduction):
    assert_allclose(reduction.rms_before, np.sqrt(BEFORE), rtol=1e-9)
    assert_allclose(reduction.rms_after, np.sqrt(AFTER), rtol=1e-9)
    assert_allclose(reduction.noise_floor, NOISE)
    assert_allclose(reduction.rho, np.sqrt(AFTER / BEFORE), rtol=1e-9)
    assert_allclose(reduction.floor_multiple, np.sqrt(AFTER) / NOISE, rtol=1e-9)


def test_the_explained_share_leaves_the_noise_out(reduction):
    assert_allclose(reduction.phi, (A**2 + B**2) / (A**2 + B**2 + OUTSIDE**2), rtol=1e-9)


def test_explained_shares_of_orthogonal_columns_add_up():
    problem = linear_problem(TRUTH, noise_std=NOISE)
    shares = [reduced(problem, accepted).phi for accepted in (("a",), ("b",), ("a", "b"))]
    assert_allclose(shares[0] + shares[1], shares[2], rtol=1e-9)
    assert_allclose(shares[0] / shares[1], A**2 / B**2, rtol=1e-9)


def test_the_order_in_which_effects_are_named_changes_nothing():
    """A fit holds its effects sorted: values of one are not those of another."""
    problem = linear_problem(TRUTH, noise_std=NOISE)
    one, other = (reduced(problem, accepted) for accepted in (("a", "b"), ("b", "a")))
    assert_allclose(other.extrapolation_rho, one.extrapolation_rho, rtol=1e-9)
    assert_allclose(other.rho, one.rho, rtol=1e-9)


def test_where_all_blocks_are_alike_the_intervals_are_points(reduction):
    assert_allclose(reduction.rho_ci95, reduction.rho, rtol=1e-9)
    assert_allclose(reduction.phi_ci95, reduction.phi, rtol=1e-9)


def test_intervals_hold_the_value_where_the_conditions_differ():
    gains = {"A": 1.0, "B": 2.0, "C": 3.0, "D": 4.0}
    problem = linear_problem({"a": 3.0, "outside": 2.0}, gains=gains)
    reduction = reduced(problem, ("a",))
    # Effect and remainder grow alike, the noise does not: from condition A alone to D alone.
    square = np.array([1.0, 4.0, 9.0, 16.0])
    assert_allclose(reduction.rho**2, (1.0 + 4.0 * square.mean()) / (1.0 + 13.0 * square.mean()))
    low, high = reduction.rho_ci95
    assert np.sqrt(65.0 / 209.0) <= low < reduction.rho < high <= np.sqrt(5.0 / 14.0)
    # Above the noise every draw is reduced alike.
    assert_allclose(reduction.phi_ci95, 9.0 / 13.0)


def test_the_interval_of_the_share_holds_it_where_the_effect_grows_faster():
    gains = {"A": 1.0, "B": 2.0, "C": 3.0, "D": 4.0}
    problem = linear_problem({"a": 3.0}, gains=gains)
    rng = np.random.default_rng(1)
    problem = replace(problem, target=problem.target + rng.standard_normal(problem.target.shape))
    reduction = reduced(problem, ("a",))
    assert reduction.phi_ci95[0] < reduction.phi < reduction.phi_ci95[1] < 1.0
    assert reduction.phi_ci95[0] > 0.9


def test_95_per_cent_of_the_draws_lie_within_the_interval():
    gains = {"A": 1.0, "B": 2.0, "C": 3.0}
    problem = linear_problem({"a": 3.0, "outside": 2.0}, gains=gains)
    reduction = reduced(problem, ("a",), limits=replace(LIMITS, bootstrap_samples=1000))
    # One draw in 27 holds condition A alone, and as many condition C alone: both are beyond 2.5 %.
    assert_allclose(reduction.rho_ci95, np.sqrt([(1.0 + 36.0) / (1.0 + 117.0), 5.0 / 14.0]))


def test_another_seed_moves_the_ends_of_an_interval_and_nothing_else():
    gains = {"A": 1.0, "B": 2.0, "C": 3.0, "D": 4.0}
    problem = linear_problem({"a": 3.0, "outside": 2.0}, gains=gains)
    rng = np.random.default_rng(1)
    problem = replace(problem, target=problem.target + rng.standard_normal(problem.target.shape))
    limits = replace(LIMITS, bootstrap_samples=1000)
    one, same, other = (
        reduced(problem, ("a",), limits=replace(limits, seed=seed)) for seed in (0, 0, 5)
    )
    assert one.rho_ci95 == same.rho_ci95
    assert one.phi_ci95 != other.phi_ci95
    assert (one.rho, one.phi, one.rms_after) == (other.rho, other.phi, other.rms_after)
    # Of four conditions few draws are different: an end jumps from one of them to the next.
    width = one.phi_ci95[1] - one.phi_ci95[0]
    assert_allclose(other.phi_ci95, one.phi_ci95, rtol=0.0, atol=0.25 * width)


def test_without_an_accepted_set_nothing_is_reduced():
    reduction = reduced(linear_problem(TRUTH, noise_std=NOISE), ())
    assert reduction.rho == 1.0
    assert reduction.phi == pytest.approx(0.0, abs=1e-12)
    assert reduction.rms_after == reduction.rms_before
    assert [step.added for step in reduction.steps] == ["baseline"]
    assert np.isnan(reduction.extrapolation_rho)


def test_without_noise_what_is_left_is_beyond_every_multiple_of_it():
    reduction = reduced(linear_problem({"a": 3.0, "outside": 1.0}, noise_std=0.0), ("a",))
    assert reduction.floor_multiple == float("inf")


def test_accepted_effects_are_listed_largest_step_first(reduction):
    assert [step.added for step in reduction.steps] == ["baseline", "a", "b"]
    squares = np.array([BEFORE, BEFORE - A**2, AFTER])
    assert_allclose([step.rms for step in reduction.steps], np.sqrt(squares), rtol=1e-9)
    assert_allclose([step.rho for step in reduction.steps], np.sqrt(squares / BEFORE), rtol=1e-9)
    assert np.isnan(reduction.steps[0].rho_ci95).all()
    assert_allclose(reduction.steps[2].rho_ci95, reduction.rho, rtol=1e-9)
    turned = reduced(linear_problem({"a": 1.0, "b": 4.0, "c": 2.0}), ("a", "b", "c"))
    assert [step.added for step in turned.steps] == ["baseline", "b", "c", "a"]


def test_extrapolation_predicts_the_condition_with_the_largest_gap_from_the_others():
    gains = {"A": 1.0, "B": 3.0, "C": 2.0}
    problem = linear_problem({"a": 4.0, "outside": 1.0}, gains=gains)
    reduction = reduced(problem, ("a",))
    assert_allclose(
        reduction.extrapolation_rho, np.sqrt((9.0 + 1.0) / (17.0 * 9.0 + 1.0)), rtol=1e-6
    )
    # Where condition B alone has twice the effect, A and C know nothing of it.
    target = problem.target.copy()
    in_b = [segment.condition == "B" for segment in problem.segments]
    target[in_b] += 4.0 * problem.columns[in_b, :, 1]
    reduction = reduced(replace(problem, target=target), ("a",))
    after, before = 17.0 * 9.0 + 1.0, 65.0 * 9.0 + 1.0
    assert_allclose(reduction.extrapolation_rho, np.sqrt(after / before), rtol=1e-6)


def halved(segments, condition):
    """Blocks of which those of one condition count half of their samples."""
    half = {segment: replace(segment, n_samples=segment.n_samples // 2) for segment in segments}
    return tuple(
        half[segment] if segment.condition == condition else segment for segment in segments
    )


def test_the_condition_with_the_largest_gap_is_that_of_the_largest_mean_square():
    """Its blocks may be shorter than those of a condition with a smaller gap."""
    problem = linear_problem({"a": 4.0}, gains={"A": 1.0, "B": 1.1, "C": 1.0})
    in_b = replace(problem, blocks=halved(problem.segments, "B"))
    of_b, of_a = 1.0 / np.sqrt(16.0 * 1.21 + 1.0), 1.0 / np.sqrt(17.0)
    assert_allclose(reduced(in_b, ("a",)).extrapolation_rho, of_b, rtol=1e-6)
    in_a = replace(problem, blocks=halved(problem.segments, "A"))
    assert_allclose(reduced(in_a, ("a",)).extrapolation_rho, of_a, rtol=1e-6)


def test_with_one_condition_nothing_can_be_extrapolated():
    reduction = reduced(linear_problem({"a": 4.0}, gains={"A": 1.0}, blocks=4), ("a",))
    assert np.isnan(reduction.extrapolation_rho)
    assert_allclose(reduction.rho, 1.0 / np.sqrt(17.0), rtol=1e-9)


def test_gap_maps_are_those_of_the_baseline_and_of_the_accepted_set(reduction):
    assert_allclose([cell.mean_square for cell in reduction.cells_before], BEFORE)
    assert_allclose([cell.mean_square for cell in reduction.cells_after], AFTER)


def test_every_run_is_validated_by_its_coherent_gap_and_its_uncertainties():
    gains = {"A": 1.0, "B": 2.0}
    problem = linear_problem({"a": A, "outside": OUTSIDE}, gains=gains, noise_std=NOISE)
    rows = reduced(replace(problem, numerical=1.2), ("a",)).validation
    assert [row.run for row in rows] == ["RA", "RB"]
    before = np.hypot(A, OUTSIDE)
    assert_allclose([row.error_before for row in rows], [before, 2.0 * before], rtol=1e-9)
    assert_allclose([row.error_after for row in rows], [OUTSIDE, 2.0 * OUTSIDE], rtol=1e-6)
    assert_allclose([row.u_val for row in rows], np.hypot(1.2, NOISE), rtol=1e-9)


def test_a_gap_below_the_noise_is_no_error():
    problem = replace(linear_problem({"a": A}, noise_std=0.5), noise_std=0.6)
    row = reduced(problem, ("a",)).validation[0]
    assert row.error_after == 0.0
    assert_allclose(row.u_val, 0.6)


class SharplyMapped(type(linear_problem({}))):
    """Problem whose map holds a cell with more coherent gap than its mean square."""

    def gap(self, effects, theta):
        cells = super().gap(effects, theta).cells
        return CellsAlone(tuple(replace(one, coherent=2.0 * one.mean_square) for one in cells))


def test_a_cell_without_noise_adds_none_to_the_uncertainty():
    problem = SharplyMapped(**vars(linear_problem({"a": A})))
    row = reduced(replace(problem, numerical=0.3), ("a",)).validation[0]
    assert_allclose(row.u_val, 0.3)
    assert_allclose(row.error_after, np.sqrt(2.0), rtol=1e-6)
