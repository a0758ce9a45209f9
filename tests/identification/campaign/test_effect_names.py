"""The names with which campaigns are checked are those that the libraries of effects publish."""

from dataclasses import replace

import pytest

from carrierflex.identification.campaign import effect_names
from carrierflex.identification.campaign.campaign_kinds import campaign_kind
from carrierflex.identification.campaign.file_names import EFFECT_NAMES
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS
from carrierflex.simulation.carrier.effects.of_planets import effects_of
from carrierflex.simulation.effect_parameters import published_names


def test_the_file_is_what_the_libraries_give():
    written = EFFECT_NAMES.read_text(encoding="utf-8")
    assert written == effect_names.effect_names_text(), "run tools/write_schemas.py"


def test_an_effect_that_the_file_lacks_is_noticed(monkeypatch):
    tilt = CARRIER_EFFECTS["carrier_tilt"]
    more = {**CARRIER_EFFECTS, "new_tilt": replace(tilt, id="new_tilt")}
    monkeypatch.setattr(effect_names, "CARRIER_EFFECTS", more)
    monkeypatch.setattr(effect_names, "effects_of", lambda n_planets: more)
    assert EFFECT_NAMES.read_text(encoding="utf-8") != effect_names.effect_names_text()


@pytest.mark.parametrize("n_planets", range(3, 9))
def test_a_carrier_knows_the_parameters_of_its_own_number_of_planets(n_planets):
    known = campaign_kind("carrier", {"n_planets": n_planets}).parameters
    for name, effect in effects_of(n_planets).items():
        published = [
            published_name
            for parameter in effect.parameters
            for published_name in published_names(parameter)
        ]
        assert known[name] == tuple(dict.fromkeys(published))
