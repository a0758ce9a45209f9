"""The verdict of fitted laws and classes: which is given, on which side of each limit, and why."""

import math
from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOT_VISIBLE,
    NOTHING,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.law_fits import Selection
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMED_WITH_REMAINDER,
    NO_INTERVAL,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    GapReduction,
    RankedSet,
    SelectionStep,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.verdict import verdict_of
from tests.diagnosis.class_answers import no_class
from tests.diagnosis.inference.toy_problem import linear_problem, with_answers

HOLDERS = {
    "cube": ("spring",),
    "quintic": ("spring",),
    "coulomb": ("friction", "loop"),
    "slider": ("loop",),
}
RIVALS = (("b",), ("c", "d"))


# Laws alone, where the records are too short for a table of classes


#: Binary fractions and squares of them: a limit can be met exactly.
LIMITS = Thresholds(
    floor_ratio=1.5**2,
    floor_ratio_estimated=2.0**2,
    named_share=0.5,
    remainder=1.25,
)
FLOOR = 2.0
#: A gap of ten floors of which one law leaves 1.1; every test changes one thing of it.
CLEAR = GapReduction(
    rms_before=10.0 * FLOOR,
    rms_after=1.1 * FLOOR,
    noise_floor=FLOOR,
    rho=0.0,
    rho_ci95=NO_INTERVAL,
    phi=0.9375,
    phi_ci95=NO_INTERVAL,
    floor_multiple=1.1,
    extrapolation_rho=1.0,
    steps=(),
    cells_before=(),
    cells_after=(),
    validation=(),
)


def decided(
    *,
    accepted=("a",),
    rivals=(),
    measured=True,
    ranking=(),
    classes=None,
    limits=LIMITS,
    **reduction,
):
    result = verdict_of(
        Selection(accepted, rivals, ranking),
        replace(CLEAR, **reduction),
        classes,
        limits,
        floor_is_measured=measured,
    )
    assert result.effects == (() if result.verdict in (NONE_OF_THESE, AT_NOISE_FLOOR) else accepted)
    return result.verdict, result.reason


def test_a_cause_that_leaves_noise_is_named():
    kind, reason = decided()
    assert kind == NAMED
    explained, remainder = reason.split("; ")
    assert (
        explained == "a explains 93.8% of the gap above the floor (mean square) on held-out records"
    )
    assert remainder == "what remains is 1.10 times the noise floor"


def test_a_remainder_is_reported_above_its_limit_only():
    assert decided(floor_multiple=1.25)[0] == NAMED
    kind, reason = decided(floor_multiple=1.3)
    assert kind == NAMED_WITH_REMAINDER
    assert reason.endswith("what remains is 1.3 times the noise floor")
    assert reason.startswith("a explains 93.8% of the gap above the floor (mean square)")


def test_a_gap_of_a_measured_floor_is_at_it_whatever_was_accepted():
    at_limit = decided(rms_before=1.5 * FLOOR)
    assert at_limit[0] == AT_NOISE_FLOOR
    assert at_limit[1] == "the held-out gap is 2.250 times the mean square of the noise floor"
    assert decided(rms_before=1.501 * FLOOR)[0] == NAMED


def test_a_gap_of_an_estimated_floor_is_at_it_where_nothing_was_accepted():
    learnt = {"classes": answer(NO_CLASS), "accepted": ()}
    assert decided(rms_before=2.0 * FLOOR, measured=False, **learnt)[0] == AT_NOISE_FLOOR
    assert decided(rms_before=2.001 * FLOOR, measured=False, **learnt)[0] == NONE_OF_THESE
    # Laws must explain what is a gap above a known floor.
    small = {"rms_before": 1.2 * FLOOR, "measured": False}
    assert decided(rms_after=0.4 * FLOOR, **small)[0] == NAMED
    assert decided(rms_after=0.5 * FLOOR, **small)[0] == AT_NOISE_FLOOR
    # The wider limit is that of an estimated floor alone.
    assert decided(rms_before=1.9 * FLOOR, **learnt)[0] == NONE_OF_THESE


def test_a_gap_of_which_no_class_learns_anything_is_coloured_noise():
    limits = replace(LIMITS, floor_ratio_estimated=1.5**2)
    coloured = {"rms_before": 1.73 * FLOOR, "accepted": (), "classes": answer(NOTHING)}
    coloured |= {"measured": False, "limits": limits}
    kind, reason = decided(**coloured)
    assert kind == AT_NOISE_FLOOR
    assert reason.startswith("the held-out gap is 2.99 times the mean square of the noise floor")
    assert "no class learns anything of it" in reason
    assert decided(**{**coloured, "classes": None})[0] == AT_NOISE_FLOOR
    assert decided(**{**coloured, "rms_before": 1.74 * FLOOR})[0] == NONE_OF_THESE
    assert decided(**{**coloured, "classes": answer(NO_CLASS)})[0] == NONE_OF_THESE
    assert decided(**{**coloured, "accepted": ("cube",)})[0] == NAMED
    # Correlated samples leave the square of a noise whose size is known as it is.
    assert decided(**{**coloured, "measured": True})[0] == NONE_OF_THESE


def test_without_noise_no_gap_is_at_the_floor():
    assert decided(noise_floor=0.0, rms_before=1e-9)[0] == NAMED


def test_where_nothing_is_accepted_the_best_set_fitted_is_reported():
    fitted = (
        RankedSet(("a", "c"), np.sqrt(17.0) / 2.0, "c is nothing"),
        RankedSet(("b",), 3.0, "b is worse"),
    )
    before = np.sqrt(17.0)
    kind, reason = decided(accepted=(), ranking=fitted, rms_before=before, noise_floor=1.0)
    assert kind == NONE_OF_THESE
    assert reason == (
        "the best laws fitted, a + c, leave 0.50 of the held-out gap and are refused (c is nothing)"
    )
    assert decided(accepted=())[1] == "no law of the library acts on these records"


def test_a_cause_explains_a_least_share():
    assert decided(phi=0.5, floor_multiple=1.5)[0] == NAMED_WITH_REMAINDER
    kind, reason = decided(phi=0.49, floor_multiple=1.6, accepted=("a", "b"))
    assert kind == NONE_OF_THESE
    assert reason == (
        "the best laws, a + b, explain 49% of the gap and leave 1.6 times the noise floor; "
        "a cause explains at least 50%"
    )


def test_laws_are_aliased_where_a_rival_predicts_as_well():
    assert decided(rivals=RIVALS) == (ALIASED, "b, c + d predicts held-out records as well")


# Classes and laws


def reduction(phi, **changed):
    made = GapReduction(
        rms_before=2.0,
        rms_after=0.5,
        noise_floor=0.1,
        rho=0.25,
        rho_ci95=(0.2, 0.3),
        phi=phi,
        phi_ci95=(0.9, 1.0),
        floor_multiple=1.2,
        extrapolation_rho=0.3,
        steps=(),
        cells_before=(),
        cells_after=(),
        validation=(),
    )
    return replace(made, **changed)


def finding(name, share=0.99, law="", law_share=0.5, is_named=False):
    return ClassFinding(name, share, (share - 0.01, share + 0.01), law, law_share, is_named)


def answer(state=NAMED_CLASS, classes=(), ties=(), share=0.99, learnable=0.99, learnt_by=()):
    return ClassAnswer(
        state=state,
        classes=tuple(classes),
        ties=ties,
        rivals={},
        share=share,
        share_ci95=(share - 0.01, share + 0.01),
        learnable=learnable,
        learnt_by=learnt_by,
        law_share=0.5,
        classes_of_law=HOLDERS,
    )


def joint(class_answer, laws=(), phi=0.99, *, rivals=(), **changed):
    """Verdict where laws that leave 1.2 floors are accepted."""
    return verdict_of(
        Selection(laws, rivals, ()),
        reduction(phi, **changed),
        class_answer,
        Thresholds(),
        floor_is_measured=True,
    )


def at_floor(class_answer):
    """Verdict where the gap is that of the noise."""
    return joint(class_answer, noise_floor=2.0)


def test_a_law_of_the_named_class_is_named_and_how_far_is_of_the_law():
    spring = answer(classes=[finding("spring", law="cube", is_named=True)])
    for verdict, changed in (
        (NAMED, {}),
        (NAMED_WITH_REMAINDER, {"floor_multiple": 5.0}),
        (ALIASED, {"rivals": (("quintic",),)}),
    ):
        result = joint(spring, ("cube",), **changed)
        assert (result.verdict, result.effects) == (verdict, ("cube",))
        assert result.reduction.rho == 0.25


def test_a_law_far_behind_its_class_is_the_nearest_only_and_how_far_is_of_the_class():
    result = joint(answer(classes=[finding("spring", law="cube")]), ("cube",), phi=0.9)
    assert (result.verdict, result.effects) == (CLASS_NAMED, ())
    # A hundredth of the gap's square of 4 - 0.01, above the floor of 0.1.
    assert result.reduction.rms_after == pytest.approx(math.sqrt(0.01 + 0.01 * 3.99))
    assert result.reduction.rho == pytest.approx(result.reduction.rms_after / 2.0)
    assert result.reduction.floor_multiple == pytest.approx(result.reduction.rms_after / 0.1)
    low, high = (math.sqrt(0.01 + share * 3.99) / 2.0 for share in (0.0, 0.02))
    assert result.reduction.rho_ci95 == pytest.approx((low, high))
    assert result.answer.classes[0].law == "cube"
    assert not result.answer.classes[0].law_named


@pytest.mark.parametrize(
    ("shapes", "measured", "verdict"),
    [
        (0.16, (), CLASS_NAMED),
        (0.16, ("cube",), NAMED_WITH_REMAINDER),  # A law of a file
        (0.35, (), NAMED_WITH_REMAINDER),
        (None, (), NAMED_WITH_REMAINDER),
    ],
)
def test_a_law_that_leaves_far_more_than_its_simulated_class_is_the_nearest_only(
    shapes, measured, verdict
):
    # Mean squares above that of the floor: 0.09 of the law, 0.016 or 0.11 of the class.
    spring = answer(classes=[finding("spring", law="cube", is_named=True)])
    remaining = {"rms_after": math.sqrt(0.1), "floor_multiple": math.sqrt(10.0)}
    of_law = reduction(0.99, **remaining)
    of_class = shapes and reduction(0.999, rms_after=shapes, floor_multiple=shapes / 0.1)
    result = verdict_of(
        Selection(("cube",), (), ()),
        of_law,
        spring,
        Thresholds(),
        floor_is_measured=True,
        by_shapes=lambda answer: of_class,
        measured=measured,
    )
    assert result.verdict == verdict
    assert result.effects == (() if verdict == CLASS_NAMED else ("cube",))
    assert result.reduction is (of_class if verdict == CLASS_NAMED else of_law)


@pytest.mark.parametrize(
    ("remaining_rms", "shapes", "verdict"),
    [
        (0.11, "explains 0% of the gap", NAMED),
        (0.11, 0.2, NAMED),
        (0.11, 0.112, CLASS_NAMED),
        (0.11, None, CLASS_NAMED),
        (0.2, "explains 0% of the gap", CLASS_NAMED),
    ],
)
def test_a_law_at_the_noise_stands_where_the_simulator_refuses_a_further_class(
    remaining_rms, shapes, verdict
):
    """Dry friction that stops the mass is, in force space, a class more."""
    pair = answer(classes=[finding("spring", law="cube"), finding("friction", law="coulomb")])
    of_law = reduction(0.999, rms_after=remaining_rms, floor_multiple=remaining_rms / 0.1)
    if isinstance(shapes, float):
        shapes = reduction(0.99, rms_after=shapes, floor_multiple=shapes / 0.1)
    result = verdict_of(
        Selection(("coulomb",), (), ()),
        of_law,
        pair,
        Thresholds(),
        floor_is_measured=True,
        by_shapes=lambda answer: shapes,
    )
    assert (result.verdict, result.effects) == (
        verdict,
        ("coulomb",) if verdict == NAMED else (),
    )


@pytest.mark.parametrize(
    ("phi", "verdict"), [(-0.56, NONE_OF_THESE), (0.49, NONE_OF_THESE), (0.51, CLASS_NAMED)]
)
def test_a_class_whose_shape_explains_little_once_it_is_simulated_is_none(phi, verdict):
    """In force space, with the motion as measured, damping explains what it cannot cause."""
    result = verdict_of(
        Selection((), (), ()),
        reduction(0.0),
        answer(classes=[finding("damping")]),
        Thresholds(),
        floor_is_measured=True,
        by_shapes=lambda answer: reduction(phi),
    )
    assert result.verdict == verdict
    assert "-5" not in result.reason


def test_what_a_class_leaves_lies_between_the_floor_and_the_gap():
    full = joint(answer(classes=[finding("spring")], share=1.02)).reduction
    assert (full.rms_after, full.floor_multiple) == pytest.approx((0.1, 1.0))
    # A floor that is not known, or said to be above all that was measured.
    result = answer(classes=[finding("spring")])
    none = joint(result, phi=0.5, noise_floor=0.0)
    assert none.reduction.rho == pytest.approx(0.1)
    assert none.reduction.floor_multiple == math.inf
    loud = joint(result, phi=0.5, noise_floor=3.0)
    assert loud.reduction.rho == 1.0


@pytest.mark.parametrize("before", [0.0, math.inf])
def test_without_a_gap_that_is_a_number_a_class_tells_its_share_alone(before):
    result = answer(classes=[finding("spring")])
    shrunk = joint(result, phi=0.5, rms_before=before).reduction
    assert shrunk.phi == 0.99
    assert (shrunk.rms_after, shrunk.rho) == (0.5, 0.25)


def test_a_law_of_another_class_is_not_named():
    result = joint(answer(classes=[finding("friction", law="coulomb")]), ("cube",))
    assert (result.verdict, result.effects) == (CLASS_NAMED, ())
    assert result.answer.ids == ("friction",)


def test_a_class_is_named_where_no_law_is():
    result = joint(answer(classes=[finding("spring")]), phi=0.3)
    assert result.verdict == CLASS_NAMED
    assert "spring explains 99.0%" in result.reason


def test_one_law_of_a_pair_does_not_name_the_pair():
    pair = answer(classes=[finding("spring", 0.7, "cube"), finding("loop", 0.29)])
    assert joint(pair, ("cube",)).effects == ()
    half = answer(classes=[finding("spring", 0.7, "cube", 0.7, True), finding("loop", 0.29)])
    result = joint(half, ("cube",))
    assert (result.verdict, result.effects) == (CLASS_NAMED, ("cube",))
    both = joint(pair, ("cube", "slider"))
    assert (both.verdict, both.effects) == (NAMED, ("cube", "slider"))


def test_a_tie_is_aliased_unless_a_named_law_lies_in_one_of_its_classes():
    tie = answer(classes=[finding("friction")], ties=(("loop",),))
    plain = joint(tie, phi=0.4)
    assert (plain.verdict, plain.effects) == (ALIASED, ())
    settled = joint(tie, ("slider",))
    assert (settled.verdict, settled.effects) == (NAMED, ("slider",))
    assert settled.answer.ids == ("loop",)
    assert settled.answer.ties == (("friction",),)


def test_a_law_in_all_tied_classes_stays_where_the_tie_is_not_settled():
    tie = answer(classes=[finding("friction")], ties=(("loop",),))
    result = joint(tie, ("coulomb",), phi=0.8)
    assert (result.verdict, result.effects) == (ALIASED, ("coulomb",))


def test_a_leading_class_names_no_law_unless_that_leaves_no_more_than_noise():
    leading = answer(LEADING_CLASS, [finding("spring", 0.6, "cube")], share=0.6)
    result = joint(leading, phi=0.5)
    assert (result.verdict, result.effects) == (CLASS_NAMED, ())
    assert joint(leading, ("cube",), phi=0.75).verdict == CLASS_NAMED
    assert joint(leading, ("cube",), phi=0.75, floor_multiple=1.1).verdict == NAMED


def test_without_a_class_laws_are_believed_only_where_they_explain_more_than_every_class():
    blind = answer(NO_CLASS, share=0.3, learnable=0.92)
    refused = joint(blind, ("coulomb",), phi=0.9)
    assert (refused.verdict, refused.effects) == (NONE_OF_THESE, ())
    believed = joint(blind, ("coulomb",), phi=0.95)
    assert (believed.verdict, believed.effects) == (NAMED, ("coulomb",))
    assert believed.answer.ids == ("friction",)
    assert joint(blind).verdict == NONE_OF_THESE


def test_nothing_stays_at_the_floor_and_a_law_that_only_the_simulation_shows_has_its_class():
    nothing = answer(NOTHING, share=float("nan"))
    assert at_floor(nothing).verdict == AT_NOISE_FLOOR
    result = joint(nothing, ("cube",))
    assert (result.verdict, result.answer.ids) == (NAMED, ("spring",))


def test_records_that_show_no_element_allow_no_diagnosis_unless_a_law_is_simulated():
    unseen = replace(answer(NOT_VISIBLE, share=float("nan")), note="the mass sticks")
    result = joint(unseen)
    assert (result.verdict, result.reason, result.effects) == (
        NOT_DIAGNOSABLE,
        "the mass sticks",
        (),
    )
    assert at_floor(unseen).verdict == AT_NOISE_FLOOR
    # While dry friction sticks no class sees it, and the simulation does.
    assert joint(unseen, ("coulomb",)).answer.ids == ("friction",)


def test_a_second_law_that_its_class_can_learn_beside_the_answer_is_named_too():
    result = joint(
        answer(
            classes=[finding("spring", 0.98, "cube", 0.98, True)],
            share=0.98,
            learnable=0.995,
            learnt_by=("loop",),
        ),
        ("cube", "slider"),
    )
    assert result.effects == ("cube", "slider")
    assert result.answer.ids == ("spring", "loop")


def test_shares_never_exceed_one():
    result = joint(answer(classes=[finding("spring", 1.02)], share=1.02), phi=0.2)
    assert result.reduction.phi == 1.0
    assert "100.0%" in result.reason
    assert replace(result.answer, share=3.2).beyond_share == 0.0


def test_a_small_second_cause_that_the_simulation_shows_is_named_beside_the_class():
    spring = answer(classes=[finding("spring", share=0.996, law="cube", law_share=0.996)])
    spring = replace(spring, share=0.996)
    result = joint(spring, ("cube", "coulomb"), phi=0.9999)
    assert (result.verdict, result.effects) == (NAMED, ("cube", "coulomb"))
    assert result.answer.ids == ("spring", "friction")
    # A further law that leaves as much as the class alone is no second cause.
    assert joint(spring, ("cube", "coulomb"), phi=0.997).verdict == CLASS_NAMED


def test_a_class_that_only_leads_does_not_overrule_records_met_to_their_noise():
    leading = answer(LEADING_CLASS, [finding("spring", share=0.6)], share=0.6)
    result = at_floor(leading)
    assert (result.verdict, result.answer.state) == (AT_NOISE_FLOOR, NOTHING)
    assert result.answer.classes == ()
    named = answer(classes=[finding("spring", share=0.9)], share=0.9)
    assert at_floor(named).verdict == CLASS_NAMED


def test_of_laws_and_classes_scored_alike_laws_stand_unless_a_class_explains_a_second_cause_more():
    friction = replace(answer(classes=[finding("friction")]), same_scores=True)
    floor = at_floor(friction)
    assert (floor.verdict, floor.answer.state) == (AT_NOISE_FLOOR, NOTHING)
    near = joint(friction, ("coulomb",), phi=0.97)
    assert (near.verdict, near.effects, near.answer.ids) == (NAMED, ("coulomb",), ("friction",))
    assert joint(friction, ("coulomb",), phi=0.9).verdict == CLASS_NAMED
    assert joint(friction, phi=0.97).verdict == CLASS_NAMED
    # What leaves no more than noise is believed however much more a class learns.
    assert joint(friction, ("coulomb",), phi=0.9, floor_multiple=1.0).verdict == NAMED


@pytest.mark.parametrize("floors", [1.0, 1.2])
def test_a_law_of_another_class_stands_only_where_it_explains_what_the_class_does(floors):
    """Planets that pass are not named for lobes that explain more, however small the gap."""
    friction = replace(answer(classes=[finding("friction")]), same_scores=True)
    behind = joint(friction, ("cube",), phi=0.985, floor_multiple=floors)
    assert (behind.verdict, behind.answer.ids) == (CLASS_NAMED, ("friction",))
    ahead = joint(friction, ("cube",), phi=0.991, floor_multiple=floors)
    assert (ahead.verdict, ahead.effects, ahead.answer.ids) == (NAMED, ("cube",), ("spring",))


def test_of_the_classes_of_a_law_that_stands_the_one_that_was_seen_is_its_own():
    loop = replace(answer(classes=[finding("loop")]), same_scores=True)
    assert joint(loop, ("coulomb",)).answer.ids == ("loop",)
    nothing = replace(answer(NOTHING), rivals={"spring": 0.9, "loop": 0.4})
    result = joint(nothing, ("cube",))
    assert result.answer.rivals == {"loop": 0.4}


def test_a_further_law_of_no_class_is_no_small_second_cause():
    spring = answer(classes=[finding("spring", share=0.99, law="cube")])
    assert joint(spring, ("cube", "of_a_user"), phi=0.9999).verdict == CLASS_NAMED


def test_the_law_of_a_class_is_not_named_beside_a_law_of_no_class():
    spring = answer(classes=[finding("spring", law="cube", is_named=True)])
    result = joint(spring, ("cube", "of_a_user"))
    assert (result.verdict, result.effects) == (CLASS_NAMED, ())


def test_one_law_of_a_leading_pair_is_not_named():
    pair = [finding("spring", 0.5, "cube", 0.5, True), finding("loop", 0.2)]
    result = joint(answer(LEADING_CLASS, pair, share=0.7), ("cube",), phi=0.6)
    assert (result.verdict, result.effects) == (CLASS_NAMED, ())


def test_a_class_keeps_its_nearest_law_where_that_is_named_and_else_takes_the_named_one():
    near_quintic = answer(classes=[finding("spring", law="quintic")])
    assert joint(near_quintic, ("cube",)).answer.classes[0].law == "cube"
    near_cube = answer(classes=[finding("spring", law="cube")])
    assert joint(near_cube, ("quintic", "cube")).answer.classes[0].law == "cube"


def test_the_reason_of_a_class_tells_its_share_and_the_nearest_laws():
    spring, loop = finding("spring", 0.7, "cube", 0.75), finding("loop", 0.29, "slider", 1.25)
    explained = "explains 99.0% of the gap above the floor (mean square) on held-out records"
    assert joint(answer(classes=[finding("spring")])).reason == f"spring {explained}"
    result = joint(answer(classes=[spring, loop]))
    assert result.reason == f"spring with loop {explained}; nearest law cube 75%, slider 100%"
    ties = (("loop",), ("friction", "loop"))
    tied = joint(answer(classes=[finding("spring")], ties=ties))
    assert tied.reason == (
        f"spring {explained}; loop, friction with loop predicts held-out records as well"
    )


def test_the_reason_against_a_law_tells_what_classes_explain_and_could_learn():
    blind = answer(NO_CLASS, share=0.3, learnable=0.95)
    assert joint(blind, ("cube", "slider"), phi=0.9).reason == (
        "the best class explains 30% of the gap in force space, so that cube with slider is no "
        "cause of it; all classes together learn 95%"
    )
    worse = answer(NO_CLASS, share=-0.5, learnable=1.25)
    reason = joint(worse, ("cube",), phi=0.9).reason
    assert reason.startswith("the best class explains 0% of the gap")
    assert reason.endswith("all classes together learn 100%")


def test_the_reason_where_records_mix_classes_says_that_classes_explain_the_gap():
    mixed = answer(NO_CLASS, share=1.02, learnable=1.02)
    text = "classes explain 100% of the gap, and these records do not show which; "
    against = joint(mixed, ("cube", "slider"), phi=0.93)
    assert against.reason == f"{text}the best laws, cube with slider, explain 93%"
    assert against.verdict == NONE_OF_THESE
    alone = joint(mixed, (), phi=0.0)
    assert alone.reason.startswith(text)


def test_classes_of_laws_that_stand_together_share_out_what_went_as_each_was_added():
    nothing = answer(NOTHING)
    steps = [("baseline", 2.0), ("cube", 1.0), ("coulomb", 0.6), ("quintic", 0.5)]
    steps = tuple(SelectionStep(name, rms, rms / 2.0, (0.0, 1.0)) for name, rms in steps)
    laws = ("cube", "coulomb", "quintic")
    result = joint(nothing, laws, phi=0.98, steps=steps).answer.classes
    # Of 4 - 0.25 = 3.75 both springs take 3 and 0.11, the friction 0.64.
    shares = {entry.id: entry.share for entry in result}
    assert shares == pytest.approx({"spring": 0.98 * 3.11 / 3.75, "friction": 0.98 * 0.64 / 3.75})
    assert sum(entry.share_ci95[0] for entry in result) == pytest.approx(0.9)


# A diagnosis from the records to the verdict


def diagnosed(*args, sets=(), **options):
    """Diagnosis of a linear problem; where a table proposes sets of laws, of those."""
    limits = Thresholds(bootstrap_samples=40, fewest_samples=20)
    problem = linear_problem(*args, **options)
    if sets:
        problem = with_answers(problem, class_answer=no_class(*sets))
    return diagnose(problem, campaign="toy", kind="element", thresholds=limits)


def test_every_verdict_of_laws_is_reached_from_records():
    named = diagnosed({"a": 3.0, "b": 5.0}, sets=(("a",), ("b",), ("a", "b")))
    assert (named.verdict, named.attribution.effects) == (NAMED, ("b", "a"))
    assert named.attribution.parameters["a"]["x"].value == pytest.approx(3.0)
    # With 2 outside the library: 8² of 8² + 2² is explained, the root of 1 + 2² is left.
    remainder = diagnosed({"a": 8.0, "outside": 2.0})
    assert (remainder.verdict, remainder.attribution.effects) == (NAMED_WITH_REMAINDER, ("a",))
    assert remainder.reason.startswith("a explains 94.1% of the gap")
    assert remainder.reason.endswith("what remains is 2.2 times the noise floor")
    aliased = diagnosed({"a": 5.0}, {"a": {"a": 1.0}, "b": {"a": -1.0}, "c": {"c": 1.0}})
    assert (aliased.verdict, aliased.attribution.aliases) == (ALIASED, (("a", "b"),))
    assert aliased.attribution.discriminating_experiment == "isolate a"
    assert diagnosed({"outside": 5.0}).verdict == NONE_OF_THESE
    assert diagnosed({}).verdict == AT_NOISE_FLOOR


def test_nothing_is_named_than_what_is_there():
    absorbed = {"a": {"baseline": 1.0}, "b": {"baseline": 2.0}}
    for given in (
        diagnosed({"outside": 5.0}),
        diagnosed({}),
        diagnosed({"baseline": 5.0}),
        diagnosed({"outside": 5.0}, absorbed),
    ):
        assert given.attribution.effects == ()
