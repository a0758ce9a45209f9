"""A mounting whose signals are misread moves the fit by what the declared errors say."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.intervals import misread_moves
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.identification.campaign.declarations import InputSignal
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, mounting_campaign

STD = 0.01
EFFECT = ("parasitic_torque",)


def _declared(campaign, sensor):
    """Campaign whose torque and one sensor declare the errors of their gains."""
    channels = tuple(
        replace(own, gain_std=STD) if own.name == sensor else own for own in campaign.channels
    )
    torque = InputSignal("torque", "N m", gain_std=STD)
    return replace(campaign, channels=channels, inputs=(torque,))


def _misread(campaign, signal):
    """Campaign with one signal read one standard deviation too large."""
    runs = []
    for run in campaign.runs:
        inputs = dict(run.inputs)
        signals = dict(run.signals)
        own = inputs if signal in inputs else signals
        own[signal] = (1.0 + STD) * own[signal]
        runs.append(replace(run, inputs=inputs, signals=signals))
    return replace(campaign, runs=tuple(runs))


def test_misread_signals_move_the_fit_as_declared_errors_say():
    made = mounting_campaign({"P_T": 0.05}, conditions=CONDITIONS[:2], seconds=60.0)
    campaign = _declared(made, "ssz")
    problem = mounting_problem(campaign)
    fit = fit_effects(problem, EFFECT)
    misreading = problem.misreading(EFFECT, fit.theta)
    moves = misread_moves(fit, misreading.scores)
    assert [error.signal for error in misreading.errors] == ["torque", "ssz"]
    scale = np.array([parameter.scale for parameter in fit.parameters])
    for signal, move in zip(("torque", "ssz"), moves, strict=True):
        again = fit_effects(mounting_problem(_misread(campaign, signal)), EFFECT)
        change = (again.theta - fit.theta) / scale
        # To first order in an error of 1 %.
        assert_allclose(move / scale, change, atol=0.05 * np.abs(change).max())
        assert np.abs(change).max() > 1e-3
