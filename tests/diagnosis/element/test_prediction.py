"""Elements beside another simulator's prediction."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.kinds import problem_of
from carrierflex.identification.campaign.declarations import Baseline
from tests.diagnosis.element.element_campaigns import (
    STIFFNESS,
    displacement_campaign,
    force_campaign,
    no_law,
)


def cubic(q, v):
    return 2e9 * q**3


def with_predictions(measured, predicted, effects=()):
    """Campaign whose baseline is what another campaign measured."""
    (channel,) = measured.channels
    runs = tuple(
        replace(run, predictions={channel.name: other.signals[channel.name]})
        for run, other in zip(measured.runs, predicted.runs, strict=True)
    )
    return replace(measured, baseline=Baseline("columns", effects), runs=runs)


def diagnosis_of(campaign):
    problem = problem_of(campaign)
    return diagnose(
        problem, campaign="twin", kind="element", floor_is_measured=problem.noise_is_measured
    )


@pytest.mark.long
@pytest.mark.parametrize("make", [force_campaign, displacement_campaign])
def test_what_the_prediction_lacks_is_named(make):
    diagnosis = diagnosis_of(with_predictions(make(cubic), make(no_law, noise=1e-12)))
    assert diagnosis.verdict in ("named", "named_with_remainder")
    assert diagnosis.attribution.effects == ("cubic_stiffness",)
    assert_allclose(diagnosis.attribution.parameters["cubic_stiffness"]["K3"].value, 2e9, rtol=0.02)
    # The prediction's own stiffness is held, not fitted to the measurement.
    assert_allclose(diagnosis.attribution.parameters["baseline"]["K1"].value, STIFFNESS, rtol=1e-3)


def test_a_prediction_in_millimetres_whose_fit_runs_away_is_refused_with_its_size():
    measured = force_campaign(no_law)
    campaign = with_predictions(measured, measured)
    runs = tuple(
        replace(run, predictions={"q": 1e3 * run.predictions["q"]}) for run in campaign.runs
    )
    size = 1e3 * max(np.abs(run.signals["q"]).max() for run in measured.runs)
    with pytest.raises(ValueError, match=rf"predictions of channel q reach {size:.3g}, where no"):
        problem_of(replace(campaign, runs=runs))


def test_the_gap_is_measured_less_predicted():
    measured, predicted = displacement_campaign(cubic), displacement_campaign(no_law, noise=1e-12)
    problem = problem_of(with_predictions(measured, predicted))
    theta = np.array([parameter.lower for parameter in problem.parameters(())])
    squares = problem.squares((), theta, np.ones(len(problem.segments), dtype=bool))
    inside = [record.block >= 0 for record in problem.records]
    expected = sum(
        float(np.square((run.signals["F"] - other.signals["F"])[is_inside]).sum())
        for run, other, is_inside in zip(measured.runs, predicted.runs, inside, strict=True)
    )
    assert_allclose(squares.sum(), expected, rtol=1e-6)
    chosen = np.arange(len(problem.segments)) % 2 == 0
    assert_allclose(problem.total_square((), theta, chosen), squares[chosen].sum(), rtol=1e-12)


@pytest.mark.long
def test_a_prediction_as_good_as_the_measurement_is_at_the_floor():
    diagnosis = diagnosis_of(
        with_predictions(
            force_campaign(cubic), force_campaign(cubic, noise=1e-12), ("cubic_stiffness",)
        )
    )
    assert diagnosis.verdict == "at_noise_floor"
    assert all("cubic_stiffness" not in ranked.effects for ranked in diagnosis.attribution.ranking)


def test_an_empty_prediction_is_refused():
    campaign = with_predictions(force_campaign(cubic), force_campaign(no_law))
    first, *others = campaign.runs
    empty = replace(first, predictions={"q": np.full(first.time.size, np.nan)})
    with pytest.raises(ValueError, match="run R0: column 'q_sim' is empty; expected a prediction"):
        problem_of(replace(campaign, runs=(empty, *others)))
