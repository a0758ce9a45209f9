from dataclasses import replace
from importlib.metadata import EntryPoint

import numpy as np
import pytest
from numpy.testing import assert_allclose

import carrierflex.diagnosis.comparison.effect_cards as effect_cards
from carrierflex.diagnosis.carrier.problem import carrier_problem
from carrierflex.diagnosis.comparison.effect_cards import (
    _ENTRY_POINT_GROUP,
    EffectCard,
    EffectParameter,
    card_of_force,
    effect_library,
    force_library,
)
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.problem import ELEMENT_CARDS, element_problem
from carrierflex.diagnosis.inference.effect_fit import fit_effects
from carrierflex.diagnosis.mounting.problem import mounting_problem
from carrierflex.identification.campaign.campaign_kinds import ELEMENT_BY_DRIVE
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.element.kernels import ElementSlots
from carrierflex.simulation.force_effect import ForceEffect, scaled_parameter
from tests.diagnosis.carrier.carrier_twin import CURVES, twin_campaign
from tests.diagnosis.element.element_campaigns import displacement_campaign
from tests.diagnosis.mounting.mounting_campaigns import CONDITIONS, mounting_campaign

LENGTH = EffectParameter("a", "m", -1e-3, 1e-3, scale=1e-5)
FORCE = EffectParameter("F", "N", 0.0, 1e4, scale=1e3)
SHAPE = EffectParameter("s", "1", 0.1, 1.0, scale=0.5, shape=True)
UNBOUNDED = EffectParameter("s", "1", 0.0, shape=True)
#: How every refusal of the card begins, and the ends of two.
REFUSED = "effect card 'my_effect':"
FORCE_LAW = r"expected a function \(deflection, speed, parameters\)"
CARRIER_LAW = r"expected a function \(sensor, inputs, rig\)"
SHAPE_LAW = r"expected a function \(sensor, inputs, rig, last value\)"
#: Torque above which the rim opens [N m], and by how much at the nominal torque [m].
OPENING, WIDTH = 180e3, 8e-5


def card(kind, law=None, parameters=None):
    default = (LENGTH,) if kind == "carrier" else (FORCE,)
    return EffectCard("my_effect", kind, "", parameters or default, "", law=law)


def registered(monkeypatch, *cards):
    """Cards, or what else an entry point names, as if an installed package named them."""
    names = [f"point_{k}" for k in range(len(cards))]
    entries = [EntryPoint(name, "module:attribute", _ENTRY_POINT_GROUP) for name in names]
    named = dict(zip(names, cards, strict=True))
    monkeypatch.setattr(effect_cards, "entry_points", lambda group: entries)
    monkeypatch.setattr(EntryPoint, "load", lambda entry: named[entry.name])


def plant_of_kind(kind):
    if kind == "carrier":
        return carrier_problem(twin_campaign(loads=((1.0, 0, 0),), turns=2), CURVES)
    if kind == "mounting":
        return mounting_problem(mounting_campaign(conditions=CONDITIONS[:1]))
    return element_problem(displacement_campaign(lambda q, v: 0.0 * q, n=500))


def test_the_library_is_the_contract():
    ids = tuple(card.id for card in ELEMENT_CARDS)
    assert ids == ELEMENT_BY_DRIVE["force"].effects
    for card in ELEMENT_CARDS:
        assert set(card.aliases) < set(ids) - {card.id}
        assert card.discriminating_experiment
        assert card.signature


def test_the_compiled_laws_take_every_parameter_of_an_element_but_a_sensors():
    taken = {
        name
        for effect in ELEMENT_EFFECTS.values()
        if effect.measurement is None and effect.law is None
        for parameter in effect.parameters
        for name in effect.values_of(parameter.name)
    }
    assert {"m", "K1", "C1", "f0", *taken} == set(ElementSlots._fields)


def test_an_effect_with_a_law_of_its_own_needs_no_compiled_one():
    quartic = ForceEffect(
        id="quartic_stiffness",
        equation="K4 q³ |q|",
        parameters=(scaled_parameter("K4", "N/m^4", (1, -4, 0)),),
        signature="odd lines, gap as amplitude⁴",
        law=lambda q, v, p: p[0] * q**3 * abs(q),
    )
    cards, laws = force_library("element", (*ELEMENT_CARDS, card_of_force(quartic, "element")))
    assert set(laws) == {"quartic_stiffness"}
    assert list(cards)[:-1] == [card.id for card in ELEMENT_CARDS]
    campaign = displacement_campaign(lambda q, v: 4e12 * q**3 * abs(q), n=500)
    problem = element_problem(campaign)
    model = replace(problem.model, cards=cards, laws=laws)
    fit = fit_effects(replace(problem, model=model), ("quartic_stiffness",))
    K4 = dict(zip((p.name for p in fit.parameters), fit.theta, strict=True))["K4"]
    assert_allclose(K4, 4e12, rtol=0.01)


def test_friction_and_damping_cannot_drive():
    for card in ELEMENT_CARDS:
        if "friction" in card.id or "damping" in card.id or card.id == "backlash":
            assert all(parameter.lower >= 0.0 for parameter in card.parameters), card.id


@pytest.mark.long
def test_a_users_threshold_of_a_carrier_is_found(monkeypatch):
    def opening(sensor, inputs, rig, threshold):
        beyond = np.maximum(inputs.torque - threshold, 0.0) / rig.nominal_torque
        wave = np.cos(2.0 * (sensor.angle - inputs.carrier_angle))
        return (not sensor.is_axial) * (wave * beyond)[None]

    parameters = (LENGTH, EffectParameter("T_0", "N m", 0.0, 360e3, scale=1e5, shape=True))
    registered(monkeypatch, card("carrier", opening, parameters))

    def truth(channel, angle):
        torque = next(torques)
        wave = np.real(np.exp(2j * (angle - channel.angle)))
        opening = WIDTH * np.clip(torque - OPENING, 0.0, None) / 360e3
        return opening * wave if channel.quantity == "radial_displacement" else 0.0

    plain = twin_campaign()
    torques = iter([run.inputs["torque"] for run in plain.runs for _ in plain.channels])
    problem = carrier_problem(twin_campaign(extra=truth), CURVES)
    result = diagnose(problem, campaign="twin", kind="carrier")
    assert (result.verdict, result.attribution.effects) == ("named", ("my_effect",)), result.reason
    values = result.attribution.parameters["my_effect"]
    # Between its nodes, 36 kN m apart, the signal is interpolated.
    assert abs(values["T_0"].value - OPENING) < 4.0 * values["T_0"].std + 5e3
    assert abs(values["a"].value - WIDTH) < 4.0 * values["a"].std + 0.02 * WIDTH


def test_three_laws_of_users_add_up_in_one_element(monkeypatch):
    cards = [
        EffectCard(name, "element", "", (FORCE,), "", law=law)
        for name, law in (
            ("one", lambda q, v, p: p[0] * q),
            ("two", lambda q, v, p: p[0] * q * q),
            ("three", lambda q, v, p: p[0] * q * q * q),
        )
    ]
    registered(monkeypatch, *cards)
    problem = plant_of_kind("element")
    base = np.ones(len(problem.parameters(())))
    effects = ("one", "two", "three")
    record = problem.records[0]
    q = record.motion[0]
    change = problem.model.predicted(record, effects, np.array([*base, 10.0, 20.0, 30.0]))
    change = change - problem.model.predicted(record, (), base)
    assert_allclose(change, 10.0 * q + 20.0 * q**2 + 30.0 * q**3, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", ["carrier", "mounting", "element"])
def test_a_card_without_a_law_is_refused_by_name(monkeypatch, kind):
    registered(monkeypatch, card(kind))
    with pytest.raises(ValueError, match=rf"^{REFUSED} no law; expected a function \([^\n]*$"):
        plant_of_kind(kind)
    registered(monkeypatch, card(kind, law="K q"))
    with pytest.raises(ValueError, match=rf"^{REFUSED} its law is a str; expected a function \("):
        plant_of_kind(kind)


@pytest.mark.parametrize("kind", ["mounting", "element"])
@pytest.mark.parametrize(
    ("law", "message"),
    [
        (lambda q, v: 0.0, rf"its law fails: TypeError: .* but 3 were given; {FORCE_LAW}"),
        (lambda q, v, p: p[1] * q, rf"its law fails: IndexError: index 1 is out .*; {FORCE_LAW}"),
        (lambda q, v, p: None, rf"its law fails: TypeError: .*; {FORCE_LAW}"),
        (lambda q, v, p: p[0] * q + 5.0, r"its law gives a force of 5 with all .*; expected 0"),
        (lambda q, v, p: p[0] * eval("q"), rf"its law does not compile: .*'eval'.*; {FORCE_LAW}"),
    ],
)
def test_a_force_law_that_cannot_serve_is_refused_by_name(monkeypatch, kind, law, message):
    registered(monkeypatch, card(kind, law))
    with pytest.raises(ValueError, match=rf"^{REFUSED} {message}[^\n]*$"):
        plant_of_kind(kind)


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (lambda sensor, inputs: 0.0, rf"its law fails: TypeError: .*; {CARRIER_LAW}"),
        (lambda s, i, rig: rig.curves["h"], rf"its law fails: KeyError: 'h'; {CARRIER_LAW}"),
        (lambda s, i, rig: i.time, r"its law gives the shape \(9,\) .*; expected \(1, 9\)"),
        (lambda s, i, rig: [np.nan * i.time], r"its law gives values that are not finite"),
    ],
)
def test_a_carriers_law_that_cannot_serve_is_refused_by_name(monkeypatch, law, message):
    registered(monkeypatch, card("carrier", law))
    with pytest.raises(ValueError, match=rf"^{REFUSED} {message}[^\n]*$"):
        plant_of_kind("carrier")


@pytest.mark.parametrize(
    ("law", "parameters", "message"),
    [
        (lambda s, i, rig: [i.time], (LENGTH, SHAPE), rf"its law fails: .*; {SHAPE_LAW}"),
        (lambda s, i, rig, x: [i.time], (SHAPE, LENGTH), r"shapes s; expected one at most"),
        (lambda s, i, rig, x: [i.time], (LENGTH, UNBOUNDED), r"shape s is bounded by 0.0 and inf"),
    ],
)
def test_a_carriers_shape_that_cannot_serve_is_refused(monkeypatch, law, parameters, message):
    registered(monkeypatch, card("carrier", law, parameters))
    with pytest.raises(ValueError, match=rf"^{REFUSED} {message}[^\n]*$"):
        plant_of_kind("carrier")


def test_cards_of_other_kinds_take_no_part(monkeypatch):
    registered(monkeypatch, card("element"))
    assert "my_effect" not in plant_of_kind("carrier").cards


def test_cards_that_cannot_serve_are_refused(monkeypatch):
    registered(monkeypatch, "not a card")
    with pytest.raises(ValueError, match=r"'point_0' .* is a str; expected an EffectCard"):
        effect_library("element", ELEMENT_CARDS)
    registered(monkeypatch, ELEMENT_CARDS[0])
    with pytest.raises(ValueError, match=r"'quadratic_stiffness' .* is registered twice"):
        effect_library("element", ELEMENT_CARDS)
    with pytest.raises(ValueError, match=r"bounds 1.0 to 0.0; expected lower < upper"):
        EffectParameter("a", "m", 1.0, 0.0)
    with pytest.raises(ValueError, match=r"scale is 0.0; expected a positive number"):
        EffectParameter("a", "m", scale=0.0)
    with pytest.raises(ValueError, match=r"no parameter that is zero without the effect"):
        card("element", parameters=(SHAPE,))
    with pytest.raises(ValueError, match=rf"{REFUSED} kind is 'gear'; expected one of carrier, "):
        card("gear")
    with pytest.raises(ValueError, match=rf"{REFUSED} parameters a, a; expected different names"):
        card("carrier", parameters=(LENGTH, LENGTH))


def test_an_entry_point_that_cannot_be_loaded_is_named(monkeypatch):
    entry = EntryPoint("broken", "no_such_module_of_effects:CARD", _ENTRY_POINT_GROUP)
    monkeypatch.setattr(effect_cards, "entry_points", lambda group: [entry])
    with pytest.raises(ValueError, match=r"^entry point 'broken' of .* cannot be loaded: No mod"):
        effect_library("element", ELEMENT_CARDS)
