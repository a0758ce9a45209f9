"""A carrier's gap map in words.

Parts with their share, frame, runs and growth; what is small yet certain.
"""

from collections.abc import Sequence

from carrierflex.diagnosis.carrier.gap_parts import (
    CARRIER,
    HOUSING,
    Conditions,
    GapPart,
    frame_of,
    gap_parts,
    part_growth,
)
from carrierflex.diagnosis.carrier.patterns import PATTERN_NAMES, RADIAL
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import PartGrowth
from carrierflex.diagnosis.gap.power_laws import WITHOUT

#: Parts of the gap named in the sentence at most, and the smallest share worth naming.
_MOST_PARTS = 3
_SMALLEST_PART = 0.05
#: Small orders named at most.
_MOST_SMALL = 4
#: Below this exponent either way a part does not depend on a condition.
_FLAT = 0.25
#: An exponent is told where its interval is narrower than this on either side.
_TOLD_WITHIN = 1.0
TORQUE, RADIAL_LOAD, SPEED = "torque", "radial load", "speed"
_MEANINGS = {
    (0, "m=0"): "axial offset",
    (0, "m=+1"): "tilt fixed to the housing",
    (0, "m=-1"): "tilt fixed to the housing",
    (0, "m=2"): "saddle fixed to the housing",
    (1, "m=+1"): "tilt fixed to the carrier",
    (0, RADIAL): "radial shift fixed to the housing",
    (1, RADIAL): "eccentricity fixed to the carrier",
}


def carrier_where_text(cells: Sequence[GapCell], conditions: Conditions) -> str:
    """One sentence about a gap map.

    Parameters
    ----------
    cells : sequence of GapCell
        The map.
    conditions : mapping of str to mapping of str to float
        ``torque`` [N m], ``radial load`` [N] and ``speed`` [rad/s] of every run, sizes.

    Returns
    -------
    str
        Shares with order, pattern, frame, runs and growth; then the parts that are small yet beyond
        chance.
    """
    everything = gap_parts(cells)
    seen = [part for part in everything if part.runs and part.share > 0.0]
    large = [part for part in seen if part.share >= _SMALLEST_PART][:_MOST_PARTS]
    if not large:
        return "no order or pattern of the gap stands out from the noise"
    texts = []
    for k, part in enumerate(large):
        start = (
            f"{100.0 * part.share:.0f} % of the gap is"
            if k == 0
            else f"{100.0 * part.share:.0f} % is"
        )
        growth = _growth(part, part_growth(part, everything, conditions), conditions)
        texts.append(
            f"{start} order {part.order}, {part.pattern}{_meaning(part, everything)}, {_runs(part, conditions)}{growth}"
        )
    return "; ".join(
        [*texts, *_small_text([part for part in seen if part not in large], conditions)]
    )


def _small_text(parts: Sequence[GapPart], conditions: Conditions) -> list[str]:
    """Orders beyond chance in most runs though small, largest first.

    The patterns of one order together.
    """
    n_runs = len(conditions[TORQUE])
    orders: dict[int, list[GapPart]] = {}
    for part in parts:
        if 2 * len(part.runs) > n_runs:
            orders.setdefault(abs(part.order), []).append(part)
    ranked = sorted(orders.items(), key=lambda item: -sum(part.share for part in item[1]))[
        :_MOST_SMALL
    ]
    if not ranked:
        return []
    named = []
    for order, own in ranked:
        surest = min(own, key=lambda part: (-len(part.runs), part.p_value))
        patterns = " and ".join(dict.fromkeys(part.pattern for part in own))
        share = 100.0 * sum(part.share for part in own)
        named.append(
            f"order {order}, {patterns} ({share:.2g} %, {_p_text(surest.p_value)} {_runs(surest, conditions)})"
        )
    return [f"small yet beyond chance: {', '.join(named)}"]


def _p_text(p_value: float) -> str:
    return f"p <= {p_value:.0e}" if p_value > 1e-99 else "p < 1e-99"


def _runs(part: GapPart, conditions: Conditions) -> str:
    return (
        "in every run"
        if len(part.runs) == len(conditions[TORQUE])
        else f"in {', '.join(sorted(part.runs))}"
    )


def _meaning(part: GapPart, parts: Sequence[GapPart]) -> str:
    known = _MEANINGS.get((part.order, part.pattern))
    if known is None and part.pattern in (*PATTERN_NAMES.values(), RADIAL):
        if part.order == 0:
            return " (fixed to the housing)"
        frame = frame_of(part, parts)
        if frame == CARRIER:
            known = "waves fixed to the carrier"
        else:
            known = (
                "pulsating, fixed to the housing"
                if frame == HOUSING
                else "fixed to carrier or housing, undecided"
            )
    return f" ({known})" if known else ""


def _growth(part: GapPart, growth: PartGrowth, conditions: Conditions) -> str:
    """How a part grows with torque, radial load and speed, as far as the runs tell."""
    text = ""
    for name in (TORQUE, RADIAL_LOAD, SPEED):
        found = growth.exponents[name]
        if not found.ci95[1] - found.value <= _TOLD_WITHIN:
            continue
        flat = abs(found.value) < _FLAT
        text += f", whatever the {name}" if flat else f", growing as {name}^{found.value:.1f}"
    if growth.exponents[TORQUE].reason:
        text += f" (growth with torque not determinable: {growth.exponents[TORQUE].reason})"
    return text + _load_words(part, growth, conditions)


def _load_words(part: GapPart, growth: PartGrowth, conditions: Conditions) -> str:
    """Whether the part differs between runs with and without a radial load, its growth with torque taken out."""
    loads, found = conditions[RADIAL_LOAD], growth.exponents[TORQUE]
    power = found.value if found.ci95[1] - found.value <= _TOLD_WITHIN else 0.0
    sizes = {
        run: part.amplitudes[run] / max(conditions[TORQUE][run], 1.0) ** power for run in part.runs
    }
    largest = max(loads.values())
    without = [size for run, size in sizes.items() if loads[run] <= WITHOUT * largest]
    with_load = [size for run, size in sizes.items() if loads[run] > WITHOUT * largest]
    both = [*without, *with_load]
    differs = without and with_load and max(both) - min(both) > 0.5 * max(both)
    return ", changing with the radial load" if differs else ""
