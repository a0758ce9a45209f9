"""A mounting whose signals are misread moves the fit by what the declared errors say."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.named_values import _misread_moves
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.identification.campaign.declarations import InputSignal
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, NOISE, mounting_campaign

STD = 0.01
EFFECT = ("parasitic_torque",)


def _declared(campaign, sensor):
    """Campaign whose torque and one sensor declare the errors of their gains."""
    channels = tuple(
        replace(channel, gain_std=STD) if channel.name == sensor else channel
        for channel in campaign.channels
    )
    torque = InputSignal("torque", "N m", gain_std=STD)
    return replace(campaign, channels=channels, inputs=(torque,))


def _misread(campaign, signal):
    """Campaign with one signal read one standard deviation too large."""
    runs = []
    for run in campaign.runs:
        inputs = dict(run.inputs)
        signals = dict(run.signals)
        columns = inputs if signal in inputs else signals
        columns[signal] = (1.0 + STD) * columns[signal]
        runs.append(replace(run, inputs=inputs, signals=signals))
    return replace(campaign, runs=tuple(runs))


@pytest.mark.long
def test_misread_signals_move_the_fit_as_declared_errors_say():
    made = mounting_campaign({"P_T": 0.05}, conditions=CONDITIONS[:2], seconds=60.0)
    campaign = _declared(made, "ssz")
    problem = mounting_problem(campaign)
    fit = fit_effects(problem, EFFECT)
    misreading = problem.misreading(EFFECT, fit.theta)
    moves = _misread_moves(fit, misreading.scores)
    assert [error.signal for error in misreading.errors] == ["torque", "ssz"]
    scale = np.array([parameter.scale for parameter in fit.parameters])
    # These records were not zeroed by their own noise.
    assert_allclose(moves[2:], 0.0)
    for signal, move in zip(("torque", "ssz"), moves[:2], strict=True):
        again = fit_effects(mounting_problem(_misread(campaign, signal)), EFFECT)
        change = (again.theta - fit.theta) / scale
        # To first order in an error of 1 %.
        assert_allclose(move / scale, change, atol=0.05 * np.abs(change).max())
        assert np.abs(change).max() > 1e-3


@pytest.mark.long
def test_noise_in_the_zero_of_a_run_moves_the_zero_of_a_sensor():
    made = mounting_campaign({"P_T": 0.05}, conditions=CONDITIONS[:2], seconds=60.0)
    first = int(made.rig["zeroing_samples"])
    runs = tuple(
        replace(run, signals={k: v - v[:first].mean() for k, v in run.signals.items()})
        for run in made.runs
    )
    problem = mounting_problem(replace(made, runs=runs))
    effects = ("sensor_zero",)
    fit = fit_effects(problem, effects)
    moves = _misread_moves(fit, problem.misreading(effects, fit.theta).scores)
    zero = [parameter.name for parameter in fit.parameters].index("z")
    # The mean of n samples of the noise in each of two runs alike; more as the signals are no noise
    # about zero, and stiffness makes up for a part.
    expected = NOISE / np.sqrt(2 * first)
    assert expected < np.sqrt((moves[:, zero] ** 2).sum()) < 1.3 * expected
