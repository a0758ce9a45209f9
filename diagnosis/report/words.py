"""Words and numbers of the report.

The verdict as a sentence, values with as many digits as their error allows.
"""

import math
import re
from collections.abc import Sequence
from typing import TypeVar

from markupsafe import Markup, escape

from carrierflex.diagnosis.comparison.problem import Effects, GapCell
from carrierflex.diagnosis.gap.findings import SIGNIFICANCE, Drift, NonSynchronousCell, PartGrowth
from carrierflex.diagnosis.gap.power_laws import Exponent
from carrierflex.diagnosis.report.svg import scaled_unit
from carrierflex.diagnosis.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    NAMED,
    NAMED_WITH_REMAINDER,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    Diagnosis,
    GapReduction,
    Interval,
    RankedSet,
)

_Row = TypeVar("_Row", Drift, NonSynchronousCell)

#: Stands for what is not known.
UNKNOWN = "–"
#: An error of so many times the value says nothing about it.
_UNDETERMINED = 1e6
_MOST_DECIMALS = 9
#: Rounding of a closed form: no signal of any unit in use is that small.
_NOTHING = 1e-15
_MOST_ROWS = 12
_MOST_BEYOND = 6
#: An exponent with a wider interval tells no law from another.
WIDEST_EXPONENT = 3.0
_PROPER_NAMES = {
    "coulomb": "Coulomb",
    "stribeck": "Stribeck",
    "maxwell": "Maxwell",
    "ntl": "non-torque-load",
}
_POWER = re.compile(r"\^(-?\d+(?:\.\d+)?)")
_TEN = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?)e([+-]?\d+)\b")

_HEADINGS = {
    NAMED: "The simulation lacks {effects}",
    NAMED_WITH_REMAINDER: "The simulation lacks {effects}, and something more",
    ALIASED: "The simulation lacks {effects}, or an effect that looks the same in these records",
    NONE_OF_THESE: "No known effect explains the gap",
    AT_NOISE_FLOOR: "Simulation and measurement agree within the noise",
    NOT_DIAGNOSABLE: "These records do not allow a diagnosis",
}
_MEANINGS = {
    NAMED: "What is named explains the gap on records it was not fitted to; what is left is near the noise.",
    NAMED_WITH_REMAINDER: "What is named explains most of the gap on records it was not fitted to; a remainder stands above "
    "the noise.",
    ALIASED: "Several effects explain the gap equally well under the conditions that were measured.",
    NONE_OF_THESE: "There is a gap, but no effect of the library may be named as its cause.",
    AT_NOISE_FLOOR: "There is no gap above the noise floor that an effect could explain.",
    NOT_DIAGNOSABLE: "Something is missing in the records; the reason says what.",
}


def verdict_heading(diagnosis: Diagnosis) -> str:
    """Verdict as one sentence with the effects in it.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.

    Returns
    -------
    str
        For example ``The simulation lacks cubic stiffness, and something more``.
    """
    return _HEADINGS[diagnosis.verdict].format(
        effects=listed([plain_name(own) for own in diagnosis.attribution.effects])
    )


def verdict_meaning(verdict: str) -> str:
    """What a verdict says in general."""
    return _MEANINGS[verdict]


def alias_sentence(diagnosis: Diagnosis) -> str:
    """What the named effects cannot be told from; empty where nothing."""
    classes = diagnosis.attribution.aliases
    texts = [
        f"{plain_name(own[0])} from {listed([plain_name(other) for other in own[1:]])}"
        for own in classes
    ]
    return f"These records do not tell {listed(texts)}." if texts else ""


def plain_name(effect: str) -> str:
    """Effect id in words: ``cubic stiffness``, ``Coulomb friction``."""
    words = effect.replace("elasto_plastic", "elasto-plastic").split("_")
    return " ".join(_PROPER_NAMES.get(word, word) for word in words)


def separating_text(diagnosis: Diagnosis) -> str:
    """Measurement that would tell more, as a sentence with the effects in words.

    Empty where none is asked for.
    """
    text = in_words(diagnosis.attribution.discriminating_experiment, diagnosis)
    return f"{capitalised(text).rstrip('.')}." if text else ""


def in_words(text: str, diagnosis: Diagnosis) -> str:
    """Text with the ids of all effects that were tried or are aliased in words, longer ids first."""
    which = diagnosis.attribution
    sets = [own.effects for own in which.ranking] + list(which.aliases)
    for effect in sorted({effect for effects in sets for effect in effects}, key=len, reverse=True):
        text = text.replace(effect, plain_name(effect))
    return text


def capitalised(text: str) -> str:
    """Text with its first letter large, the others as they are."""
    return text[:1].upper() + text[1:]


def counted(count: int, word: str) -> str:
    """Number with its noun: ``1 run``, ``3 runs``."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def set_name(effects: Effects) -> str:
    """Set of effects in words; the empty one is the baseline."""
    return " + ".join(plain_name(own) for own in effects) or "baseline alone"


def added_effects(far: GapReduction) -> Effects:
    """Effects of the best supported set, named or not; empty where no set is supported."""
    return tuple(step.added for step in far.search[1:])


def listed(words: Sequence[str]) -> str:
    """Words joined as in a sentence: ``a, b and c``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def number(value: float, digits: int = 3) -> str:
    """Number with so many significant digits; a dash for what is not finite."""
    return f"{value:.{digits}g}" if math.isfinite(value) else UNKNOWN


def ratio(value: float) -> str:
    """Ratio with three decimals."""
    return f"{value:.3f}" if math.isfinite(value) else UNKNOWN


def interval(ends: Interval) -> str:
    """95 % interval of a ratio."""
    return f"[{ends[0]:.3f}, {ends[1]:.3f}]" if all(math.isfinite(end) for end in ends) else UNKNOWN


def percent(value: float) -> str:
    """Share in per cent, one decimal below ten."""
    if not math.isfinite(value):
        return UNKNOWN
    return f"{100.0 * value:.1f} %" if abs(value) < 0.0995 else f"{100.0 * value:.0f} %"


def percent_interval(ends: Interval) -> str:
    """Interval of a share."""
    return (
        f"{100.0 * ends[0]:.1f} to {100.0 * ends[1]:.1f} %"
        if all(math.isfinite(end) for end in ends)
        else UNKNOWN
    )


def sized(value: float, unit: str) -> str:
    """Size with its unit, prefixed: ``208 µm``."""
    if not math.isfinite(value):
        return UNKNOWN
    if abs(value) < _NOTHING:
        return f"0 {unit}"
    factor, shown = scaled_unit(abs(value), unit)
    return f"{factor * value:.3g} {shown}"


def with_error(value: float, std: float) -> tuple[str, str]:
    """Value and standard deviation, both to the second digit of the latter, under one power of ten.

    Parameters
    ----------
    value, std : float
        What was found, and its standard deviation.

    Returns
    -------
    tuple of str
        For example ``("3.942", "0.013")`` or ``("5.80e-4", "0.10e-4")``; "not determined" where the
        error is beyond all bounds.
    """
    if not math.isfinite(value):
        return UNKNOWN, UNKNOWN
    if not (math.isfinite(std) and std > 0.0):
        return f"{value:.4g}", UNKNOWN
    if std > _UNDETERMINED * abs(value):
        return f"{value:.1g}", "not determined"
    power = math.floor(math.log10(max(abs(value), std)))
    shift = 0 if -3 <= power < 5 else power
    decimals = min(max(0, shift - math.floor(math.log10(std)) + 1), _MOST_DECIMALS)
    ending = f"e{shift}" if shift else ""
    own, error = (f"{part / 10.0**shift:.{decimals}f}{ending}" for part in (value, std))
    return own, error


def parameter_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str, str, str]]:
    """Effect, name, value, standard deviation and unit of every parameter.

    Those of the named effects first.
    """
    which = diagnosis.attribution
    order = sorted(which.parameters, key=lambda effect: effect not in which.effects)
    return [
        (effect, name, *with_error(own.value, own.std), own.unit)
        for effect in order
        for name, own in which.parameters[effect].items()
    ]


def remark(own: RankedSet, diagnosis: Diagnosis) -> str:
    """What became of a set that was tried."""
    if own.effects and set(own.effects) == set(diagnosis.attribution.effects):
        return "named"
    return in_words(own.refused, diagnosis) or "passes every rule"


def powers(text: str) -> Markup:
    """Text with its powers raised: ``V/V^3``, ``deflection^3.0``, ``5.8e-4``."""
    escaped = str(escape(text.replace(" <= ", " ≤ ")))
    escaped = _TEN.sub(lambda match: f"{match[1]}·10<sup>{_minus(match[2])}</sup>", escaped)
    return Markup(_POWER.sub(lambda match: f"<sup>{_minus(match[1])}</sup>", escaped))


def _minus(digits: str) -> str:
    return digits.lstrip("+").replace("-", "−")


def place_of(cell: GapCell) -> str:
    """Where a cell lies: its order or its frequency band."""
    if cell.frequency_hz is None:
        return f"order {cell.order:g}"
    low, high = cell.frequency_hz
    return f"{high:.4g} Hz" if high <= 1.001 * low or low == high else f"{low:.3g}–{high:.3g} Hz"


def pair(ends: Interval) -> str:
    """Interval of an exponent."""
    return f"{ends[0]:.1f} to {ends[1]:.1f}" if all(math.isfinite(end) for end in ends) else UNKNOWN


def root_sized(mean_square: float, unit: str) -> str:
    """RMS with its unit from a mean square, which may be slightly negative above a subtracted noise."""
    return sized(math.sqrt(max(mean_square, 0.0)), unit) if math.isfinite(mean_square) else UNKNOWN


def beyond_chance(rows: Sequence[_Row]) -> list[_Row]:
    """Rows whose p-value is significant, the first six."""
    return [row for row in rows if row.p_value < SIGNIFICANCE][:_MOST_BEYOND]


def where_parts(text: str) -> tuple[str, str]:
    """Sentence about the place of the gap in two: its shares, and what is said beside them."""
    parts = text.split("; ")
    shares = next((k for k, part in enumerate(parts) if not part[:1].isdigit()), len(parts))
    return "; ".join(parts[: max(shares, 1)]), "; ".join(parts[max(shares, 1) :])


def growth_rows(growth: Sequence[PartGrowth]) -> list[tuple[str, str, str, Exponent]]:
    """Part, frame, condition and exponent of everything that is determined, at most twelve rows."""
    rows = []
    for part in growth:
        name = part.channel_pattern + (
            f", order {part.order:g}" if math.isfinite(part.order) else ""
        )
        rows += [
            (name, part.frame or UNKNOWN, condition, own)
            for condition, own in part.exponents.items()
            if math.isfinite(own.value) and own.ci95[1] - own.ci95[0] <= WIDEST_EXPONENT
        ]
    return rows[:_MOST_ROWS]


def p_value(value: float) -> str:
    """Probability with its power of ten; very small ones as a bound."""
    if not math.isfinite(value):
        return UNKNOWN
    return "< 1e-99" if value < 1e-99 else f"{value:.1g}"
