"""Table of what does not repeat from one repetition to the next."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from carrierflex.diagnosis.gap.findings import NonSynchronousCell
from carrierflex.diagnosis.report.words import beyond_chance, in_one_unit


class ScatterRow(NamedTuple):
    """Row of the table of what does not repeat; RMS of measured, simulated and noise."""

    cell: str
    run: str
    sizes: list[str]
    p_value: float


def scatter_rows(cells: Sequence[NonSynchronousCell], unit: str) -> tuple[list[ScatterRow], str]:
    """What does not repeat beyond chance, all sizes in one unit, and that unit.

    The mean squares may be slightly negative above a subtracted noise.
    """
    rows = beyond_chance(cells)
    squares = [square for row in rows for square in (row.measured, row.simulated, row.noise)]
    sizes, shown = in_one_unit(
        [math.sqrt(max(square, 0.0)) if math.isfinite(square) else square for square in squares],
        unit,
    )
    table = []
    for number_of_row, row in enumerate(rows):
        place = "off the orders" if row.order is None else f"order {row.order:g}"
        own = sizes[3 * number_of_row : 3 * number_of_row + 3]
        table.append(ScatterRow(f"{row.channel_pattern}, {place}", row.run, own, row.p_value))
    return table, shown
