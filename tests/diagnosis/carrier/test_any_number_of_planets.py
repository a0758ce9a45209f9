"""Carriers of three to eight planets: orders, texts and verdicts are those of their own number."""

import re
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from carrierflex.diagnosis.carrier.classes.class_rows import class_rows
from carrierflex.diagnosis.carrier.model import _lagrange
from carrierflex.diagnosis.carrier.pictures import pins_passing
from carrierflex.diagnosis.carrier.records.columns import angle_nodes, delay_nodes, flexible_terms
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.fe.carrier_curves import named_curves
from carrierflex.identification.campaign.campaign_kinds import campaign_kind
from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.simulation.carrier.effects.of_planets import effects_of
from carrierflex.simulation.carrier.patterns import pin_radius_of
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.workflows.fe.carrier_variants import solved_carrier
from tests.diagnosis.carrier.carrier_twin import CARRIER_RIG, CHANNELS, CURVES, twin_problem
from tests.reduction.test_any_number_of_planets import stage_of

NUMBERS = range(3, 9)
COARSE = 0.06
EVERY_LOAD = ((1.0, 0, 0), (0.5, 0, 0), (0.75, 0, -2e5), (0.25, 1e5, 1e5))


@cache
def rig_of(n_planets):
    """Rig with the curves of a carrier of this number of planets, by finite elements."""
    stage = stage_of(n_planets)
    stiff, flexible = (solved_carrier(name, stage, COARSE) for name in ("stiff", "flexible"))
    curves = named_curves(stiff.deflection, flexible.deflection)
    radius = pin_radius_of(curves["delta_f"], curves["g_f"], n_planets)
    return CarrierRig(360e3, n_planets, radius, curves)


def texts_of(effect):
    return (effect.equation, effect.signature, effect.discriminating_experiment)


def test_effects_of_three_planets_are_those_of_the_contract():
    for name, effect in effects_of(3).items():
        assert texts_of(effect) == texts_of(CARRIER_EFFECTS[name])
        assert effect.parameters == CARRIER_EFFECTS[name].parameters


@pytest.mark.parametrize("n", NUMBERS)
def test_texts_speak_of_the_planets_own_orders(n):
    effects = effects_of(n)
    assert effects["flexible_pins"].signature.startswith(f"order {n}, m = ")
    assert effects["stiff_pins"].signature.startswith(f"order {2 * n}, m = ")
    assert f"cos {n} theta and sin {n} theta" in effects["ring_pass"].equation
    assert f"order {n} changes slope" in effects["pin_clearance"].discriminating_experiment
    uneven = re.findall(r"\d+", effects["unequal_load_sharing"].signature)
    assert [int(order) for order in uneven] == [k for k in range(1, 2 * n) if k != n]
    if n not in (3, 6):
        spoken = " ".join(text for effect in effects.values() for text in texts_of(effect))
        assert not re.search(r"orders? [36]\b(?!,)", spoken.replace("orders 1, 2, 3", ""))


@pytest.mark.parametrize("n", NUMBERS)
def test_signals_have_as_many_parameters_as_the_effect(n):
    angle = np.linspace(0.0, 6.0, 5)
    inputs = CarrierInputs(angle, angle, 1e5 + angle, angle, angle, 0.0, 6.0)
    rig = CarrierRig(360e3, n, CARRIER_RIG.pin_radius, CURVES)
    for name in ("unequal_load_sharing", "face_runout", "ring_pass"):
        effect = effects_of(n)[name]
        signals = effect.signals(RimSensor(0.5, 0.4, is_axial=True), inputs, rig)
        assert len(signals) == len(effect.parameters)
        known = campaign_kind("carrier", {"n_planets": n}).parameters[name]
        assert known == tuple(parameter.name for parameter in effect.parameters)


@pytest.mark.parametrize("n", NUMBERS)
def test_every_class_finds_its_waves_among_the_columns_of_the_flexible_model(n):
    rig = CarrierRig(360e3, n, CARRIER_RIG.pin_radius, CURVES)
    rows = class_rows(CHANNELS, rig, np.ones((2, 3)), 2)
    assert rows.of_run(0).shape == (rows.size + 1, len(CHANNELS), 2 + len(flexible_terms(n)))
    assert max(order for order, *_ in flexible_terms(n)) == highest_order(n) == 4 * n


@pytest.mark.parametrize("n", NUMBERS)
@pytest.mark.parametrize("nodes_of", [angle_nodes, delay_nodes])
def test_shifted_signals_are_met_at_the_second_order_of_the_planets(n, nodes_of):
    nodes = nodes_of(n)
    for shift in np.linspace(nodes[0], nodes[-1], 41):
        weights, _ = _lagrange(nodes, shift)
        # Over all phases at once: the wave and its interpolation as complex numbers.
        error = np.abs(weights @ np.exp(2j * n * nodes) - np.exp(2j * n * shift))
        assert error < 0.005


@pytest.mark.long
@pytest.mark.parametrize(("n", "order"), [(4, 8), (5, 10), (5, 15), (7, 28)])
def test_the_map_holds_the_orders_of_many_planets(n, order):
    rig = CarrierRig(360e3, n, CARRIER_RIG.pin_radius, CURVES)

    def wave(channel, angle):
        return 3e-5 * np.cos(order * (channel.angle - angle)) * (channel in CHANNELS[:4])

    problem = twin_problem(
        None, contained=("axial_offset",), extra=wave, turns=6, loads=EVERY_LOAD[:1], rig=rig
    )
    theta = problem.starts((), {})[-1]
    cells = [cell for cell in problem.gap((), theta).cells if cell.order == order]
    largest = max(cells, key=lambda cell: cell.coherent)
    assert largest.channel_pattern == ("m=0", "m=+1", "m=2", "m=-1")[order % 4]
    # Four of six channels, half the squared amplitude.
    assert_allclose(largest.coherent, (3e-5) ** 2 / 2.0 * 4.0 / 6.0, rtol=0.05)


def test_pins_pass_a_sensor_as_often_as_there_are_planets():
    for n in NUMBERS:
        steps = np.diff(np.sort(list(pins_passing(0.3, n).values())))
        assert len(steps) == n - 1
        assert_allclose(steps, 2.0 * np.pi / n)


@pytest.mark.long
@pytest.mark.parametrize(
    ("n", "effect"),
    [
        (4, "carrier_tilt"),
        (4, "ring_pass"),
        (4, None),
        (5, "pin_clearance"),
        (5, "ring_pass"),
        (4, "flexible_pins"),
        (5, "stiff_pins"),
    ],
)
def test_what_is_missing_is_named(n, effect):
    problem = twin_problem(effect, turns=8, rig=rig_of(n))
    diagnosis = diagnose(problem, campaign="twin", kind="carrier")
    if effect is None:
        assert diagnosis.verdict == "at_noise_floor"
        return
    assert diagnosis.verdict == "named"
    assert diagnosis.attribution.effects == (effect,)
    orders = {abs(finding.order) for finding in diagnosis.gap.findings.where if finding.share > 0.5}
    assert orders == {{"carrier_tilt": 1, "stiff_pins": 2 * n}.get(effect, n)}
