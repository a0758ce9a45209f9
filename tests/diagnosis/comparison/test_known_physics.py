"""What a campaign states beforehand acts on the fits: windows, known values, declared errors."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.mounting.records import mounting_records
from carrierflex.identification.campaign.declarations import InputSignal, KnownValue
from carrierflex.identification.carrier.carrier_identification import identify_jointly
from carrierflex.identification.carrier.models import rigid_model
from carrierflex.identification.mounting.bushing_models import LINEAR, mounting_residuals
from tests.diagnosis.carrier.carrier_twin import CHANNELS, CURVES, RIG, twin_campaign
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    STIFFNESS,
    displacement_campaign,
    force_campaign,
    no_law,
)
from tests.diagnosis.mounting.mounting_campaigns import mounting_campaign
from tests.identification.synthetic_campaigns import carrier_campaign


def damaged(campaign, windows, *, repaired=False):
    """Copy that uses some windows only; outside them its signals are wild, or missing."""
    runs = []
    for run in campaign.runs:
        used = replace(run, use=windows)
        wild = np.nan if repaired else 1e3 * np.cos(np.arange(run.time.size) ** 2)
        signals = {
            name: np.where(used.in_use, values, wild) for name, values in run.signals.items()
        }
        runs.append(replace(used, signals=signals))
    return replace(campaign, runs=tuple(runs))


def fitted(problem):
    return fit_effects(problem, ())


@pytest.mark.parametrize("make", [force_campaign, displacement_campaign])
def test_an_element_is_fitted_and_scored_within_the_windows_alone(make):
    campaign = make(no_law)
    windows = ((1.0, 4.0), (5.0, 9.0))
    if make is force_campaign:
        # Steady state from the first sample, so that the record may begin anywhere.
        campaign = replace(campaign, rig={"drive": "force", "settle_samples": 0})
    problem = element_problem(damaged(campaign, windows))
    clean = element_problem(damaged(campaign, windows, repaired=True))
    fit = fitted(problem)
    assert_array_equal(fit.theta, fitted(clean).theta)
    values = dict(zip([p.name for p in fit.parameters], fit.theta, strict=True))
    assert values["K1"] == pytest.approx(STIFFNESS, rel=0.01)
    assert values["C1"] == pytest.approx(DAMPING, rel=0.05)
    for record in problem.records:
        time = 1.0 + record.step * np.arange(record.drive.size)
        assert not record.counts[(time > 4.0 + 1e-9) & (time < 5.0 - 1e-9)].any()
        assert time[-1] <= 9.0 + 1e-9


@pytest.mark.long
def test_a_carrier_is_fitted_and_scored_within_the_windows_alone():
    campaign = twin_campaign(turns=8)
    windows = ((0.0, 6.0), (12.0, 15.0))
    problem = carrier_problem(damaged(campaign, windows), CURVES)
    clean = carrier_problem(damaged(campaign, windows, repaired=True), CURVES)
    assert_array_equal(fitted(problem).theta, fitted(clean).theta)
    counted = sum(segment.n_samples for segment in problem.segments)
    inside = sum(run.in_use.sum() for run in damaged(campaign, windows).runs) * len(CHANNELS)
    assert 0.8 * inside < counted <= inside
    assert all(segment.n_samples for segment in problem.segments)


def test_a_mounting_is_compared_within_the_windows_alone():
    campaign = mounting_campaign()
    windows = ((20.0, 60.0), (80.0, 125.0))
    records = mounting_records(damaged(campaign, windows))
    for record, unrestricted in zip(records, mounting_records(campaign), strict=True):
        counted = np.isfinite(record.measured).all(axis=1)
        time = record.inputs.time
        inside = ((time >= 20.0) & (time <= 60.0)) | ((time >= 80.0) & (time <= 125.0))
        assert_array_equal(counted, inside)
        assert_array_equal(record.measured[counted], unrestricted.measured[counted])
        per_block = [counted[record.block == block].sum() for block in range(record.n_blocks)]
        assert min(per_block) > 0.8 * max(per_block)


def test_bushings_are_identified_within_the_windows_alone():
    campaign = mounting_campaign(conditions=((3.0e5, 0.0, -1.0e5),))
    residuals = mounting_residuals(damaged(campaign, ((20.0, 60.0),)), LINEAR)
    inside = damaged(campaign, ((20.0, 60.0),)).runs[0].in_use
    misfit = residuals(np.array([24.0e6, 1.4e5, 0.0])).reshape(-1, 6)
    assert_array_equal((misfit != 0.0).any(axis=1), inside)


def test_the_carriers_motion_is_identified_within_the_windows_alone():
    campaign, windows = carrier_campaign(), ((2.0, 9.0), (12.0, 20.0))
    estimate = identify_jointly(damaged(campaign, windows), rigid_model())
    clean = identify_jointly(damaged(campaign, windows, repaired=True), rigid_model())
    assert_array_equal(estimate.values, clean.values)
    assert not np.array_equal(estimate.values, identify_jointly(campaign, rigid_model()).values)


def known_stiffness(campaign, std):
    fixed = {"baseline.K1": KnownValue(1.1 * STIFFNESS, std)}
    return replace(campaign, baseline=replace(campaign.baseline, fixed=fixed))


def test_known_physics_is_a_prior_of_the_fit():
    campaign = displacement_campaign(no_law, n=1500)
    free = fitted(element_problem(campaign))
    k = [parameter.name for parameter in free.parameters].index("K1")
    loose = fitted(element_problem(known_stiffness(campaign, 1e9)))
    fixed = fitted(element_problem(known_stiffness(campaign, 0.0)))
    assert_allclose(loose.theta, free.theta, rtol=1e-6)
    assert fixed.theta[k] == 1.1 * STIFFNESS
    # Normal data beside a normal prior: the mean weighs both by their precisions.
    without_others = 1.0 / np.linalg.inv(free.sums.matrix.sum(axis=0))[k, k]
    variance = element_problem(campaign).records[0].noise
    std = np.sqrt(variance / without_others)
    half = fitted(element_problem(known_stiffness(campaign, std)))
    # The search ends where a step promises less than 1e-5 of the cost: 1e-3 of the shift of 5 %.
    assert_allclose(half.theta[k], 0.5 * (free.theta[k] + 1.1 * STIFFNESS), rtol=1e-4)


@pytest.mark.long
def test_a_known_tilt_is_given_by_size_and_angle():
    fixed = {
        "carrier_tilt.phi_PLC": KnownValue(4e-4, 0.0),
        "carrier_tilt.theta_PLC": KnownValue(0.7, 0.0),
    }
    campaign = twin_campaign(turns=4)
    baseline = replace(campaign.baseline, fixed=fixed)
    fit = fitted(carrier_problem(replace(campaign, baseline=baseline), CURVES))
    tilt = [v for p, v in zip(fit.parameters, fit.theta, strict=True) if p.effect == "carrier_tilt"]
    assert_allclose(tilt, [4e-4 * np.cos(0.7), 4e-4 * np.sin(0.7)], rtol=1e-12)


def test_a_prior_of_a_candidate_never_makes_a_larger_set_dearer():
    campaign = displacement_campaign(no_law, n=1500)
    fixed = {"cubic_stiffness.K3": KnownValue(1e9, 1e3)}
    problem = element_problem(replace(campaign, baseline=replace(campaign.baseline, fixed=fixed)))
    smaller = fitted(problem)
    larger = fit_effects(problem, ("cubic_stiffness",), contained=[smaller])
    assert larger.cost < smaller.cost
    assert larger.theta[-1] == pytest.approx(1e9, rel=0.01)


@pytest.mark.long
def test_impossible_effects_are_no_candidates():
    campaign = force_campaign(lambda q, v: 8e8 * q**3)
    ruled_out = replace(campaign.baseline, impossible=("cubic_stiffness", "backlash"))
    problem = element_problem(replace(campaign, baseline=ruled_out))
    assert {"cubic_stiffness", "backlash"}.isdisjoint(problem.cards)
    proposed = set().union(*problem.class_answer().law_sets)
    assert "quintic_stiffness" in proposed
    assert {"cubic_stiffness", "backlash"}.isdisjoint(proposed)
    assert "quintic_stiffness" in problem.cards


@pytest.mark.long
def test_impossible_effects_of_a_carrier_are_no_candidates():
    campaign = twin_campaign(turns=2)
    ruled_out = replace(campaign.baseline, impossible=("face_runout",))
    problem = carrier_problem(replace(campaign, baseline=ruled_out), CURVES)
    assert "face_runout" not in problem.cards
    assert "face_runout" not in problem.gram_table().library


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "error", "declared", "true"),
    [
        ("sensor_gain", "gain_std", 1e-5, 0.2),
        ("sensor_zero", "zero_std", 1e-9, 6e-5),
        ("sensor_delay", "delay_std", 1e-6, 0.05),
        ("sensor_angle", "angle_std", 1e-6, 0.04),
    ],
)
def test_a_declared_error_bounds_what_a_sensor_can_explain(effect, error, declared, true):
    campaign = twin_campaign(effect, turns=4)
    result = []
    for std in (None, declared):
        channels = tuple(replace(channel, **{error: std}) for channel in campaign.channels)
        problem = carrier_problem(replace(campaign, channels=channels), CURVES)
        fit = fit_effects(problem, (effect,))
        result.append(abs(fit.theta[-1]))
    assert result[0] == pytest.approx(true, rel=0.1)
    assert result[1] < 0.2 * true


def test_declared_noise_of_the_input_is_carried_to_the_channel():
    noise = 0.05
    campaign = force_campaign(no_law)
    rng = np.random.default_rng(5)
    runs = tuple(
        replace(
            run, inputs={"force": run.inputs["force"] + noise * rng.standard_normal(run.time.size)}
        )
        for run in campaign.runs
    )
    noisy = replace(campaign, runs=runs)
    declared = replace(noisy, inputs=(InputSignal("force", "N", noise_std=noise),))
    ratios = []
    for each in (noisy, declared):
        problem = element_problem(each)
        ratios.append(fitted(problem).cost / problem.noise_square.sum())
    assert ratios[0] > 2.0
    assert ratios[1] == pytest.approx(1.0, abs=0.3)


def test_a_carrier_without_radial_load_is_diagnosed_as_one_whose_load_is_zero():
    campaign = twin_campaign(turns=2, loads=((1.0, 0, 0), (0.5, 0, 0)))
    runs = tuple(
        replace(run, inputs={name: run.inputs[name] for name in ("carrier_angle", "torque")})
        for run in campaign.runs
    )
    without = replace(campaign, rig={**RIG, "radial_load": "none"}, runs=runs)
    assert_array_equal(
        fitted(carrier_problem(without, CURVES)).theta,
        fitted(carrier_problem(campaign, CURVES)).theta,
    )
    experiments = carrier_problem(without, CURVES).candidate_experiments()
    assert all("radial loads" not in experiment.text for experiment in experiments)
