"""Figures of the report as inline SVG: shapes, signals, loops and polar plots.

Text stays text, identifiers are unique on the page, a title for screen readers. Matplotlib late.
"""

import io
import re
from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from carrierflex.diagnosis.classes.results import MeasuredShape
from carrierflex.diagnosis.comparison.overlay import (
    GAP,
    LAW,
    REMAINDER,
    Overlay,
    Panel,
    Picture,
    is_function,
)
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.report.words import scaled_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


#: Width of every figure [in]: on a phone it is shown at about its own size, so that its text stays
#: readable.
WIDTH = 4.4
#: Colours that differ in lightness and for every kind of colour vision (Okabe and Ito 2008).
BLUE = "#0072b2"
ORANGE = "#d55e00"
BLACK = "#000000"
GREY = "#6b6b6b"

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # selectable, and a tenth of the size of outlines
    "svg.hashsalt": "carrierflex",  # the same figure gives the same file
    "text.parse_math": False,  # a $ in the name of a channel begins no formula
    "font.size": 9.0,
    "axes.linewidth": 0.7,
    "axes.titlesize": 9.5,
}
_IDENTIFIER = re.compile(r'(\bid="|href="#|url\(#)')


def inline_svg(draw: "Callable[[], Figure]", key: str, title: str) -> Markup:
    """SVG element of a figure without fixed size; its identifiers start with `key`."""
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
    return Markup(f'{labelled}<title id="{key}-title">{escape(title)}</title>{body}')


def _lay_out(figure: "Figure") -> None:
    """Place the axes; saving would draw the figure twice, once for their places alone."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    engine = figure.get_layout_engine()
    if engine is not None:
        FigureCanvasSVG(figure)
        engine.execute(figure)
        figure.set_layout_engine(None)


_HEIGHT = 2.9


def shape_figure(shape: MeasuredShape, law: str) -> "Figure":
    """Curve of a class over the visited range."""
    from matplotlib.figure import Figure

    x_factor, x_unit = scaled_unit(float(abs(shape.x).max()), shape.units[0])
    y_factor, y_unit = scaled_unit(float(abs(shape.y).max()), shape.units[1])
    figure = Figure(figsize=(WIDTH, _HEIGHT), layout="constrained")
    panel = figure.subplots()
    x = x_factor * shape.x
    low, high = y_factor * shape.band.T
    is_curve = bool((x[1:] >= x[:-1]).all())
    if is_curve:
        panel.fill_between(x, low, high, color=BLUE, alpha=0.25, linewidth=0.0, label="95 % band")
    panel.plot(x, y_factor * shape.y, color=BLUE, linewidth=1.6, label=shape.name)
    for other in shape.beside:
        low, high = y_factor * other.band.T
        other_x = x_factor * other.x
        if is_curve:
            panel.fill_between(other_x, low, high, color=ORANGE, alpha=0.25, linewidth=0.0)
        panel.plot(other_x, y_factor * other.y, color=ORANGE, linewidth=1.6, label=other.name)
    if shape.law.size:
        panel.plot(x, y_factor * shape.law, color=BLACK, linestyle="--", linewidth=1.2, label=law)
    panel.set_xlabel(f"{shape.labels[0]} [{x_unit}]")
    panel.set_ylabel(f"{shape.labels[1]} [{y_unit}]")
    panel.legend(fontsize=8, frameon=False)
    return figure


#: Samples of a stretch of time at most, and mean crossings of the signal in it at least.
_MOST_SAMPLES, _CROSSINGS = 400, 12
#: Letters of a channel's name beside its axis.
_MOST_LETTERS = 10


def signal_figure(before: Overlay, after: Overlay | None, unit: str) -> "Figure":
    """Signals above, what is left of the gap below."""
    from matplotlib.figure import Figure

    x, measured = before.x, before.measured
    factor, shown = scaled_unit(float(np.nanmax(np.abs(measured))), unit)
    gap = measured - before.simulated
    gap_factor, gap_unit = scaled_unit(float(np.nanmax(np.abs(gap))), unit)
    figure = Figure(figsize=(WIDTH, 2.55), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    upper.plot(x, factor * measured, color=BLACK, linewidth=2.6, alpha=0.35, label="measured")
    lower.axhline(0.0, color=GREY, linewidth=0.6)
    for overlay, name, colour, dashes in (
        (before, "simulated, before", ORANGE, "--"),
        (after, "simulated, after", BLUE, "-"),
    ):
        if overlay is None:
            continue
        upper.plot(x, factor * overlay.simulated, dashes, color=colour, linewidth=1.3, label=name)
        rest = gap_factor * (overlay.measured - overlay.simulated)
        lower.plot(x, rest, dashes, color=colour, linewidth=1.1)
    upper.set_ylabel(f"{shortened(before.channel, _MOST_LETTERS)} [{shown}]")
    lower.set_ylabel(f"gap [{gap_unit}]")
    lower.set_xlabel(f"{before.x_name} [{before.x_unit}]")
    if before.x_unit == "deg":
        lower.set_xticks(range(0, 361, 60))
        lower.set_xlim(0.0, 360.0)
    for panel in (upper, lower):
        panel.grid(alpha=0.25)
        panel.margins(x=0.0)
    figure.align_ylabels()
    figure.legend(loc="outside upper center", ncols=3, fontsize=8, frameon=False, handlelength=1.6)
    return figure


def shortened(name: str, most: int) -> str:
    """Name that an axis has room for; a longer one ends with an ellipsis."""
    return name if len(name) <= most else f"{name[: most - 1]}…"


def stretch_of(overlay: Overlay) -> slice:
    """What is drawn of a signal: the whole turn, or a stretch of time about the largest gap."""
    if overlay.x_unit == "deg":
        return slice(None)
    n = overlay.x.size
    length = min(_MOST_SAMPLES, n)
    level = np.nan_to_num(overlay.measured - np.nanmean(overlay.measured))
    crossings = np.count_nonzero(np.diff(np.signbit(level)))
    if crossings > _CROSSINGS:
        length = int(np.clip(n * _CROSSINGS / crossings, 60, n))
    length = min(length, n)
    energy = _windowed(np.nan_to_num(overlay.measured - overlay.simulated) ** 2, length)
    first = int(np.argmax(energy))
    return slice(first, first + length)


def _windowed(values: FloatArray, length: int) -> FloatArray:
    """Sums over all windows of a length."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    return total[length:] - total[:-length]


#: Colour and stroke of every role.
_ROLE_STROKES = {
    GAP: {"color": BLUE, "linewidth": 1.8, "linestyle": "-"},
    LAW: {"color": BLACK, "linewidth": 1.4, "linestyle": "--"},
    REMAINDER: {"color": ORANGE, "linewidth": 1.6, "linestyle": "-"},
}
_SHADE_MAP = "cividis"
#: Resolution of the clouds, which are pixels inside the drawing: thousands of separate marks would
#: swell the file.
_CLOUD_DPI = 220
#: Left and lower end, width and height of a polar plot in its figure: every one has the same
#: labels, whose room need not be looked for.
_POLAR_AXES = (0.13, 0.07, 0.74, 0.74)
#: Marks stand within the edge, over the reach.
_MARKS_AT = 1.2
_MARK = {
    "ha": "center",
    "va": "center",
    "fontsize": 6.5,
    "color": GREY,
    "bbox": {"boxstyle": "circle,pad=0.25", "facecolor": "white", "edgecolor": GREY, "lw": 0.7},
}
#: The remaining gap is drawn at most this large beside the gap.
_REMAINDER = 0.4


def panel_figure(picture: Picture, panel: Panel) -> "Figure":
    """One panel of a picture."""
    return _polar_figure(picture, panel) if picture.is_polar else _cloud_figure(picture, panel)


def remainder_factor(picture: Picture) -> float:
    """By how much the remaining gap is drawn larger in polar plots: 1, 2, 5, 10 ... 1000.

    At its own size it would lie on the zero circle.
    """
    remainder, gap = (
        _largest([t.y for panel in picture.panels for t in panel.traces if t.role == role])
        for role in (REMAINDER, GAP)
    )
    if remainder <= 0.0 or gap <= 0.0:
        return 1.0
    return float(np.clip(_round_step(_REMAINDER * gap / remainder), 1.0, 1000.0))


def _largest(values: list[FloatArray]) -> float:
    return max((float(np.nanmax(np.abs(array))) for array in values if array.size), default=0.0)


def _cloud_figure(picture: Picture, panel: Panel) -> "Figure":
    from matplotlib.figure import Figure

    traces = [trace for panel in picture.panels for trace in panel.traces]
    x_factor, x_unit = scaled_unit(_largest([trace.x for trace in traces]), picture.x_unit)
    y_factor, y_unit = scaled_unit(_largest([trace.y for trace in traces]), picture.y_unit)
    shades = [trace.shade for trace in traces if trace.shade is not None]
    s_factor, s_unit = scaled_unit(_largest(shades), picture.shade_unit)
    limit = s_factor * _largest(shades)
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained", dpi=_CLOUD_DPI)
    axes = figure.subplots()
    for trace in panel.traces:
        x, y = x_factor * trace.x, y_factor * trace.y
        if trace.shade is None:
            _draw_law(axes, x, y)
            continue
        cloud = axes.scatter(
            x,
            y,
            c=s_factor * trace.shade,
            s=7.0,
            cmap=_SHADE_MAP,
            vmin=-limit,
            vmax=limit,
            linewidths=0.0,
            rasterized=True,
        )
        figure.colorbar(cloud, ax=axes, label=f"{picture.shade_name} [{s_unit}]", aspect=30)
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    axes.set_xlabel(f"{picture.x_name} [{x_unit}]")
    axes.set_ylabel(f"{picture.y_name} [{y_unit}]")
    axes.grid(alpha=0.25)
    return figure


def _draw_law(axes: "Axes", x: FloatArray, y: FloatArray) -> None:
    """Line through a law that is a function of x, points for a loop."""
    order = np.argsort(x, kind="stable")
    if is_function(x, y):
        axes.plot(x[order], y[order], color=ORANGE, linewidth=1.8, zorder=3)
    else:
        axes.plot(x, y, ".", color=ORANGE, markersize=1.8, rasterized=True, zorder=3)


def _polar_figure(picture: Picture, panel: Panel) -> "Figure":
    from matplotlib.figure import Figure

    every = _largest([trace.y for each in picture.panels for trace in each.traces])
    factor, unit = scaled_unit(every, picture.y_unit)
    reach = factor * every or 1.0
    magnified = remainder_factor(picture)
    figure = Figure(figsize=(0.8 * WIDTH, 0.8 * WIDTH))
    axes = figure.add_axes(_POLAR_AXES, projection="polar")
    for trace in panel.traces:
        stroke = _ROLE_STROKES[trace.role]
        drawn = (magnified if trace.role == REMAINDER else 1.0) * factor * trace.y
        axes.plot(trace.x, drawn, **stroke, label=trace.role)  # type: ignore[arg-type]
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(circle, np.zeros(circle.size), ":", color=GREY, linewidth=0.8, zorder=3)
    _polar_axes(axes, reach)
    for text, angle in panel.marks.items():
        axes.text(angle, _MARKS_AT * reach, text, **_MARK)  # type: ignore[arg-type]
    axes.set_title(
        f"{picture.y_name} [{unit}] over {picture.x_name} [{picture.x_unit}]", fontsize=8.5
    )
    return figure


def _polar_axes(axes: "Axes", reach: float) -> None:
    """Zero circle off the centre, so that negative values have room inside it."""
    axes.set_ylim(-1.6 * reach, 1.35 * reach)
    step = _round_step(reach)
    axes.set_yticks([-step, 0.0, step], [f"−{step:g}", "0", f"+{step:g}"])
    axes.set_rlabel_position(88.0)  # type: ignore[attr-defined]
    axes.tick_params(labelsize=7)
    for label in axes.get_yticklabels():
        label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 0.4, "alpha": 0.8})
    axes.grid(alpha=0.35)
    # The labels on top of the curves, not under them.
    axes.set_axisbelow(False)


def _round_step(reach: float) -> float:
    """Largest of 1, 2, 5 times a power of ten that is not beyond a reach."""
    power = 10.0 ** np.floor(np.log10(reach))
    return float(
        max(step for step in (1.0, 2.0, 5.0) if step * power <= reach * (1.0 + 1e-9)) * power
    )
