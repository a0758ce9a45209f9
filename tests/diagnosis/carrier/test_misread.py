"""A carrier whose signals are misread moves the fit by what the declared errors say."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.intervals import misread_moves
from carrierflex.diagnosis.inference.named_values import published_values
from carrierflex.identification.campaign.declarations import InputSignal
from tests.diagnosis.carrier.carrier_twin import CHANNELS, CURVES, twin_campaign

GAIN, ANGLE, TORQUE = 0.01, 0.004, 0.02
AXIAL = CHANNELS[:4]
EFFECT = ("torque_tilt",)


@pytest.fixture(scope="module")
def campaign():
    """Four axial sensors; the second and the torque declare their errors."""
    channels = (
        AXIAL[0],
        replace(AXIAL[1], gain_std=GAIN, angle_std=ANGLE),
        *AXIAL[2:],
    )
    made = twin_campaign("torque_tilt", channels=channels, turns=8)
    return replace(made, inputs=(InputSignal("torque", "N m", gain_std=TORQUE),))


def _misread(campaign, what):
    """Campaign as it is read one standard deviation off."""
    second = campaign.channels[1]
    if what == "angle":
        # The sensor stands further on than is declared.
        moved = replace(second, angle=second.angle - ANGLE)
        others = (campaign.channels[0], moved, *campaign.channels[2:])
        return replace(campaign, channels=others)
    runs = []
    for run in campaign.runs:
        signals = dict(run.signals)
        inputs = dict(run.inputs)
        if what == "gain":
            signals[second.name] = (1.0 + GAIN) * signals[second.name]
        else:
            inputs["torque"] = (1.0 + TORQUE) * inputs["torque"]
        runs.append(replace(run, signals=signals, inputs=inputs))
    return replace(campaign, runs=tuple(runs))


def test_misread_signals_move_the_fit_as_declared_errors_say(campaign):
    problem = carrier_problem(campaign, CURVES)
    fit = fit_effects(problem, EFFECT)
    misreading = problem.misreading(EFFECT, fit.theta)
    moves = misread_moves(fit, misreading.scores)
    number = {(error.signal, error.part.value): e for e, error in enumerate(misreading.errors)}
    for what, key in (
        ("torque", ("torque", "gain")),
        ("gain", (AXIAL[1].name, "gain")),
        ("angle", (AXIAL[1].name, "angle")),
    ):
        again = fit_effects(carrier_problem(_misread(campaign, what), CURVES), EFFECT)
        change = again.theta - fit.theta
        scale = np.array([parameter.scale for parameter in fit.parameters])
        # To first order: an error of 2 % leaves 2 % of its own change, and priors a little.
        assert_allclose(
            moves[number[key]] / scale,
            change / scale,
            atol=0.05 * np.abs(change / scale).max(),
        )
        assert np.abs(change / scale).max() > 1e-4


def test_published_intervals_hold_the_errors_and_the_words_say_so(campaign):
    problem = carrier_problem(campaign, CURVES)
    fit = fit_effects(problem, EFFECT)
    aware = published_values(problem, fit, floor_ratio=1.1)
    bare = replace(campaign, channels=AXIAL, inputs=())
    blind = published_values(carrier_problem(bare, CURVES), fit, floor_ratio=1.1)
    tilt, before = (own.parameters["torque_tilt"]["phi_T"] for own in (aware, blind))
    # Torque 2 % too large is a tilt per torque 2 % too small.
    assert tilt.std > TORQUE * tilt.value > 2.0 * before.std
    assert aware.gains.endswith("gains (torque 2 %, channels 1 %), angles (channels 0.229 deg)")
    assert blind.gains.startswith("loads taken as read")


def test_a_baseline_without_parameters_has_none_that_a_misread_signal_moves(campaign):
    bare = replace(campaign, baseline=replace(campaign.baseline, effects=()))
    problem = carrier_problem(bare, CURVES)
    fit = fit_effects(problem, ())
    assert not fit.parameters
    published = published_values(problem, fit, floor_ratio=1.0)
    assert published.parameters == {}
    assert "gains" in published.gains
