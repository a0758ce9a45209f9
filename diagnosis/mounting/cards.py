"""Effect cards of the kind "mounting": the effects of the simulator as the diagnosis takes them."""

from math import inf

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, card_of_force
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS

KIND = "mounting"
MOUNTING_CARDS = tuple(card_of_force(effect, KIND) for effect in MOUNTING_EFFECTS.values())

#: A response to loads of the measured spectrum with random phases: nothing physical, so that it
#: must not help.
NEGATIVE_CONTROLS = tuple(
    EffectCard(
        name,
        KIND,
        f"size x response to the {load} with random phases",
        (EffectParameter("size", "1", -inf, inf, 1.0),),
        "none",
    )
    for name, load in (("placebo_1", "torque"), ("placebo_2", "vertical load"))
)

#: Effects of one sensor; the fit chooses which.
ONE_CHANNEL = tuple(
    effect.id
    for effect in MOUNTING_EFFECTS.values()
    if effect.measurement and effect.measurement.is_of_one_channel
)
