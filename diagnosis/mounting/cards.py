"""Effect cards of the kind "mounting": the effects of the simulator as the diagnosis takes them."""

from carrierflex.diagnosis.comparison.effect_cards import card_of_force
from carrierflex.simulation.mounting.effects import MOUNTING_EFFECTS

KIND = "mounting"
MOUNTING_CARDS = tuple(card_of_force(effect, KIND) for effect in MOUNTING_EFFECTS.values())

#: Effects of one sensor; the fit chooses which.
ONE_CHANNEL = tuple(
    effect.id
    for effect in MOUNTING_EFFECTS.values()
    if effect.measurement and effect.measurement.is_of_one_channel
)
