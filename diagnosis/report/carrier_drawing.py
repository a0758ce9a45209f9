"""Drawing of the carrier with the dimensions that an answer names. Matplotlib late."""

import math
from typing import TYPE_CHECKING, NamedTuple

from carrierflex.diagnosis.report.figures import BLACK, ORANGE, WIDTH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BODY, _EDGE = "#e6e9ed", "#57606a"
_HEIGHT = 2.4
#: Half-width of the drawn strip, and bounds of the height [m].
_LEFT, _RIGHT, _LOW, _HIGH = -0.75, 1.15, -0.54, 0.54
#: Shorter lines have their number so far beside them [m].
_SHORT, _LABEL_OFFSET = 0.15, 0.045

_Point = tuple[float, float]


class _Line(NamedTuple):
    """A dimension line: its ends [m] in the view of the section or of the face."""

    start: _Point
    end: _Point
    is_of_face: bool = False
    number_at: float = 0.5


#: Section through a pin (axis horizontal, upwind on the left) and through a web, as drawn: the
#: default carrier's sizes.
_UPWIND, _GAP, _DOWNWIND = 0.065, 0.240, 0.045
_END = _UPWIND + _GAP + _DOWNWIND
_OUTER, _PINS, _PIN, _WEB, _CLEAR = 0.435, 0.308, 0.160, 0.235, 0.219
_HUB, _BORE, _HUB_LENGTH = 0.460, 0.320, 0.120
_SEAT, _SEAT_BORE, _SEAT_LENGTH = 0.400, 0.280, 0.060
#: Where both views stand.
_SECTION_AT, _FACE_AT = -0.55, 0.55

_LINES = {
    "upwind_plate_thickness": _Line((0.0, 0.46), (_UPWIND, 0.46)),
    "plate_gap": _Line((_UPWIND, 0.46), (_UPWIND + _GAP, 0.46)),
    "downwind_plate_thickness": _Line((_UPWIND + _GAP, 0.46), (_END, 0.46)),
    "hub_length": _Line((-_HUB_LENGTH, -0.46), (0.0, -0.46)),
    "seat_length": _Line((_END, -0.46), (_END + _SEAT_LENGTH, -0.46)),
    "hub_outer_diameter": _Line((-0.09, -_HUB / 2), (-0.09, _HUB / 2), number_at=0.3),
    "hub_inner_diameter": _Line((-0.045, -_BORE / 2), (-0.045, _BORE / 2)),
    "seat_outer_diameter": _Line(
        (_END + 0.045, -_SEAT / 2), (_END + 0.045, _SEAT / 2), number_at=0.3
    ),
    "seat_inner_diameter": _Line((_END + 0.02, -_SEAT_BORE / 2), (_END + 0.02, _SEAT_BORE / 2)),
    "outer_radius": _Line((0.0, 0.0), (-0.217, -0.377), True),
    "centre_distance": _Line((0.0, 0.0), (0.0, _PINS), True),
    "pin_hole_diameter": _Line((-_PIN / 2, _PINS), (_PIN / 2, _PINS), True),
    "planet_clearance_radius": _Line((0.267, -0.154), (0.080, -0.040), True),
    "web_inner_radius": _Line((0.0, 0.0), (0.0, -_WEB), True),
}


def shown_dimensions(effects: tuple[str, ...]) -> list[str]:
    """Dimensions among some effects that stand on the drawing."""
    names = [name.removeprefix("geometry/") for name in effects if name.startswith("geometry/")]
    return [name for name in names if name in _LINES]


def carrier_figure(dimensions: list[str]) -> "Figure":
    """Section and face of the parametric carrier; dimension lines of what is named.

    The proportions are those of the default carrier.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, _HEIGHT))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_xlim(_LEFT, _RIGHT)
    axes.set_ylim(_LOW, _HIGH)
    _section(axes)
    _face(axes)
    for number, name in enumerate(dimensions, start=1):
        line = _LINES[name]
        at = _FACE_AT if line.is_of_face else _SECTION_AT
        ends = [(x + at, y) for x, y in (line.start, line.end)]
        arrow = {"arrowstyle": "<->", "color": ORANGE, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", ends[1], ends[0], arrowprops=arrow)
        x, y = (a + line.number_at * (b - a) for a, b in zip(*ends, strict=True))
        if math.dist(*ends) < _SHORT:
            y += math.copysign(_LABEL_OFFSET, y)
        box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": ORANGE}
        axes.text(x, y, str(number), fontsize=7, ha="center", va="center", bbox=box)
    return figure


def _section(axes: "Axes") -> None:
    """Half above the axis through a pin, half below it through a web."""
    from matplotlib.patches import Rectangle

    def block(x: float, y: float, width: float, height: float, colour: str = _BODY) -> None:
        axes.add_patch(
            Rectangle((x + _SECTION_AT, y), width, height, facecolor=colour, edgecolor=_EDGE)
        )

    for sign in (1.0, -1.0):
        block(-_HUB_LENGTH, sign * _BORE / 2, _HUB_LENGTH, sign * (_HUB - _BORE) / 2)
        block(0.0, sign * _BORE / 2, _UPWIND, sign * (_OUTER - _BORE / 2))
        downwind = _UPWIND + _GAP
        block(downwind, sign * _SEAT_BORE / 2, _DOWNWIND, sign * (_OUTER - _SEAT_BORE / 2))
        block(_END, sign * _SEAT_BORE / 2, _SEAT_LENGTH, sign * (_SEAT - _SEAT_BORE) / 2)
    block(_UPWIND, -_WEB, _GAP, _WEB - _OUTER)
    block(0.0, _PINS - _PIN / 2, _END, _PIN, "white")
    ends = [x + _SECTION_AT for x in (-_HUB_LENGTH - 0.04, _END + _SEAT_LENGTH + 0.04)]
    axes.plot(ends, [0.0, 0.0], "-.", color=BLACK, linewidth=0.6)


def _face(axes: "Axes") -> None:
    """Upwind plate from the planets' side: pin holes, webs and the room of the planets."""
    from matplotlib.patches import Circle

    def circle(x: float, y: float, radius: float, colour: str = "none", style: str = "-") -> None:
        axes.add_patch(
            Circle((x + _FACE_AT, y), radius, facecolor=colour, edgecolor=_EDGE, linestyle=style)
        )

    circle(0.0, 0.0, _OUTER, _BODY)
    circle(0.0, 0.0, _WEB, "none", ":")
    circle(0.0, 0.0, _BORE / 2, "white")
    for x, y in ((0.0, _PINS), (0.2667, -_PINS / 2), (-0.2667, -_PINS / 2)):
        circle(x, y, _PIN / 2, "white")
        circle(x, y, _CLEAR, "none", ":")
