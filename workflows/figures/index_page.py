"""The page that shows all figures with what is in the paper, what made them and what is derived."""

from collections.abc import Sequence
from html import escape

from carrierflex.files.versions import software_name
from carrierflex.workflows.figures.figures_2011 import FIGURES_2011
from carrierflex.workflows.figures.figures_2012 import FIGURES_2012
from carrierflex.workflows.figures.paper_figure import PaperFigure

#: All of them, in the order of the index.
FIGURES = (*FIGURES_2011, *FIGURES_2012)
_STYLE = """body { font: 16px/1.5 system-ui, "DejaVu Sans", sans-serif; color: #1b1f24;
margin: 0 auto; max-width: 1080px; padding: 16px; }
figure { margin: 36px 0; padding-top: 10px; border-top: 1px solid #d0d7de; }
img { max-width: 100%; height: auto; }
h1 { font-size: 24px; } h2 { font-size: 20px; margin: 0 0 8px; }
dl { margin: 8px 0; } dt { font-weight: 600; } dd { margin: 0 0 6px; max-width: 52em; }
nav a { margin-right: 12px; white-space: nowrap; }"""
_PAPERS = {
    "2011": "Modeling of Wind Turbine Gearbox Mounting (2011)",
    "2012": "Modeling and Parameter Identification of Deflections in Planetary Stage of Wind "
    "Turbine Gearbox (2012)",
}


def index_page(figures: Sequence[PaperFigure], size: float) -> str:
    """HTML text of the index; the pictures stand beside it.

    Parameters
    ----------
    figures : sequence of PaperFigure
        Figures that were drawn.
    size : float
        Element edge length [m] of the finite elements.
    """
    links = " ".join(f'<a href="#{figure.name}">{figure.name}</a>' for figure in figures)
    pieces = [
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Figures of the papers</title><style>{_STYLE}</style></head><body>",
        "<h1>The figures of both papers, from this project's runs</h1>",
        f"<p>Drawn by {escape(software_name())}, finite elements of {size:g} m. Nothing here is "
        "measured: where the papers show measurements, a more detailed simulation replaces them, "
        "and each figure says what it takes from the papers.</p>",
        f"<nav>{links}</nav>",
    ]
    for paper, title in _PAPERS.items():
        of_paper = [figure for figure in figures if figure.paper == paper]
        if of_paper:
            pieces.append(f"<h1>{escape(title)}</h1>")
        pieces += [_entry(figure) for figure in of_paper]
    return "\n".join([*pieces, "</body></html>\n"])


def _entry(figure: PaperFigure) -> str:
    # The texts are this project's own and hold markup; the title is plain.
    return (
        f'<figure id="{figure.name}"><h2>Figure {figure.number}: {escape(figure.title)}</h2>'
        f'<img src="{figure.file}" alt="{escape(figure.title)}">'
        f"<figcaption><dl><dt>In the paper</dt><dd>{figure.in_the_paper}</dd>"
        f"<dt>Made by</dt><dd>{figure.made_by}</dd>"
        f"<dt>Derived from the papers</dt><dd>{figure.derived}</dd></dl></figcaption></figure>"
    )
