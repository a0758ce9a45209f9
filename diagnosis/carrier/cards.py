"""Effect cards of the kind "carrier": the effects of the simulator as the diagnosis takes them."""

from functools import partial

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.effect_cards import EffectCard
from carrierflex.simulation.carrier.effect import Effect, lengths
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor

FloatArray = NDArray[np.float64]
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


def _waves(
    sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, *, order: float
) -> FloatArray:
    phase = order * inputs.carrier_angle
    return sensor.is_axial * np.array([np.cos(phase), np.sin(phase)])


def _negative_control(name: str, order: float) -> Effect:
    """Waves of an order at which no machine element of the stage turns."""
    return Effect(
        name,
        equation=f"p cos and sin of {order} theta on the axial sensors",
        parameters=lengths("p_c", "p_s"),
        signature="none",
        pattern=partial(_waves, order=order),
    )


#: Effects without meaning, to measure what chance alone explains.
NEGATIVE_CONTROLS = (_negative_control("placebo_1", 2.618), _negative_control("placebo_2", 4.382))
