"""Parts of a carrier's gap.

One pattern and order over all runs, what it is fixed to and how it grows with the loads.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.carrier.patterns import PATTERN_NAMES, RADIAL, FloatArray
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import SIGNIFICANCE, PartGrowth
from carrierflex.diagnosis.gap.power_laws import exponents

HOUSING, CARRIER, UNDECIDED = "housing", "carrier", "undecided"
#: A wave is fixed to the carrier where it holds this share of its order; a weaker one may be the
#: leak of a sensor's gain.
_OWN_ORDER = 0.9
#: Growth is fitted for this many parts.
_MOST_PARTS = 12

Conditions = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class GapPart:
    """Cells of one pattern and order in all runs.

    Parameters
    ----------
    pattern : str
        Sensor pattern.
    order : int
        Order; negative for backward motion of a radial pair.
    share : float
        Share of the gap.
    amplitudes, errors : dict of str to float
        RMS by run and its standard deviation.
    runs : tuple of str
        Runs in which it is beyond chance.
    p_value : float
        Largest of those runs; 1 where there is none.
    """

    pattern: str
    order: int
    share: float
    amplitudes: dict[str, float]
    errors: dict[str, float]
    runs: tuple[str, ...]
    p_value: float


def gap_parts(cells: Sequence[GapCell]) -> tuple[GapPart, ...]:
    """Parts of the gap over all runs, largest first.

    The two halves of a static tilt are one part.
    """
    groups: dict[tuple[str, int], list[GapCell]] = {}
    for cell in cells:
        pattern = (
            "m=+1" if (cell.order, cell.channel_pattern) == (0, "m=-1") else cell.channel_pattern
        )
        groups.setdefault((pattern, int(cell.order)), []).append(cell)
    parts = []
    for (pattern, order), own in groups.items():
        sizes: dict[str, float] = {}
        noise: dict[str, float] = {}
        for cell in own:
            sizes[cell.run] = sizes.get(cell.run, 0.0) + max(cell.coherent, 0.0)
            noise[cell.run] = noise.get(cell.run, 0.0) + max(cell.mean_square - cell.coherent, 0.0)
        seen = [cell for cell in own if cell.p_value < SIGNIFICANCE and cell.coherent > 0.0]
        parts.append(
            GapPart(
                pattern,
                order,
                sum(cell.share for cell in own),
                {run: float(np.sqrt(size)) for run, size in sizes.items()},
                # Of the two components of the noise one lies along the amplitude.
                {run: float(np.sqrt(0.5 * size)) for run, size in noise.items()},
                tuple(dict.fromkeys(cell.run for cell in seen)),
                max((cell.p_value for cell in seen), default=1.0),
            )
        )
    return tuple(sorted(parts, key=lambda part: -part.share))


def frame_of(part: GapPart, parts: Sequence[GapPart]) -> str:
    """What a part is fixed to, told by its pattern and order.

    Static parts stay with the housing. A shape that turns with the carrier shows order n only in
    pattern ``m = n mod 4``, and in a radial pair as forward motion for n = 1, 5, ..., backward for
    n = 3, 7, ...; a part of another pattern pulsates in the housing.

    Parameters
    ----------
    part : GapPart
        Part.
    parts : sequence of GapPart
        All parts, to compare with those of the same order.

    Returns
    -------
    str
        ``housing``, ``carrier`` or ``undecided``.
    """
    if part.order == 0:
        return HOUSING
    if part.pattern == RADIAL:
        return _radial_frame(part, parts)
    numbers = {name: m for m, name in PATTERN_NAMES.items()}
    if part.pattern not in numbers:
        return UNDECIDED
    rivals = [own for own in parts if own.order == part.order and own.pattern in numbers]
    share = part.share / max(sum(max(own.share, 0.0) for own in rivals), np.finfo(float).tiny)
    if (part.order - numbers[part.pattern]) % 4 == 0:
        return CARRIER if share >= _OWN_ORDER else UNDECIDED
    return HOUSING if share > 1.0 - _OWN_ORDER else UNDECIDED


def _radial_frame(part: GapPart, parts: Sequence[GapPart]) -> str:
    if part.order % 2 == 0:
        return UNDECIDED
    size = {own.order: max(own.share, 0.0) for own in parts if own.pattern == RADIAL}
    n = abs(part.order)
    turning = n if n % 4 == 1 else -n
    share = size.get(turning, 0.0) / max(size.get(n, 0.0) + size.get(-n, 0.0), np.finfo(float).tiny)
    if share >= _OWN_ORDER:
        return CARRIER if part.order == turning else UNDECIDED
    return HOUSING if 0.25 <= share <= 0.75 else UNDECIDED


def part_growth(part: GapPart, parts: Sequence[GapPart], conditions: Conditions) -> PartGrowth:
    """Exponents of a part with every condition, over the runs that show it.

    Parameters
    ----------
    part : GapPart
        Part.
    parts : sequence of GapPart
        All parts.
    conditions : mapping of str to mapping of str to float
        Size of every condition in every run.
    """
    runs = part.runs
    size, error = (np.array([own[run] for run in runs]) for own in (part.amplitudes, part.errors))
    values: dict[str, FloatArray] = {
        name: np.array([by_run[run] for run in runs], dtype=np.float64)
        for name, by_run in conditions.items()
    }
    return PartGrowth(
        part.pattern, float(part.order), frame_of(part, parts), exponents(size, error, values)
    )


def growth_table(cells: Sequence[GapCell], conditions: Conditions) -> tuple[PartGrowth, ...]:
    """Frame and growth of the largest significant parts."""
    parts = gap_parts(cells)
    seen = [part for part in parts if part.runs and part.share > 0.0][:_MOST_PARTS]
    return tuple(part_growth(part, parts, conditions) for part in seen)
