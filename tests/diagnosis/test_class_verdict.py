"""The table of verdicts: class, law, what is left."""

import math
from dataclasses import replace

import pytest

from carrierflex.diagnosis.class_verdict import joint_verdict
from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    NOT_VISIBLE,
    NOTHING,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMED_WITH_REMAINDER,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    GapReduction,
    SelectionStep,
)

HOLDERS = {
    "cube": ("spring",),
    "quintic": ("spring",),
    "coulomb": ("friction", "loop"),
    "slider": ("loop",),
}


def reduction(phi):
    return GapReduction(
        rms_before=2.0,
        rms_after=0.5,
        noise_floor=0.1,
        rho=0.25,
        rho_ci95=(0.2, 0.3),
        phi=phi,
        phi_ci95=(0.9, 1.0),
        floor_multiple=5.0,
        negative_control_rho=1.0,
        black_box_rho=0.2,
        extrapolation_rho=0.3,
        steps=(),
        cells_before=(),
        cells_after=(),
        validation=(),
    )


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


def joint(found, verdict=NAMED, laws=(), phi=0.99):
    return joint_verdict(verdict, "why", laws, reduction(phi), found)


def test_a_law_of_the_named_class_is_named_and_how_far_is_of_the_law():
    spring = answer(classes=[finding("spring", law="cube", is_named=True)])
    for verdict in (NAMED, NAMED_WITH_REMAINDER, ALIASED):
        found = joint(spring, verdict, ("cube",))
        assert (found.verdict, found.effects) == (verdict, ("cube",))
        assert found.reduction.rho == 0.25


def test_a_law_far_behind_its_class_is_the_nearest_only_and_how_far_is_of_the_class():
    found = joint(answer(classes=[finding("spring", law="cube")]), NAMED, ("cube",), phi=0.9)
    assert (found.verdict, found.effects) == (CLASS_NAMED, ())
    # A hundredth of the gap's square of 4 - 0.01, above the floor of 0.1.
    assert found.reduction.rms_after == pytest.approx(math.sqrt(0.01 + 0.01 * 3.99))
    assert found.reduction.rho == pytest.approx(found.reduction.rms_after / 2.0)
    assert found.reduction.floor_multiple == pytest.approx(found.reduction.rms_after / 0.1)
    low, high = (math.sqrt(0.01 + left * 3.99) / 2.0 for left in (0.0, 0.02))
    assert found.reduction.rho_ci95 == pytest.approx((low, high))
    assert found.answer.classes[0].law == "cube"
    assert not found.answer.classes[0].law_named


def test_what_a_class_leaves_lies_between_the_floor_and_the_gap():
    whole = joint(answer(classes=[finding("spring")], share=1.02), NONE_OF_THESE).reduction
    assert (whole.rms_after, whole.floor_multiple) == pytest.approx((0.1, 1.0))
    # A floor that is not known, or said to be above all that was measured.
    found = answer(classes=[finding("spring")])
    none = joint_verdict(NONE_OF_THESE, "why", (), replace(reduction(0.5), noise_floor=0.0), found)
    assert none.reduction.rho == pytest.approx(0.1)
    assert none.reduction.floor_multiple == math.inf
    loud = joint_verdict(NONE_OF_THESE, "why", (), replace(reduction(0.5), noise_floor=3.0), found)
    assert loud.reduction.rho == 1.0


@pytest.mark.parametrize("before", [0.0, math.inf])
def test_without_a_gap_that_is_a_number_a_class_tells_its_share_alone(before):
    found = answer(classes=[finding("spring")])
    plain = replace(reduction(0.5), rms_before=before)
    told = joint_verdict(NONE_OF_THESE, "why", (), plain, found).reduction
    assert told.phi == 0.99
    assert (told.rms_after, told.rho) == (plain.rms_after, plain.rho)


def test_a_law_of_another_class_is_not_named():
    found = joint(answer(classes=[finding("friction", law="coulomb")]), NAMED, ("cube",))
    assert (found.verdict, found.effects) == (CLASS_NAMED, ())
    assert found.answer.ids == ("friction",)


def test_a_class_is_named_where_no_law_is():
    found = joint(answer(classes=[finding("spring")]), NONE_OF_THESE, (), phi=0.3)
    assert found.verdict == CLASS_NAMED
    assert "spring explains 99.0%" in found.reason


def test_one_law_of_a_pair_does_not_name_the_pair():
    pair = answer(classes=[finding("spring", 0.7, "cube"), finding("loop", 0.29)])
    assert joint(pair, NAMED, ("cube",)).effects == ()
    half = answer(classes=[finding("spring", 0.7, "cube", 0.7, True), finding("loop", 0.29)])
    found = joint(half, NAMED, ("cube",))
    assert (found.verdict, found.effects) == (CLASS_NAMED, ("cube",))
    both = joint(pair, NAMED, ("cube", "slider"))
    assert (both.verdict, both.effects) == (NAMED, ("cube", "slider"))


def test_a_tie_is_aliased_unless_a_named_law_lies_in_one_of_its_classes():
    tie = answer(classes=[finding("friction")], ties=(("loop",),))
    plain = joint(tie, NONE_OF_THESE, (), phi=0.4)
    assert (plain.verdict, plain.effects) == (ALIASED, ())
    settled = joint(tie, NAMED, ("slider",))
    assert (settled.verdict, settled.effects) == (NAMED, ("slider",))
    assert settled.answer.ids == ("loop",)
    assert settled.answer.ties == (("friction",),)


def test_a_law_in_all_tied_classes_stays_where_the_tie_is_not_settled():
    tie = answer(classes=[finding("friction")], ties=(("loop",),))
    found = joint(tie, NAMED, ("coulomb",), phi=0.8)
    assert (found.verdict, found.effects) == (ALIASED, ("coulomb",))


def test_a_leading_class_names_no_law():
    leading = answer(LEADING_CLASS, [finding("spring", 0.6, "cube")], share=0.6)
    found = joint(leading, NONE_OF_THESE, (), phi=0.5)
    assert (found.verdict, found.effects) == (CLASS_NAMED, ())


def test_without_a_class_laws_are_believed_only_where_they_explain_more_than_every_class():
    blind = answer(NO_CLASS, share=0.3, learnable=0.5)
    refused = joint(blind, NAMED, ("coulomb",), phi=0.9)
    assert (refused.verdict, refused.effects) == (NONE_OF_THESE, ())
    believed = joint(blind, NAMED, ("coulomb",), phi=0.95)
    assert (believed.verdict, believed.effects) == (NAMED, ("coulomb",))
    assert believed.answer.ids == ("friction",)
    assert joint(blind, NONE_OF_THESE, ()).verdict == NONE_OF_THESE


def test_nothing_stays_at_the_floor_and_a_law_that_only_the_simulation_shows_has_its_class():
    nothing = answer(NOTHING, share=float("nan"))
    assert joint(nothing, AT_NOISE_FLOOR, ()).verdict == AT_NOISE_FLOOR
    found = joint(nothing, NAMED, ("cube",))
    assert (found.verdict, found.answer.ids) == (NAMED, ("spring",))


def test_records_that_show_no_element_allow_no_diagnosis_unless_a_law_is_simulated():
    unseen = replace(answer(NOT_VISIBLE, share=float("nan")), note="the mass sticks")
    told = joint(unseen, NONE_OF_THESE, ())
    assert (told.verdict, told.reason, told.effects) == (NOT_DIAGNOSABLE, "the mass sticks", ())
    assert joint(unseen, AT_NOISE_FLOOR, ()).verdict == AT_NOISE_FLOOR
    # While dry friction sticks no class sees it, and the simulation does.
    assert joint(unseen, NAMED, ("coulomb",)).answer.ids == ("friction",)


def test_a_second_law_that_its_class_can_learn_beside_the_answer_is_named_too():
    found = joint(
        answer(
            classes=[finding("spring", 0.98, "cube", 0.98, True)],
            share=0.98,
            learnable=0.995,
            learnt_by=("loop",),
        ),
        NAMED,
        ("cube", "slider"),
    )
    assert found.effects == ("cube", "slider")
    assert found.answer.ids == ("spring", "loop")


def test_shares_never_exceed_one():
    found = joint(answer(classes=[finding("spring", 1.02)], share=1.02), NONE_OF_THESE, (), 0.2)
    assert found.reduction.phi == 1.0
    assert "100.0%" in found.reason
    assert replace(found.answer, share=3.2).beyond_share == 0.0


def test_a_small_second_cause_that_the_simulation_shows_is_named_beside_the_class():
    spring = answer(classes=[finding("spring", share=0.996, law="cube", law_share=0.996)])
    spring = replace(spring, share=0.996)
    found = joint(spring, NAMED, ("cube", "coulomb"), phi=0.9999)
    assert (found.verdict, found.effects) == (NAMED, ("cube", "coulomb"))
    assert found.answer.ids == ("spring", "friction")
    # A further law that leaves as much as the class alone is no second cause.
    assert joint(spring, NAMED, ("cube", "coulomb"), phi=0.997).verdict == CLASS_NAMED


def test_a_class_that_only_leads_does_not_overrule_records_met_to_their_noise():
    leading = answer(LEADING_CLASS, [finding("spring", share=0.6)], share=0.6)
    found = joint(leading, AT_NOISE_FLOOR, ())
    assert (found.verdict, found.answer.state) == (AT_NOISE_FLOOR, NOTHING)
    assert found.answer.classes == ()
    named = answer(classes=[finding("spring", share=0.9)], share=0.9)
    assert joint(named, AT_NOISE_FLOOR, ()).verdict == CLASS_NAMED


def test_of_laws_and_classes_scored_alike_laws_stand_unless_a_class_explains_a_second_cause_more():
    friction = replace(answer(classes=[finding("friction")]), same_scores=True)
    floor = joint(friction, AT_NOISE_FLOOR, ())
    assert (floor.verdict, floor.answer.state) == (AT_NOISE_FLOOR, NOTHING)
    near = joint(friction, NAMED, ("cube",), phi=0.97)
    assert (near.verdict, near.effects, near.answer.ids) == (NAMED, ("cube",), ("spring",))
    assert joint(friction, NAMED, ("cube",), phi=0.9).verdict == CLASS_NAMED
    assert joint(friction, NONE_OF_THESE, (), phi=0.97).verdict == CLASS_NAMED
    # What leaves no more than noise is believed however much more a class learns.
    at_floor = replace(reduction(0.9), floor_multiple=1.0)
    assert joint_verdict(NAMED, "why", ("cube",), at_floor, friction).verdict == NAMED


def test_of_the_classes_of_a_law_that_stands_the_one_that_was_seen_is_its_own():
    loop = replace(answer(classes=[finding("loop")]), same_scores=True)
    assert joint(loop, NAMED, ("coulomb",)).answer.ids == ("loop",)
    nothing = replace(answer(NOTHING), rivals={"spring": 0.9, "loop": 0.4})
    found = joint(nothing, NAMED, ("cube",))
    assert found.answer.rivals == {"loop": 0.4}


def test_a_further_law_of_no_class_is_no_small_second_cause():
    spring = answer(classes=[finding("spring", share=0.99, law="cube")])
    assert joint(spring, NAMED, ("cube", "of_a_user"), phi=0.9999).verdict == CLASS_NAMED


def test_one_law_of_a_leading_pair_is_not_named():
    pair = [finding("spring", 0.5, "cube", 0.5, True), finding("loop", 0.2)]
    found = joint(answer(LEADING_CLASS, pair, share=0.7), NAMED, ("cube",), phi=0.6)
    assert (found.verdict, found.effects) == (CLASS_NAMED, ())


def test_a_class_keeps_its_nearest_law_where_that_is_named_and_else_takes_the_named_one():
    near_quintic = answer(classes=[finding("spring", law="quintic")])
    assert joint(near_quintic, NAMED, ("cube",)).answer.classes[0].law == "cube"
    near_cube = answer(classes=[finding("spring", law="cube")])
    assert joint(near_cube, NAMED, ("quintic", "cube")).answer.classes[0].law == "cube"


def test_the_reason_of_a_class_tells_its_share_and_the_nearest_laws():
    spring, loop = finding("spring", 0.7, "cube", 0.75), finding("loop", 0.29, "slider", 1.25)
    told = "explains 99.0% of the gap above the floor (mean square) on held-out records"
    assert joint(answer(classes=[finding("spring")]), NONE_OF_THESE).reason == f"spring {told}"
    found = joint(answer(classes=[spring, loop]), NONE_OF_THESE)
    assert found.reason == f"spring with loop {told}; nearest law cube 75%, slider 100%"
    ties = (("loop",), ("friction", "loop"))
    tied = joint(answer(classes=[finding("spring")], ties=ties), NONE_OF_THESE)
    assert tied.reason == (
        f"spring {told}; loop, friction with loop predicts held-out records as well"
    )


def test_the_reason_against_a_law_tells_what_classes_explain_and_could_learn():
    blind = answer(NO_CLASS, share=0.3, learnable=0.5)
    assert joint(blind, NAMED, ("cube", "slider"), phi=0.9).reason == (
        "the best class explains 30% of the gap in force space, so that cube with slider is no "
        "cause of it; all classes together learn 50%"
    )
    worse = answer(NO_CLASS, share=-0.5, learnable=-0.25)
    reason = joint(worse, NAMED, ("cube",), phi=0.9).reason
    assert reason.startswith("the best class explains 0% of the gap")
    assert reason.endswith("all classes together learn 0%")


def test_classes_of_laws_that_stand_together_share_out_what_went_as_each_was_added():
    nothing = answer(NOTHING)
    steps = [("baseline", 2.0), ("cube", 1.0), ("coulomb", 0.6), ("quintic", 0.5)]
    far = replace(
        reduction(0.98),
        steps=tuple(SelectionStep(name, rms, rms / 2.0, (0.0, 1.0)) for name, rms in steps),
    )
    laws = ("cube", "coulomb", "quintic")
    found = joint_verdict(NAMED_WITH_REMAINDER, "why", laws, far, nothing).answer.classes
    # Of 4 - 0.25 = 3.75 both springs take 3 and 0.11, the friction 0.64.
    shares = {own.id: own.share for own in found}
    assert shares == pytest.approx({"spring": 0.98 * 3.11 / 3.75, "friction": 0.98 * 0.64 / 3.75})
    assert sum(own.share_ci95[0] for own in found) == pytest.approx(far.phi_ci95[0])
