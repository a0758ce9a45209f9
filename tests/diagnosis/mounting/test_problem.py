from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.gap.findings import MOTION
from carrierflex.diagnosis.gap.gap_map import block_powers
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.mounting.gap import _PATTERNS, _line_counts, _pattern_matrix
from carrierflex.diagnosis.mounting.model import MOUNTING_CARDS
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.diagnosis.mounting.records import mounting_records
from carrierflex.identification.campaign.campaign_kinds import MOUNTING
from carrierflex.simulation.mounting.rig import SENSORS
from tests.diagnosis.mounting.mounting_campaigns import (
    CONDITIONS,
    NOISE,
    TRUE_LINEAR,
    mounting_campaign,
)

#: Truth of the simulator and value of the card's parameters, by effect.
TRUTH = {
    "cubic_stiffness": ({"K3": 5e11}, {"K3": 5e11}),
    "quintic_stiffness": ({"K5": 1e16}, {"K5": 1e16}),
    "deflection_dependent_damping": ({"C3": 2e11}, {"C1": 2e11}),
    "fluid_branch": ({"k": 1e7, "c": 5e6}, {"k": 1e7, "c": 5e6}),
    "elasto_plastic_friction": ({"Kp": 8e6, "Fy": 1.5e4}, {"Kp": 8e6, "Fy": 1.5e4}),
    "parasitic_torque": ({"P_T": 0.1}, {"P_T": 0.1}),
    "axial_bushing_stiffness": ({"k_x": 2e7}, {"dk_x": 1.9e7}),
    "main_bearing_compliance": ({"main_bearing_compliance": 3e-9}, {"compliance": 3e-9}),
    "ntl_direction": ({"ntl_angle": 0.1}, {"angle": 0.1}),
    "unequal_bushings": ({"starboard_excess": 0.1}, {"e": 0.1}),
    "sensor_gain": ({"gain_spz": 1.05}, {"g": 0.05}),
    "sensor_zero": ({"zero_ssx": 1e-4}, {"z": 1e-4}),
    # One and a half samples: between samples an interpolation shows.
    "sensor_delay": ({"delay": 0.075}, {"tau": 0.075}),
}
FAST = ("parasitic_torque", "unequal_bushings", "sensor_zero")


def diagnosis_of(problem):
    return diagnose(problem, campaign="twin", kind="mounting")


def check_named(effect, **options):
    simulated, expected = TRUTH[effect]
    result = diagnosis_of(mounting_problem(mounting_campaign(simulated, **options)))
    # The twin holds the effect in the form of its card: nothing else explains it as well.
    assert (result.verdict, result.attribution.effects) == ("named", (effect,)), result.reason
    assert result.attribution.aliases == ()
    assert result.reduction.floor_multiple == pytest.approx(1.0, abs=0.02)
    assert result.reduction.rho < 0.3
    for name, value in expected.items():
        estimate = result.attribution.parameters[effect][name]
        assert abs(estimate.value - value) < 4.0 * estimate.std, (name, estimate)


def test_the_library_holds_every_effect_of_the_contract():
    assert {card.id for card in MOUNTING_CARDS} == set(MOUNTING.effects)


@pytest.mark.long
@pytest.mark.parametrize(
    "effect", [FAST[0], *(pytest.param(effect, marks=pytest.mark.long) for effect in FAST[1:])]
)
def test_a_missing_effect_is_named(effect):
    check_named(effect, conditions=CONDITIONS[:3])


@pytest.mark.acceptance
@pytest.mark.parametrize("effect", [effect for effect in TRUTH if effect not in FAST])
def test_every_other_missing_effect_is_named(effect):
    check_named(effect)


@pytest.mark.long
def test_linear_bushings_are_at_the_noise_floor_whatever_the_nominal_stiffness():
    result = diagnosis_of(mounting_problem(mounting_campaign()))
    assert result.verdict == "at_noise_floor"
    estimate = result.attribution.parameters["baseline"]["K1"]
    assert abs(estimate.value - TRUE_LINEAR["K1"]) < 4.0 * estimate.std


@pytest.mark.long
def test_an_effect_that_the_baseline_contains_is_fitted_with_it_and_not_named():
    campaign = mounting_campaign({"P_T": 0.1}, effects=("parasitic_torque",))
    problem = mounting_problem(campaign)
    assert "parasitic_torque" not in problem.cards
    fit = fit_effects(problem, ())
    assert_allclose(fit.theta[2], 0.1, rtol=5e-3)


@pytest.mark.parametrize(
    "effect", ["cubic_stiffness", "sensor_delay", "sensor_gain", "ntl_direction"]
)
def test_derivatives_are_those_of_the_prediction(effect):
    problem = mounting_problem(mounting_campaign(TRUTH[effect][0], conditions=CONDITIONS[:2]))
    theta = problem.starts((effect,), {})[1].copy()
    theta[-1] += 0.05 * problem.parameters((effect,))[-1].scale
    chosen = np.ones(len(problem.segments), dtype=bool)
    sums = problem.sums((effect,), theta, chosen)
    slope, cost = -2.0 * sums.right_side.sum(axis=0), sums.square.sum()
    for k, parameter in enumerate(problem.parameters((effect,))):
        step = 1e-4 * parameter.scale * np.eye(theta.size)[k]
        costs = [problem.squares((effect,), theta + sign * step, chosen).sum() for sign in (1, -1)]
        # Against the largest slope that such a residual could have; forward differences of 1e-4 are
        # that exact.
        size = np.sqrt(sums.matrix.sum(axis=0)[k, k] * cost)
        assert abs((costs[0] - costs[1]) / (2e-4 * parameter.scale) - slope[k]) < 5e-3 * size


def test_records_are_thinned_alike_for_loads_and_signals():
    fine = mounting_campaign({"P_T": 0.1}, conditions=CONDITIONS[:2], step=0.01)
    record = mounting_records(fine)[0]
    assert_allclose(record.step, 0.02, rtol=1e-6)
    assert_allclose(record.noise, NOISE**2 / 2.0)
    fit = fit_effects(mounting_problem(fine), ("parasitic_torque",))
    # Thinned to 20 Hz the damping would be 2 % off.
    assert_allclose(fit.theta, [*TRUE_LINEAR.values(), 0.1], rtol=5e-3)


def test_noise_that_is_not_declared_is_found_in_the_signals():
    records = mounting_records(mounting_campaign(declared=False))
    assert_allclose(np.sqrt(np.mean([record.noise for record in records])), NOISE, rtol=0.05)


def test_patterns_keep_the_mean_square_and_a_roll_is_roll():
    names, matrix = _pattern_matrix(SENSORS, SENSORS)
    assert_allclose(matrix @ matrix.T, np.eye(6), atol=1e-15)
    roll = matrix @ np.array([0.0, 0.0, 0.75, -0.75, 0.0, 0.0])
    assert names[int(np.argmax(np.abs(roll)))] == "roll" == next(iter(_PATTERNS))
    assert_allclose(np.delete(roll, 0), 0.0, atol=1e-15)


def test_powers_of_the_bands_add_up_to_the_sum_of_squares():
    record = mounting_records(mounting_campaign(conditions=CONDITIONS[:1]))[0]
    edges_hz = np.array([0.0, 0.1, 1.0, 11.0])
    powers = block_powers(record.measured, record.block, record.step, edges_hz)
    assert_allclose(powers.sum(axis=(0, 2)), (record.measured**2).sum(axis=0), rtol=1e-10)
    assert _line_counts(record, edges_hz).sum() == len(record.measured)


def test_the_gap_of_unequal_bushings_is_vertical_and_follows_the_torque():
    problem = mounting_problem(mounting_campaign(TRUTH["unequal_bushings"][0]))
    (finding,) = problem.gap((), fit_effects(problem, ()).theta).findings().where
    assert (finding.kind, finding.patterns) == (MOTION, ("vertical",))
    assert (finding.follows.load, finding.follows.is_rate) == ("torque", False)
    assert finding.follows.correlation > 0.9


def test_a_missing_stretch_of_a_channel_is_left_out():
    campaign = mounting_campaign({"P_T": 0.1}, conditions=CONDITIONS[:2])
    campaign.runs[0].signals["ssz"][500:900] = np.nan
    problem = mounting_problem(campaign)
    assert_allclose(fit_effects(problem, ("parasitic_torque",)).theta[2], 0.1, rtol=5e-3)
    assert sum(segment.n_samples for segment in problem.segments) == 2 * 2600 * 6 - 400


def with_signals(campaign, change):
    runs = [
        replace(run, signals={name: change(name, values) for name, values in run.signals.items()})
        for run in campaign.runs
    ]
    return replace(campaign, runs=tuple(runs))


def test_unusable_campaigns_are_refused_in_plain_words():
    campaign = mounting_campaign(conditions=CONDITIONS[:1])
    with pytest.raises(ValueError, match="column 'spy' holds 0 measured samples"):
        mounting_problem(
            with_signals(
                campaign, lambda name, values: values * np.nan if name == "spy" else values
            )
        )
    with pytest.raises(ValueError, match="every channel is constant"):
        mounting_problem(with_signals(campaign, lambda name, values: 0.0 * values))
    with pytest.raises(ValueError, match="constant in every run; expected loads that change"):
        mounting_problem(mounting_campaign(conditions=((0.0, 0.0, 0.0),)))


def test_one_run_alone_is_diagnosed_by_its_blocks():
    result = diagnosis_of(
        mounting_problem(mounting_campaign(TRUTH["unequal_bushings"][0], conditions=CONDITIONS[:1]))
    )
    assert (result.verdict, result.attribution.effects) == ("named", ("unequal_bushings",))
    assert result.attribution.aliases == ()
    # One condition: nothing is left from which another could be predicted.
    assert np.isnan(result.reduction.extrapolation_rho)


def test_the_gain_is_looked_for_at_the_sensor_that_has_it():
    problem = mounting_problem(
        mounting_campaign(TRUTH["sensor_gain"][0], conditions=CONDITIONS[:2])
    )
    assert problem.choice(("sensor_gain",)) == {"sensor_gain": SENSORS.index("spz")}
    assert_allclose(fit_effects(problem, ("sensor_gain",)).theta[2], 0.05, rtol=1e-2)
