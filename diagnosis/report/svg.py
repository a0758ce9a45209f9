"""Matplotlib figures as inline SVG.

Text stays text, identifiers are unique on the page, a title for screen readers.
"""

import io
import re
from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Width of every figure [in]: on a phone it is shown at about its own size, so that its text stays
#: readable.
WIDTH = 4.4
#: Colours that differ in lightness and for every kind of colour vision (Okabe and Ito 2008), and
#: the map of magnitudes.
BLUE = "#0072b2"
ORANGE = "#d55e00"
BLACK = "#000000"
GREY = "#6b6b6b"
GREEN = "#009e73"
MAGNITUDE_MAP = "cividis"
#: Cells within chance.
CHANCE = "#e6e9ed"

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # selectable, and a tenth of the size of outlines
    "svg.hashsalt": "carrierflex",  # the same figure gives the same file
    "text.parse_math": False,  # a $ in the name of a channel begins no formula
    "font.size": 9.0,
    "axes.linewidth": 0.7,
    "axes.titlesize": 9.5,
}
_IDENTIFIER = re.compile(r'(\bid="|href="#|url\(#)')


def inline_svg(draw: "Callable[[], Figure]", key: str, title: str) -> str:
    """SVG element of a figure, to be put into a page.

    Parameters
    ----------
    draw : callable
        Gives the figure; called with the report's style in force.
    key : str
        Its name on the page: letters, digits and hyphens, no other figure's.
    title : str
        What it shows, in words, for those who do not see it.

    Returns
    -------
    str
        ``<svg ...>...</svg>`` without fixed size; its identifiers start with `key`.
    """
    from matplotlib import rc_context

    file = io.StringIO()
    with rc_context(_STYLE):
        figure = draw()
        _lay_out(figure)
        figure.savefig(
            file, format="svg", transparent=True, metadata={"Date": None, "Creator": None}
        )
    text = file.getvalue()
    text = text[text.index("<svg") :].strip()
    text = re.sub(r"<metadata>.*?</metadata>", "", text, count=1, flags=re.DOTALL)
    text = _IDENTIFIER.sub(rf"\g<1>{key}-", text)
    head, body = text.split(">", 1)
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head)
    labelled = f'{head} role="img" aria-labelledby="{key}-title">'
    return f'{labelled}<title id="{key}-title">{escape(title)}</title>{body}'


def _lay_out(figure: "Figure") -> None:
    """Place the axes; saving would draw the figure twice, once for their places alone."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    engine = figure.get_layout_engine()
    if engine is not None:
        FigureCanvasSVG(figure)
        engine.execute(figure)
        figure.set_layout_engine(None)


def scaled_unit(largest: float, unit: str) -> tuple[float, str]:
    """Factor and unit that show a size with few digits: ``2e-4 m`` as 200 µm.

    Parameters
    ----------
    largest : float
        Size to be shown.
    unit : str
        Its unit; only a plain symbol takes a prefix.

    Returns
    -------
    tuple of (float, str)
        What values are multiplied by, and the unit they then have.
    """
    if (
        not re.fullmatch(r"[A-Za-z]+(/s)?", unit)
        or not 0.0 < largest < float("inf")
        or unit == "rad"
    ):
        return 1.0, unit
    for factor, prefix in ((1e9, "n"), (1e6, "µ"), (1e3, "m"), (1.0, ""), (1e-3, "k")):
        if largest * factor >= 1.0 and largest * factor < 1e3:
            return factor, prefix + unit
    return 1.0, unit
