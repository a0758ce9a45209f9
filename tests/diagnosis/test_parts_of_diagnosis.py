"""What a diagnosis is put together from: what is missing, which effects, their tests, details."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
)
from carrierflex.diagnosis.comparison.overlay import Overlay
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.gap.findings import GapFindings, OffOrderMotion, Scalar
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    FLOOR_UNKNOWN,
    NAMED,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment
from tests.diagnosis.class_answers import no_class, one_class
from tests.diagnosis.inference.toy_problem import CellsAlone, linear_problem, with_answers

LIMITS = Thresholds(bootstrap_samples=40, fewest_samples=20)


def diagnosis_of(problem, limits=LIMITS, **options):
    return diagnose(problem, campaign="toy", kind="element", thresholds=limits, **options)


def test_what_the_records_lack_for_a_diagnosis_is_told():
    def reason_of(problem, **limits):
        given = diagnose(problem, campaign="c", kind="k", thresholds=replace(LIMITS, **limits))
        if given.verdict == NOT_DIAGNOSABLE:
            assert given.reason == given.attribution.discriminating_experiment
            assert given.reduction is None
            return given.reason
        return ""

    # Three runs of two blocks of sixteen samples.
    known = linear_problem({"a": 5.0})
    assert reason_of(known, fewest_samples=33) == (
        "run RA holds 32 samples that count; expected at least 33"
    )
    assert reason_of(known, fewest_samples=32) == ""
    blocks = linear_problem({"a": 5.0}, gains={"A": 1.0}, blocks=3)
    assert reason_of(blocks, fewest_segments=4) == (
        "the records hold 3 blocks to fit and score; expected at least 4: a longer record or "
        "another run"
    )
    assert reason_of(blocks, fewest_segments=3) == ""
    assert reason_of(linear_problem({"a": 5.0}, {})) == (
        "every effect of the library is in the baseline or excluded; there is no candidate"
    )


def test_limits_may_be_left_out():
    problem = linear_problem({"a": 5.0}, n_samples=100)
    assert diagnose(problem, campaign="c", kind="k").attribution.effects == ("a",)
    short = linear_problem({"a": 5.0}, n_samples=99)
    assert "expected at least 200" in diagnose(short, campaign="c", kind="k").reason


def test_every_step_is_told_as_it_begins():
    steps = []
    diagnosis_of(linear_problem({"a": 5.0}), note=steps.append)
    fits = [f"baseline + {name}" for name in "abcd"]
    assert steps == ["classes", "baseline", *fits, "intervals", "separating trials", "pictures"]


def test_effects_are_those_of_a_verdict_that_names_laws():
    assert diagnosis_of(linear_problem({"a": 5.0})).attribution.effects == ("a",)
    short = diagnosis_of(linear_problem({"a": 8.0, "outside": 5.9}))
    assert (short.verdict, short.attribution.effects) == (NONE_OF_THESE, ())
    # The held-out records support it all the same.
    assert [step.added for step in short.reduction.steps] == ["baseline", "a"]


def test_the_separating_test_is_of_the_first_effect_that_has_an_alias():
    effects = {"a": {"a": 1.0}, "b": {"b": 1.0}, "t": {"b": 2.0}}

    def apart(names, theta):
        problem = linear_problem({}, {"a": {"a": 1.0}, "b": {"b": 1.0}, "t": {"t": 1.0}})
        return problem.with_signals_of(names, theta)

    pairs = no_class(("a", "b"), ("a", "t"))
    problem = linear_problem({"a": 9.0, "b": 4.0}, effects)
    trials = (CandidateExperiment("a trial", apart),)
    diagnosis = diagnosis_of(with_answers(replace(problem, candidates=trials), class_answer=pairs))
    assert (diagnosis.verdict, diagnosis.attribution.aliases) == (ALIASED, (("b", "t"),))
    assert diagnosis.attribution.discriminating_experiment == (
        "to distinguish b from t, run a trial; predicted difference 4.0 times the noise; isolate b"
    )
    # Where no trial separates them, what the card says; where all are told apart nothing.
    untried = diagnosis_of(with_answers(problem, class_answer=pairs)).attribution
    assert untried.discriminating_experiment == "isolate b"
    both = with_answers(linear_problem({"a": 9.0, "b": 4.0}), class_answer=no_class(("a", "b")))
    alone = diagnosis_of(both)
    assert alone.attribution.aliases == ()
    assert alone.attribution.discriminating_experiment == ""


def test_tied_classes_without_rival_laws_have_no_separating_trial_of_laws():
    tie = replace(class_answer(NAMED_CLASS), ties=(("loop",),))
    diagnosis = diagnosis_of(with_answers(linear_problem({"outside": 5.0}), class_answer=tie))
    assert (diagnosis.verdict, diagnosis.attribution.aliases) == (ALIASED, ())
    assert diagnosis.attribution.discriminating_experiment == ""


SIGNAL = np.array([1.0, 2.0, 4.0])
OVERLAY = Overlay("RA", "q", np.arange(3.0), "time", "s", SIGNAL, SIGNAL - 1.0)


def test_signals_are_laid_over_one_another_where_a_problem_has_them():
    known = linear_problem({"a": 5.0})
    assert diagnosis_of(known).signals is None
    assert diagnosis_of(with_answers(known, overlays=())).signals is None
    both = diagnosis_of(with_answers(known, overlays=(OVERLAY,))).signals
    assert (both.before, both.after) == ((OVERLAY,), (OVERLAY,))
    none = diagnosis_of(with_answers(linear_problem({"outside": 5.0}), overlays=(OVERLAY,))).signals
    assert (none.before, none.after) == ((OVERLAY,), ())


def test_the_gap_is_looked_at_beyond_its_map():
    known = linear_problem({"a": 5.0})
    findings = GapFindings((), "orders")
    scalar = Scalar("mass", "kg", np.ones(3), np.full(3, 1.5))

    class Gap(CellsAlone):
        def findings(self):
            return findings

        def scalars(self):
            return (scalar,)

    cells = known.gap((), np.zeros(1)).cells
    detail = diagnosis_of(with_answers(known, gap=Gap(cells))).gap
    assert detail.findings is findings
    assert [entry.area_before for entry in detail.scalars] == [pytest.approx(0.5)]
    assert {cell.run for cell in detail.cells} == {"RA", "RB", "RC"}


def class_answer(state, law="", *, share=0.99):
    answer = one_class("spring", law, {"a": ("spring",)}, state=state, share=share)
    return replace(answer, law_sets=(("a",),))


def test_the_class_of_the_cause_is_told_where_a_problem_has_classes():
    known = linear_problem({"a": 5.0})
    for plain in (known, with_answers(known, class_answer=None)):
        alone = diagnosis_of(plain)
        assert (alone.verdict, alone.classes, alone.reduction_law) == (NAMED, None, None)
    both = diagnosis_of(with_answers(known, class_answer=class_answer(NAMED_CLASS, "a")))
    assert (both.verdict, both.attribution.effects) == (NAMED, ("a",))
    assert both.classes.ids == ("spring",)
    unknown = linear_problem({"outside": 5.0})
    diagnosis = diagnosis_of(with_answers(unknown, class_answer=class_answer(NAMED_CLASS)))
    assert (diagnosis.verdict, diagnosis.attribution.effects) == (CLASS_NAMED, ())
    # How far is of the class, and beside it of the laws.
    before, floor = diagnosis.reduction.rms_before, diagnosis.reduction.noise_floor
    remaining = floor**2 + 0.01 * (before**2 - floor**2)
    assert diagnosis.reduction.rho == pytest.approx(np.sqrt(remaining) / before)
    assert diagnosis.reduction_law.rho == 1.0


def line(size, explained=1.0):
    """Motion beside the orders, of a mean square that is the same in every run."""
    return OffOrderMotion(
        id="nonsynchronous/0.47X",
        label="0.47X",
        channels=("q", "p"),
        runs=("RA", "RB", "RC"),
        is_in_every_run=True,
        band_hz=(1.0, 2.0),
        mean_square=dict.fromkeys(("RA", "RB", "RC"), size),
        explained=explained,
        p_value=1e-9,
    )


def test_records_that_mix_the_classes_ask_for_others_where_no_cause_is_named():
    mixed = no_class(("a",), experiment="drive on")
    none = diagnosis_of(with_answers(linear_problem({"outside": 5.0}), class_answer=mixed))
    assert (none.verdict, none.attribution.effects) == (NONE_OF_THESE, ())
    assert none.attribution.discriminating_experiment == "drive on"
    # A law that is named beside them asks for nothing.
    law = diagnosis_of(with_answers(linear_problem({"a": 5.0}), class_answer=mixed))
    assert (law.verdict, law.attribution.discriminating_experiment) == (NAMED, "")


def test_motion_beside_the_orders_is_put_together_with_the_effects():
    known = linear_problem({"a": 5.0})
    without = diagnosis_of(with_answers(known, off_order_motions=()))
    assert (without.verdict, without.reduction_law, without.classes) == (NAMED, None, None)
    both = diagnosis_of(with_answers(known, off_order_motions=(line(16.0),)))
    assert (both.verdict, both.attribution.effects) == (CLASS_NAMED, ("a",))
    assert both.reduction_law.rms_before**2 == pytest.approx(26.0)
    assert both.reduction.rms_before**2 == pytest.approx(42.0)
    assert both.classes.ids == ("nonsynchronous/0.47X",)
    # Where neither explains the gap no effect is named.
    none = diagnosis_of(with_answers(known, off_order_motions=(line(64.0, 0.2),)))
    assert (none.verdict, none.attribution.effects) == (NONE_OF_THESE, ())
    assert both.shrinks_by_class
    assert not none.shrinks_by_class
    quiet = diagnosis_of(with_answers(linear_problem({}), off_order_motions=(line(16.0),)))
    assert quiet.verdict == CLASS_NAMED
    assert diagnosis_of(linear_problem({})).verdict == AT_NOISE_FLOOR


def test_classes_on_the_orders_and_motion_beside_them_are_told_together():
    answers = {
        "class_answer": class_answer(LEADING_CLASS, share=0.75),
        "off_order_motions": (line(16.0),),
    }
    problem = with_answers(linear_problem({"outside": 5.0}), **answers)
    diagnosis = diagnosis_of(problem)
    assert diagnosis.verdict == CLASS_NAMED
    assert diagnosis.classes.ids == ("nonsynchronous/0.47X", "spring")
    # What the laws alone do is kept through both.
    assert diagnosis.reduction_law.rho == 1.0
    assert diagnosis.reduction_law.rms_before**2 == pytest.approx(26.0)
    assert diagnosis.reduction.rms_before**2 == pytest.approx(42.0)


@pytest.mark.parametrize(
    ("signal_square", "unknown_floor", "measured", "is_earned"),
    [
        (1e4, "", False, True),
        (1e4, "", True, True),
        # A plateau that lies far below what no class learns.
        (1e4, "filtered", False, False),
        # An estimated noise of half the signal is as good a cause; a declared one is a statement.
        (200.0, "", False, False),
        (200.0, "", True, True),
    ],
)
def test_agreement_is_said_of_a_noise_that_is_known_and_small(
    signal_square, unknown_floor, measured, is_earned
):
    quiet = type(
        "Quiet",
        (type(linear_problem({})),),
        {"signal_square": signal_square, "unknown_floor": unknown_floor},
    )
    diagnosis = diagnosis_of(quiet(**vars(linear_problem({}))), floor_is_measured=measured)
    if is_earned:
        assert (diagnosis.verdict, diagnosis.reason_id) == (AT_NOISE_FLOOR, "")
        return
    assert (diagnosis.verdict, diagnosis.reason_id) == (NOT_DIAGNOSABLE, FLOOR_UNKNOWN)
    share = 6 * 16 / signal_square
    assert diagnosis.reason.startswith(f"the baseline leaves {100 * share:.2g} % of the signal")
    assert "declare noise_std" in diagnosis.attribution.discriminating_experiment


@pytest.mark.parametrize(
    ("cause", "measured", "learnable", "is_open"),
    [
        # A mean square of 5 floors may be noise with a memory, one of 10 is none.
        (2.0, False, 0.4, True),
        (3.0, False, 0.4, False),
        (2.0, True, 0.4, False),
        # Classes together explain more than half of it: noise is not learnt.
        (2.0, False, 0.6, False),
    ],
)
def test_a_gap_that_noise_of_unknown_size_may_be_is_of_no_unknown_cause(
    cause, measured, learnable, is_open
):
    answer = replace(no_class(), share=0.4, learnable=learnable)
    problem = with_answers(linear_problem({"outside": cause}), class_answer=answer)
    diagnosis = diagnosis_of(problem, floor_is_measured=measured)
    expected = (NOT_DIAGNOSABLE, FLOOR_UNKNOWN) if is_open else (NONE_OF_THESE, "")
    assert (diagnosis.verdict, diagnosis.reason_id) == expected
