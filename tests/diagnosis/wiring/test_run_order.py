"""Exchanged runs are found by a refit, not by the fit that has met the wrong pairs."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.blind_check.case_plans import case_plans
from carrierflex.blind_check.labels import NOTHING
from carrierflex.blind_check.truth.campaigns import case_campaign
from carrierflex.diagnosis.baseline_check import checked_baseline
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.diagnosis.wiring.refits import (
    Fault,
    PredictedRecord,
    exchanged_runs,
)
from carrierflex.workflows.fe.default_curves import default_curves
from tests.identification.synthetic_campaigns import carrier_campaign, run_case


@pytest.fixture(scope="module")
def campaign():
    return carrier_campaign([run_case(name) for name in ("one", "two", "three")])


def records(campaign, factors):
    """Every run with a wave of its own size beside the prediction of another size."""
    time = campaign.runs[0].time
    wave = np.sin(2.0 * np.pi * time)[:, None]
    return [
        PredictedRecord(run.name, time, measured * wave, predicted * wave)
        for run, (measured, predicted) in zip(campaign.runs, factors, strict=True)
    ]


def test_runs_that_fit_the_wrong_inputs_a_little_better_are_refitted(campaign):
    signals = [run.signals for run in campaign.runs]

    def mean_square(trial):
        """Mean square of a refit: nothing with the signals of the first two runs exchanged."""
        taken = [
            next(k for k, signals_of_run in enumerate(signals) if signals_of_run is run.signals)
            for run in trial.runs
        ]
        return 0.0 if taken == [1, 0, 2] else 9.0

    # The fit lies between the two runs, a little nearer to the pairs that it has met.
    met = records(campaign, [(1.0, 1.52), (2.0, 1.5), (5.0, 5.0)])
    (result,) = exchanged_runs(met, campaign, mean_square)
    assert (result.id, result.about, result.mean_square) == (Fault.RUN_ORDER, "one, two", 0.0)


def test_runs_that_fit_their_own_inputs_far_better_are_not_refitted(campaign):
    def refused(_):
        raise AssertionError

    assert exchanged_runs(records(campaign, [(1, 1.1), (2, 1.9), (5, 5)]), campaign, refused) == ()


@pytest.mark.long
def test_exchanged_runs_beside_an_offset_of_every_run_are_told():
    """Six runs of which a baseline with five shared parameters predicts each other's alike."""
    plan = next(plan for plan in case_plans("carrier", 60, 7) if plan.family == NOTHING)
    clean = case_campaign(plan)[0]
    first, second, *others = clean.runs
    swapped = (replace(first, signals=second.signals), replace(second, signals=first.signals))
    wrong = replace(clean, runs=(*swapped, *others))
    problem = problem_of(wrong, default_curves())
    check = checked_baseline(problem, wrong, problem.wiring(wrong))
    shares = {rival.id: share for rival, share in check.rivals}
    assert shares[Fault.RUN_ORDER] > 0.99
