"""How many fixed-interface modes a body needs.

By number, by the frequency up to which it is used, by cut-off frequency, or by the error of its
response.
"""

from collections.abc import Callable, Mapping
from typing import Any

from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.dynamic_stiffness import FullResponse, full_response, modes_needed
from carrierflex.reduction.held_structure import Grounded
from carrierflex.reduction.modes.mode_rules import (
    CUT_OFF_SHARE,
    FREE_CUT_OFF_SHARE,
    AtLeast,
    Below,
    ModeRule,
    rule_for_use,
)

#: Frequency [Hz] up to which a body is used where the user does not say: beyond the twentieth
#: harmonic of the ring's teeth passing (99 teeth at 22.1 rpm: 36.5 Hz).
DEFAULT_FREQUENCY = 750.0
#: A basis larger than this is not tried for a response error.
_MOST_MODES = 320


#: Frequency response of a body, full and reduced to the modes of a rule.
ResponseOfRule = Callable[[ModeRule], FullResponse]


def response_of_body(structure: StructuralModel, body: Grounded) -> ResponseOfRule:
    """Response of a body to the modes of a rule; `body`, its factor, serves every rule."""
    return lambda rule: full_response(structure, craig_bampton(structure, rule, body=body))


def chosen_modes(response_of: ResponseOfRule, options: Mapping[str, Any]) -> ModeRule:
    """Rule for the number of modes by what the options ask for.

    Parameters
    ----------
    response_of : callable
        Response of the body by a rule, asked where the response counts.
    options : mapping
        As :func:`rule_of_options` takes them, or ``frf_tolerance`` with ``up_to`` [Hz].

    Raises
    ------
    ValueError
        Where a value is out of range, or more modes would be needed than are tried.
    """
    if options.get("frf_tolerance") is not None:
        return modes_for_response(
            response_of, _frequency_of_use(options), float(options["frf_tolerance"])
        )
    return rule_of_options(options)


def rule_of_options(options: Mapping[str, Any]) -> ModeRule:
    """Rule for the number of modes where the response of the body is not looked at.

    Parameters
    ----------
    options : mapping
        ``modes`` (a number), ``modes_below`` [Hz] of the modes, or ``up_to`` [Hz], the frequency
        up to which the body is used; None where not asked for. ``interface`` is ``"free"`` for a
        basis of free modes.

    Raises
    ------
    ValueError
        Where a value is out of range.
    """
    if options.get("modes") is not None:
        return AtLeast(int(options["modes"]))
    if options.get("modes_below") is not None:
        return Below(float(options["modes_below"]))
    share = FREE_CUT_OFF_SHARE if options.get("interface") == "free" else CUT_OFF_SHARE
    return rule_for_use(_frequency_of_use(options), share)


def wanted_frequency(options: Mapping[str, Any]) -> float | None:
    """Frequency [Hz] up to which the options say that the body is used.

    None where they give the modes instead.
    """
    if options.get("modes") is not None or options.get("modes_below") is not None:
        return None
    return _frequency_of_use(options)


def _frequency_of_use(options: Mapping[str, Any]) -> float:
    return DEFAULT_FREQUENCY if options.get("up_to") is None else float(options["up_to"])


def modes_for_response(
    response_of: ResponseOfRule, frequency_hz: float, tolerance: float
) -> ModeRule:
    """Fewest modes whose frequency response at pilots and sensors is met up to a frequency.

    Parameters
    ----------
    response_of : callable
        Response of the body by a rule.
    frequency_hz : float
        End of the band [Hz].
    tolerance : float
        Largest error allowed, as :func:`carrierflex.reduction.dynamic_stiffness.response_error`
        measures it.

    Returns
    -------
    ModeRule
        That number of modes.

    Raises
    ------
    ValueError
        Where frequency or tolerance is not positive, or 320 modes are not enough.
    """
    if not (frequency_hz > 0.0 and tolerance > 0.0):
        raise ValueError(
            f"response error {tolerance:g} up to {frequency_hz:g} Hz; expected a positive "
            "tolerance and a positive frequency"
        )
    # The series of the left-out modes converges from twice the band's end on.
    tried: ModeRule = Below(2.0 * frequency_hz)
    while True:
        response = response_of(tried)
        try:
            return AtLeast(modes_needed(response, frequency_hz, tolerance))
        except ValueError:
            n_modes = max(10, 2 * len(response.omega))
            if n_modes > _MOST_MODES:
                raise
            tried = AtLeast(n_modes)
