"""Effect cards of the kind "element": the effects of the simulator as the diagnosis takes them."""

from math import inf

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, card_of_force
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.element.effects import ELEMENT_EFFECTS

KIND = "element"
ELEMENT_CARDS = tuple(card_of_force(effect, KIND) for effect in ELEMENT_EFFECTS.values())

#: A force of the drive's spectrum with random phases: nothing physical, so that it must not help.
NEGATIVE_CONTROLS = tuple(
    EffectCard(
        name,
        KIND,
        "size x surrogate of the drive with random phases",
        (EffectParameter("size", "N", -inf, inf, powers=(1, 0, 0)),),
        "none",
    )
    for name in ("placebo_1", "placebo_2")
)
