"""Campaigns with few sensors, few conditions, or a baseline that contains nonlinear effects."""

from dataclasses import replace

import numpy as np
import pytest

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.law_fits import law_fits
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.mounting.problem import mounting_problem
from tests.diagnosis.carrier.carrier_twin import CHANNELS, KNOWN, twin_problem
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, NOISE, mounting_campaign

FLUID = {"k": 1e7, "c": 5e6}


def without(campaign, *sensors):
    channels = tuple(channel for channel in campaign.channels if channel.name not in sensors)
    runs = tuple(
        replace(run, signals={c.name: run.signals[c.name] for c in channels})
        for run in campaign.runs
    )
    return replace(campaign, channels=channels, runs=runs)


@pytest.mark.acceptance
def test_a_mounting_whose_baseline_contains_the_fluid_is_at_the_noise_floor():
    campaign = mounting_campaign(FLUID, conditions=CONDITIONS[:3], effects=("fluid_branch",))
    fit = fit_effects(mounting_problem(campaign), ())
    assert fit.known["fluid_branch", "k"] == pytest.approx(FLUID["k"], rel=0.01)
    assert fit.known["fluid_branch", "c"] == pytest.approx(FLUID["c"], rel=0.01)
    result = diagnose(mounting_problem(without(campaign, "spx")), campaign="twin", kind="mounting")
    assert result.verdict == "at_noise_floor", result.reason


def test_a_baseline_with_a_gain_beside_a_stiff_spring_starts_from_a_motion_within_the_model():
    problem = mounting_problem(
        mounting_campaign({"K5": 1e17}, conditions=CONDITIONS[:2], effects=("sensor_gain",))
    )
    fit = fit_effects(problem, ())
    assert np.sqrt(fit.cost / problem.cell_counts.sum()) < 100.0 * NOISE


@pytest.mark.long
def test_with_two_conditions_what_explains_the_whole_gap_is_named_with_few_sensors():
    campaign = without(
        mounting_campaign({"K5": 1e17}, conditions=(CONDITIONS[2], CONDITIONS[0])), "spz", "sbx"
    )
    result = diagnose(mounting_problem(campaign), campaign="twin", kind="mounting")
    assert result.attribution.effects == ("quintic_stiffness",), result.reason
    assert result.verdict == "named"


@pytest.mark.long
def test_a_set_whose_search_stuck_is_refused_and_ends_no_diagnosis():
    problem = twin_problem(
        contained=tuple(KNOWN)[1:3],
        loads=((0.75, 0, 5e4),),
        turns=6,
        channels=CHANNELS[:3],
        seed=23,
    )
    fits = law_fits(problem, Thresholds())
    good = fits.fit(("sensor_zero",))
    # A baseline that claims an impossible fit: every larger set is then stuck above it.
    fits.fits[()] = replace(fits.fit(()), cost=0.5 * good.cost)
    fits.fits.pop(("flexible_pins", "sensor_zero"), None)
    assert "did not converge" in fits.rejection(("flexible_pins", "sensor_zero"))
    result = diagnose(problem, campaign="twin", kind="carrier")
    # With three sensors and one condition the missing offset looks like a sensor's zero.
    assert result.verdict == "aliased"
    classes = [set(members) for members in result.attribution.aliases]
    assert any({"axial_offset", "sensor_zero"} <= members for members in classes)
