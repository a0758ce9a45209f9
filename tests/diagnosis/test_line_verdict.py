"""Verdict of a gap of which a part is motion between the shaft's orders, in numbers made by "
"hand."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import OffOrderMotion
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    BlockScore,
    GapReduction,
    RunValidation,
)
from carrierflex.diagnosis.line_verdict import with_lines
from carrierflex.diagnosis.verdict import Verdict


def motion(name, explained, *, channels=("x", "y"), **mean_square):
    return OffOrderMotion(
        id=f"nonsynchronous/{name}",
        label=name,
        channels=channels,
        runs=tuple(mean_square),
        is_in_every_run=len(mean_square) == 2,
        band_hz=(1.0, 2.0),
        mean_square=mean_square,
        explained=explained,
        p_value=1e-9,
    )


def cell(coherent, frequency_hz=None):
    return GapCell("x", 1.0, "A", coherent + 1.0, coherent, 0.5, (0.4, 0.6), 1e-4, frequency_hz)


#: Run A is three times as long as B. On the orders a gap of 9 - 1 = 8 above the floor, of which the
#: effects explain three quarters.
REDUCTION = GapReduction(
    rms_before=3.0,
    rms_after=1.5,
    noise_floor=1.0,
    rho=0.5,
    rho_ci95=(0.25, 1.0),
    phi=0.75,
    phi_ci95=(0.5, 1.0),
    floor_multiple=1.5,
    extrapolation_rho=0.3,
    steps=(),
    cells_before=(),
    cells_after=(cell(1.0), cell(3.0), cell(5.0, (1.0, 2.0))),
    validation=(RunValidation("A", 9.0, 5.0, 0.1), RunValidation("B", 9.0, 3.0, 0.1)),
    blocks=(
        BlockScore("A", "slow", 0, 100, 2.0),
        BlockScore("A", "slow", 1, 200, 3.0),
        BlockScore("B", "fast", 0, 100, 4.0),
    ),
)
#: Mean squares of 4 and 32 / 4 = 8 over all samples, of which 2 and 8 are predicted.
SLOW = motion("0.47X", 0.5, A=4.0, B=4.0)
FAST = motion("2.3X", 1.0, channels=("x",), B=32.0)


def decided(verdict=NAMED, reduction=REDUCTION, motions=(SLOW, FAST), classes=()):
    answer = ClassAnswer(
        state=NAMED_CLASS,
        classes=tuple(classes),
        ties=(),
        rivals={},
        share=0.0,
        share_ci95=(0.0, 0.0),
        learnable=0.0,
        learnt_by=(),
        law_share=0.0,
        classes_of_law={},
    )
    return with_lines(Verdict(verdict, "why", (), answer, reduction), motions)


def test_effects_and_lines_shrink_the_whole_gap_together():
    result = decided()
    # 8 on the orders and 12 beside them; explained 6 and 10.
    assert result.reduction.phi == result.answer.share == pytest.approx(0.8)
    assert result.reduction.phi_ci95 == pytest.approx((0.7, 0.9))
    assert result.reduction.rms_before == pytest.approx(np.sqrt(9.0 + 12.0))
    assert result.reduction.rms_after == pytest.approx(np.sqrt(2.25 + 2.0))
    assert result.reduction.rho == pytest.approx(np.sqrt(4.25 / 21.0))
    low, high = np.sqrt(2.5625 / 21.0), np.sqrt(11.0 / 21.0)
    assert result.reduction.rho_ci95 == pytest.approx((low, high))
    assert result.reduction.floor_multiple == pytest.approx(np.sqrt(4.25))
    # Of the whole gap the effects explain what the lines do not.
    assert result.answer.law_share == pytest.approx(0.3)


def test_lines_are_classes_the_largest_first_with_what_other_turns_predict_of_them():
    result = decided()
    assert (result.verdict, result.answer.state) == (CLASS_NAMED, NAMED_CLASS)
    assert result.answer.ids == ("nonsynchronous/2.3X", "nonsynchronous/0.47X")
    assert [entry.share for entry in result.answer.classes] == pytest.approx([0.4, 0.1])
    assert result.answer.classes[1].share_ci95 == pytest.approx((0.1, 0.2))
    assert "2.3X (x alone), 0.47X (several channels), is 60% of the gap" in result.reason


@pytest.mark.parametrize(
    ("verdict", "joint", "words"),
    [
        (NAMED, CLASS_NAMED, "; of the rest: why"),
        (ALIASED, ALIASED, "; of the rest: why"),
        (CLASS_NAMED, CLASS_NAMED, "; on the orders why"),
        (NONE_OF_THESE, CLASS_NAMED, "; no effect explains the rest: why"),
        (NOT_DIAGNOSABLE, CLASS_NAMED, "is 60% of the gap"),
    ],
)
def test_the_reason_ends_with_that_of_the_search(verdict, joint, words):
    result = decided(verdict)
    assert result.verdict == joint
    assert result.reason.endswith(words)


def test_at_the_noise_floor_the_lines_are_the_whole_gap():
    result = decided(AT_NOISE_FLOOR)
    assert result.answer.share == pytest.approx(10.0 / 12.0)
    assert "is 100% of the gap" in result.reason


@pytest.mark.parametrize(
    ("phi", "state", "verdict"),
    [
        (0.7, LEADING_CLASS, CLASS_NAMED),
        (0.0, LEADING_CLASS, CLASS_NAMED),
        (-0.01, NO_CLASS, NONE_OF_THESE),
        (float("nan"), LEADING_CLASS, CLASS_NAMED),
    ],
)
def test_the_word_follows_the_share_of_the_whole_gap(phi, state, verdict):
    result = decided(reduction=replace(REDUCTION, phi=phi))
    assert (result.answer.state, result.verdict) == (state, verdict)
    assert bool(result.answer.classes) is (state != NO_CLASS)


def test_motion_below_half_a_floor_or_a_fortieth_of_the_gap_is_no_part_of_the_answer():
    def is_told(reduction, *motions):
        return decided(reduction=reduction, motions=motions).reason != "why"

    floor = replace(REDUCTION, rms_before=1.0)
    assert not is_told(floor, motion("a", 1.0, A=0.24, B=0.24))
    assert is_told(floor, motion("a", 1.0, A=0.26, B=0.26))
    large = replace(REDUCTION, rms_before=10.0)  # a gap of 99 above the floor
    assert not is_told(large, motion("a", 1.0, A=2.4, B=2.4))
    assert is_told(large, motion("a", 1.0, A=2.6, B=2.6))
    assert not is_told(replace(REDUCTION, rms_before=0.0, noise_floor=0.0))


def test_a_line_of_less_than_a_fortieth_beside_a_large_one_is_not_listed():
    result = decided(motions=[SLOW, FAST, motion("9X", 1.0, A=0.4, B=0.4)])
    assert result.answer.ids == ("nonsynchronous/2.3X", "nonsynchronous/0.47X")
    assert result.answer.share == pytest.approx(16.4 / 20.4)


def test_classes_of_the_orders_are_shares_of_the_whole_gap_and_small_ones_go():
    classes = [
        ClassFinding("tilt", 0.7, (0.6, 0.8), "law", 0.5, True),
        ClassFinding("offset", 0.06, (0.0, 0.1), "", 0.0, False),
    ]
    result = decided(classes=classes)
    assert result.answer.ids[2:] == ("tilt",)
    tilt = result.answer.classes[2]
    assert (tilt.share, tilt.law_share) == pytest.approx((0.28, 0.2))
    assert tilt.share_ci95 == pytest.approx((0.24, 0.32))


def test_maps_runs_and_blocks_are_those_of_the_effects_and_the_whole_gap():
    after = decided().reduction
    # Cells of lines are none of what the effects leave on the orders.
    assert [entry.share for entry in after.cells_after] == pytest.approx([0.25, 0.75])
    assert [run.error_after for run in after.validation] == pytest.approx([np.sqrt(21.0), 0.0])
    assert [run.error_before for run in after.validation] == [9.0, 9.0]
    assert [block.mean_square for block in after.blocks] == pytest.approx([6.0, 7.0, 40.0])
    lines = replace(REDUCTION, cells_after=(cell(0.0),))
    assert np.isnan(decided(reduction=lines).reduction.cells_after[0].share)


def test_without_a_floor_nothing_is_a_multiple_of_it():
    assert decided(reduction=replace(REDUCTION, noise_floor=0.0)).reduction.floor_multiple == np.inf


def test_an_order_read_too_seldom_is_not_called_one_between_the_orders():
    fast = replace(SLOW, id="aliased/99X", label="99X")
    assert decided(motions=(fast,)).reason.startswith(
        "motion above half the samples of a turn, 99X"
    )
    assert decided(motions=(SLOW,)).reason.startswith("motion between the shaft's orders, 0.47X")
