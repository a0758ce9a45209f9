"""Clocks that drift by many periods' parts are put back and refitted."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from carrierflex.diagnosis.wiring.refits import (
    ClockDrift,
    PredictedRecord,
    _drift,
    drifting_clocks,
    put_back,
    refitted_clock,
)
from tests.diagnosis.element.element_campaigns import displacement_campaign

NOISE = 0.05


@pytest.fixture(scope="module")
def campaign():
    return displacement_campaign(lambda q, v: 0.0 * q)


def force_of(run):
    """The only signal of a run."""
    (values,) = run.signals.values()
    return values


def read_late(run, delay):
    """Run whose force is read ``delay(time)`` [s] ago."""
    (name,) = run.signals
    at = run.time - delay(run.time)
    return replace(run, signals={name: CubicSpline(run.time, run.signals[name])(at)})


def rivals(campaign, late):
    """Rivals of records with one late run beside the prediction of those on time."""
    runs = (*campaign.runs[:-1], late)
    records = [
        PredictedRecord(
            run.name,
            run.time,
            force_of(run)[:, None],
            force_of(on_time)[:, None],
        )
        for run, on_time in zip(runs, campaign.runs, strict=True)
    ]

    def mean_square(corrected):
        """Mean square beside the runs on time, away from the ends."""
        squares = [
            np.mean((force_of(one) - force_of(two))[50:-50] ** 2)
            for one, two in zip(corrected.runs, campaign.runs, strict=True)
        ]
        return float(np.mean(squares))

    return drifting_clocks(records, replace(campaign, runs=runs), mean_square)


@pytest.mark.parametrize("drift", [0.005, 0.05, -0.05])
def test_a_drift_is_found_in_its_run_and_put_back(campaign, drift):
    last = campaign.runs[-1]
    (rival,) = rivals(campaign, read_late(last, lambda time: drift * time / time[-1]))
    assert rival.about == last.name
    assert float(rival.text.split()[5]) == pytest.approx(1e3 * abs(drift), rel=0.05)
    assert rival.mean_square < 1e-3 * np.var(force_of(last))


def test_runs_on_time_have_no_rival(campaign):
    assert rivals(campaign, campaign.runs[-1]) == ()


def test_a_drift_far_below_a_step_of_time_is_none(campaign):
    """A hundredth of a step, which these records show by ten deviations and more."""
    last = campaign.runs[-1]
    late = read_late(last, lambda time: 5e-5 * time / time[-1])
    record = PredictedRecord("late", last.time, force_of(late)[:, None], force_of(last)[:, None])
    drift, sureness = _drift(record)
    assert drift.growth == pytest.approx(5e-5, rel=0.2)
    assert sureness > 10.0
    assert rivals(campaign, late) == ()


def test_signals_that_are_put_back_are_where_they_were(campaign):
    late = replace(
        campaign,
        runs=tuple(read_late(run, lambda time: 0.05 + 0.0 * time) for run in campaign.runs),
    )
    for back, run in zip(
        put_back(late, [ClockDrift("", 0.05, 0.0)]).runs, campaign.runs, strict=True
    ):
        scale = np.abs(force_of(run)).max()
        inner = slice(50, -50)
        np.testing.assert_allclose(force_of(back)[inner], force_of(run)[inner], atol=0.02 * scale)


def late_by(campaign, delay):
    """Campaign whose signals are all late."""
    return replace(
        campaign,
        runs=tuple(read_late(run, lambda time: delay + 0.0 * time) for run in campaign.runs),
    )


def test_a_guess_that_does_not_explain_the_gap_is_sought_by_refits(campaign):
    def mean_square(corrected):
        """Mean square beside the signals on time."""
        pairs = zip(corrected.runs, campaign.runs, strict=True)
        return float(np.mean([np.mean((force_of(a) - force_of(b))[50:-50] ** 2) for a, b in pairs]))

    late = late_by(campaign, 0.05)
    guess = ClockDrift("", 0.07, 0.0)
    clock, square = refitted_clock(late, guess, mean_square, 0.0)
    assert clock.delay == pytest.approx(0.05, rel=0.03)
    assert square < 1e-3 * mean_square(late)
    assert refitted_clock(late, guess, mean_square, np.inf) == (
        guess,
        mean_square(put_back(late, [guess])),
    )
