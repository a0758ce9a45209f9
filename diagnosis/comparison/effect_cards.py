"""Effect cards: what a missing effect is, which parameters it has, what it looks like, and what it is confused with.

The kinds "carrier", "mounting" and "element" bring a library of cards; users add their own by an
entry point of the group ``carrierflex.effects`` that names an :class:`EffectCard`
(docs/diagnosis.md has an example).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any

#: Entry points of this group are looked through for cards.
ENTRY_POINT_GROUP = "carrierflex.effects"


@dataclass(frozen=True, eq=False)
class EffectParameter:
    """One parameter of an effect.

    Parameters
    ----------
    name : str
        Symbol, as in the papers.
    unit : str
        SI unit.
    lower, upper : float
        Physical bounds; a lower bound of zero is the physical sign (friction never drives).
    scale : float
        Size at which the effect is worth noticing, in `unit`, or in the plant's own scale where
        `powers` is given: step of the search and standard deviation of the prior.
    powers : tuple of int, optional
        Powers of force, length and time in the parameter. The plant then scales and bounds it by
        its own force, deflection and time, and writes its unit (a voltage analogue has volts in
        place of newton and metre).
    shape : bool
        Whether the effect is absent only where another parameter is zero (a yield force, a time
        constant): such a parameter has no prior and is searched from several starts.
    """

    name: str
    unit: str
    lower: float = -math.inf
    upper: float = math.inf
    scale: float = 1.0
    powers: tuple[int, int, int] | None = None
    shape: bool = False

    def __post_init__(self) -> None:
        if not self.lower < self.upper:
            raise ValueError(
                f"parameter {self.name}: bounds {self.lower} to {self.upper}; expected lower < upper"
            )
        if not (self.scale > 0.0 and math.isfinite(self.scale)):
            raise ValueError(
                f"parameter {self.name}: scale is {self.scale}; expected a positive number"
            )


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
        How the plant computes it; each kind says what it expects. Kind element: a function
        ``(deflection, speed, parameters) -> force`` of floats and one array that numba can compile.
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
        if not self.parameters or all(parameter.shape for parameter in self.parameters):
            raise ValueError(
                f"effect card '{self.id}': no parameter that is zero without the effect; expected one"
            )


def effect_library(kind: str, own: Iterable[EffectCard]) -> dict[str, EffectCard]:
    """Cards of a kind by id: its own and those that users registered.

    Parameters
    ----------
    kind : str
        ``carrier``, ``mounting`` or ``element``.
    own : iterable of EffectCard
        Cards the kind brings.

    Returns
    -------
    dict of str to EffectCard
        Own cards first.

    Raises
    ------
    ValueError
        Where an entry point names something else than a card, or an id stands twice.
    """
    library: dict[str, EffectCard] = {}
    for card in (*own, *_registered(kind)):
        if card.id in library:
            raise ValueError(
                f"effect '{card.id}' of kind {kind} is registered twice; expected different ids"
            )
        library[card.id] = card
    return library


def _registered(kind: str) -> list[EffectCard]:
    cards = []
    for entry in sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda entry: entry.name):
        card = entry.load()
        if not isinstance(card, EffectCard):
            raise ValueError(
                f"entry point '{entry.name}' of group {ENTRY_POINT_GROUP} is a {type(card).__name__}; "
                "expected an EffectCard"
            )
        if card.kind == kind:
            cards.append(card)
    return cards
