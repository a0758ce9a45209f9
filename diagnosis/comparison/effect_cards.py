"""Effect cards: what a missing effect is, which parameters it has, what it looks like.

A card also states what its effect is confused with.

The kinds "carrier", "mounting" and "element" bring a library of cards; users add their own by an
entry point of the group ``carrierflex.effects`` that names an :class:`EffectCard`. The chapter
"Adding an effect or a kind" of docs/own_effects.md has an example of each kind.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any

from carrierflex.identification.campaign.campaign_kinds import KIND_NAMES
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.force_effect import ForceEffect

#: Entry points of this group are looked through for cards.
ENTRY_POINT_GROUP = "carrierflex.effects"


@dataclass(frozen=True, eq=False)
class EffectCard:
    """One physical effect that a simulation may lack.

    Parameters
    ----------
    id : str
        Effect id of the campaign contract, or a new one.
    kind : str
        Kind of campaign it belongs to.
    equation : str
        The law in text.
    parameters : tuple of EffectParameter
        What is fitted; the effect is absent where those that are no shape are zero.
    signature : str
        What it looks like in the gap map.
    aliases : tuple of str
        Ids it is commonly confused with.
    discriminating_experiment : str
        The measurement that tells it from them.
    acts_on_others : bool
        Whether it changes how other effects are read (a sensor's gain, place or delay): it is tried
        beside each of them.
    law : object, optional
        How the kind computes it; a user's card must have one. Kinds element and mounting: a
        function ``(deflection, speed, parameters) -> force`` of floats and one array that numba can
        compile, which acts in the element, or in both bushings in y and in z. Kind carrier: a
        function ``(sensor, inputs, rig) -> signal per unit of each parameter``. See
        :mod:`carrierflex.diagnosis.comparison.user_laws`.
    """

    id: str
    kind: str
    equation: str
    parameters: tuple[EffectParameter, ...]
    signature: str
    aliases: tuple[str, ...] = ()
    discriminating_experiment: str = ""
    acts_on_others: bool = False
    law: Any = None

    def __post_init__(self) -> None:
        if self.kind not in KIND_NAMES:
            known = ", ".join(KIND_NAMES)
            raise ValueError(
                f"effect card '{self.id}': kind is '{self.kind}'; expected one of {known}"
            )
        names = [parameter.name for parameter in self.parameters]
        if len(set(names)) < len(names):
            listed = ", ".join(names)
            raise ValueError(
                f"effect card '{self.id}': parameters {listed}; expected different names"
            )
        if not self.parameters or all(parameter.shape for parameter in self.parameters):
            raise ValueError(
                f"effect card '{self.id}': no parameter that is zero without the effect; expected "
                "one"
            )


def card_of_force(effect: ForceEffect, kind: str) -> EffectCard:
    """Card of a simulator's effect, for selection and report.

    Parameters
    ----------
    effect : ForceEffect
        Effect of the simulator.
    kind : str
        Kind of campaign it belongs to.
    """
    return EffectCard(
        effect.id,
        kind,
        effect.equation,
        effect.parameters,
        effect.signature,
        effect.aliases,
        effect.discriminating_experiment,
        acts_on_others=effect.acts_on_others,
        law=effect.law,
    )


def effect_library(kind: str, cards: Iterable[EffectCard]) -> dict[str, EffectCard]:
    """Cards of a kind by id: those it brings and those that users registered.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.
    cards : iterable of EffectCard
        Cards the kind brings.

    Returns
    -------
    dict of str to EffectCard
        Own cards first.

    Raises
    ------
    ValueError
        Where an entry point cannot be loaded or names something else than a card, or an id stands
        twice.
    """
    library: dict[str, EffectCard] = {}
    for card in (*cards, *_registered(kind)):
        if card.id in library:
            raise ValueError(
                f"effect '{card.id}' of kind {kind} is registered twice; expected different ids"
            )
        library[card.id] = card
    return library


def users_cards(
    library: Mapping[str, EffectCard],
    cards: Iterable[EffectCard],
) -> tuple[EffectCard, ...]:
    """Cards of a library that users registered: all but the kind's own."""
    brought = {card.id for card in cards}
    return tuple(card for card in library.values() if card.id not in brought)


def _registered(kind: str) -> list[EffectCard]:
    cards = []
    for entry in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda entry: entry.name):
        try:
            card = entry.load()
        except Exception as error:
            said = (str(error).splitlines() or [type(error).__name__])[0]
            raise ValueError(
                f"entry point '{entry.name}' of group {ENTRY_POINT_GROUP} cannot be loaded: {said}"
            ) from error
        if not isinstance(card, EffectCard):
            raise ValueError(
                f"entry point '{entry.name}' of group {ENTRY_POINT_GROUP} is a "
                f"{type(card).__name__}; "
                "expected an EffectCard"
            )
        if card.kind == kind:
            cards.append(card)
    return cards
