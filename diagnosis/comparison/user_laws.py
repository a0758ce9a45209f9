"""Laws of the cards that users register: tried once, and refused by the card's id.

The law of a card says how its kind computes the effect (docs/diagnosis.md has an example of each):

kind ``element`` and ``mounting``
    ``(deflection, speed, parameters) -> force``, which numba can compile; see
    :mod:`carrierflex.simulation.force_laws`.
kind ``carrier``
    ``(sensor, inputs, rig) -> signal per unit of each parameter``, an array of shape
    (n_parameters, n); a card whose last parameter is a shape (a threshold) takes its value as a
    fourth argument and gives no row for it; see :mod:`carrierflex.diagnosis.carrier.laws`.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.diagnosis.carrier.laws import CarrierInputs, CarrierRig, RimSensor
from carrierflex.diagnosis.comparison.effect_cards import EffectCard, effect_library, users_cards
from carrierflex.simulation.force_laws import Force, compiled_force

FloatArray = NDArray[np.float64]

_FORCE_LAW = "a function (deflection, speed, parameters) -> force that numba can compile"
_CARRIER_LAW = "a function (sensor, inputs, rig) -> signals of unit parameters, (n_parameters, n)"
_CARRIER_SHAPE_LAW = (
    "a function (sensor, inputs, rig, last value) -> signals, (n_parameters - 1, n)"
)
#: Deflections [m] and speeds [m/s] at which a force law is tried.
_TRIED_MOTIONS = ((0.0, 0.0), (1e-3, 1e-2), (-1e-3, -1e-2))
#: Samples of the inputs on which a carrier's law is tried.
_TRIED_SAMPLES = 9
#: Colours in which numba writes its messages.
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def force_library(
    kind: str,
    own: Sequence[EffectCard],
) -> tuple[dict[str, EffectCard], dict[str, Force]]:
    """Cards of a kind whose effects are forces, and the compiled laws of those of users.

    Parameters
    ----------
    kind : str
        ``element`` or ``mounting``.
    own : sequence of EffectCard
        Cards the kind brings, its placebos among them.

    Returns
    -------
    tuple of (dict of str to EffectCard, dict of str to callable)
        All cards by id, own ones first; users' laws by id.

    Raises
    ------
    ValueError
        Where a user's card has no law, or one that fails, does not compile, or gives a force while
        its effect is absent.
    """
    cards = effect_library(kind, own)
    laws: dict[str, Force] = {}
    for card in users_cards(cards, own):
        _check_is_function(card, _FORCE_LAW)
        _try_force(card)
        laws[card.id] = _compiled(card)
    return cards, laws


def refuse_wrong_carrier_laws(cards: Iterable[EffectCard], rig: CarrierRig) -> None:
    """Refuse users' cards of kind ``carrier`` whose law does not give what a fit can use.

    Parameters
    ----------
    cards : iterable of EffectCard
        Users' cards.
    rig : CarrierRig
        Rig and curves of the campaign.

    Raises
    ------
    ValueError
        Where a card has no law, a shape that cannot be interpolated, or a law that fails or gives
        an array of another shape or values that are not finite.
    """
    for card in cards:
        has_shape = any(parameter.shape for parameter in card.parameters)
        _check_is_function(card, _CARRIER_SHAPE_LAW if has_shape else _CARRIER_LAW)
        if has_shape:
            _check_shape_parameter(card)
        for is_axial in (True, False):
            _try_signals(card, RimSensor(0.5, 0.4, is_axial), rig)


def _refusal(card: EffectCard, found: str, expected: str) -> ValueError:
    return ValueError(f"effect card '{card.id}': {found}; expected {expected}")


def _check_is_function(card: EffectCard, expected: str) -> None:
    if card.law is None:
        raise _refusal(card, "no law", expected)
    if not callable(card.law):
        raise _refusal(card, f"its law is a {type(card.law).__name__}", expected)


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
            raise _refusal(card, f"its law fails: {_first_line(error)}", _FORCE_LAW) from error
        if force != 0.0:
            found = f"its law gives a force of {force:g} with all parameters but the shapes at zero"
            raise _refusal(card, found, "0")


def _compiled(card: EffectCard) -> Force:
    try:
        return compiled_force(card.law)
    except Exception as error:
        found = f"its law does not compile: {_first_line(error)}"
        raise _refusal(card, found, _FORCE_LAW) from error


def _check_shape_parameter(card: EffectCard) -> None:
    *others, last = card.parameters
    if not last.shape or any(parameter.shape for parameter in others):
        names = ", ".join(parameter.name for parameter in card.parameters if parameter.shape)
        raise _refusal(card, f"shapes {names}", "one at most, as the last parameter")
    if not np.isfinite([last.lower, last.upper]).all():
        found = f"shape {last.name} is bounded by {last.lower} and {last.upper}"
        raise _refusal(card, found, "finite bounds, between which signals are interpolated")


def _try_signals(card: EffectCard, sensor: RimSensor, rig: CarrierRig) -> None:
    last = card.parameters[-1]
    values = (0.5 * (last.lower + last.upper),) if last.shape else ()
    wanted = (len(card.parameters) - len(values), _TRIED_SAMPLES)
    try:
        rows = card.law(sensor, _tried_inputs(rig), rig, *values)
        signals = np.asarray(rows, dtype=np.float64)
    except Exception as error:
        expected = _CARRIER_SHAPE_LAW if last.shape else _CARRIER_LAW
        raise _refusal(card, f"its law fails: {_first_line(error)}", expected) from error
    if signals.shape != wanted:
        found = f"its law gives the shape {signals.shape} for {_TRIED_SAMPLES} samples"
        raise _refusal(card, found, str(wanted))
    if not np.isfinite(signals).all():
        raise _refusal(card, "its law gives values that are not finite", "finite values")


def _tried_inputs(rig: CarrierRig) -> CarrierInputs:
    """One turn with loads of both signs and zero among them."""
    share = np.linspace(-1.0, 1.0, _TRIED_SAMPLES)
    force = 1e5 * share
    return CarrierInputs(
        time=share + 1.0,
        carrier_angle=np.pi * (share + 1.0),
        torque=rig.nominal_torque * share,
        ntl_y=force,
        ntl_z=force[::-1],
        start=0.0,
        end=2.0,
    )


def _first_line(error: Exception) -> str:
    """Kind of an error and its first telling line; numba's first one names its own pipeline."""
    lines = [line.strip() for line in _COLOUR.sub("", str(error)).splitlines()]
    telling = [line for line in lines if line and not line.startswith("Failed in nopython mode")]
    return f"{type(error).__name__}: {telling[0]}" if telling else type(error).__name__
