"""Names that the libraries of effects publish, for the file that campaigns are checked with.

An effect is one object, its parameters beside the functions of its arrays. A campaign's document
names effects and parameters only: ``effect_names.json`` holds those names, so that a document is
refused before any library of arrays is loaded. ``tools/write_schemas.py`` writes it.
"""

import json
from collections.abc import Mapping
from typing import Any

from carrierflex.geometry.parameters import FEWEST_PLANETS, MOST_PLANETS
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.library import CARRIER_EFFECTS, RADIAL_MOTION
from carrierflex.simulation.carrier.effects.of_planets import effects_of
from carrierflex.simulation.effect_parameters import published_names
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS
from carrierflex.simulation.force_effect import ForceEffect
from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS

_Effects = Mapping[str, Effect] | Mapping[str, ForceEffect]


def effect_names() -> dict[str, Any]:
    """Names by kind of campaign.

    Returns
    -------
    dict
        Of every kind ``parameters``, published names by effect, and ``angles``, by effect the angle
        of every size that is published with one. Of kind ``carrier`` also ``of_planets``: by number
        of planets the parameters of effects that have others than those of the default carrier.
    """
    names = {
        "carrier": _names({**CARRIER_EFFECTS, **RADIAL_MOTION}),
        "mounting": _names(MOUNTING_EFFECTS),
        "element": _names(ELEMENT_EFFECTS),
    }
    names["carrier"]["of_planets"] = {
        str(n_planets): _other_parameters(effects_of(n_planets))
        for n_planets in range(FEWEST_PLANETS, MOST_PLANETS + 1)
    }
    return names


def effect_names_text() -> str:
    """The names as they stand in their file."""
    return json.dumps(effect_names(), indent=1) + "\n"


def _names(effects: _Effects) -> dict[str, Any]:
    angles = {
        name: {
            parameter.pair.size: parameter.pair.angle
            for parameter in effect.parameters
            if parameter.pair is not None
        }
        for name, effect in effects.items()
    }
    return {
        "parameters": _published(effects),
        "angles": {name: pairs for name, pairs in angles.items() if pairs},
    }


def _published(effects: _Effects) -> dict[str, list[str]]:
    """Published names of the parameters of every effect."""
    return {
        name: list(
            dict.fromkeys(
                published
                for parameter in effect.parameters
                for published in published_names(parameter)
            )
        )
        for name, effect in effects.items()
    }


def _other_parameters(effects: Mapping[str, Effect]) -> dict[str, list[str]]:
    default = _published(CARRIER_EFFECTS)
    return {name: names for name, names in _published(effects).items() if names != default[name]}
