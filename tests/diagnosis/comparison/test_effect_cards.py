from importlib.metadata import EntryPoint

import numpy as np
import pytest

import carrierflex.diagnosis.comparison.effect_cards as effect_cards
from carrierflex.diagnosis.comparison.effect_cards import (
    EffectCard,
    EffectParameter,
    effect_library,
)
from carrierflex.diagnosis.diagnose import diagnose
from carrierflex.diagnosis.element.cards import ELEMENT_CARDS, SLOT_NAMES
from carrierflex.diagnosis.element.problem import element_problem
from carrierflex.identification.campaign.campaign_kinds import ELEMENT_BY_DRIVE
from tests.diagnosis.element.element_campaigns import displacement_campaign

#: The example of docs/diagnosis.md: a rubber stop that only pushes.
RUBBER_STOP = EffectCard(
    id="rubber_stop",
    kind="element",
    equation="K_s max(q - 0.5 mm, 0)",
    parameters=(EffectParameter("K_s", "N/m", 0.0, 20.0, powers=(1, -1, 0)),),
    signature="even and odd lines once the deflection passes the stop",
    aliases=("quadratic_stiffness",),
    discriminating_experiment="amplitudes below and above 0.5 mm",
    law=lambda q, v, p: p[0] * max(q - 0.5e-3, 0.0),
)
NO_CARD = "not a card"


def registered(monkeypatch, *names):
    entries = [
        EntryPoint(name, f"{__name__}:{name}", effect_cards.ENTRY_POINT_GROUP) for name in names
    ]
    monkeypatch.setattr(effect_cards, "entry_points", lambda group: entries)
    cards = {"RUBBER_STOP": RUBBER_STOP, "NO_CARD": NO_CARD, "TWICE": ELEMENT_CARDS[0]}
    monkeypatch.setattr(EntryPoint, "load", lambda entry: cards[entry.name])


def test_the_library_is_the_contract():
    ids = tuple(card.id for card in ELEMENT_CARDS)
    assert sorted(ids) == sorted(ELEMENT_BY_DRIVE["force"].effects)
    for card in ELEMENT_CARDS:
        assert set(card.aliases) < set(ids) - {card.id}
        assert card.discriminating_experiment
        assert card.signature
        for parameter in card.parameters:
            assert (card.id, parameter.name) in SLOT_NAMES


def test_friction_and_damping_cannot_drive():
    for card in ELEMENT_CARDS:
        if "friction" in card.id or "damping" in card.id or card.id == "backlash":
            assert all(parameter.lower >= 0.0 for parameter in card.parameters), card.id


def test_a_users_effect_is_found_by_its_card_alone(monkeypatch):
    registered(monkeypatch, "RUBBER_STOP")
    campaign = displacement_campaign(lambda q, v: 4e3 * np.maximum(q - 0.5e-3, 0.0), n=2000)
    found = diagnose(element_problem(campaign), campaign="stop", kind="element")
    assert found.verdict == "named"
    assert found.attribution.effects == ("rubber_stop",)
    own = found.attribution.parameters["rubber_stop"]["K_s"]
    assert own.unit == "N/m"
    assert abs(own.value - 4e3) < 4.0 * own.std + 8.0


def test_cards_that_cannot_serve_are_refused(monkeypatch):
    registered(monkeypatch, "NO_CARD")
    with pytest.raises(
        ValueError, match=r"entry point 'NO_CARD' .* is a str; expected an EffectCard"
    ):
        effect_library("element", ELEMENT_CARDS)
    registered(monkeypatch, "TWICE")
    with pytest.raises(
        ValueError, match=r"effect 'quadratic_stiffness' of kind element is registered twice"
    ):
        effect_library("element", ELEMENT_CARDS)
    with pytest.raises(ValueError, match=r"bounds 1.0 to 0.0; expected lower < upper"):
        EffectParameter("a", "m", 1.0, 0.0)
    with pytest.raises(ValueError, match=r"scale is 0.0; expected a positive number"):
        EffectParameter("a", "m", scale=0.0)
    with pytest.raises(ValueError, match=r"no parameter that is zero without the effect"):
        EffectCard("x", "element", "", (EffectParameter("a", "m", shape=True),), "")
