"""Effects among which the diagnosis of a carrier chooses: its own, users'.

The law of a user's card is ``(sensor, inputs, rig) -> signal per unit of each parameter``, an array
of shape (n_parameters, n); a card whose last parameter is a shape (a threshold) takes its value as
a fourth argument and gives no row for it; see :mod:`carrierflex.simulation.carrier.effect`.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from carrierflex.diagnosis.comparison.effect_cards import (
    EffectCard,
    check_is_function,
    effect_library,
    first_line,
    refusal,
    users_cards,
)
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.simulation.carrier.effect import Effect
from carrierflex.simulation.carrier.effects.deflection import PIN_CLEARANCE, with_weight
from carrierflex.simulation.carrier.effects.of_planets import effects_of
from carrierflex.simulation.carrier.patterns import pin_radius_of
from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor

_CARRIER_LAW = "a function (sensor, inputs, rig) -> signals of unit parameters, (n_parameters, n)"
_CARRIER_SHAPE_LAW = (
    "a function (sensor, inputs, rig, last value) -> signals, (n_parameters - 1, n)"
)
_KIND = "carrier"


def carrier_rig(stated: Mapping[str, Any], curves: Mapping[str, DeflectionCurve]) -> CarrierRig:
    """Rig that a campaign states; the radius of the pin circle is that which its curves imply."""
    n_planets = int(stated["n_planets"])
    pin_radius = np.nan
    if "g_f" in curves:
        pin_radius = pin_radius_of(curves["delta_f"], curves["g_f"], n_planets)
    return CarrierRig(float(stated["nominal_torque"]), n_planets, pin_radius, curves)


def carrier_library(rig: CarrierRig, further: Sequence[Effect] = ()) -> dict[str, Effect]:
    """Effects by id that the curves of a rig allow, and `further` ones of a campaign."""
    of_rig = effects_of(rig.n_planets)
    of_rig[PIN_CLEARANCE.id] = with_weight(of_rig[PIN_CLEARANCE.id], rig.curves)
    effects = (*of_rig.values(), *further)
    cards = tuple(card_of(effect) for effect in effects)
    users = users_cards(effect_library(_KIND, cards), cards)
    for card in users:
        _refuse_wrong_law(card, rig)
    return {
        effect.id: effect
        for effect in (*effects, *(_effect_of(card) for card in users))
        if set(effect.curves) <= set(rig.curves)
    }


def _refuse_wrong_law(card: EffectCard, rig: CarrierRig) -> None:
    """Refuse a user's card of kind ``carrier`` whose law does not give what a fit can use."""
    *others, last = card.parameters
    has_shape = any(parameter.shape for parameter in card.parameters)
    expected = _CARRIER_SHAPE_LAW if has_shape else _CARRIER_LAW
    check_is_function(card, expected)
    values: tuple[float, ...] = ()
    if has_shape:
        if not last.shape or any(parameter.shape for parameter in others):
            names = ", ".join(parameter.name for parameter in card.parameters if parameter.shape)
            raise refusal(card, f"shapes {names}", "one at most, as the last parameter")
        if not np.isfinite([last.lower, last.upper]).all():
            problem = f"shape {last.name} is bounded by {last.lower} and {last.upper}"
            raise refusal(card, problem, "finite bounds, between which signals are interpolated")
        values = (0.5 * (last.lower + last.upper),)
    # One turn with loads of both signs and zero among them.
    share = np.linspace(-1.0, 1.0, 9)
    time, force = share + 1.0, 1e5 * share
    torque = rig.nominal_torque * share
    inputs = CarrierInputs(time, np.pi * time, torque, force, force[::-1], start=0.0, end=2.0)
    shape = (len(card.parameters) - len(values), share.size)
    for is_axial in (True, False):
        try:
            rows = card.law(RimSensor(0.5, 0.4, is_axial), inputs, rig, *values)
            signals = np.asarray(rows, dtype=np.float64)
        except Exception as error:
            raise refusal(card, f"its law fails: {first_line(error)}", expected) from error
        if signals.shape != shape:
            problem = f"its law gives the shape {signals.shape} for {share.size} samples"
            raise refusal(card, problem, str(shape))
        if not np.isfinite(signals).all():
            raise refusal(card, "its law gives values that are not finite", "finite values")


def card_of(effect: Effect) -> EffectCard:
    """Card of an effect, for selection and report."""
    return EffectCard(
        effect.id,
        _KIND,
        effect.equation,
        effect.parameters,
        effect.signature,
        effect.aliases,
        effect.discriminating_experiment,
        law=effect.pattern,
    )


def _effect_of(card: EffectCard) -> Effect:
    """Effect of a user's card."""
    return Effect(
        card.id,
        equation=card.equation,
        parameters=card.parameters,
        signature=card.signature,
        pattern=card.law,
        aliases=card.aliases,
        discriminating_experiment=card.discriminating_experiment,
    )
