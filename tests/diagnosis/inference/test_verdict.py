"""The six verdicts: which is given, on which side of each limit, and with which reason."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.forward_selection import forward_selection
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    NAMED,
    NAMED_WITH_REMAINDER,
    NO_INTERVAL,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    GapReduction,
    RankedSet,
)
from carrierflex.diagnosis.inference.screening import Screen, ScreenedEffect
from carrierflex.diagnosis.inference.selection import Selection
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.inference.verdict import verdict
from tests.diagnosis.inference.toy_problem import linear_problem

#: Binary fractions and squares of them: a limit can be met exactly.
LIMITS = Thresholds(
    floor_ratio=1.5**2,
    floor_ratio_estimated=2.0**2,
    coloured_ratio=3.0**2,
    nothing_learnt=0.125,
    named_share=0.5,
    named_share_beyond=0.875,
    gap_beyond_floor=1.5,
    class_weight=0.75,
    negative_control_share=0.75,
    wholly_explained=0.96875,
    remainder=1.25,
    black_box_share=0.75,
    surviving_share=0.0625,
    bootstrap_samples=20,
)
FLOOR = 2.0
#: A gap of ten floors of which one effect leaves 1.1; every test changes one thing of it.
CLEAR = GapReduction(
    rms_before=10.0 * FLOOR,
    rms_after=1.1 * FLOOR,
    noise_floor=FLOOR,
    rho=0.0,
    rho_ci95=NO_INTERVAL,
    phi=0.9375,
    phi_ci95=NO_INTERVAL,
    floor_multiple=1.1,
    negative_control_rho=1.0,
    black_box_rho=0.0,
    extrapolation_rho=1.0,
    steps=(),
    cells_before=(),
    cells_after=(),
    validation=(),
)
RIVALS = (("b",), ("c", "d"))


@pytest.fixture(scope="module")
def search():
    made = forward_selection(linear_problem({"a": 4.0}), LIMITS)
    made.score(())
    made.score(("a",))
    return made


@pytest.fixture
def decided(search):
    def decide(
        *,
        accepted=("a",),
        rivals=(),
        weight=1.0,
        classes=(("a",),),
        surviving=(1.0,),
        measured=True,
        explainable=1.0,
        ranking=None,
        scores=search,
        **reduction,
    ):
        weights = (RankedSet(("a",), weight, 1.0, 0.0), RankedSet((), 1.0 - weight, 4.0, 0.0))
        screened = Screen(
            tuple(ScreenedEffect(f"e{k}", 1.0, share, ()) for k, share in enumerate(surviving)),
            np.eye(len(surviving)),
        )
        return verdict(
            scores,
            screened,
            Selection(accepted, rivals, ranking or weights),
            classes,
            replace(CLEAR, **reduction),
            floor_is_measured=measured,
            explainable=explainable,
        )

    return decide


def test_a_cause_that_leaves_noise_is_named(decided):
    kind, reason = decided()
    assert kind == NAMED
    explained, remainder = reason.split("; ")
    assert (
        explained == "explains 93.8% of the gap above the floor (mean square) on held-out records"
    )
    assert remainder == "what is left is 1.10 times the noise floor"


def test_a_remainder_is_told_above_its_limit_only(decided):
    assert decided(floor_multiple=1.25)[0] == NAMED
    kind, reason = decided(floor_multiple=1.3)
    assert kind == NAMED_WITH_REMAINDER
    assert reason.endswith("what is left is 1.3 times the noise floor")
    assert reason.startswith("explains 93.8% of the gap above the floor (mean square)")


def test_a_gap_of_a_measured_floor_is_at_it_whatever_was_accepted(decided):
    at_limit = decided(rms_before=1.5 * FLOOR)
    assert at_limit[0] == AT_NOISE_FLOOR
    assert at_limit[1] == "the held-out gap is 2.250 times the mean square of the noise floor"
    assert decided(rms_before=1.501 * FLOOR)[0] == NAMED


def test_a_gap_of_an_estimated_floor_is_at_it_where_nothing_was_accepted(decided):
    assert decided(rms_before=2.0 * FLOOR, measured=False, accepted=())[0] == AT_NOISE_FLOOR
    assert decided(rms_before=2.001 * FLOOR, measured=False, accepted=())[0] == NONE_OF_THESE
    assert decided(rms_before=1.2 * FLOOR, measured=False)[0] == NAMED
    # The wider limit is that of an estimated floor alone.
    assert decided(rms_before=1.9 * FLOOR, accepted=())[0] == NONE_OF_THESE


def test_a_gap_of_which_a_flexible_model_learns_nothing_is_coloured_noise(decided):
    coloured = {"rms_before": 3.0 * FLOOR, "explainable": 0.125, "accepted": ()}
    kind, reason = decided(**coloured)
    assert kind == AT_NOISE_FLOOR
    assert reason.startswith("the held-out gap is 9.00 times the mean square of the noise floor")
    assert "a black-box reference learns nothing of it" in reason
    assert decided(**{**coloured, "rms_before": 3.01 * FLOOR})[0] == NONE_OF_THESE
    assert decided(**{**coloured, "explainable": 0.13})[0] == NONE_OF_THESE
    assert decided(**{**coloured, "accepted": ("a",)})[0] == NAMED


def test_without_noise_no_gap_is_at_the_floor(decided):
    assert decided(noise_floor=0.0, rms_before=1e-9)[0] == NAMED


def test_effects_that_the_baseline_absorbs_cannot_be_diagnosed(decided):
    absorbed = (
        NOT_DIAGNOSABLE,
        "the baseline absorbs the signature of every effect in these records",
    )
    assert decided(surviving=(0.06, 0.01)) == absorbed
    assert decided(surviving=(0.06,), accepted=()) == absorbed
    assert decided(surviving=(0.01, 0.0625))[0] == NAMED
    # A gap at the floor needs no effect that could be seen.
    assert decided(surviving=(0.01,), rms_before=FLOOR)[0] == AT_NOISE_FLOOR


def test_where_nothing_is_accepted_the_best_set_tried_is_told(decided):
    tried = (
        RankedSet((), 0.5, 0.1, 0.0, "the baseline"),
        RankedSet(("b",), 0.3, 3.0, 0.0, "b is worse"),
        RankedSet(("a", "c"), 0.2, np.sqrt(17.0) / 2.0, 0.0, "c is nothing"),
    )
    kind, reason = decided(accepted=(), ranking=tried, explainable=0.6)
    assert kind == NONE_OF_THESE
    assert reason == (
        "the best set tried, a + c, leaves 0.50 of the held-out gap and is rejected (c is "
        "nothing); a black-box reference could explain 60%"
    )
    assert decided(accepted=(), ranking=tried, explainable=-0.6)[1].endswith("could explain 0%")


def test_a_cause_explains_a_least_share_and_more_where_much_is_left(decided):
    assert decided(phi=0.5, floor_multiple=1.5, explainable=0.5)[0] == NAMED_WITH_REMAINDER
    kind, reason = decided(phi=0.49, floor_multiple=1.5, explainable=0.5)
    assert kind == NONE_OF_THESE
    assert reason == (
        "the best set, a, explains 49% of the gap and leaves 1.5 times the noise floor; "
        "a cause explains at least 50% then"
    )
    assert decided(phi=0.875, floor_multiple=1.6)[0] == NAMED_WITH_REMAINDER
    kind, reason = decided(phi=0.87, floor_multiple=1.6, accepted=("a", "b"))
    assert kind == NONE_OF_THESE
    assert "the best set, a + b, explains 87% of the gap and leaves 1.6 times" in reason
    assert "a cause explains at least 88% then" in reason


def test_what_a_flexible_model_learns_far_better_is_none_of_the_library(decided):
    # Three quarters of 3/4, and of one where the flexible model claims more than the whole gap.
    assert decided(phi=0.5625, explainable=0.75)[0] == NAMED
    kind, reason = decided(phi=0.56, explainable=0.75)
    assert kind == NONE_OF_THESE
    figures, meaning = reason.split(": ")
    assert figures == "the best set explains 56% of the gap, a black-box reference 75%"
    assert meaning == "it can be learnt, but not by this library"
    assert decided(phi=0.75, explainable=4.0)[0] == NAMED
    assert decided(phi=0.74, explainable=4.0)[0] == NONE_OF_THESE


def test_a_class_of_several_effects_is_aliased_where_a_rival_predicts_as_well(decided):
    kind, reason = decided(classes=(("x",), ("a", "b")), rivals=RIVALS)
    assert (kind, reason) == (ALIASED, "b, c + d predicts held-out records as well")
    assert decided(classes=(("a", "b"),))[0] == NAMED
    assert decided(classes=(("a",),), rivals=RIVALS)[0] == NAMED


def test_parameters_that_move_between_folds_are_not_named(decided, search):
    score = search.score(("a",))
    moved = forward_selection(search.problem, LIMITS)
    moved.scores.update(search.scores)
    moved.scores[("a",)] = replace(score, theta_by_fold=score.theta_by_fold * [[1.0, 2.0]])
    assert decided(scores=moved) == (
        NONE_OF_THESE,
        "the parameters of the best set change from fold to fold beyond their error",
    )
    # An alias is told first: members of a class trade with one another.
    assert decided(scores=moved, classes=(("a", "b"),), rivals=RIVALS)[0] == ALIASED


def test_a_class_with_too_little_stacking_weight_is_aliased_with_its_rivals(decided):
    assert decided(weight=0.75, rivals=RIVALS)[0] == NAMED
    kind, reason = decided(weight=0.74, rivals=RIVALS)
    assert kind == ALIASED
    assert reason == "the class holds 0.74 of the stacking weight; b, c + d is as good"
    assert decided(weight=0.74)[0] == NAMED


def test_nothing_is_named_where_a_negative_control_shrinks_the_gap_too(decided):
    # Three quarters of what the set shrinks: 1 - 0.5² = 0.75 (1 - 0²).
    assert decided(negative_control_rho=0.5)[0] == NAMED
    kind, reason = decided(negative_control_rho=0.49)
    assert kind == NONE_OF_THESE
    assert reason == "a negative control shrinks the gap to 0.49 too: the records allow no naming"
    # 0.75 (1 - 0.5²) = 0.5625 = 1 - 0.66²
    assert decided(negative_control_rho=0.67, rho=0.5)[0] == NAMED
    assert decided(negative_control_rho=0.65, rho=0.5)[0] == NONE_OF_THESE
    assert decided(negative_control_rho=0.49, phi=0.96875)[0] == NAMED


def diagnosed(*args, **options):
    limits = Thresholds(bootstrap_samples=40, fewest_samples=20)
    problem = linear_problem(*args, **options)
    return diagnose(problem, campaign="toy", kind="element", thresholds=limits)


def test_a_whole_diagnosis_reaches_every_verdict():
    named = diagnosed({"a": 3.0, "b": 5.0})
    assert (named.verdict, named.attribution.effects) == (NAMED, ("b", "a"))
    assert named.attribution.parameters["a"]["x"].value == pytest.approx(3.0)
    # With 2 outside the library: 8² of 8² + 2² is explained, the root of 1 + 2² is left.
    remainder = diagnosed({"a": 8.0, "outside": 2.0})
    assert (remainder.verdict, remainder.attribution.effects) == (NAMED_WITH_REMAINDER, ("a",))
    assert remainder.reason.startswith("explains 94.1% of the gap")
    assert remainder.reason.endswith("what is left is 2.2 times the noise floor")
    aliased = diagnosed({"a": 5.0}, {"a": {"a": 1.0}, "b": {"a": -1.0}, "c": {"c": 1.0}})
    assert (aliased.verdict, aliased.attribution.aliases) == (ALIASED, (("a", "b"),))
    assert aliased.attribution.discriminating_experiment == "isolate a"
    assert diagnosed({"outside": 5.0}).verdict == NONE_OF_THESE
    assert diagnosed({}).verdict == AT_NOISE_FLOOR
    absorbed = diagnosed({"outside": 5.0}, {"a": {"baseline": 1.0}, "b": {"baseline": 2.0}})
    assert absorbed.verdict == NOT_DIAGNOSABLE


def test_a_whole_diagnosis_names_nothing_else_than_what_is_there():
    for verdict_given in (diagnosed({"outside": 5.0}), diagnosed({}), diagnosed({"baseline": 5.0})):
        assert verdict_given.attribution.effects == ()


def test_a_flexible_model_tells_what_could_be_learnt_of_a_cause_outside_the_library():
    # 1 + 4² floors before; the flexible model leaves one: 16/17.
    known = diagnosed({"outside": 4.0}, flexible=("outside",))
    assert known.attribution.explainable == pytest.approx(16.0 / 17.0, rel=1e-3)
    assert known.reason.endswith("a black-box reference could explain 94%")
    # Named alone, the larger of two causes would leave what the flexible model can learn.
    short = diagnosed({"a": 8.0, "outside": 4.6}, flexible=("outside", "a"))
    assert short.verdict == NONE_OF_THESE
    assert "a cause explains at least 91% then" in short.reason
