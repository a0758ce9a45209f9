"""Whether the records show an element at all: what its baseline leaves of the force."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOT_VISIBLE
from carrierflex.diagnosis.element import answer as answers
from carrierflex.diagnosis.element.answer import answer_of_table
from tests.diagnosis.classes.toy_table import N_KNOWN
from tests.diagnosis.element.toy_element import ToyScores, decay, multisine, toy_element

#: Floors that the baseline leaves: one of noise, and a cause of which its class leaves a tenth.
BASELINE_FLOORS = 101.0
LEFT_BY_CLASS = 11.0
IN_ONE_BLOCK = np.where(np.arange(N_KNOWN) == 3, N_KNOWN, 0.0)
DRIVEN = [multisine(level) for level in (1.0, 2.0, 4.0)]
RELEASED = [decay(level) for level in (1.0, 2.0)]


def state(force, *, cause="restoring_force", runs=DRIVEN, gap=None, states=()):
    """State of the answer where the force has some square in floors, in all or by block."""
    records = [
        replace(run, record=SimpleNamespace(drive=run.record.drive, gap=gap)) for run in runs
    ]
    remaining = {"cause": 0.1}
    element = toy_element(
        records,
        {"cause": BASELINE_FLOORS - 1.0},
        {cause: remaining},
        model=SimpleNamespace(by_force=True, states=states, cards={}),
        union=remaining,
        force=force,
    )
    answer = answer_of_table(element, "")
    assert bool(answer.classes) == (answer.state == NAMED_CLASS)
    assert ("more than no force at all" in answer.note) == (answer.state == NOT_VISIBLE)
    return answer.state


@pytest.fixture(autouse=True)
def without_shapes(monkeypatch):
    """Classes have no measured shape."""
    monkeypatch.setattr(answers, "measured_shape", lambda *_: (None, None))


@pytest.fixture
def without_motion(monkeypatch):
    """Sets the floors that a function of the drive leaves of the force beside no motion."""

    def set_floors(floors):
        squares = HeldOutSquares(np.full(N_KNOWN, floors / N_KNOWN), (), ())
        still = SimpleNamespace(of=lambda classes: squares if classes == ("drive_side",) else None)
        monkeypatch.setattr(ToyScores, "without_baseline", still)

    return set_floors


@pytest.mark.parametrize(
    ("force", "expected"),
    [
        (0.4 * BASELINE_FLOORS, NOT_VISIBLE),
        # As much as no force at all.
        (BASELINE_FLOORS, NOT_VISIBLE),
        # A law may hold most of the force, or one level alone may move.
        (1.1 * BASELINE_FLOORS, NAMED_CLASS),
        (0.9 * BASELINE_FLOORS + 0.2 * BASELINE_FLOORS * IN_ONE_BLOCK, NAMED_CLASS),
    ],
)
def test_a_baseline_that_leaves_more_than_no_force_at_all_is_no_element(force, expected):
    assert state(force) == expected


@pytest.mark.parametrize(
    ("floors", "expected"),
    [(2.1 * LEFT_BY_CLASS, NAMED_CLASS), (1.9 * LEFT_BY_CLASS, NOT_VISIBLE)],
)
def test_where_little_of_the_drive_arrives_the_motion_shows_beside_the_drive_side(
    floors, expected, without_motion
):
    without_motion(floors)
    assert state(BASELINE_FLOORS, cause="drive_side") == expected


def test_after_a_release_there_is_no_drive_side(without_motion):
    without_motion(1e3)
    assert state(BASELINE_FLOORS, cause="drive_side") == NAMED_CLASS
    assert state(BASELINE_FLOORS, runs=RELEASED, states={"R0": (1e-3, 0.0)}) == NOT_VISIBLE


def test_the_gap_of_another_simulator_is_none_of_its_baseline_to_explain():
    assert state(BASELINE_FLOORS, gap=np.zeros(1)) == NAMED_CLASS
