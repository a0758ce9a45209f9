"""Whether the intervals of an answer hold the true parameters, where a case has true ones."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from carrierflex.blind_check.scoring.class_judging import RIGHT, ClassJudged

_NORMAL_95 = 1.959964
#: Parameters of the baseline that are scored; its damping is an equivalent one beside any other.
_OF_BASELINE = ("m", "K1")


@dataclass(frozen=True)
class Hit:
    """One parameter that answer and label both hold.

    `half_width` is over the true value, or in rad where the parameter is a direction.
    """

    name: str
    is_baseline: bool
    is_covered: bool
    half_width: float
    is_direction: bool = False


def covered_parameters(case: ClassJudged) -> list[Hit]:
    """Parameters of the baseline and of textbook laws that a right answer names.

    Parameters
    ----------
    case : ClassJudged
        A case; one without true parameters, or that is not right, gives none.

    Returns
    -------
    list of Hit
        Whether the 95 % interval holds the true value, and its half-width over that value.
    """
    if case.outcome != RIGHT:
        return []
    claimed = case.verdict.document.get("parameters") or {}
    hits = []
    for effect, values in case.label.parameters.items():
        for symbol, true in values.items():
            claim = claimed.get(effect, {}).get(symbol)
            interval = _interval(claim) if claim else None
            is_baseline = effect == "baseline"
            if interval is None or true == 0.0 or (is_baseline and symbol not in _OF_BASELINE):
                continue
            low, high = interval
            width = 0.5 * (high - low) / abs(true)
            hits.append(Hit(f"{effect}.{symbol}", is_baseline, low <= true <= high, width))
    return hits


def _interval(claim: Mapping[str, Any]) -> tuple[float, float] | None:
    """The claimed 95 % interval, or that of its standard deviation."""
    own = claim.get("ci95")
    if own and None not in own:
        return float(own[0]), float(own[1])
    if claim.get("value") is None or claim.get("std") is None:
        return None
    value, std = float(claim["value"]), float(claim["std"])
    return value - _NORMAL_95 * std, value + _NORMAL_95 * std
