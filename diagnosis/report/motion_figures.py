"""Force-space loops and polar plots of the report. Matplotlib late."""

from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.comparison.overlay import GAP, LAW, LEFT, Panel, Picture, is_function
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.report.svg import BLACK, BLUE, GREY, ORANGE, WIDTH, scaled_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Colour and stroke of every role.
_STROKES = {
    GAP: {"color": BLUE, "linewidth": 1.8, "linestyle": "-"},
    LAW: {"color": BLACK, "linewidth": 1.4, "linestyle": "--"},
    LEFT: {"color": ORANGE, "linewidth": 1.6, "linestyle": "-"},
}
_SHADE_MAP = "cividis"
#: Resolution of the clouds, which are pixels inside the drawing: thousands of separate marks would
#: swell the file.
_CLOUD_DPI = 220
#: Left and lower end, width and height of a polar plot in its figure: every one has the same
#: labels, whose room need not be looked for.
_POLAR_PLACE = (0.13, 0.07, 0.74, 0.74)
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
    """One panel of a picture.

    Parameters
    ----------
    picture : Picture
        Names and units of the axes; all its panels share one scale of the values.
    panel : Panel
        What is drawn.

    Returns
    -------
    matplotlib.figure.Figure
        Cloud with the law, or polar plot.
    """
    return _polar_figure(picture, panel) if picture.is_polar else _cloud_figure(picture, panel)


def remainder_factor(picture: Picture) -> float:
    """By how much the remaining gap is drawn larger in polar plots: 1, 2, 5, 10 ... 1000.

    At its own size it would lie on the zero circle.
    """
    left, gap = (
        _largest([t.y for panel in picture.panels for t in panel.traces if t.role == role])
        for role in (LEFT, GAP)
    )
    if left <= 0.0 or gap <= 0.0:
        return 1.0
    return float(np.clip(_round_step(_REMAINDER * gap / left), 1.0, 1000.0))


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
    axes = figure.add_axes(_POLAR_PLACE, projection="polar")
    for trace in panel.traces:
        stroke = _STROKES[trace.role]
        drawn = (magnified if trace.role == LEFT else 1.0) * factor * trace.y
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
