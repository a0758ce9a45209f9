"""Effect cards: what a missing effect is, which parameters it has, what it looks like.

A card also states what its effect is confused with.

The kinds "carrier", "mounting" and "element" bring a library of cards; users add their own by an
entry point of the group ``carrierflex.effects`` that names an :class:`EffectCard`. The chapter
"Adding an effect or a kind" of docs/own_effects.md has an example of each kind.

The law of a card says how its kind computes the effect; docs/own_effects.md has an example of each
kind. Where effects are forces it is ``(deflection, speed, parameters) -> force``, which numba can
compile; see :mod:`carrierflex.simulation.force_laws`.
"""

import re
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import numpy as np

from carrierflex.identification.campaign.campaign_kinds import KIND_NAMES
from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.force_effect import ForceEffect
from carrierflex.simulation.force_laws import Force, compiled_force

#: Entry points of this group are looked through for cards.
_ENTRY_POINT_GROUP = "carrierflex.effects"


@dataclass(frozen=True, eq=False)
class EffectCard:
    """One physical effect that a simulation may lack."""

    id: str  # Effect id of the campaign contract, or a new one
    kind: str  # Kind of campaign it belongs to
    equation: str  # The law in text
    #: What is fitted; the effect is absent where those that are no shape are zero
    parameters: tuple[EffectParameter, ...]
    signature: str  # What it looks like in the gap map
    aliases: tuple[str, ...] = ()  # Ids it is commonly confused with
    discriminating_experiment: str = ""  # The measurement that tells it from them
    #: How the kind computes it; a user's card must have one. Kinds element and mounting: a function
    #: ``(deflection, speed, parameters) -> force`` of floats and one array that numba can compile,
    #: which acts in the element, or in both bushings in y and in z. Kind carrier: a function
    #: ``(sensor, inputs, rig) -> signal per unit of each parameter``.
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
    """Card of a simulator's effect, for selection and report."""
    return EffectCard(
        effect.id,
        kind,
        effect.equation,
        effect.parameters,
        effect.signature,
        effect.aliases,
        effect.discriminating_experiment,
        law=effect.law,
    )


def effect_library(kind: str, cards: Iterable[EffectCard]) -> dict[str, EffectCard]:
    """Cards of a kind by id, those that it brings first, then those of users."""
    library: dict[str, EffectCard] = {}
    installed = _installed(entry_points, tuple(sys.path))
    for card in (*cards, *(card for card in installed if card.kind == kind)):
        if card.id in library:
            raise ValueError(
                f"effect '{card.id}' of kind {kind} is registered twice; expected different ids"
            )
        library[card.id] = card
    return library


def users_cards(
    library: Mapping[str, EffectCard], cards: Iterable[EffectCard]
) -> tuple[EffectCard, ...]:
    """Cards of a library that users registered: all but the kind's own."""
    brought = {card.id for card in cards}
    return tuple(card for card in library.values() if card.id not in brought)


# The packages on a path are looked through once: a diagnosis makes many problems.
@cache
def _installed(
    entries_of: Callable[..., Iterable[EntryPoint]], path: tuple[str, ...]
) -> tuple[EffectCard, ...]:
    cards = []
    for entry in sorted(entries_of(group=_ENTRY_POINT_GROUP), key=lambda entry: entry.name):
        try:
            card = entry.load()
        except Exception as error:
            said = (str(error).splitlines() or [type(error).__name__])[0]
            raise ValueError(
                f"entry point '{entry.name}' of group {_ENTRY_POINT_GROUP} cannot be loaded: {said}"
            ) from error
        if not isinstance(card, EffectCard):
            raise ValueError(
                f"entry point '{entry.name}' of group {_ENTRY_POINT_GROUP} is a "
                f"{type(card).__name__}; "
                "expected an EffectCard"
            )
        cards.append(card)
    return tuple(cards)


_FORCE_LAW = "a function (deflection, speed, parameters) -> force that numba can compile"
#: Colours in which numba writes its messages.
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def force_library(
    kind: str, brought: Sequence[EffectCard]
) -> tuple[dict[str, EffectCard], dict[str, Force]]:
    """Cards of a kind whose effects are forces, and compiled laws that its simulator lacks.

    Parameters
    ----------
    kind : str
        ``element`` or ``mounting``.
    brought : sequence of EffectCard
        Cards the kind brings.

    Raises
    ------
    ValueError
        Where a user's card has no law, or one that fails, does not compile, or gives a force while
        its effect is absent.
    """
    cards = effect_library(kind, brought)
    users = {card.id for card in users_cards(cards, brought)}
    laws: dict[str, Force] = {}
    for card in cards.values():
        if card.law is not None or card.id in users:
            check_is_function(card, _FORCE_LAW)
            _try_force(card)
            try:
                laws[card.id] = compiled_force(card.law)
            except Exception as error:
                problem = f"its law does not compile: {first_line(error)}"
                raise refusal(card, problem, _FORCE_LAW) from error
    return cards, laws


def refusal(card: EffectCard, problem: str, expected: str) -> ValueError:
    """Error that names a user's card, what was wrong with it and what is expected."""
    return ValueError(f"effect card '{card.id}': {problem}; expected {expected}")


def check_is_function(card: EffectCard, expected: str) -> None:
    """Refuse a card whose law is missing or no function."""
    if card.law is None:
        raise refusal(card, "no law", expected)
    if not callable(card.law):
        raise refusal(card, f"its law is a {type(card.law).__name__}", expected)


def _try_force(card: EffectCard) -> None:
    """Call the plain function: there an index beyond the parameters is an error, compiled not."""
    law: Callable[..., Any] = getattr(card.law, "py_func", card.law)
    scales = np.array([np.clip(p.scale, p.lower, p.upper) for p in card.parameters])
    is_shape = [parameter.shape for parameter in card.parameters]
    absent = np.where(is_shape, scales, 0.0)
    for deflection, speed in ((0.0, 0.0), (1e-3, 1e-2), (-1e-3, -1e-2)):
        try:
            law(deflection, speed, scales)
            force = float(law(deflection, speed, absent))
        except Exception as error:
            raise refusal(card, f"its law fails: {first_line(error)}", _FORCE_LAW) from error
        if force != 0.0:
            absence = "with all parameters but the shapes at zero"
            raise refusal(card, f"its law gives a force of {force:g} {absence}", "0")


def first_line(error: Exception) -> str:
    """Kind of an error and its first telling line; numba's first one names its own pipeline."""
    lines = [line.strip() for line in _COLOUR.sub("", str(error)).splitlines()]
    telling = [line for line in lines if line and not line.startswith("Failed in nopython mode")]
    return f"{type(error).__name__}: {telling[0]}" if telling else type(error).__name__
