"""The gap of a mounting in one sentence: motion, frequency, runs, and the load that it follows."""

from collections.abc import Sequence

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, GapCell
from carrierflex.diagnosis.mounting.gap_map import PATTERNS, pattern_matrix
from carrierflex.diagnosis.mounting.records import MountingRecord

_SIGNIFICANCE = 0.01
#: Part of the pattern's gap that the named frequencies and runs hold.
_CORE = 0.8
#: Correlation with a load from which the sentence says that the gap follows it.
_FOLLOWS = 0.8
_LOADS = (("torque", "the torque"), ("ntl_z", "the vertical load"), ("ntl_y", "the sideways load"))


def mounting_where_text(
    cells: Sequence[GapCell],
    records: Sequence[MountingRecord],
    residuals: Sequence[FloatArray],
    sensors: Sequence[str],
    channels: Sequence[str],
) -> str:
    """Say in one sentence where the gap lies.

    Parameters
    ----------
    cells : sequence of GapCell
        Gap map, largest share first.
    records, residuals, sensors, channels
        As for :func:`carrierflex.diagnosis.mounting.gap_map.mounting_gap_cells`.

    Returns
    -------
    str
        The sentence.
    """
    seen = [cell for cell in cells if cell.p_value < _SIGNIFICANCE and cell.coherent > 0.0]
    if not seen:
        return "no motion of the housing stands out from the noise"
    by_pattern: dict[str, float] = {}
    for cell in seen:
        by_pattern[cell.channel_pattern] = by_pattern.get(cell.channel_pattern, 0.0) + cell.share
    first = max(by_pattern, key=lambda name: by_pattern[name])
    core = _core([cell for cell in seen if cell.channel_pattern == first])
    high = max(cell.frequency_hz[1] for cell in core if cell.frequency_hz)
    runs = {cell.run for cell in core}
    where = "in every run" if len(runs) == len(records) else f"in {', '.join(sorted(runs))}"
    names, matrix = pattern_matrix(sensors, channels)
    load = _load_followed(records, [gap @ matrix[names.index(first)] for gap in residuals])
    motion = f"{first} motion of the housing" if first in PATTERNS else f"motion at {first}"
    share = min(100.0 * by_pattern[first], 100.0)
    return f"{share:.0f} % of the gap is {motion}, mostly below {high:.2g} Hz, {where}{load}"


def _core(cells: Sequence[GapCell]) -> list[GapCell]:
    """Largest cells that hold most of a pattern's gap."""
    core, wanted = [], _CORE * sum(cell.coherent for cell in cells)
    for cell in cells:
        core.append(cell)
        if sum(own.coherent for own in core) >= wanted:
            break
    return core


def _load_followed(records: Sequence[MountingRecord], gaps: Sequence[FloatArray]) -> str:
    """The load, or its rate, that a gap is most correlated with, in words.

    Empty where with none.
    """
    best, text = _FOLLOWS, ""
    for name, words in _LOADS:
        loads = [getattr(record.inputs, name) for record in records]
        rates = [np.gradient(load) for load in loads]
        for values, how in ((loads, ""), (rates, "the rate of ")):
            strength = _correlation(np.concatenate(values), np.concatenate(gaps))
            if strength > best:
                best, text = strength, f", and follows {how}{words} (correlation {strength:.2f})"
    return text


def _correlation(a: FloatArray, b: FloatArray) -> float:
    size = float(a.std() * b.std())
    return float(abs(np.mean((a - a.mean()) * (b - b.mean())))) / size if size > 0.0 else 0.0
