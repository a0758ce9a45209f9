"""Classes of an element under forces of one frequency at several levels."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from carrierflex.blind_check import labels
from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.classes.results import NAMED_CLASS, NO_CLASS, NOTHING
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects, mean_square_left
from tests.diagnosis.element.element_campaigns import PERIOD, STEP, force_campaign

#: 7.8 Hz, below the resonance at 10 Hz.
LINE = 20
LEVELS = (1.0, 2.0, 4.0, 8.0)
NOISE = 5e-6


def dry(q, v):
    return 0.4 * np.tanh(v / 1e-3)


def hard(q, v):
    return 1e10 * q**3


def nothing(q, v):
    return 0.0 * v


def both(q, v):
    return dry(q, v) + hard(q, v)


@cache
def answered(law):
    """Problem of a law under one line and its classes."""
    campaign = force_campaign(law, amplitudes=LEVELS, lines=(LINE,), noise=NOISE, seed=3)
    problem = element_problem(campaign)
    return problem, problem.class_answer()


@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "state", "classes"),
    [
        (dry, NAMED_CLASS, ["dissipation"]),
        (hard, NAMED_CLASS, ["restoring_force"]),
        (nothing, NOTHING, []),
    ],
)
def test_a_line_that_changes_with_the_level_shows_the_class(law, state, classes):
    # A force of the deflection changes the stiffness with the level, one of the speed the damping.
    problem, answer = answered(law)
    assert answer.state == state
    assert [entry.id for entry in answer.classes] == classes
    # Noise leaves no harmonic of the lowest level, and its line is compared all the same.
    lowest = problem.class_table.records[0]
    line_hz = LINE / (PERIOD * STEP)
    assert 1.2 * line_hz < lowest.weight.band_hz < 2.0 * line_hz


@pytest.mark.long
def test_two_causes_under_one_line_ask_for_more_frequencies():
    _, result = answered(both)
    assert result.state == NO_CLASS
    assert result.share > 0.95
    assert result.experiment.startswith("drive at many frequencies")
    assert result.best == ("restoring_force",)
    # One cause is named, and nothing has to be recorded anew for it.
    _, alone = answered(hard)
    assert alone.experiment == ""


def test_an_element_whose_load_drifts_under_one_line_is_fitted_and_not_lost():
    """Instruments alone ended in a mass five hundred times too large, eight floors of gap."""
    plans = [plan for plan in case_plans("element", 60, 511) if plan.family == labels.NOTHING]
    clean, label = case_campaign(plans[511 % len(plans)])
    assert label.drive == "sines"

    def drifting(run):
        growth = 1.0 + 0.1 * (run.time - run.time[0]) / np.ptp(run.time)
        return replace(run, inputs={"force": growth * run.inputs["force"]})

    problem = element_problem(replace(clean, runs=tuple(map(drifting, clean.runs))))
    known = fit_effects(problem, ()).known
    # The line determines the stiffness less the inertia, and the transient both, roughly.
    assert known["baseline", "m"] < 5.0 * label.parameters["baseline"]["m"]
    remaining = mean_square_left(problem, fit_effects(problem, ()))
    assert remaining < 5.0 * float(problem.noise_square.sum() / problem.cell_counts.sum())
