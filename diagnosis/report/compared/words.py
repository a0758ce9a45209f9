"""What became of the gap, in words and as the content of comparison.json."""

import math
from collections.abc import Sequence
from typing import Any

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.report.compared.change import (
    GONE,
    LARGER,
    NEW,
    SMALLER,
    CellChange,
    GapChange,
)
from carrierflex.diagnosis.report.words import listed, percent, ratio, sized
from carrierflex.files.json_files import plain
from carrierflex.files.versions import software_name

FORMAT = "carrierflex-comparison"
VERSION = 1
#: Cells that are named in a sentence.
_MOST_NAMED = 3


def first_sentence(change: GapChange) -> str:
    """What became of the gap as one sentence.

    For example ``The change took 92 % of the gap: 46 µm RMS before, 14 µm after on the same
    held-out records (ratio 0.300, 95 % 0.28 to 0.33; noise floor 5 µm).``
    """
    unit = change.before.unit
    sizes = f"{sized(change.before.rms, unit)} RMS before, {sized(change.after.rms, unit)} after"
    floor = sized(change.before.noise_floor, unit)
    low, high = change.ratio_ci95
    figures = (
        f"{sizes} on the same held-out records (ratio {ratio(change.ratio)}, 95 % {low:.3f} to "
        f"{high:.3f}; noise floor {floor})"
    )
    if not math.isfinite(change.ratio):
        return f"There was no gap that could change: {sizes}."
    if high < 1.0:
        took = f"{percent(min(change.explained, 1.0))} of the gap above the noise"
        return f"The change took {took}: {figures}."
    if low > 1.0:
        return f"The change made the gap larger: {figures}."
    return f"The change left the gap as it was: {figures}."


def causes_sentence(change: GapChange) -> str:
    """Causes that are named before and after."""
    parts = []
    if change.solved:
        parts.append(f"no longer missing: {_names(change.solved)}")
    if change.remaining:
        parts.append(f"still missing: {_names(change.remaining)}")
    if change.added:
        parts.append(f"missing now, not named before: {_names(change.added)}")
    if not parts:
        return "Neither diagnosis names a cause."
    text = "; ".join(parts)
    return f"{text[:1].upper()}{text[1:]}."


def cells_sentence(change: GapChange) -> str:
    """What shrank and what came, by cells of the gap map."""
    shrank = [cell for cell in change.cells if cell.what in (GONE, SMALLER)]
    came = [cell for cell in change.cells if cell.what in (NEW, LARGER)]
    return f"Shrank: {_cells(shrank)}. Came: {_cells(came)}."


def place(cell: CellChange) -> str:
    """Where a cell lies, without its run."""
    if cell.frequency_hz is None:
        return f"{cell.channel_pattern}, order {cell.order:g}"
    low, high = cell.frequency_hz
    band = f"{high:.4g} Hz" if high <= 1.001 * low else f"{low:.3g}–{high:.3g} Hz"
    return f"{cell.channel_pattern}, {band}"


def change_document(change: GapChange) -> dict[str, Any]:
    """Content of comparison.json."""
    sides = {
        name: {
            "folder": str(side.folder),
            "campaign": side.campaign,
            "verdict": side.verdict,
            "causes": side.causes,
            "rms": side.rms,
            "noise_floor": side.noise_floor,
        }
        for name, side in (("before", change.before), ("after", change.after))
    }
    document: dict[str, Any] = plain(
        {
            "format": FORMAT,
            "version": VERSION,
            "software": software_name(),
            "text": first_sentence(change),
            "kind": change.before.kind,
            "unit": change.before.unit,
            "measured": change.before.measured,
            **sides,
            "ratio": change.ratio,
            "ratio_ci95": change.ratio_ci95,
            "explained": change.explained,
            "causes": {
                "solved": change.solved,
                "remaining": change.remaining,
                "added": change.added,
            },
            "cells": change.cells,
            "runs": change.runs,
        }
    )
    return document


def _names(causes: Sequence[str]) -> str:
    return listed([plain_name(cause) for cause in causes])


def _cells(cells: Sequence[CellChange]) -> str:
    """Places of the largest cells, each once, and how many cells there are beside."""
    if not cells:
        return "nothing"
    places = list(dict.fromkeys(place(cell) for cell in cells))
    more = len(places) - _MOST_NAMED
    text = "; ".join(places[:_MOST_NAMED])
    return f"{text}; and {more} more" if more > 0 else text
