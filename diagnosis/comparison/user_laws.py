"""Laws of the cards, mostly users': tried once, and refused by the card's id.

The law of a card says how its kind computes the effect; docs/own_effects.md has an example of each
kind. Where effects are forces it is ``(deflection, speed, parameters) -> force``, which numba can
compile; see :mod:`carrierflex.simulation.force_laws`.
"""

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.comparison.effect_cards import EffectCard, effect_library, users_cards
from carrierflex.simulation.force_laws import Force, compiled_force

FloatArray = NDArray[np.float64]

_FORCE_LAW = "a function (deflection, speed, parameters) -> force that numba can compile"
#: Deflections [m] and speeds [m/s] at which a force law is tried.
_TRIED_MOTIONS = ((0.0, 0.0), (1e-3, 1e-2), (-1e-3, -1e-2))
#: Colours in which numba writes its messages.
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def force_library(
    kind: str,
    brought: Sequence[EffectCard],
) -> tuple[dict[str, EffectCard], dict[str, Force]]:
    """Cards of a kind whose effects are forces, and the compiled laws of those of users.

    Parameters
    ----------
    kind : str
        ``element`` or ``mounting``.
    brought : sequence of EffectCard
        Cards the kind brings.

    Returns
    -------
    tuple of (dict of str to EffectCard, dict of str to callable)
        All cards by id, own ones first; by id the laws of users and those of the kind that its
        simulator's compiled laws lack.

    Raises
    ------
    ValueError
        Where a user's card has no law, or one that fails, does not compile, or gives a force while
        its effect is absent.
    """
    cards = effect_library(kind, brought)
    laws: dict[str, Force] = {}
    users = {card.id for card in users_cards(cards, brought)}
    for card in cards.values():
        if card.law is None and card.id not in users:
            continue
        check_is_function(card, _FORCE_LAW)
        _try_force(card)
        laws[card.id] = _compiled(card)
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
    for deflection, speed in _TRIED_MOTIONS:
        try:
            law(deflection, speed, scales)
            force = float(law(deflection, speed, absent))
        except Exception as error:
            raise refusal(card, f"its law fails: {first_line(error)}", _FORCE_LAW) from error
        if force != 0.0:
            problem = (
                f"its law gives a force of {force:g} with all parameters but the shapes at zero"
            )
            raise refusal(card, problem, "0")


def _compiled(card: EffectCard) -> Force:
    try:
        return compiled_force(card.law)
    except Exception as error:
        problem = f"its law does not compile: {first_line(error)}"
        raise refusal(card, problem, _FORCE_LAW) from error


def first_line(error: Exception) -> str:
    """Kind of an error and its first telling line; numba's first one names its own pipeline."""
    lines = [line.strip() for line in _COLOUR.sub("", str(error)).splitlines()]
    telling = [line for line in lines if line and not line.startswith("Failed in nopython mode")]
    return f"{type(error).__name__}: {telling[0]}" if telling else type(error).__name__
