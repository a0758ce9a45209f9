"""Mountings beside another simulator's prediction."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.effect_fit import mean_square_of
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.declarations import Baseline
from carrierflex.workflows.diagnosis.examination import examined
from tests.diagnosis.mounting.mounting_campaigns import TRUE_LINEAR, mounting_campaign

CUBIC = {"K3": 6e12}


def with_predictions(measured, predicted, effects=()):
    """Campaign whose baseline is what another campaign measured."""
    runs = tuple(
        replace(run, predictions=dict(other.signals))
        for run, other in zip(measured.runs, predicted.runs, strict=True)
    )
    return replace(measured, baseline=Baseline("columns", effects), runs=runs)


def diagnosis_of(campaign):
    problem = problem_of(campaign)
    return diagnose(
        problem, campaign="twin", kind="mounting", floor_is_measured=problem.noise_is_measured
    )


@pytest.mark.acceptance
def test_what_the_prediction_lacks_is_named():
    diagnosis = diagnosis_of(
        with_predictions(mounting_campaign(CUBIC), mounting_campaign(noise=0.0))
    )
    assert diagnosis.verdict in ("named", "named_with_remainder"), diagnosis.reason
    assert diagnosis.attribution.effects == ("cubic_stiffness",)
    assert_allclose(
        diagnosis.attribution.parameters["cubic_stiffness"]["K3"].value, CUBIC["K3"], rtol=0.02
    )
    # The prediction's own stiffness is held, not fitted to the measurement.
    assert_allclose(
        diagnosis.attribution.parameters["baseline"]["K1"].value, TRUE_LINEAR["K1"], rtol=1e-4
    )


def test_a_prediction_in_millimetres_is_no_exchange_of_runs():
    """A refitted model is no rival of another simulator's prediction, which stands as it is."""
    measured = mounting_campaign(seconds=40.0)
    predicted = with_predictions(measured, measured)
    runs = tuple(
        replace(run, predictions={k: 1e3 * v for k, v in run.predictions.items()})
        for run in predicted.runs
    )
    examination = examined(replace(predicted, runs=runs))
    assert examination.baseline().rivals == ()
    assert {warning.check for warning in examination.warnings} >= {"unit"}


def test_a_prediction_without_damping_has_bushings_all_the_same():
    """Columns that are early leave a negative damping to least squares."""
    measured = mounting_campaign({"C1": 0.0}, seconds=40.0, noise=0.0)
    early = {run.name: {k: np.roll(v, -1) for k, v in run.signals.items()} for run in measured.runs}
    runs = tuple(replace(run, predictions=early[run.name]) for run in measured.runs)
    campaign = replace(measured, baseline=Baseline("columns", ()), runs=runs)
    problem = problem_of(campaign)
    assert np.isfinite(mean_square_of(problem))


def test_the_gap_is_measured_less_predicted():
    measured, predicted = mounting_campaign(CUBIC), mounting_campaign(noise=0.0)
    problem = problem_of(with_predictions(measured, predicted))
    theta = np.array([parameter.lower for parameter in problem.parameters(())])
    expected = sum(
        float(np.square(run.signals[name] - other.signals[name]).sum())
        for run, other in zip(measured.runs, predicted.runs, strict=True)
        for name in run.signals
    )
    assert_allclose(
        problem.squares((), theta, np.ones(len(problem.segments), dtype=bool)).sum(),
        expected,
        rtol=1e-6,
    )


@pytest.mark.long
def test_a_prediction_as_good_as_the_measurement_is_at_the_floor():
    diagnosis = diagnosis_of(
        with_predictions(
            mounting_campaign(CUBIC), mounting_campaign(CUBIC, noise=0.0), ("cubic_stiffness",)
        )
    )
    assert diagnosis.verdict == "at_noise_floor"
    assert all("cubic_stiffness" not in ranked.effects for ranked in diagnosis.attribution.ranking)


def test_an_empty_prediction_is_refused():
    campaign = with_predictions(mounting_campaign(), mounting_campaign())
    first, *others = campaign.runs
    empty = replace(
        first, predictions={**first.predictions, "ssx": np.full(first.time.size, np.nan)}
    )
    with pytest.raises(
        ValueError, match="run R0: column 'ssx_sim' is empty; expected a prediction"
    ):
        problem_of(replace(campaign, runs=(empty, *others)))
