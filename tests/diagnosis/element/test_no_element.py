"""Records in which the motion is not that of an element under its drive."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.classes.results import NAMED_CLASS, NOT_VISIBLE, NOTHING
from carrierflex.diagnosis.element.problem import element_problem
from tests.diagnosis.element.element_campaigns import displacement_campaign, force_campaign, no_law


def found(campaign):
    return element_problem(campaign).class_answer()


def with_signals(campaign, signal_of):
    """Campaign of other signals of its one channel, each of a run and its own signal."""
    name = campaign.channels[0].name
    runs = [
        replace(run, signals={name: signal_of(number, run.signals[name])})
        for number, run in enumerate(campaign.runs)
    ]
    return replace(campaign, runs=tuple(runs))


def stuck(number, signal):
    """Noise of the sensor, and a drift that is none of the drive's."""
    rng = np.random.default_rng(number)
    drift = np.cumsum(rng.standard_normal(signal.size))
    return 2e-6 * (rng.standard_normal(signal.size) + drift / drift.std())


def of_another_run(number, signal):
    """A motion as large as ever, which the drive of its run did not make."""
    return np.roll(signal[::-1], 300 * (number + 1))


@pytest.mark.parametrize("signal_of", [stuck, of_another_run])
def test_a_motion_that_the_drive_does_not_make_shows_no_class(signal_of):
    told = found(with_signals(force_campaign(no_law), signal_of))
    assert (told.state, told.classes, told.ties) == (NOT_VISIBLE, (), ())
    assert "the baseline's force explains nothing" in told.note


def test_a_force_that_the_motion_does_not_make_shows_no_class():
    told = found(with_signals(displacement_campaign(no_law), of_another_run))
    assert told.state == NOT_VISIBLE


def test_an_element_under_much_noise_is_seen():
    # Three quarters of the motion's square are noise, and its gap is none.
    assert found(force_campaign(no_law, noise=2e-4)).state == NOTHING


def test_a_law_that_holds_most_of_the_force_is_seen():
    # The cubic spring carries ten times the linear one at the ends of the motion.
    told = found(displacement_campaign(lambda q, v: 4e11 * q**3))
    assert told.state == NAMED_CLASS
    assert [own.id for own in told.classes] == ["restoring_force"]
