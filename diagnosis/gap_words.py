"""The gap map in one plain sentence."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.gap_map import GapMap
from diagnosis.order_map import PATTERNS

#: A cell counts as seen in a run below this adjusted p-value and above this share of the run's gap.
SIGNIFICANCE = 0.01
_SMALLEST_SHARE = 0.02
#: Parts named in the sentence at most, and the smallest overall share worth naming.
_MOST_PARTS = 3
_SMALLEST_PART = 0.05

_STATIC_TEXT = {(0,): "axial offset", (1, -1): "tilt fixed to the housing", (2,): "saddle fixed to the housing"}


@dataclass(frozen=True, eq=False)
class GapPart:
    """Cells of the gap map that belong together.

    Parameters
    ----------
    order : int
        Order of carrier rotation.
    patterns : tuple of int
        Patterns m; (1, -1) for a static tilt.
    share : float
        Share of the overall gap.
    runs : tuple of str
        Runs in which it is seen.
    """

    order: int
    patterns: tuple[int, ...]
    share: float
    runs: tuple[str, ...]


def gap_parts(gap: GapMap) -> tuple[GapPart, ...]:
    """Parts of the gap, largest overall share first; the two halves of a static tilt are one part.

    Parameters
    ----------
    gap : GapMap
        The map.

    Returns
    -------
    tuple of GapPart
        Every cell once.
    """
    parts = []
    for order in gap.orders:
        groups: Sequence[tuple[int, ...]] = [(0,), (1, -1), (2,)] if order == 0 else [(m,) for m in PATTERNS]
        for group in groups:
            columns = [PATTERNS.index(m) for m in group]
            seen = _seen(gap, int(order), columns)
            share = float(gap.overall_share[order, columns].sum())
            parts.append(
                GapPart(int(order), group, share, tuple(run for run, yes in zip(gap.runs, seen, strict=True) if yes))
            )
    return tuple(sorted(parts, key=lambda part: -part.share))


def where_text(gap: GapMap) -> str:
    """Say in one sentence where the gap lies.

    Parameters
    ----------
    gap : GapMap
        The map.

    Returns
    -------
    str
        Such as "52 % of the gap is order 1, pattern m = +1 (tilt fixed to the carrier), in every run".
    """
    named = [part for part in gap_parts(gap) if part.share >= _SMALLEST_PART and part.runs][:_MOST_PARTS]
    if not named or not np.isfinite(gap.overall_share).all():
        return "no order or pattern of the gap stands out from the scatter of the revolutions"
    first, *others = named
    sentence = f"{_percent(first)} of the gap is {_part_text(first, gap)}"
    return "; ".join([sentence, *(f"{_percent(part)} is {_part_text(part, gap)}" for part in others)])


def _seen(gap: GapMap, order: int, columns: list[int]) -> NDArray[np.bool_]:
    """Find the runs in which a part is beyond chance and not negligible, shape (n_runs,)."""
    beyond_chance = gap.adjusted_p_value[:, order, columns].min(axis=1) < SIGNIFICANCE
    return beyond_chance & (gap.share[:, order, columns].sum(axis=1) > _SMALLEST_SHARE)


def _percent(part: GapPart) -> str:
    return f"{100.0 * part.share:.0f} %"


def _part_text(part: GapPart, gap: GapMap) -> str:
    sign = "±1" if len(part.patterns) == 2 else {1: "+1"}.get(part.patterns[0], str(part.patterns[0]))
    where = "in every run" if part.runs == gap.runs else f"in {_listed(part.runs)}"
    return f"order {part.order}, pattern m = {sign}{_meaning(part)}, {where}"


def _meaning(part: GapPart) -> str:
    """Name the shape on the carrier or the housing that makes this cell, where one does."""
    if part.order == 0:
        return f" ({_STATIC_TEXT[part.patterns]})"
    if (part.order - part.patterns[0]) % 4:
        return ""
    return " (tilt fixed to the carrier)" if part.order == 1 else " (waves fixed to the carrier)"


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
