from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.model import effect_rows
from carrierflex.diagnosis.carrier.problem import CarrierProblem, carrier_problem
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.identification.campaign.campaign_kinds import CARRIER
from carrierflex.identification.campaign.declarations import Baseline
from carrierflex.simulation.carrier.effects.library import RADIAL_MOTION
from tests.diagnosis.carrier.carrier_twin import (
    CHANNELS,
    CURVES,
    INJECTED,
    LOADS,
    NOISE,
    twin_campaign,
    twin_problem,
)

EFFECTS = (
    *INJECTED,
    "pin_clearance",
    "bearing_clearance",
    "clearance_rocking",
    "sensor_gain",
    "sensor_angle",
    "sensor_zero",
    "sensor_delay",
)
FAST = ("carrier_tilt", "flange_warp", "sensor_gain", "sensor_delay", "bearing_clearance")


def diagnosis_of(problem):
    return diagnose(problem, campaign="twin", kind="carrier")


def check_named(effect, **options):
    result = diagnosis_of(twin_problem(effect, **options))
    # The twin holds the effect in the form of its card: nothing else explains it as well.
    assert (result.verdict, result.attribution.effects) == ("named", (effect,)), result.reason
    assert result.reduction.phi > 0.99
    assert result.reduction.floor_multiple == pytest.approx(1.0, abs=0.02)


def test_the_twins_hold_every_effect_of_the_contract():
    # What radial probes alone see has twins of its own (test_radial_motion.py).
    assert {*EFFECTS, "axial_offset", *RADIAL_MOTION} == set(CARRIER.effects)


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "options"),
    [
        # A tilt shows in every load; the others need all of them.
        (FAST[0], {"loads": LOADS[:4], "turns": 8}),
        *(pytest.param(effect, {}, marks=pytest.mark.long) for effect in FAST[1:]),
    ],
)
def test_a_missing_effect_is_named(effect, options):
    check_named(effect, **options)


#: Named elsewhere, or a tie: the zero of one of four sensors is a saddle (test_few_sensors.py).
ELSEWHERE = (*FAST, "sensor_zero")


@pytest.mark.acceptance
@pytest.mark.parametrize("effect", [effect for effect in EFFECTS if effect not in ELSEWHERE])
def test_every_other_missing_effect_is_named(effect):
    check_named(effect)


@pytest.mark.long
def test_nothing_missing_is_at_the_noise_floor():
    assert diagnosis_of(twin_problem(None)).verdict == "at_noise_floor"


@pytest.mark.long
def test_an_effect_outside_the_library_is_none_of_these():
    problem = twin_problem(
        None, extra=lambda channel, angle: 5e-5 * np.cos(10.0 * angle) * (channel.name == "s227")
    )
    assert diagnosis_of(problem).verdict == "none_of_these"


@pytest.mark.parametrize(
    "effect", ["sensor_gain", "sensor_angle", "sensor_delay", "pin_clearance", "clearance_rocking"]
)
def test_derivatives_are_those_of_the_prediction(effect):
    problem = twin_problem(effect, loads=((1.0, 0, 0), (0.6, 0, 1e5)), turns=3)
    theta = problem.starts((effect,), {})[-1].copy()
    # Off the values between which a shape is interpolated: the slope jumps there.
    for k, parameter in enumerate(problem.parameters((effect,))):
        if parameter.effect == effect:
            theta[k] = max(theta[k], 0.6 * parameter.scale) + 0.013 * (k + 1) * parameter.scale
    chosen = np.ones(len(problem.segments), dtype=bool)
    slope = -2.0 * problem.sums((effect,), theta, chosen).full_right_side().sum(axis=0)
    for k, parameter in enumerate(problem.parameters((effect,))):
        step = 1e-4 * parameter.scale * np.eye(theta.size)[k]
        cost = [problem.squares((effect,), theta + sign * step, chosen).sum() for sign in (1, -1)]
        # Central differences of a quadratic are exact but for rounding of the sums.
        size = np.sqrt(problem.sums((effect,), theta, chosen).total_matrix()[k, k] * cost[0])
        assert abs((cost[0] - cost[1]) / (2e-4 * parameter.scale) - slope[k]) < 1e-3 * size


def test_unknowns_of_other_runs_are_left_out_and_count_in_the_total():
    problem = twin_problem("thermal_drift", loads=LOADS[:3], turns=3)
    names = [
        (parameter.effect, parameter.run) for parameter in problem.parameters(("thermal_drift",))
    ]
    theta = problem.starts(("thermal_drift",), {})[-1]
    sums = problem.sums(("thermal_drift",), theta, np.ones(len(problem.segments), dtype=bool))
    # Offset and three drifts of one run, five that all runs share; not those of the two others.
    assert sums.matrix.shape[1:] == (9, 9)
    assert sums.right_side.shape[1:] == (9,)
    full = sums.full_right_side()
    for segment, right_side, row in zip(sums.unknowns, sums.right_side, full, strict=True):
        assert np.array_equal(row[segment], right_side)
        assert not np.delete(row, segment).any()
    total = sums.total_matrix()
    assert total.shape == (17, 17) == (len(names), len(names))
    run_of = [run for _, run in names]
    for i, j in np.ndindex(total.shape):
        apart = run_of[i] and run_of[j] and run_of[i] != run_of[j]
        assert (total[i, j] == 0.0) or not apart
    drifts = [k for k, owner in enumerate(names) if owner == ("thermal_drift", "run2")]
    assert (np.diag(total)[drifts] > 0.0).all()


def test_rows_that_all_runs_share_are_held_once():
    problem = twin_problem(loads=LOADS[:3], turns=3)
    base = problem.starts((), {})[-1]
    _, *of_effects = effect_rows(problem.model, tuple(problem.cards), base).groups
    assert len(of_effects) > len(problem.cards)
    for rows in of_effects:
        assert rows.weights.any()
        is_shared = np.array_equal(
            rows.weights, np.broadcast_to(rows.weights[:1], rows.weights.shape)
        )
        assert is_shared == (rows.weights.strides[0] == 0)
    assert sum(rows.weights.strides[0] == 0 for rows in of_effects) > 0.8 * len(of_effects)


@pytest.mark.long
def test_parameters_of_a_gain_and_a_threshold_are_recovered():
    gain = fit_effects(twin_problem("sensor_gain"), ("sensor_gain",))
    assert gain.parameters[-1].name == "g_s137"
    assert abs(gain.theta[-1] - 0.2) < 4.0 * np.sqrt(gain.covariance[-1, -1])
    closing = fit_effects(twin_problem("pin_clearance"), ("pin_clearance",))
    # Amplitudes of weight and radial load, of which the twin has none, stand between the two.
    assert_allclose(closing.theta[[-6, -1]], [1.5, 150e3], rtol=0.05)


@pytest.mark.long
def test_noise_is_measured_where_none_is_declared():
    campaign = twin_campaign(None)
    silent = replace(
        campaign, channels=tuple(replace(channel, noise_std=None) for channel in campaign.channels)
    )
    problem = carrier_problem(silent, CURVES)
    # 96 revolutions of 60 samples: the variance is known to a few per cent.
    assert_allclose(np.sqrt(problem.noise), NOISE, rtol=0.06)


def test_one_revolution_is_not_diagnosable():
    result = diagnosis_of(twin_problem(None, loads=((1.0, 0, 0),), turns=1))
    assert result.verdict == "not_diagnosable"
    assert "expected at least" in result.reason


def test_channels_that_say_nothing_are_refused():
    campaign = twin_campaign(None, turns=2)
    for value, message in ((np.nan, "is missing"), (1e-3, "is constant")):
        runs = tuple(
            replace(run, signals={**run.signals, "s137": np.full(run.time.size, value)})
            for run in campaign.runs
        )
        with pytest.raises(ValueError, match=f"s137.*{message}"):
            carrier_problem(replace(campaign, runs=runs), CURVES)


@pytest.mark.long
def test_another_simulators_prediction_is_the_baseline():
    campaign = twin_campaign("flange_warp")
    clean = twin_campaign(None, seed=1)
    runs = tuple(
        replace(run, predictions=dict(other.signals))
        for run, other in zip(campaign.runs, clean.runs, strict=True)
    )
    columns = replace(campaign, runs=runs, baseline=Baseline("columns", ("axial_offset",)))
    assert diagnosis_of(carrier_problem(columns, CURVES)).attribution.effects == ("flange_warp",)


@pytest.mark.long
def test_a_large_campaign_has_fewer_blocks_and_a_larger_one_is_refused(monkeypatch):
    usual = twin_problem()
    size = usual.records.products.nbytes
    monkeypatch.setattr("carrierflex.diagnosis.carrier.records.sums._USUAL_MEMORY", size // 3)
    smaller = twin_problem()
    assert len(smaller.segments) < len(usual.segments) / 2
    assert smaller.records.products.nbytes <= size // 3
    # The same record, in fewer blocks; products of orthogonal columns are rounding.
    every = np.arange(len(usual.records.index))
    result, expected = (problem.records.gram(every).sum(axis=0) for problem in (smaller, usual))
    size_of_column = np.sqrt(np.diagonal(expected, axis1=1, axis2=2))
    scale = size_of_column[:, :, None] * size_of_column[:, None, :]
    assert (np.abs(result - expected) <= 1e-9 * scale).all()
    monkeypatch.setattr("carrierflex.diagnosis.carrier.records.sums._MOST_MEMORY", size // 20)
    with pytest.raises(ValueError, match=r"runs of \d+ channels: a diagnosis takes"):
        twin_problem()


def test_runs_in_parts_have_the_sums_of_all_at_once(monkeypatch):
    at_once = twin_problem("flange_warp", loads=LOADS[:4], turns=3, channels=CHANNELS[2:5])
    effects = ("flange_warp", "sensor_delay")
    fit = fit_effects(at_once, effects)
    chosen = np.ones(len(at_once.segments), dtype=bool)
    chosen[::3] = False
    expected = at_once.sums(effects, fit.theta, chosen), at_once.squares(effects, fit.theta, chosen)
    monkeypatch.setattr("carrierflex.diagnosis.carrier.records.sums._AT_ONCE", 1)
    by_run = replace(at_once, records=replace(at_once.records))
    assert len(by_run.records.slices) == len(at_once.campaign.runs)
    sums, squares = (
        by_run.sums(effects, fit.theta, chosen),
        by_run.squares(effects, fit.theta, chosen),
    )
    scale = expected[0].square.max()
    assert_allclose(sums.square, expected[0].square, atol=1e-10 * scale)
    assert_allclose(squares, expected[1], atol=1e-10 * scale)
    assert_allclose(
        sums.total_matrix(chosen), expected[0].total_matrix(chosen), rtol=1e-9, atol=1e-15
    )
    grams = [problem.gram_table().total for problem in (by_run, at_once)]
    size = np.sqrt(np.diagonal(grams[1]))
    change = grams[0] - grams[1]
    assert (np.abs(change) <= 1e-9 * np.outer(size, size)).all()


def test_of_thresholds_that_leave_as_much_but_for_rounding_a_fit_begins_at_the_first(monkeypatch):
    problem = twin_problem(loads=LOADS[:2], turns=3)
    tried = []

    def rounded(self, effects, choice, start):
        """Fit of a start, which leaves a rounding less than the one before."""
        tried.append(start)
        return start, 1.0 - 1e-15 * len(tried)

    monkeypatch.setattr(CarrierProblem, "_closed_fit", rounded)
    theta = problem.starts(("pin_clearance",), {})[1]
    assert len(tried) > 5
    assert_allclose(theta, tried[0])
