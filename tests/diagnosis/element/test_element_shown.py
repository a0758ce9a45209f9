"""Whether the records show an element at all: what its baseline leaves of the force."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOT_VISIBLE
from carrierflex.diagnosis.element.classes.answer import answer_of_table
from tests.diagnosis.classes.toy_table import N_KNOWN
from tests.diagnosis.element.toy_element import multisine, toy_element

#: Floors that the baseline leaves: one of noise, and a spring.
LEFT = 101.0
IN_ONE_BLOCK = np.where(np.arange(N_KNOWN) == 3, N_KNOWN, 0.0)


def state(force, *, gap=None):
    """State of the answer where the force has some square in floors, in all or by block."""
    records = [multisine(level) for level in (1.0, 2.0, 4.0)]
    records = [replace(own, record=SimpleNamespace(drive=own.x, gap=gap)) for own in records]
    shown = {"restoring_force": {"spring": 0.0}}
    own = toy_element(records, {"spring": LEFT - 1.0}, shown, force=force)
    model = SimpleNamespace(by_force=True, states={})
    told = answer_of_table(own, model, "", lambda table: lambda *_: None)
    assert bool(told.classes) == (told.state == NAMED_CLASS)
    assert ("more than no force at all" in told.note) == (told.state == NOT_VISIBLE)
    return told.state


@pytest.mark.parametrize(
    ("force", "expected"),
    [
        (0.4 * LEFT, NOT_VISIBLE),
        # As much as no force at all.
        (LEFT, NOT_VISIBLE),
        # A law may hold most of the force, or one level alone may move.
        (1.1 * LEFT, NAMED_CLASS),
        (0.9 * LEFT + 0.2 * LEFT * IN_ONE_BLOCK, NAMED_CLASS),
    ],
)
def test_a_baseline_that_leaves_more_than_no_force_at_all_is_no_element(force, expected):
    assert state(force) == expected


def test_the_gap_of_another_simulator_is_none_of_its_baseline_to_explain():
    assert state(LEFT, gap=np.zeros(1)) == NAMED_CLASS
