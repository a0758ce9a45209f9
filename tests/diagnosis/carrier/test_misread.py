"""A carrier whose signals are misread moves the fit by what the declared errors say."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.misread import _rigs_of_curve_errors
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.inference.named_values import _misread_moves, published_values
from carrierflex.identification.campaign.declarations import InputSignal
from carrierflex.simulation.sensing import delayed_angle
from tests.diagnosis.carrier.carrier_twin import (
    CARRIER_RIG,
    CHANNELS,
    CURVES,
    LOADS,
    twin_campaign,
)

GAIN, ANGLE, TORQUE, DELAY = 0.01, 0.004, 0.02, 2e-3
AXIAL = CHANNELS[:4]
RADIUS = AXIAL[0].radius
RADIUS_STD = 0.01 * RADIUS
EFFECT = ("torque_tilt",)
#: Three loads determine every effect here; a move is a ratio that more of them leave as it is.
SHORT = {"loads": LOADS[:3], "turns": 4}


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


def turned(run):
    return run.inputs["carrier_angle"]


def _misread(campaign, what):
    """Campaign as it is read one standard deviation off."""
    second = campaign.channels[1]
    if what == "delay":
        late = {
            late_run.name: delayed_angle(late_run.time, turned(late_run), -DELAY)
            for late_run in campaign.runs
        }
        runs = [
            replace(run, inputs={**run.inputs, "carrier_angle": late[run.name]})
            for run in campaign.runs
        ]
        return replace(campaign, runs=tuple(runs))
    if what in ("angle", "radius"):
        # The sensor is further on, or further out, than is declared.
        smaller = {"angle": second.angle - ANGLE, "radius": second.radius - RADIUS_STD}
        moved = replace(second, **{what: smaller[what]})
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


@pytest.mark.long
def test_misread_signals_move_the_fit_as_declared_errors_say(campaign):
    problem = carrier_problem(campaign, CURVES)
    fit = fit_effects(problem, EFFECT)
    misreading = problem.misreading(EFFECT, fit.theta)
    moves = _misread_moves(fit, misreading.scores)
    number = {(error.signal, error.quantity.value): e for e, error in enumerate(misreading.errors)}
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


def _moved(problem, effects, row):
    """Moves of a fit in scales of its parameters, and those scales."""
    fit = fit_effects(problem, effects)
    moves = _misread_moves(fit, problem.misreading(effects, fit.theta).scores[row][None])[0]
    return fit, moves, np.array([parameter.scale for parameter in fit.parameters])


@pytest.mark.long
@pytest.mark.parametrize(
    ("effects", "what"),
    [
        # Waves that no sensor's own effect moves; a delay of 3 degrees beside what is late by it.
        (("face_runout",), "angle"),
        (("ring_pass",), "delay"),
        (("torque_tilt",), "radius"),
        (("sensor_delay",), "angle"),
    ],
)
def test_places_and_delays_move_whatever_is_fitted(effects, what):
    declared = {
        "angle": {"angle_std": ANGLE},
        "delay": {"delay_std": DELAY},
        "radius": {"radius_std": RADIUS_STD},
    }[what]
    channels = (AXIAL[0], replace(AXIAL[1], **declared), *AXIAL[2:])
    campaign = twin_campaign(*effects, channels=channels, **SHORT)
    problem = carrier_problem(campaign, CURVES)
    fit, moves, scale = _moved(problem, effects, 0)
    source = {"angle": "probe angles", "delay": "delay", "radius": "probe radius"}[what]
    assert problem.misreading(effects, fit.theta).sources[0] == source
    again = fit_effects(carrier_problem(_misread(campaign, what), CURVES), effects)
    change = (again.theta - fit.theta) / scale
    of_effects = np.array([parameter.effect in effects for parameter in fit.parameters])
    assert np.abs(change[of_effects]).max() > 1e-4
    assert_allclose(moves / scale, change, atol=0.05 * np.abs(change).max())
    assert_allclose(
        (moves / scale)[of_effects],
        change[of_effects],
        atol=0.05 * np.abs(change[of_effects]).max(),
    )


@pytest.mark.long
def test_waves_of_a_curve_that_are_off_move_the_fit_as_a_fit_with_such_curves_does():
    campaign = twin_campaign("ring_pass", channels=AXIAL, **SHORT)
    # Curves whose size has no error of the mesh.
    curves = {name: replace(curve, mesh_error=0.0) for name, curve in CURVES.items()}
    fit, _, scale = _moved(carrier_problem(campaign, curves), ("ring_pass",), 0)
    misreading = carrier_problem(campaign, curves).misreading(("ring_pass",), fit.theta)
    assert not misreading.errors
    changes = []
    for rig in _rigs_of_curve_errors(replace(CARRIER_RIG, curves=curves)):
        again = fit_effects(carrier_problem(campaign, rig.curves), ("ring_pass",))
        changes.append((again.theta - fit.theta) / scale)
    shown = [change for change in changes if np.abs(change).max() > 1e-5]
    moves = _misread_moves(fit, misreading.scores) / scale
    # Orders 6 and 9 of flexible pins under torque; those of a single pin are in no column.
    assert len(moves) == len(shown) == 2
    for move, change in zip(moves, shown, strict=True):
        assert_allclose(move, change, atol=0.1 * np.abs(change).max())
    # At these sensors a tilt at order 3 is order 3 of the pins: order 6 tells how much is whose.
    names = [parameter.name for parameter in fit.parameters]
    in_metres = dict(zip(names, np.abs(moves[0]) * scale, strict=True))
    assert RADIUS * in_metres["q_c"] > 20.0 * in_metres["p_c"]


def test_a_curve_that_is_too_small_as_a_whole_is_no_error():
    for rig in _rigs_of_curve_errors(CARRIER_RIG):
        changed = [name for name in CURVES if rig.curves[name] is not CURVES[name]]
        for name in changed:
            before, after = (
                curves.axial_order_content() for curves in (CURVES[name], rig.curves[name])
            )
            moved = np.flatnonzero(~np.isclose(after, before, rtol=1e-6, atol=1e-3 * before.max()))
            assert len(moved) <= 1
            assert moved.tolist() != [int(before[1:].argmax()) + 1]


@pytest.mark.long
def test_published_intervals_hold_the_errors_and_the_words_say_so(campaign):
    problem = carrier_problem(campaign, CURVES)
    fit = fit_effects(problem, EFFECT)
    aware = published_values(problem, fit, floor_ratio=1.1)
    bare = replace(campaign, channels=AXIAL, inputs=())
    blind = published_values(carrier_problem(bare, CURVES), fit, floor_ratio=1.1)
    tilt, before = (published.parameters["torque_tilt"]["phi_T"] for published in (aware, blind))
    # Torque 2 % too large is a tilt per torque 2 % too small.
    assert tilt.std > TORQUE * tilt.value > 2.0 * before.std
    declared, of_curves = aware.gains.split("; ")
    assert declared.endswith("gains (torque 2 %, channels 1 %), angles (channels 0.229 deg)")
    assert of_curves.endswith("of the curves by their mesh (rho_f 5.7%)")
    assert blind.gains.startswith("load-cell errors are not included")


@pytest.mark.long
def test_an_interval_of_the_pins_holds_the_known_error_of_the_curves_size(campaign):
    exact = {name: replace(curve, mesh_error=0.0) for name, curve in CURVES.items()}
    as_read = replace(campaign, channels=AXIAL, inputs=())
    published = [
        published_values(problem, fit_effects(problem, EFFECT), floor_ratio=1.1)
        for problem in (carrier_problem(as_read, curves) for curves in (CURVES, exact))
    ]
    known, unknown = (values.parameters["flexible_pins"]["rho_f"] for values in published)
    half = np.diff(known.ci95).item() / 2.0
    # Of 5.7 % of the size, and what the interval holds besides.
    assert half >= 0.99 * np.hypot(0.057 * known.value, np.diff(unknown.ci95).item() / 2.0)
    assert half < 0.08 * known.value
    assert np.diff(unknown.ci95) < 0.5 * half
    assert published[1].gains.endswith("mesh (curves --mesh-error) is not included")


def test_a_baseline_without_parameters_has_none_that_a_misread_signal_moves(campaign):
    bare = replace(campaign, baseline=replace(campaign.baseline, effects=()))
    problem = carrier_problem(bare, CURVES)
    fit = fit_effects(problem, ())
    assert not fit.parameters
    published = published_values(problem, fit, floor_ratio=1.0)
    assert published.parameters == {}
    assert "gains" in published.gains
