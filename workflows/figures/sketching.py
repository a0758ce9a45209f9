"""Parts of technical drawings: bodies, leaders, forces, dimensions, angles, springs, ground.

All lengths are in the units of the drawing's axes; a drawing to scale has metres.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Polygon, Rectangle

Point = tuple[float, float]

INK = "#28323c"
FORCE = "#c8501e"
MEASURE = "#4a5a6a"
SENSOR = "#1f5fa8"
STEEL = "#c3ccd6"
CARRIER = "#9fb6cf"
GEAR = "#d8c08a"
RUBBER = "#5b5148"
HOUSING = "#dfe4e8"
FRAME = "#8a949e"

_BOX = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.9}


def sheet(
    size: tuple[float, float], x: tuple[float, float], y: tuple[float, float]
) -> tuple[Figure, Axes]:
    """Figure of `size` [inch] with one drawing: equal scales, no frame, the given ranges."""
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    prepare(axes, x, y)
    return figure, axes


def prepare(axes: Axes, x: tuple[float, float], y: tuple[float, float], title: str = "") -> None:
    """Turn axes into a drawing: equal scales, no frame, the given ranges."""
    axes.set(xlim=x, ylim=y, aspect="equal", title=title)
    axes.axis("off")


def box(
    axes: Axes,
    x: tuple[float, float],
    y: tuple[float, float],
    colour: str = STEEL,
    *,
    hatch: str = "",
    layer: float = 2.0,
) -> None:
    """Rectangle between two x and two y."""
    axes.add_patch(
        Rectangle(
            (x[0], y[0]),
            x[1] - x[0],
            y[1] - y[0],
            facecolor=colour,
            edgecolor=INK,
            linewidth=0.8,
            hatch=hatch,
            zorder=layer,
        )
    )


def mirrored(
    axes: Axes,
    x: tuple[float, float],
    radius: tuple[float, float],
    colour: str = STEEL,
    *,
    hatch: str = "",
    layer: float = 2.0,
) -> None:
    """Section of a body of revolution about y = 0: a rectangle above the axis and one below."""
    box(axes, x, radius, colour, hatch=hatch, layer=layer)
    box(axes, x, (-radius[1], -radius[0]), colour, hatch=hatch, layer=layer)


def outline(axes: Axes, corners: Sequence[Point], colour: str, *, layer: float = 2.0) -> None:
    """Closed polygon."""
    axes.add_patch(Polygon(corners, facecolor=colour, edgecolor=INK, linewidth=0.8, zorder=layer))


def disc(
    axes: Axes,
    centre: Point,
    radius: float,
    colour: str = STEEL,
    *,
    style: str = "-",
    layer: float = 2.0,
) -> None:
    """Circle, filled unless its colour is ``none``."""
    axes.add_patch(
        Circle(
            centre,
            radius,
            facecolor=colour,
            edgecolor=INK,
            linewidth=0.8,
            linestyle=style,
            zorder=layer,
        )
    )


def leader(
    axes: Axes, text: str, at: Point, text_at: Point, *, colour: str = INK, size: float = 9.0
) -> None:
    """Text with a thin line to the part that it names, which ends in a dot."""
    axes.annotate(
        text,
        at,
        text_at,
        ha="center",
        va="center",
        fontsize=size,
        color=colour,
        bbox=_BOX,
        zorder=9,
        arrowprops={
            "arrowstyle": "-",
            "color": colour,
            "linewidth": 0.8,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
        },
    )
    axes.plot(*at, "o", color=colour, markersize=3, zorder=9)


def words(axes: Axes, text: str, at: Point, *, colour: str = INK, size: float = 9.0) -> None:
    """Text on a white ground."""
    axes.text(*at, text, ha="center", va="center", fontsize=size, color=colour, bbox=_BOX, zorder=9)


def _headed_line(
    axes: Axes, tail: Point, head: Point, *, colour: str, width: float, style: str = "-|>"
) -> None:
    axes.annotate(
        "",
        head,
        tail,
        arrowprops={
            "arrowstyle": style,
            "color": colour,
            "linewidth": width,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
            "mutation_scale": 8.0 + 2.0 * width,
        },
        zorder=8,
    )


def arrow(
    axes: Axes,
    tail: Point,
    head: Point,
    text: str = "",
    *,
    text_at: Point | None = None,
    colour: str = FORCE,
    width: float = 1.8,
) -> None:
    """Arrow of a force or an axis, its symbol at `text_at` or a little beyond the head."""
    _headed_line(axes, tail, head, colour=colour, width=width)
    if text:
        beyond = (
            head[0] + 0.14 * (head[0] - tail[0]),
            head[1] + 0.14 * (head[1] - tail[1]),
        )
        words(axes, text, text_at or beyond, colour=colour, size=10.0)


def turning_arrow(
    axes: Axes,
    centre: Point,
    radius: float,
    degrees: tuple[float, float],
    text: str = "",
    *,
    text_at: Point | None = None,
    colour: str = FORCE,
    width: float = 1.6,
) -> None:
    """Arc with an arrow head at its end; `degrees` count from the right, anticlockwise."""
    angle = np.deg2rad(np.linspace(*degrees, 60))
    x, y = centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)
    axes.plot(x[:-2], y[:-2], color=colour, linewidth=width, zorder=8)
    _headed_line(axes, (x[-4], y[-4]), (x[-1], y[-1]), colour=colour, width=width)
    if text:
        middle = np.deg2rad(np.mean(degrees))
        beyond = (
            centre[0] + 1.25 * radius * float(np.cos(middle)),
            centre[1] + 1.25 * radius * float(np.sin(middle)),
        )
        words(axes, text, text_at or beyond, colour=colour, size=10.0)


def dimension(
    axes: Axes, first: Point, last: Point, text: str, *, text_at: Point | None = None
) -> None:
    """Line with arrow heads at both ends and its length in words at the middle."""
    _headed_line(axes, first, last, colour=MEASURE, width=0.9, style="<|-|>")
    middle = ((first[0] + last[0]) / 2.0, (first[1] + last[1]) / 2.0)
    words(axes, text, text_at or middle, colour=MEASURE)


def line(
    axes: Axes,
    points: Sequence[Point],
    *,
    colour: str = MEASURE,
    width: float = 0.9,
    style: str = "-",
) -> None:
    """Polygonal line: an extension line, a centre line."""
    x, y = zip(*points, strict=True)
    axes.plot(x, y, color=colour, linewidth=width, linestyle=style, zorder=6)


def dashed_arc(
    axes: Axes, centre: Point, radius: float, degrees: tuple[float, float], colour: str
) -> None:
    """Arc without heads; `degrees` count from the right, anticlockwise."""
    axes.add_patch(
        Arc(
            centre,
            2.0 * radius,
            2.0 * radius,
            theta1=degrees[0],
            theta2=degrees[1],
            color=colour,
            linewidth=1.0,
            linestyle="--",
            zorder=6,
        )
    )


def spring(axes: Axes, foot: Point, head: Point, *, width: float, turns: int = 5) -> None:
    """Zigzag of a spring from `foot` to `head`."""
    along = np.array(head) - np.array(foot)
    across = np.array([-along[1], along[0]]) / np.hypot(*along)
    share = np.concatenate([[0.0, 0.18], 0.18 + 0.64 * (np.arange(2 * turns) + 0.5) / (2 * turns)])
    share = np.concatenate([share, [0.82, 1.0]])
    side = np.zeros(share.size)
    side[2:-2] = 0.5 * width * np.where(np.arange(2 * turns) % 2, -1.0, 1.0)
    points = np.array(foot) + share[:, None] * along + side[:, None] * across
    axes.plot(*points.T, color=INK, linewidth=1.4, zorder=5)


def damper(axes: Axes, foot: Point, head: Point, *, width: float) -> None:
    """Pot and piston of a viscous damper, upright from `foot` to `head`."""
    x = foot[0]
    bottom = foot[1]
    top = head[1]
    height = top - bottom
    pot = (bottom + 0.35 * height, bottom + 0.62 * height)
    piston = pot[0] + 0.45 * (pot[1] - pot[0])
    half = width / 2.0
    for points in (
        [(x, bottom), (x, pot[0])],
        [(x - half, pot[1]), (x - half, pot[0]), (x + half, pot[0]), (x + half, pot[1])],
        [(x, piston), (x, top)],
        [(x - 0.8 * half, piston), (x + 0.8 * half, piston)],
    ):
        line(axes, points, colour=INK, width=1.4)


def ground(axes: Axes, x: tuple[float, float], y: float, *, depth: float) -> None:
    """Hatched ground below a level."""
    axes.add_patch(
        Rectangle(
            (x[0], y - depth),
            x[1] - x[0],
            depth,
            facecolor="white",
            edgecolor=FRAME,
            hatch="////",
            linewidth=0.0,
            zorder=1,
        )
    )
    axes.plot(x, (y, y), color=INK, linewidth=1.2, zorder=2)


def cross(
    axes: Axes,
    origin: Point,
    length: float,
    right: str,
    up: str,
    *,
    to_left: bool = False,
) -> None:
    """Two axes at a right angle: one to the right (or the left), one up."""
    sign = -1.0 if to_left else 1.0
    arrow(
        axes, origin, (origin[0] + sign * length, origin[1]), right, colour=INK, width=1.2,
        text_at=(origin[0] + sign * 1.25 * length, origin[1]),
    )  # fmt: skip
    arrow(
        axes, origin, (origin[0], origin[1] + length), up, colour=INK, width=1.2,
        text_at=(origin[0], origin[1] + 1.25 * length),
    )  # fmt: skip
