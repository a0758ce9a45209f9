"""Words and numbers of the report.

The verdict as a sentence, values with as many digits as their error allows.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, TypeVar

from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.comparison.problem import Effects, GapCell
from carrierflex.diagnosis.gap.findings import Drift, Exponent, NonSynchronousCell, PartGrowth
from carrierflex.diagnosis.gap.gap_map import SIGNIFICANCE
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMED,
    NAMED_WITH_REMAINDER,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    GapReduction,
    Interval,
    NamedValue,
    RankedSet,
)
from carrierflex.diagnosis.report.class_words import class_names, lacking_words
from carrierflex.diagnosis.report.first_screen.engineering import (
    parameter_words,
    shown_unit,
)
from carrierflex.diagnosis.report.phrases import (
    Phrase,
    in_scientific_notation,
    phrase,
    unit_phrase,
)
from carrierflex.diagnosis.report.svg import scaled_unit
from carrierflex.diagnosis.results import Diagnosis

_Row = TypeVar("_Row", Drift, NonSynchronousCell)

#: Stands for what is not known.
UNKNOWN = "–"
#: An error of so many times the value says nothing about it.
_UNDETERMINED = 1e6
_MOST_DECIMALS = 9
#: Rounding of a closed form: no signal of any unit in use is that small.
_NOTHING = 1e-15
#: Smaller ones say no more.
_SMALLEST_P = 1e-6
_MOST_ROWS = 12
_MOST_BEYOND = 6
#: An exponent with a wider interval tells no law from another.
WIDEST_EXPONENT = 3.0

_HEADINGS = {
    NAMED: "The simulation lacks {effects}",
    NAMED_WITH_REMAINDER: "The simulation lacks {effects}, and something more",
    CLASS_NAMED: "The simulation lacks an effect of a known class, by no law of the library",
    ALIASED: "The simulation lacks {effects}, or an effect that looks the same in these records",
    NONE_OF_THESE: "No known effect explains the gap",
    AT_NOISE_FLOOR: "Simulation and measurement agree within the noise",
    NOT_DIAGNOSABLE: "These records do not allow a diagnosis",
}
_MEANINGS = {
    NAMED: "What is named explains the gap on records it was not fitted to; the remaining gap is "
    "near the noise.",
    NAMED_WITH_REMAINDER: "What is named explains most of the gap on records it was not fitted to; "
    "a remainder is above the noise.",
    CLASS_NAMED: "A model of the class without a fixed form explains the gap on records it was not "
    "fitted to; no law of the library follows its curve.",
    ALIASED: "Several effects explain the gap equally well under the measured conditions.",
    NONE_OF_THESE: "There is a gap, but no effect of the library may be named as its cause.",
    AT_NOISE_FLOOR: "There is no gap above the noise floor that an effect could explain.",
    NOT_DIAGNOSABLE: "Something is missing in the records; the reason says what.",
}


def verdict_heading(diagnosis: Diagnosis) -> str:
    """Verdict as one sentence with the effects in it.

    Parameters
    ----------
    diagnosis : Diagnosis
        Result of the diagnosis.

    Returns
    -------
    str
        For example ``The simulation lacks cubic stiffness, and something more``.
    """
    answer = diagnosis.classes
    if answer is not None and answer.classes:
        if diagnosis.verdict == CLASS_NAMED:
            lacking = lacking_words(answer, diagnosis.attribution.effects)
            return f"The simulation lacks {lacking}"
        if diagnosis.verdict == ALIASED and not diagnosis.attribution.effects:
            return f"The simulation lacks {class_names(answer)}, or what looks the same here"
    if diagnosis.verdict == NONE_OF_THESE and answer is not None and answer.experiment:
        return "These records show that an effect is missing, not which one"
    return _HEADINGS[diagnosis.verdict].format(
        effects=listed([plain_name(effect) for effect in diagnosis.attribution.effects])
    )


def verdict_meaning(verdict: str) -> str:
    """What a verdict says in general."""
    return _MEANINGS[verdict]


def alias_sentence(diagnosis: Diagnosis) -> str:
    """Effects that the named ones cannot be told from; empty where none."""
    texts = []
    for effect, *others in diagnosis.attribution.aliases:
        names = listed([plain_name(other) for other in others])
        texts.append(f"{plain_name(effect)} from {names}")
    return f"These records do not tell {listed(texts)}." if texts else ""


def experiment_text(diagnosis: Diagnosis) -> str:
    """Discriminating experiment as a sentence; empty where none is asked for."""
    text = diagnosis.attribution.discriminating_experiment
    return f"{capitalised(text).rstrip('.')}." if text else ""


def capitalised(text: str) -> str:
    """Text with its first letter large, the others as they are."""
    return text[:1].upper() + text[1:]


def counted(count: int, word: str) -> str:
    """Number with its noun: ``1 run``, ``3 runs``."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def added_effects(reduction: GapReduction | None) -> Effects:
    """Effects of the best supported set, named or not; empty where no set is supported."""
    return tuple(step.added for step in reduction.steps[1:]) if reduction else ()


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
    """95 % interval of a ratio; its half width where both ends are the same in three decimals."""
    if not all(math.isfinite(end) for end in ends):
        return UNKNOWN
    low, high = (f"{end:.3f}" for end in ends)
    return f"[{low}, {high}]" if low != high else "± < 0.001"


def percent(value: float) -> str:
    """Share in per cent, one decimal below ten."""
    if not math.isfinite(value):
        return UNKNOWN
    return f"{100.0 * value:.1f} %" if abs(value) < 0.0995 else f"{100.0 * value:.0f} %"


def in_one_unit(values: Sequence[float], unit: str) -> tuple[list[str], str]:
    """Sizes of a column under one prefix, by the largest of them, and their unit."""
    finite = [abs(value) for value in values if math.isfinite(value)]
    factor, shown = scaled_unit(max(finite, default=0.0), unit)
    return ["0" if abs(value) < _NOTHING else number(factor * value) for value in values], shown


class CellRow(NamedTuple):
    """Row of a table of parts of the gap: one place in all runs in which it stands out."""

    place: str
    runs: str
    share: float
    rms: float


def cell_rows(cells: Sequence[GapCell], *, many_channels: bool, n_runs: int) -> list[CellRow]:
    """Cells of one place merged over the runs, largest share first.

    The share is the sum, the RMS that over the runs.
    """
    groups: dict[str, list[GapCell]] = {}
    for cell in cells:
        before = f"{cell.channel_pattern}, " if many_channels else ""
        groups.setdefault(before + position_of(cell), []).append(cell)
    rows = []
    for place, members in groups.items():
        runs = list(dict.fromkeys(cell.run for cell in members))
        named = "every run" if len(runs) == n_runs > 1 else ", ".join(runs)
        mean_square = sum(cell.mean_square for cell in members) / len(members)
        share = sum(cell.share for cell in members)
        rows.append(CellRow(place, named, share, math.sqrt(max(mean_square, 0.0))))
    return sorted(rows, key=lambda row: -row.share)[:_MOST_ROWS]


def sized(value: float, unit: str) -> str:
    """Size with its unit, prefixed: ``208 µm``."""
    if not math.isfinite(value):
        return UNKNOWN
    if abs(value) < _NOTHING:
        return f"0 {unit}"
    factor, shown = scaled_unit(abs(value), unit)
    return f"{factor * value:.3g} {shown}"


def with_error(value: float, std: float) -> tuple[Phrase, Phrase]:
    """Value and standard deviation, both to the second digit of the latter, under one power of ten.

    Parameters
    ----------
    value, std : float
        Value and its standard deviation.

    Returns
    -------
    tuple of Phrase
        For example ``3.942`` and ``0.013``, or ``5.80e-4`` and ``0.10e-4``; "not determined" where
        the error is not a number or beyond all bounds.
    """
    if not math.isfinite(value):
        return phrase(UNKNOWN), phrase(UNKNOWN)
    if math.isnan(std):
        return in_scientific_notation(f"{value:.4g}"), phrase("not determined")
    if not (math.isfinite(std) and std > 0.0):
        return in_scientific_notation(f"{value:.4g}"), phrase(UNKNOWN)
    if std > _UNDETERMINED * abs(value):
        return in_scientific_notation(f"{value:.1g}"), phrase("not determined")
    power = math.floor(math.log10(max(abs(value), std)))
    shift = 0 if -3 <= power < 5 else power
    decimals = min(max(0, shift - math.floor(math.log10(std)) + 1), _MOST_DECIMALS)
    ending = f"e{shift}" if shift else ""
    value_text = f"{value / 10.0**shift:.{decimals}f}{ending}"
    error_text = f"{std / 10.0**shift:.{decimals}f}{ending}"
    return in_scientific_notation(value_text), in_scientific_notation(error_text)


class ParameterRow(NamedTuple):
    """Row of the table of parameters."""

    effect: str
    words: str
    name: str
    value: Phrase
    std: Phrase
    unit: Phrase


def parameter_rows(diagnosis: Diagnosis) -> list[ParameterRow]:
    """Every parameter in engineers' units, those of the named effects first."""
    which = diagnosis.attribution
    order = sorted(which.parameters, key=lambda effect: effect not in which.effects)
    return [
        _parameter_row(effect, name, named)
        for effect in order
        for name, named in which.parameters[effect].items()
    ]


def _parameter_row(effect: str, name: str, named: NamedValue) -> ParameterRow:
    factor, unit = shown_unit(name, named.unit)
    value, std = with_error(factor * named.value, factor * named.std)
    return ParameterRow(effect, parameter_words(effect, name), name, value, std, unit_phrase(unit))


def remark(ranked: RankedSet, diagnosis: Diagnosis) -> str:
    """What became of a set that was tried."""
    if ranked.effects and set(ranked.effects) == set(diagnosis.attribution.effects):
        return "named"
    return ranked.refused or "passes every rule"


def beside_named(effects: Effects, named: Effects) -> str:
    """Set of effects, told by its difference from the named one where both are long."""
    common = [effect for effect in effects if effect in named]
    if len(named) < 2 or set(effects) == set(named) or len(common) < 2:
        return set_name(effects)
    more = [plain_name(effect) for effect in effects if effect not in named]
    less = [plain_name(effect) for effect in named if effect not in effects]
    changes = [f"and {name}" for name in more] + [f"without {name}" for name in less]
    return f"the named ones {', '.join(changes)}"


def position_of(cell: GapCell) -> str:
    """Where a cell lies: its order or its frequency band."""
    if cell.frequency_hz is None:
        return f"order {cell.order:g}"
    low, high = cell.frequency_hz
    return f"{high:.4g} Hz" if high <= 1.001 * low or low == high else f"{low:.3g}–{high:.3g} Hz"


def rounded(value: float, decimals: int) -> str:
    """Number with so many decimals; what rounds to zero has no sign."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def pair(ends: Interval) -> str:
    """Interval of an exponent."""
    if not all(math.isfinite(end) for end in ends):
        return UNKNOWN
    low, high = (rounded(end, 1) for end in ends)
    return f"{low} to {high}" if low != high else f"{low} ± < 0.1"


def beyond_chance(rows: Sequence[_Row]) -> list[_Row]:
    """Rows whose p-value is significant, the first six."""
    return [row for row in rows if row.p_value < SIGNIFICANCE][:_MOST_BEYOND]


class GrowthRow(NamedTuple):
    """Row of the table of amplitude-scaling exponents."""

    part: str
    frame: str
    condition: str
    exponent: Exponent


def growth_rows(growth: Sequence[PartGrowth]) -> list[GrowthRow]:
    """Every exponent that is determined, at most twelve rows."""
    rows = []
    for part in growth:
        order = f", order {part.order:g}" if math.isfinite(part.order) else ""
        rows += [
            GrowthRow(part.channel_pattern + order, part.frame or UNKNOWN, condition, exponent)
            for condition, exponent in part.exponents.items()
            if math.isfinite(exponent.value)
            and exponent.ci95[1] - exponent.ci95[0] <= WIDEST_EXPONENT
        ]
    return rows[:_MOST_ROWS]


def p_value(value: float) -> Phrase:
    """Probability with its power of ten; very small ones as a bound."""
    if not math.isfinite(value):
        return phrase(UNKNOWN)
    if value < _SMALLEST_P:
        return phrase("< ") + in_scientific_notation(f"{_SMALLEST_P:.0e}")
    return in_scientific_notation(f"{value:.1g}")
