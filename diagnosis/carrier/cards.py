"""Effect cards of the kind "carrier": the effects of the simulator as the diagnosis takes them."""

from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.simulation.carrier.effect import Effect

KIND = "carrier"


def card_of(effect: Effect) -> EffectCard:
    """Card of an effect, for selection and report."""
    return EffectCard(
        effect.id,
        KIND,
        effect.equation,
        effect.parameters,
        effect.signature,
        effect.aliases,
        effect.discriminating_experiment,
        acts_on_others=effect.acts_on_others,
        law=effect.pattern,
    )


def effect_of(card: EffectCard) -> Effect:
    """Effect of a user's card."""
    return Effect(
        card.id,
        equation=card.equation,
        parameters=card.parameters,
        signature=card.signature,
        pattern=card.law,
        aliases=card.aliases,
        discriminating_experiment=card.discriminating_experiment,
        acts_on_others=card.acts_on_others,
    )
