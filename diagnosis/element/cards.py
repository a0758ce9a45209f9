"""Effect cards of the kind "element": the effects of the simulator as the diagnosis takes them."""

from carrierflex.diagnosis.comparison.effect_cards import card_of_force
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS

KIND = "element"
ELEMENT_CARDS = tuple(card_of_force(effect, KIND) for effect in ELEMENT_EFFECTS.values())
