"""Figures of a comparison: error of every run, largest cells of the gap map. Matplotlib late."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.report.compared.change import CellChange, RunChange
from carrierflex.diagnosis.report.compared.words import place
from carrierflex.diagnosis.report.svg import BLUE, GREY, ORANGE, WIDTH, scaled_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_ROWS = 14
#: Letters of a row's name; a longer one ends with an ellipsis.
_MOST_LETTERS = 34


def runs_figure(runs: Sequence[RunChange], unit: str) -> "Figure":
    """Comparison error of every run before and after, its uncertainty beside it.

    Parameters
    ----------
    runs : sequence of RunChange
        At least one; the first are drawn.
    unit : str
        Unit of the channels.
    """
    drawn = runs[:_MOST_ROWS]
    return _paired_rows(
        [row.run for row in drawn],
        np.array([(row.error_before, row.error_after, row.u_val) for row in drawn]),
        unit,
        "RMS of the gap above the noise",
    )


def cells_figure(cells: Sequence[CellChange], unit: str) -> "Figure":
    """Cells that changed most, before and after.

    Parameters
    ----------
    cells : sequence of CellChange
        At least one, largest change first; the first are drawn.
    unit : str
        Unit of the channels.
    """
    drawn = cells[:_MOST_ROWS]
    return _paired_rows(
        [f"{place(cell)}, {cell.run}" for cell in drawn],
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
