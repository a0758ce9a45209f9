"""How a result looks in a notebook: a table, and a picture below it."""

from collections.abc import Iterable
from html import escape
from io import StringIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def shown_in_notebook(
    title: str, rows: Iterable[tuple[str, str]], figure: "Figure | None" = None
) -> str:
    """HTML of a result.

    Parameters
    ----------
    title : str
        What it is.
    rows : iterable of (str, str)
        Names and values with their units; shown as they are, markup escaped.
    figure : matplotlib.figure.Figure, optional
        Picture, which goes in as SVG.

    Returns
    -------
    str
        HTML, as notebooks ask for by ``_repr_html_``.
    """
    cells = "".join(
        f"<tr><th style='text-align:left'>{escape(name)}</th>"
        f"<td style='text-align:left'>{escape(value)}</td></tr>"
        for name, value in rows
    )
    picture = "" if figure is None else _svg(figure)
    return f"<b>{escape(title)}</b><table>{cells}</table>{picture}"


def _svg(figure: "Figure") -> str:
    text = StringIO()
    figure.savefig(text, format="svg")
    drawn = text.getvalue()
    return drawn[drawn.index("<svg") :]
