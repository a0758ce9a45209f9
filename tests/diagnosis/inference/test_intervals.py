"""Intervals of parameters hold the truth beside coloured noise and beside gains that are off."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter
from scipy.stats import t as student_t

from carrierflex.diagnosis.comparison.known_physics import DeclaredGains
from carrierflex.diagnosis.comparison.problem import Parameter, SegmentSums
from carrierflex.diagnosis.element.noise import declared_gains
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import EffectFit, Prior, fit_effects
from carrierflex.diagnosis.inference.named_values import (
    _named_values,
    _scatter,
    _small_sample_factor,
)
from carrierflex.identification.campaign.declarations import InputSignal
from carrierflex.identification.estimation.resampling import NORMAL_95
from tests.diagnosis.element.element_campaigns import (
    DAMPING,
    STIFFNESS,
    displacement_campaign,
    force_campaign,
)

CUBIC = 5e8
N_BLOCKS = 10
N_SAMPLES = 200
N_PARAMETERS = 4
TRUTH = np.array([1.0, -2.0, 0.5, 3.0])


def _slow(rng):
    """Signal whose neighbouring samples are alike (first order, pole at 0.9)."""
    white = rng.standard_normal(N_BLOCKS * N_SAMPLES + 100)
    return lfilter([1.0], [1.0, -0.9], white)[100:].reshape(N_BLOCKS, N_SAMPLES)


def _linear_fit(rng):
    """Least squares of slow regressors beside slow noise, with the sums of every block."""
    regressors = np.stack([_slow(rng) for _ in range(N_PARAMETERS)], axis=2)
    target = regressors @ TRUTH + _slow(rng)
    flat = regressors.reshape(-1, N_PARAMETERS)
    theta = np.linalg.lstsq(flat, target.ravel(), rcond=None)[0]
    residual = target - regressors @ theta
    sums = SegmentSums(
        np.einsum("bip,biq->bpq", regressors, regressors),
        np.einsum("bip,bi->bp", regressors, residual),
        np.einsum("bi,bi->b", residual, residual),
    )
    unknowns = tuple(
        Parameter(f"x{k}", "m", -np.inf, np.inf, 1.0, effect="baseline")
        for k in range(N_PARAMETERS)
    )
    nowhere = np.zeros(N_PARAMETERS, dtype=bool)
    cost = float(sums.square.sum())
    return EffectFit((), unknowns, theta, cost, sums, Prior.none(N_PARAMETERS), nowhere)


def test_blocks_cover_where_white_noise_and_normal_quantiles_do_not():
    rng = np.random.default_rng(11)
    hits = {"white": [], "normal": [], "student": []}
    for _ in range(400):
        fit = _linear_fit(rng)
        error = np.abs(fit.theta - TRUTH)
        inverse = np.linalg.inv(fit.sums.matrix.sum(axis=0))
        variance = fit.cost / (N_BLOCKS * N_SAMPLES - N_PARAMETERS)
        hits["white"].append(error < 1.96 * np.sqrt(variance * np.diag(inverse)))
        for name, few in (("normal", False), ("student", True)):
            values = _named_values(fit, _scatter(fit, few_blocks=few))["baseline"]
            hits[name].append(
                [
                    values[f"x{k}"].ci95[0] < TRUTH[k] < values[f"x{k}"].ci95[1]
                    for k in range(N_PARAMETERS)
                ]
            )
    covered = {name: float(np.mean(all_of)) for name, all_of in hits.items()}
    # Nominal 0.95. With four parameters beside ten blocks both corrections together are on the wide
    # side: 0.975, 0.986 and 0.983 for seeds 11, 101 and 202, where the normal quantile gives 0.896,
    # 0.914 and 0.907.
    assert covered["white"] < 0.6
    assert covered["normal"] < 0.94
    assert 0.94 < covered["student"]


def test_small_sample_factor_counts_the_parameters_that_moved():
    fit = _linear_fit(np.random.default_rng(3))

    def factor(changed):
        plain, few = (
            _named_values(changed, _scatter(changed, few_blocks=few))["baseline"]["x0"].std
            for few in (False, True)
        )
        return few / plain

    assert_allclose(factor(fit), student_t.ppf(0.975, 6) / NORMAL_95 * np.sqrt(9 / 6))
    on_bound = replace(fit, at_bound=np.array([False, True, False, False]))
    assert_allclose(factor(on_bound), student_t.ppf(0.975, 7) / NORMAL_95 * np.sqrt(9 / 7))
    fixed = replace(fit.parameters[3], lower=1.0, upper=1.0)
    with_held = replace(fit, parameters=(*fit.parameters[:3], fixed))
    assert_allclose(factor(with_held), student_t.ppf(0.975, 7) / NORMAL_95 * np.sqrt(9 / 7))


def test_a_value_that_is_held_is_no_unknown_of_the_covariance():
    fit = _linear_fit(np.random.default_rng(3))
    fixed = replace(fit.parameters[3], lower=1.0, upper=1.0)
    covariance = replace(fit, parameters=(*fit.parameters[:3], fixed)).covariance
    without = replace(
        fit,
        parameters=fit.parameters[:3],
        theta=fit.theta[:3],
        sums=SegmentSums(fit.sums.matrix[:, :3, :3], fit.sums.right_side[:, :3], fit.sums.square),
        prior=Prior.none(3),
    )
    assert_allclose(covariance[:3, :3], without.covariance, rtol=1e-9)
    assert not covariance[3].any()


def test_parameters_of_runs_of_one_block_take_no_degree_of_freedom_of_the_others():
    fit = _linear_fit(np.random.default_rng(3))
    of_run = replace(fit.parameters[3], run="first")

    def factor(n_blocks):
        """Factor where the last unknown acts in so many blocks."""
        matrix = fit.sums.matrix.copy()
        matrix[n_blocks:, 3], matrix[n_blocks:, :, 3] = 0.0, 0.0
        sums = replace(fit.sums, matrix=matrix)
        return _small_sample_factor(
            replace(fit, parameters=(*fit.parameters[:3], of_run), sums=sums)
        )

    three, four = (student_t.ppf(0.975, 10 - p) / NORMAL_95 * np.sqrt(9 / (10 - p)) for p in (3, 4))
    assert_allclose(factor(1), three)
    assert_allclose(factor(2), four)
    # The same where sums keep the unknowns of every block alone.
    unknowns = np.tile(np.arange(4), (10, 1))
    unknowns[1:, 3] = 0
    short = SegmentSums(fit.sums.matrix, fit.sums.right_side, fit.sums.square, unknowns, 4)
    assert short.n_segments_of_each().tolist() == [19, 10, 10, 1]


def test_no_interval_where_blocks_are_no_more_than_parameters():
    fit = _linear_fit(np.random.default_rng(3))
    few = replace(
        fit,
        sums=SegmentSums(
            *(sums[:4] for sums in (fit.sums.matrix, fit.sums.right_side, fit.sums.square))
        ),
    )
    value = _named_values(few, _scatter(few, few_blocks=True))["baseline"]["x0"]
    assert np.isnan([value.std, *value.ci95]).all()


def _misread(campaign, force, deflection):
    """Campaign whose signals are read by these factors too large."""
    runs = tuple(
        replace(
            run,
            inputs={"displacement": deflection * run.inputs["displacement"]},
            signals={"F": force * run.signals["F"]},
        )
        for run in campaign.runs
    )
    return replace(campaign, runs=runs)


def _declared(campaign, force, deflection):
    return replace(
        campaign,
        channels=(replace(campaign.channels[0], gain_std=force),),
        inputs=(InputSignal("displacement", "m", gain_std=deflection),),
    )


@pytest.mark.parametrize(("force", "deflection"), [(1.01, 1.0), (1.0, 1.03)])
def test_declared_gains_hold_what_misread_signals_shift(force, deflection):
    right = displacement_campaign(lambda q, v: CUBIC * q**3, n=1500)
    wrong = _misread(right, force, deflection)
    declared = _declared(wrong, 0.01, 0.03)
    fits = [
        fit_effects(element_problem(campaign), ("cubic_stiffness",))
        for campaign in (right, wrong, declared)
    ]
    values = [_named_values(fit, _scatter(fit, few_blocks=True)) for fit in fits]
    exact, blind, aware = [value["cubic_stiffness"]["K3"] for value in values]
    # K3 q^3 scales as force over the third power of deflection, exactly.
    assert_allclose(blind.value, exact.value * force / deflection**3, rtol=1e-4)
    assert not blind.ci95[0] < CUBIC < blind.ci95[1]
    assert aware.ci95[0] < CUBIC < aware.ci95[1]
    gain = np.hypot(1 * 0.01, 3 * 0.03)
    assert_allclose(aware.std**2, blind.std**2 + (gain * aware.value) ** 2, rtol=1e-6)
    for name, truth in (("K1", STIFFNESS), ("C1", DAMPING)):
        base, plain = values[2]["baseline"][name], values[1]["baseline"][name]
        gain_error = np.hypot(0.01, 0.03) * base.value
        assert_allclose(base.std**2, plain.std**2 + gain_error**2, rtol=1e-6)
        assert base.ci95[0] < truth < base.ci95[1]


def test_signals_that_share_a_gain_lose_it():
    gains = DeclaredGains(force=0.01, deflection=0.03)
    assert_allclose(gains.of((0, -2, 0)), 0.06)  # K3 / K1
    decay = DeclaredGains(deflection=0.03, force_is_inertia=True)
    assert decay.of((1, -1, 0)) == 0.0  # a natural frequency knows no gain
    assert_allclose(decay.of((1, -3, 0)), 0.06)
    assert decay.words == "intervals hold the declared standard deviations of gains: deflection 3 %"


def test_gains_belong_to_the_signal_that_declares_them():
    moved = displacement_campaign(lambda q, v: 0.0 * q, n=200)
    assert declared_gains(moved).words == "gain errors are not included"
    assert declared_gains(_declared(moved, 0.01, 0.03)) == DeclaredGains(0.01, 0.03)
    driven = force_campaign(lambda q, v: CUBIC * q**3)
    driven = replace(driven, inputs=(InputSignal("force", "N", gain_std=0.02),))
    assert declared_gains(driven) == DeclaredGains(force=0.02)
    assert declared_gains(driven).words.endswith("force 2 %; that of the deflection taken as exact")
    free = tuple(replace(run, inputs={}) for run in driven.runs)
    released = replace(driven, rig={"drive": "free_decay"}, inputs=(), runs=free)
    assert declared_gains(released).force_is_inertia
