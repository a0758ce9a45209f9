"""Page of a comparison: one HTML file which asks no network."""

from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.report import words
from carrierflex.diagnosis.report.compared import words as change_words
from carrierflex.diagnosis.report.compared.change import GapChange
from carrierflex.diagnosis.report.compared.figure import cells_figure, runs_figure
from carrierflex.diagnosis.report.svg import inline_svg
from carrierflex.files.versions import software_name

_MOST_ROWS = 30


def comparison_page(change: GapChange) -> str:
    """HTML text of a comparison.

    Parameters
    ----------
    change : GapChange
        What became of the gap.

    Returns
    -------
    str
        A complete page with its figures and style inside.
    """
    environment = Environment(
        loader=PackageLoader("carrierflex.diagnosis.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["plain_name"] = plain_name
    return environment.get_template("comparison.html.j2").render(
        change=change,
        unit=change.before.unit,
        words=words,
        change_words=change_words,
        software=software_name(),
        figures=_figures(change),
        cells=change.cells[:_MOST_ROWS],
        n_more_cells=max(len(change.cells) - _MOST_ROWS, 0),
    )


def _figures(change: GapChange) -> list[dict[str, Any]]:
    """Figures with captions; one that has nothing to show is left out."""
    unit = change.before.unit
    drawn = []
    if change.runs:
        title = "Comparison error of every run before and after"
        svg = inline_svg(lambda: runs_figure(change.runs, unit), "runs", title)
        caption = "Error of every run; the grey bar is its uncertainty u_val (ASME V&V 20)."
        drawn.append({"svg": Markup(svg), "caption": caption})
    if change.cells:
        title = "Cells of the gap map that changed most"
        svg = inline_svg(lambda: cells_figure(change.cells, unit), "cells", title)
        caption = "Cells of the gap map, largest change first; the grey bar is the cell's noise."
        drawn.append({"svg": Markup(svg), "caption": caption})
    return drawn
