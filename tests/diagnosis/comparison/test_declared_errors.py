"""Declared errors of signals move the parameters by as much as least squares lets them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.comparison.known_physics import (
    LOADS_AS_READ,
    DeclaredError,
    DeclaredGains,
    KnownPhysics,
    declared_errors,
    errors_words,
)
from carrierflex.diagnosis.comparison.problem import Parameter, SegmentSums
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.diagnosis.inference.effect_fit import EffectFit, Prior, fit_effects
from carrierflex.diagnosis.inference.named_values import _misread_moves, _prior_moves
from carrierflex.identification.campaign.declarations import Channel, InputSignal
from carrierflex.simulation.measurement import Measurement
from tests.diagnosis.element.element_campaigns import displacement_campaign

STD = 0.02


def _linear_fit(columns, target):
    """Fit of channels by least squares, columns of shape (C, n, p)."""
    flat = columns.reshape(-1, columns.shape[2])
    theta = np.linalg.lstsq(flat, target.ravel(), rcond=None)[0]
    residual = target - columns @ theta
    sums = SegmentSums(
        (flat.T @ flat)[None],
        (flat.T @ residual.ravel())[None],
        np.array([residual.ravel() @ residual.ravel()]),
    )
    p = theta.size
    unknowns = tuple(
        Parameter(f"x{k}", "m", -np.inf, np.inf, 1.0, effect="baseline") for k in range(p)
    )
    no_bound = np.zeros(p, dtype=bool)
    return EffectFit((), unknowns, theta, 0.0, sums, Prior.none(p), no_bound)


def _moved(columns, target, fit):
    """Root of the sum of squares of the moves by a gain of each channel."""
    scores = STD * np.array(
        [of_channel.T @ signal for of_channel, signal in zip(columns, target, strict=True)]
    )
    return np.sqrt((_misread_moves(fit, scores) ** 2).sum(axis=0))


def test_alike_channels_share_their_gains_and_a_channel_alone_has_its_own():
    rng = np.random.default_rng(1)
    shared, lone = rng.standard_normal((2, 300))
    lone -= lone @ shared / (shared @ shared) * shared
    columns = np.zeros((5, 300, 2))
    columns[:4, :, 0] = shared
    columns[4, :, 1] = lone
    target = columns @ np.array([3.0, -2.0])
    fit = _linear_fit(columns, target)
    assert_allclose(_moved(columns, target, fit), [STD * 3.0 / np.sqrt(4), STD * 2.0], rtol=1e-9)


def test_a_held_parameter_does_not_move_and_leaves_the_others_more():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((2, 300, 2))
    columns[..., 1] += columns[..., 0]
    target = columns @ np.array([3.0, -2.0])
    fit = _linear_fit(columns, target)
    fixed = replace(fit.parameters[1], lower=-2.0, upper=-2.0)
    alone = replace(fit, parameters=(fit.parameters[0], fixed))
    moved = _moved(columns, target, alone)
    assert moved[1] == 0.0
    first = columns[..., 0]
    by_hand = STD * (first * target).sum(axis=1) / (first**2).sum()
    assert_allclose(moved[0], np.sqrt((by_hand**2).sum()), rtol=1e-9)


def test_a_prior_that_the_records_contradict_is_an_error_as_large_as_its_pull():
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((1, 300, 1))
    target = 5.0 * columns[..., 0]
    fit = _linear_fit(columns, target)
    square = fit.sums.total_matrix()[0, 0]
    zero = np.zeros(1)
    for weight in (1e-3 * square, 1e3 * square):
        prior = Prior(np.array([weight]), zero, np.ones(1, dtype=bool))
        theta = np.array([5.0 * square / (square + weight)])
        drawn = replace(fit, theta=theta, prior=prior)
        pull = _prior_moves(drawn)[0, 0]
        assert_allclose(pull, -theta[0] * weight / (square + weight), rtol=1e-9)
    # Records that tell the value alone: what the prior took away.
    prior = Prior(np.array([1e-3 * square]), zero, np.ones(1, dtype=bool))
    theta = np.array([5.0 / 1.001])
    assert_allclose(
        _prior_moves(replace(fit, theta=theta, prior=prior))[0, 0], theta[0] - 5.0, rtol=2e-3
    )


@pytest.mark.parametrize("at_bound", [False, True])
def test_what_a_prior_alone_tells_apart_is_as_uncertain_as_the_prior(at_bound):
    """Also where the fit meets the end of the prior's range, which is no physical bound."""
    columns = np.random.default_rng(4).standard_normal((1, 300, 1)) * np.ones(2)
    fit = _linear_fit(columns + 1e-9 * np.arange(2), 5.0 * columns[..., 0])
    square = fit.sums.total_matrix()[0, 0]
    prior = Prior(np.array([0.0, 1e-6 * square]), np.zeros(2), np.ones(2, dtype=bool))
    known = replace(fit.parameters[1], prior_std=2.0)
    drawn = replace(
        fit,
        parameters=(fit.parameters[0], known),
        theta=np.array([5.0, 0.0]),
        prior=prior,
        at_bound=np.array([False, at_bound]),
    )
    assert_allclose(_prior_moves(drawn), [[-2.0, 2.0]], rtol=1e-3)


@pytest.mark.parametrize(("force", "deflection"), [(1e-3, 0.0), (0.0, 1e-3)])
def test_powers_of_an_element_are_the_case_of_one_channel(force, deflection):
    campaign = displacement_campaign(lambda q, v: 5e8 * q**3, n=1500)
    runs = tuple(
        replace(
            run,
            inputs={"displacement": (1.0 + deflection) * run.inputs["displacement"]},
            signals={"F": (1.0 + force) * run.signals["F"]},
        )
        for run in campaign.runs
    )
    effects = ("cubic_stiffness",)
    problem = element_problem(campaign)
    fit = fit_effects(problem, effects)
    misread = element_problem(replace(campaign, runs=runs))
    everything = np.ones(len(problem.segments), dtype=bool)
    scores = [
        compared.sums(effects, fit.theta, everything).full_right_side().sum(axis=0)
        for compared in (problem, misread)
    ]
    moves = _misread_moves(fit, np.array([scores[1] - scores[0]]))[0]
    gains = DeclaredGains(force, deflection)
    powers = {"m": (1, -1, 2), "K1": (1, -1, 0), "C1": (1, -1, 1), "K3": (1, -3, 0)}
    for parameter, move, value in zip(fit.parameters, moves, fit.theta, strict=True):
        if parameter.name in powers:
            expected = gains.of(powers[parameter.name]) * abs(value)
            # To first order, and the columns move with the noise that is left: 1.2 % at most.
            assert_allclose(abs(move), expected, rtol=0.03)


def test_errors_are_those_that_are_declared_and_the_delay_is_one():
    channels = (
        Channel("a", "axial_displacement", "m", gain_std=0.01, angle_std=0.005, delay_std=1e-3),
        Channel("b", "axial_displacement", "m", zero_std=1e-6, delay_std=2e-3),
    )
    known = KnownPhysics(channels=channels, inputs=(InputSignal("torque", "N m", gain_std=0.02),))
    assert set(declared_errors(known)) == {
        DeclaredError("torque", Measurement.GAIN, 0.02),
        DeclaredError("a", Measurement.GAIN, 0.01, 0),
        DeclaredError("a", Measurement.ANGLE, 0.005, 0),
        DeclaredError("b", Measurement.ZERO, 1e-6, 1),
        DeclaredError("a", Measurement.DELAY, 2e-3),
    }
    assert [error.is_of_input for error in declared_errors(known)] == [True] + 4 * [False]


def test_words_say_what_is_declared_and_that_loads_are_taken_as_read():
    torque = DeclaredError("torque", Measurement.GAIN, 0.01)
    channels = [DeclaredError(name, Measurement.GAIN, 0.02, k) for k, name in enumerate("ab")]
    turned = DeclaredError("a", Measurement.ANGLE, float(np.deg2rad(0.5)), 0)
    assert errors_words(()) == LOADS_AS_READ
    assert errors_words(channels).endswith(f"gains (channels 2 %); {LOADS_AS_READ}")
    assert errors_words((torque, *channels, turned)) == (
        "intervals hold the declared standard deviations of gains (torque 1 %, channels 2 %), "
        "angles (channels 0.5 deg)"
    )
