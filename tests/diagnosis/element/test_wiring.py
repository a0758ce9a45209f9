"""Delays and drifts that a fit of the baseline cannot find are told by the spectra."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from carrierflex.diagnosis.element import signatures
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.element.wiring import element_clocks
from carrierflex.diagnosis.inference.effect_fit import mean_square_of
from tests.diagnosis.element.element_campaigns import (
    displacement_campaign,
    force_campaign,
    late,
    no_law,
)

CAMPAIGNS = {"force": force_campaign, "displacement": displacement_campaign}


def clocks_of(campaign):
    problem = element_problem(campaign)
    return element_clocks(problem.records, by_force=problem.model.by_force)


@pytest.mark.parametrize("drive", list(CAMPAIGNS))
@pytest.mark.parametrize("delay", [0.0, 0.05, pytest.param(-0.04, marks=pytest.mark.long)])
def test_the_delay_of_a_linear_element_is_found(drive, delay):
    """Within half a step; damping and mass make up for a delay of a drive that ends at 4.7 Hz."""
    campaign = CAMPAIGNS[drive](no_law)
    step = campaign.runs[0].time[1]
    clocks = clocks_of(late(campaign, delay))
    result = next((clock.delay for clock in clocks if not clock.run), 0.0)
    assert result == pytest.approx(delay, abs={"force": 0.5, "displacement": 2.0}[drive] * step)


def test_a_nonlinear_element_on_time_has_no_delay():
    campaign = displacement_campaign(lambda q, v: 40.0 * np.sign(v))
    assert clocks_of(campaign) == ()


def drifting(campaign, number, growth):
    """Campaign of which one run is ever later, from zero to `growth` [s]."""
    name = campaign.channels[0].name
    run = campaign.runs[number]
    at = run.time - growth * run.time / run.time[-1]
    moved = replace(run, signals={name: CubicSpline(run.time, run.signals[name])(at)})
    return replace(campaign, runs=(*campaign.runs[:number], moved, *campaign.runs[number + 1 :]))


@pytest.mark.parametrize("drive", list(CAMPAIGNS))
@pytest.mark.parametrize("growth", [0.08, pytest.param(-0.06, marks=pytest.mark.long)])
def test_the_run_whose_clock_drifts_is_found(drive, growth):
    campaign = CAMPAIGNS[drive](no_law)
    number = len(campaign.runs) - 1
    step = campaign.runs[number].time[1]
    clocks = clocks_of(drifting(campaign, number, growth))
    (clock,) = [candidate for candidate in clocks if candidate.run]
    assert clock.run == campaign.runs[number].name
    assert clock.growth == pytest.approx(growth, abs=step)
    assert clock.delay == pytest.approx(0.5 * growth, abs=step)


def test_a_refit_makes_no_columns_of_laws_that_it_does_not_fit(monkeypatch):
    campaign = force_campaign(no_law)
    problem = element_problem(campaign)
    expected = mean_square_of(problem)
    made = []

    def noted(model, record, column):
        made.append(column.effect)
        return np.zeros(record.response.size)

    monkeypatch.setattr(signatures, "column_values", noted)
    assert problem.wiring(campaign).refitted(campaign) == pytest.approx(expected, rel=1e-9)
    assert made == []
