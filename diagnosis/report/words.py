"""Numbers, units, parameters and table rows of the report in words.

Texts are plain, powers as ``torque^1.0``; the report raises them. Values have as many digits as
their error allows.
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from markupsafe import Markup, escape

from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.comparison.problem import BASELINE, Effects
from carrierflex.diagnosis.gap.findings import Exponent, PartGrowth
from carrierflex.diagnosis.inference.results import (
    GapReduction,
    Interval,
    NamedValue,
    RankedSet,
    SelectionStep,
)
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.quantities import NOTHING, UNKNOWN, number, scaled_unit
from carrierflex.identification.estimation.resampling import NORMAL_95

_POWER = re.compile(r"\^(-?\d+(?:\.\d+)?)")
_POWER_OF_TEN = re.compile(r"(^|(?:&lt;|≤) )(-?\d+(?:\.\d+)?)e([+-]?\d+)")


def raised(text: str) -> Markup:
    """HTML of a plain text: ``torque^-0.5``, ``5.80e-4`` and ``p <= 1e-09`` as they are printed."""
    html = str(escape(text)).replace("&lt;=", "≤")
    html = _POWER_OF_TEN.sub(lambda m: f"{m[1]}{m[2]}·10^{int(m[3])}", html)
    return Markup(_POWER.sub(lambda m: f"<sup>{m[1].replace('-', '−')}</sup>", html))


#: Factor and unit that a unit of the contract is shown in.
_SHOWN = {
    "m/N": (1e11, "µm per 100 kN"),
    "m/(N m)": (1e11, "µm per 100 kN m"),
    "rad/N": (1e8, "mrad per 100 kN"),
    "rad/(N m)": (1e8, "mrad per 100 kN m"),
    "1/N": (1e7, "% per 100 kN"),
    "s": (1e3, "ms"),
    "m": (1e6, "µm"),
    "Pa": (1e-9, "GPa"),
    "rad": (1e3, "mrad"),
}
#: Parameter of a dimension off its drawing, which a drawing gives in mm.
CHANGE = "change"
_AXES = {"y": "sideways", "z": "vertical"}
_TILTS = ("tilt of direction 0 deg", "tilt of direction 90 deg")
_WORDS: dict[str, str] = {
    "m": "mass",
    "K1": "stiffness",
    "K2": "quadratic stiffness",
    "K3": "cubic stiffness",
    "K5": "quintic stiffness",
    "C1": "damping",
    "C2": "quadratic damping",
    "C3": "cubic damping",
    "f0": "constant force",
    "q_0": "deflection at the release",
    "v_0": "speed at the release",
    "Fc": "friction force",
    "Fs": "breakaway force",
    "v_s": "Stribeck speed",
    "Fy": "force at which it slips",
    "Kp": "stiffness before it slips",
    "gap": "clearance",
    "k": "stiffness of the branch",
    "c": "damping of the branch",
    "tau": "time constant",
    "delay": "delay",
    "F_plus": "friction force outwards",
    "F_minus": "friction force inwards",
    "d_x": "axial offset",
    "d_y": "sideways offset",
    "d_z": "vertical offset",
    "phi_H": "tilt of the housing",
    "theta_H": "direction of the housing's tilt",
    "phi_T": "tilt at nominal torque",
    "theta_T": "direction of that tilt",
    "phi_PLC": "tilt of the carrier",
    "theta_PLC": "direction of the carrier's tilt",
    "e_PLC": "eccentricity of the carrier",
    "theta_e": "direction of the eccentricity",
    "rho_s": "share of stiff pins",
    "rho_f": "share of flexible pins",
    "theta_rho": "turn of the deflection",
    "kappa_r": "load sharing, radial",
    "kappa_t": "load sharing, tangential",
    "s_0": "saddle without load",
    "s_T": "saddle by torque",
    "P_T": "torque per radial load",
    "dk_x": "axial stiffness beyond nominal",
    "compliance": "compliance of the main bearing",
    "angle": "turn of the radial load",
    "dv": "error of the angle",
    "g": "error of the gain",
    "e": "difference port to starboard",
    "z": "zero",
    "F_s": "load of half the travel",
    "phi_B": "largest tilt in the bearing",
    "r_B": "largest radial shift in the bearing",
    "phi_R": "largest tilt between the bearings",
    "r_R": "largest radial shift between the bearings",
    "W_1": "weight on the bearing pressed towards +z",
    "W_2": "weight on the bearing pressed towards -z",
}
#: Parameters of pins that close.
_OF_CLOSED_PINS = {
    "c": "share that closes",
    "w_s": "weight on stiff pins",
    "w_f": "weight on flexible pins",
    "k_s": "radial load on stiff pins",
    "k_f": "radial load on flexible pins",
    "T_c": "torque at which it closes",
}


def parameter_words(effect: str, name: str) -> str:
    """What a parameter is, in words: ``tilt of the carrier``."""
    if effect == "sensor_delay":
        return "delay"
    if effect == "pin_clearance":
        return _OF_CLOSED_PINS.get(name, name)
    stem, _, last = name.partition("_")
    if effect in ("ntl_tilt", "flange_warp", "bearing_clearance") and last in _AXES:
        what = {"a": _TILTS[0], "b": _TILTS[1], "s": "saddle"}.get(stem, stem)
        return f"{what} by {_AXES[last]} load"
    if effect == "ring_pass" and last in ("c", "s"):
        motion = {"p": "axial motion", "q": _TILTS[0]}.get(stem, _TILTS[1])
        return f"{motion} as planets pass, {'cosine' if last == 'c' else 'sine'}"
    if effect == "unequal_load_sharing" and last.isdigit():
        return f"excess load of pin {last}"
    if effect == "face_runout" and last.isdigit():
        return f"order {last}, {'cosine' if stem == 'a' else 'sine'}"
    if effect == "thermal_drift" and last.isdigit():
        return f"drift, term {last}"
    words = _WORDS.get(name, "")
    if words and effect == BASELINE and name in ("K1", "C1"):
        return f"{words} of the baseline"
    return words


def shown_unit(name: str, unit: str) -> tuple[float, str]:
    """Factor to the unit that an engineer uses for a parameter, and that unit."""
    # Directions; other angles are small.
    if unit == "rad" and name.startswith(("theta", "angle", "dv")):
        return 180.0 / math.pi, "deg"
    if unit == "m" and name == CHANGE:
        return 1e3, "mm"
    return _SHOWN.get(unit, (1.0, unit))


MOST_ROWS = 12
#: An exponent with a wider interval tells no law from another.
WIDEST_EXPONENT = 3.0


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
    return ["0" if abs(value) < NOTHING else number(factor * value) for value in values], shown


def with_error(value: float, std: float) -> tuple[str, str]:
    """Value and standard deviation to the second digit of the latter, under one power of ten.

    For example ``5.80e-4`` and ``0.10e-4``; "not determined" where the error is beyond all bounds.
    """
    if not math.isfinite(value):
        return UNKNOWN, UNKNOWN
    if math.isnan(std):
        return f"{value:.4g}", "not determined"
    if not (math.isfinite(std) and std > 0.0):
        return f"{value:.4g}", UNKNOWN
    if std > 1e6 * abs(value):
        return f"{value:.1g}", "not determined"
    power = math.floor(math.log10(max(abs(value), std)))
    shift = 0 if -3 <= power < 5 else power
    decimals = min(max(0, shift - math.floor(math.log10(std)) + 1), 9)
    ending = f"e{shift}" if shift else ""
    texts = [f"{size / 10.0**shift:.{decimals}f}{ending}" for size in (value, std)]
    return texts[0], texts[1]


class _ParameterRow(NamedTuple):
    """Row of the table of parameters; errors are half widths of 95 % intervals."""

    effect: str
    words: str
    name: str
    value: float
    error: float
    unit: str
    sources: Mapping[str, float]


def named_rows(diagnosis: Diagnosis, effect: str) -> list[_ParameterRow]:
    """Parameters of an effect: those that differ from zero beyond their std, or all."""
    which = diagnosis.attribution
    values = which.parameters.get(effect) or which.alternatives.get(effect, {})
    clear = {name: named for name, named in values.items() if abs(named.value) > named.std}
    return [_parameter_row(effect, *entry) for entry in (clear or values).items()]


def parameter_rows(diagnosis: Diagnosis) -> list[_ParameterRow]:
    """Every parameter in engineers' units, those of the named effects first."""
    which = diagnosis.attribution
    order = sorted(which.parameters, key=lambda effect: effect not in which.effects)
    return [
        _parameter_row(effect, name, named)
        for effect in order
        for name, named in which.parameters[effect].items()
    ]


def _parameter_row(effect: str, name: str, named: NamedValue) -> _ParameterRow:
    factor, unit = shown_unit(name, named.unit)
    wide = NORMAL_95 * factor
    least = 0.01 * named.std
    sources = {source: wide * std for source, std in named.sources.items() if std >= least}
    words = parameter_words(effect, name)
    return _ParameterRow(effect, words, name, factor * named.value, wide * named.std, unit, sources)


def value_words(row: _ParameterRow) -> str:
    """Value with its 95 % interval and unit: ``0.595 ± 0.014 mrad``."""
    value, error = with_error(row.value, row.error)
    unit = "" if row.unit == "1" else f" {row.unit}"
    if error in (UNKNOWN, "not determined"):
        return f"{value}{unit}{'' if error == UNKNOWN else f', {error}'}"
    (value, _, power), error = value.partition("e"), error.partition("e")[0]
    return f"({value} ± {error})·10^{power}{unit}" if power else f"{value} ± {error}{unit}"


def source_names(rows: Sequence[_ParameterRow]) -> list[str]:
    """Sources of error of several parameters, each once."""
    return list(dict.fromkeys(source for row in rows for source in row.sources))


def acting_sizes(steps: Sequence[SelectionStep], runs: Sequence[Any]) -> list[float]:
    """What every step takes in every run, then in both halves of the runs."""
    return [
        size
        for step in steps
        for size in (*(step.by_run.get(run.name, math.nan) for run in runs), *step.halves)
    ]


def remark(ranked: RankedSet, diagnosis: Diagnosis) -> str:
    """What became of a set that was tried."""
    if ranked.effects and set(ranked.effects) == set(diagnosis.attribution.effects):
        return "named"
    return ranked.refused or "passes every rule"


def compared_with_named(effects: Effects, named: Effects) -> str:
    """Set of effects, told by its difference from the named one where both are long."""
    common = [effect for effect in effects if effect in named]
    if len(named) < 2 or set(effects) == set(named) or len(common) < 2:
        return set_name(effects)
    more = [plain_name(effect) for effect in effects if effect not in named]
    less = [plain_name(effect) for effect in named if effect not in effects]
    changes = [f"and {name}" for name in more] + [f"without {name}" for name in less]
    return f"the named ones {', '.join(changes)}"


def position_of(order: float, band_hz: tuple[float, float] | None) -> str:
    """Where a cell lies: its order, or its band of frequency."""
    if band_hz is None:
        return f"order {order:g}"
    low, high = band_hz
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


def growth_rows(growth: Sequence[PartGrowth]) -> list[tuple[str, str, str, Exponent]]:
    """Part, frame, condition and every exponent that is determined, at most twelve rows."""
    rows = []
    for group in growth:
        order = f", order {group.order:g}" if math.isfinite(group.order) else ""
        rows += [
            (group.channel_pattern + order, group.frame or UNKNOWN, condition, exponent)
            for condition, exponent in group.exponents.items()
            if math.isfinite(exponent.value)
            and exponent.ci95[1] - exponent.ci95[0] <= WIDEST_EXPONENT
        ]
    return rows[:MOST_ROWS]
