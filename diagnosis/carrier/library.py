"""Effects among which the diagnosis of a carrier chooses: its own, the placebos, and users'."""

from carrierflex.diagnosis.carrier.cards import CARRIER_CARDS, KIND, NEGATIVE_CONTROLS
from carrierflex.diagnosis.carrier.laws import CarrierRig
from carrierflex.diagnosis.comparison.effect_cards import EffectCard, effect_library, users_cards
from carrierflex.diagnosis.comparison.user_laws import refuse_wrong_carrier_laws

#: Effects computed from the deflection under a single loaded pin, the curve g_f.
_NEEDS_PIN_CURVE = ("unequal_load_sharing", "load_sharing_ntl")


def carrier_library(rig: CarrierRig) -> dict[str, EffectCard]:
    """Cards by id that the curves of a rig allow.

    Parameters
    ----------
    rig : CarrierRig
        Rig and curves of the campaign.

    Returns
    -------
    dict of str to EffectCard
        Own cards and placebos first, then users'.

    Raises
    ------
    ValueError
        Where a user's card cannot be computed.
    """
    own_cards = (*CARRIER_CARDS, *NEGATIVE_CONTROLS)
    cards = effect_library(KIND, own_cards)
    refuse_wrong_carrier_laws(users_cards(cards, own_cards), rig)
    if "g_f" in rig.curves:
        return cards
    return {name: card for name, card in cards.items() if name not in _NEEDS_PIN_CURVE}
