"""A force that changes its size in the course of the records follows no law of its class."""

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS
from carrierflex.diagnosis.element.problem import element_problem
from tests.diagnosis.element.element_campaigns import displacement_campaign


def friction(q, v):
    """Dry friction that keeps its size."""
    return 2.0 * np.tanh(v / 1e-3)


def loaded_friction(q, v):
    """The same under a load that comes and goes twice in each run."""
    return friction(q, v) * (1.0 + 0.4 * np.sin(np.linspace(0.0, 4.0 * np.pi, q.size)))


def answer_of(law):
    return element_problem(displacement_campaign(law)).class_answer()


def test_friction_that_keeps_its_size_is_named():
    answer = answer_of(friction)
    assert (answer.state, answer.ids, answer.changes) == (NAMED_CLASS, ("dissipation",), "")


def test_friction_that_changes_its_size_is_of_no_class():
    answer = answer_of(loaded_friction)
    assert (answer.state, answer.best) == (NO_CLASS, ("dissipation",))
    # Standard deviation of the sine, 0.4 / sqrt(2); the speed weighs its blocks unevenly.
    percent = float(answer.changes.partition(" by ")[2].partition("%")[0])
    assert percent == pytest.approx(28.3, rel=0.15)
    assert "until nothing changes" in answer.experiment
