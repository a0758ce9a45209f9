"""Comparison of two diagnoses: sentences, comparison.json, figures and the HTML page."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.report.diagnosis_files import Verdict
from carrierflex.diagnosis.report.figures import BLUE, GREY, ORANGE, WIDTH, inline_svg
from carrierflex.diagnosis.report.gap_change import (
    GONE,
    LARGER,
    NEW,
    SMALLER,
    CellChange,
    DiagnosisSide,
    GapChange,
    RunChange,
)
from carrierflex.diagnosis.report.page import rendered_page
from carrierflex.diagnosis.report.words import (
    listed,
    percent,
    position_of,
    ratio,
    scaled_unit,
    sized,
)
from carrierflex.files.json_files import plain
from carrierflex.files.result_schemas import json_content, json_table
from carrierflex.files.versions import software_name

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_SIDE = json_table(
    "Side",
    "One of two diagnoses.",
    {DiagnosisSide: "folder campaign causes rms noise_floor"},
    verdict=(Verdict, "What the diagnosis says"),
)
_CAUSES = json_table("Causes", "What became of the causes.", {GapChange: "solved remaining added"})
#: comparison.json.
COMPARISON = json_table(
    "ComparisonDocument",
    "comparison.json, written by compare.",
    {DiagnosisSide: "kind unit measured", GapChange: "ratio ratio_ci95 explained cells runs"},
    format=(Literal["carrierflex-comparison"], "Kind of the file"),
    version=(Literal[1], "Version of the format"),
    software=(str, "Name and version of this software"),
    text=(str, "What became of the gap, in one sentence"),
    before=(_SIDE, "First diagnosis"),
    after=(_SIDE, "Second diagnosis"),
    causes=(_CAUSES, "Causes"),
)
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
    clauses = []
    if change.solved:
        clauses.append(f"no longer missing: {_names(change.solved)}")
    if change.remaining:
        clauses.append(f"still missing: {_names(change.remaining)}")
    if change.added:
        clauses.append(f"missing now, not named before: {_names(change.added)}")
    if not clauses:
        return "Neither diagnosis names a cause."
    text = "; ".join(clauses)
    return f"{text[:1].upper()}{text[1:]}."


def cells_sentence(change: GapChange) -> str:
    """What shrank and what came, by cells of the gap map."""
    shrank = [cell for cell in change.cells if cell.what in (GONE, SMALLER)]
    came = [cell for cell in change.cells if cell.what in (NEW, LARGER)]
    return f"Shrank: {_cells(shrank)}. Came: {_cells(came)}."


def _cell_name(cell: CellChange) -> str:
    """Where a cell lies, without its run."""
    return f"{cell.channel_pattern}, {position_of(cell.order, cell.frequency_hz)}"


def change_document(change: GapChange) -> dict[str, Any]:
    """Content of comparison.json."""
    sides = {
        name: json_content(_SIDE, side)
        for name, side in (("before", change.before), ("after", change.after))
    }
    document: dict[str, Any] = plain(
        json_content(
            COMPARISON,
            change,
            change.before,
            software=software_name(),
            text=first_sentence(change),
            causes=json_content(_CAUSES, change),
            **sides,
        )
    )
    return document


def _names(causes: Sequence[str]) -> str:
    return listed([plain_name(cause) for cause in causes])


def _cells(cells: Sequence[CellChange]) -> str:
    """Places of the largest cells, each once, and how many cells there are beside."""
    if not cells:
        return "nothing"
    names = list(dict.fromkeys(_cell_name(cell) for cell in cells))
    more = len(names) - _MOST_NAMED
    text = "; ".join(names[:_MOST_NAMED])
    return f"{text}; and {more} more" if more > 0 else text


_MOST_DRAWN = 14
#: Letters of a row's name; a longer one ends with an ellipsis.
_MOST_LETTERS = 34


def _runs_figure(runs: Sequence[RunChange], unit: str) -> "Figure":
    """Comparison error of every run before and after, its uncertainty beside it."""
    drawn = runs[:_MOST_DRAWN]
    return _paired_rows(
        [row.run for row in drawn],
        np.array([(row.error_before, row.error_after, row.u_val) for row in drawn]),
        unit,
        "RMS of the gap above the noise",
    )


def _cells_figure(cells: Sequence[CellChange], unit: str) -> "Figure":
    """Cells that changed most, before and after."""
    drawn = cells[:_MOST_DRAWN]
    return _paired_rows(
        [f"{_cell_name(cell)}, {cell.run}" for cell in drawn],
        np.array([(cell.rms_before, cell.rms_after, cell.u) for cell in drawn]),
        unit,
        "RMS of the cell above the noise",
    )


def _paired_rows(names: Sequence[str], sizes: np.ndarray, unit: str, label: str) -> "Figure":
    """One row a name: size before, size after, and the uncertainty as a bar from zero."""
    from matplotlib.figure import Figure

    factor, shown_unit = scaled_unit(float(np.nanmax(sizes, initial=0.0)), unit)
    before, after, uncertainty = factor * sizes.T
    rows = np.arange(len(names))
    figure = Figure(figsize=(WIDTH, 1.25 + 0.25 * len(names)), layout="constrained")
    panel = figure.subplots()
    panel.barh(rows, uncertainty, height=0.7, color=GREY, alpha=0.3, label="uncertainty")
    panel.hlines(rows, before, after, color=GREY, linewidth=1.0)
    panel.plot(before, rows, "o", color=ORANGE, markersize=6, label="before")
    panel.plot(after, rows, "D", color=BLUE, markersize=4.5, label="after")
    panel.set_yticks(rows, [_short(name) for name in names])
    panel.tick_params(axis="y", length=0, labelsize=8)
    panel.set_ylim(len(names) - 0.4, -0.6)
    panel.set_xlim(left=0.0)
    panel.set_xlabel(f"{label} [{shown_unit}]")
    panel.grid(axis="x", alpha=0.25)
    figure.legend(loc="outside lower center", ncols=3, fontsize=8, frameon=False)
    return figure


def _short(name: str) -> str:
    return name if len(name) <= _MOST_LETTERS else f"{name[: _MOST_LETTERS - 1]}…"


_MOST_ROWS = 30


def comparison_page(change: GapChange) -> str:
    """HTML text of a comparison."""
    content = {
        "change": change,
        "unit": change.before.unit,
        "cell_name": _cell_name,
        "first_sentence": first_sentence(change),
        "causes_sentence": causes_sentence(change),
        "cells_sentence": cells_sentence(change),
        "software": software_name(),
        "figures": _figures(change),
        "cells": change.cells[:_MOST_ROWS],
        "n_more_cells": max(len(change.cells) - _MOST_ROWS, 0),
    }
    return rendered_page("comparison.html.j2", content)


def _figures(change: GapChange) -> list[dict[str, Any]]:
    """Figures with captions; one that has nothing to show is left out."""
    unit = change.before.unit
    drawn = []
    if change.runs:
        title = "Comparison error of every run before and after"
        svg = inline_svg(lambda: _runs_figure(change.runs, unit), "runs", title)
        caption = "Error of every run; the grey bar is its uncertainty u_val (ASME V&V 20)."
        drawn.append({"svg": svg, "caption": caption})
    if change.cells:
        title = "Cells of the gap map that changed most"
        svg = inline_svg(lambda: _cells_figure(change.cells, unit), "cells", title)
        caption = "Cells of the gap map, largest change first; the grey bar is the cell's noise."
        drawn.append({"svg": svg, "caption": caption})
    return drawn
