"""Drawings of the machine with the gap at its sensors, and of named dimensions. Matplotlib late."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carrierflex.diagnosis.comparison.overlay import SignalComparison
from carrierflex.diagnosis.report.figures import BLACK, BLUE, GREY, ORANGE, WIDTH
from carrierflex.diagnosis.report.report_data import CampaignOutline, ReportData
from carrierflex.files.quantities import sized
from carrierflex.identification.campaign.declarations import Channel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEIGHT = 2.1
#: Half of what is drawn, in radii of the rim.
_HALF_WIDTH, _HALF_HEIGHT = 3.14, 1.5
_BODY, _EDGE = "#e6e9ed", "#57606a"
#: Circle of the pins over the sensors' circle where the campaign does not tell: the default
#: carrier's.
_PIN_CIRCLE, _PIN = 0.75, 0.13
#: The largest gap is drawn this large, over the radius of the rim.
_PATTERN = 0.16
_Sizes = Mapping[str, tuple[float, float]]
_Point = tuple[float, float]


def machine_figure(data: ReportData, pattern: int | None) -> "Figure":
    """The machine with its sensors, out of scale; beside each the gap before and after.

    `pattern` is the number of circumferential waves of the largest part of the gap at the rim.
    """
    campaign, sizes, unit = data.campaign, data.sizes, data.diagnosis.unit
    signals = data.diagnosis.signals
    figure, axes = _sheet(_HEIGHT, (-_HALF_WIDTH, _HALF_WIDTH), (-_HALF_HEIGHT, _HALF_HEIGHT))
    if campaign.kind == "carrier":
        _carrier(axes, campaign, sizes, unit)
        if pattern is not None and signals is not None:
            _rim_pattern(axes, campaign, signals, pattern)
    elif campaign.kind == "mounting":
        _mounting(axes, campaign, sizes, unit)
    else:
        _element(axes, campaign, sizes, unit)
    return figure


def _sheet(height: float, x: _Point, y: _Point) -> tuple["Figure", "Axes"]:
    """Figure with one pair of axes of equal scales and given ranges, without a frame."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_xlim(*x)
    axes.set_ylim(*y)
    return figure, axes


def _disc(axes: "Axes", at: np.ndarray | _Point, radius: float, **style: Any) -> None:
    """Circle, white with the edge of a body where the style does not say otherwise."""
    from matplotlib.patches import Circle

    centre = (float(at[0]), float(at[1]))
    axes.add_patch(Circle(centre, radius, **{"facecolor": "white", "edgecolor": _EDGE} | style))


def _block(axes: "Axes", corner: _Point, width: float, height: float, **style: Any) -> None:
    """Rectangle, of a body where the style does not say otherwise."""
    from matplotlib.patches import Rectangle

    drawn = {"facecolor": _BODY, "edgecolor": _EDGE} | style
    axes.add_patch(Rectangle(corner, width, height, **drawn))


def _text(axes: "Axes", x: float, y: float, text: str, **style: Any) -> None:
    """Small centred text in the colour of the edges where the style does not say otherwise."""
    drawn: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7, "color": _EDGE}
    axes.text(x, y, text, **drawn | style)


def _largest_gap(sizes: _Sizes) -> float:
    """Largest gap before, one where there is none."""
    return max((before for before, _ in sizes.values()), default=0.0) or 1.0


def _size_words(name: str, sizes: _Sizes, unit: str) -> str:
    """Name of a channel and its gap, ``s047: 171 to 12 µm``."""
    if name not in sizes:
        return name
    before, after = sizes[name]
    text = f"{name}\n{sized(before, unit)}"
    return f"{text} → {sized(after, unit)}" if np.isfinite(after) else text


def _carrier(axes: "Axes", campaign: CampaignOutline, sizes: _Sizes, unit: str) -> None:
    """Seen downwind: z up, angles clockwise."""
    _disc(axes, (0.0, 0.0), 1.0, facecolor=_BODY, linewidth=1.2)
    _disc(axes, (0.0, 0.0), 0.42, linewidth=0.9)
    n_pins = int(campaign.rig.get("n_planets", 3))
    for k in range(n_pins):
        at = _PIN_CIRCLE * _unit(2.0 * np.pi * k / n_pins)
        _disc(axes, at, _PIN, linewidth=0.9)
        _text(axes, at[0], at[1], str(k + 1))
    axes.annotate(
        "",
        _point(0.3 * _unit(0.9)),
        _point(0.3 * _unit(-0.9)),
        arrowprops={"arrowstyle": "->", "color": _EDGE, "connectionstyle": "arc3,rad=-0.5"},
    )
    _text(axes, 0.0, 0.0, "turns")
    largest = _largest_gap(sizes)
    placed = _apart(campaign.channels)
    for channel, turned in zip(campaign.channels, placed, strict=True):
        if channel.angle is None:
            continue
        _gap_marks(axes, 1.06 * _unit(channel.angle), sizes.get(channel.name), largest)
        words = 1.36 * _unit(turned) * np.array([1.0, 0.93])
        side = "left" if words[0] > 0.15 else "right" if words[0] < -0.15 else "center"
        words[0] += 0.1 * np.sign(words[0]) if side != "center" else 0.0
        text = _size_words(channel.name, sizes, unit)
        _text(axes, words[0], words[1], text, ha=side, fontsize=8, color=BLACK)


def _apart(channels: tuple[Channel, ...]) -> list[float]:
    """Angles of the names, so far apart that they do not overlap."""
    angles = [channel.angle or 0.0 for channel in channels]
    order = np.argsort(angles, kind="stable")
    placed = np.array(angles)
    for _ in range(60):
        for k in range(len(order)):
            a, b = order[k], order[(k + 1) % len(order)]
            turn = 2.0 * np.pi if k + 1 == len(order) else 0.0
            lack = min(0.5, 2.0 * np.pi / len(order)) - (placed[b] + turn - placed[a])
            if lack > 1e-9 and a != b:
                placed[a] -= 0.5 * lack
                placed[b] += 0.5 * lack
    return [float(angle) for angle in placed]


def _point(at: np.ndarray) -> _Point:
    return float(at[0]), float(at[1])


def _unit(angle: float) -> np.ndarray:
    """Direction of an angle about x from z, seen downwind: y points to the left."""
    return np.array([np.sin(angle), np.cos(angle)])


def _gap_marks(axes: "Axes", at: np.ndarray, sizes: _Point | None, largest: float) -> None:
    """Discs of areas as the gap before and after."""
    for size, colour in zip(sizes or (), (ORANGE, BLUE), strict=False):
        if np.isfinite(size) and size > 0.0:
            radius = 0.15 * float(np.sqrt(size / largest))
            _disc(axes, at, radius, facecolor=colour, edgecolor="white", linewidth=0.6)


def _rim_pattern(
    axes: "Axes", campaign: CampaignOutline, signals: SignalComparison, waves: int
) -> None:
    """The pattern around the rim at the instant at which it is largest."""
    gaps = {one.channel: one.measured - one.simulated for one in signals.before}
    sensors = [
        channel
        for channel in campaign.channels
        if channel.name in gaps
        and channel.angle is not None
        and channel.quantity == "axial_displacement"
    ]
    if len(sensors) < 3:
        return
    angles = np.array([channel.angle for channel in sensors])
    values = np.array([gaps[channel.name] for channel in sensors])
    instant = int(np.argmax(np.square(values).sum(axis=0)))
    around = np.linspace(0.0, 2.0 * np.pi, 181)

    def columns(v: np.ndarray) -> np.ndarray:
        """Cosine and sine of the waves, or the constant."""
        if waves == 0:
            return np.ones((v.size, 1))
        return np.column_stack([np.cos(waves * v), np.sin(waves * v)])

    solution = np.linalg.lstsq(columns(angles), values[:, instant], rcond=None)[0]
    shape = columns(around) @ solution
    reach = float(np.abs(shape).max())
    if reach == 0.0:
        return
    radius = 1.0 + _PATTERN * shape / reach
    axes.plot(radius * np.sin(around), radius * np.cos(around), "--", color=ORANGE, linewidth=1.4)


#: Places of the sensors, seen downwind (starboard, +y, on the left): sensor to place and direction;
#: axial ones look out of the page.
_SENSOR_POSITIONS = {
    "ssz": ((-1.0, 0.35), (0.0, 1.0)),
    "spz": ((1.0, 0.35), (0.0, 1.0)),
    "ssx": ((-1.0, -0.35), None),
    "spx": ((1.0, -0.35), None),
    "spy": ((0.0, 0.95), (1.0, 0.0)),
    "sbx": ((0.0, -0.95), None),
}


def _mounting(axes: "Axes", campaign: CampaignOutline, sizes: _Sizes, unit: str) -> None:
    """Gearbox housing between its bushings, seen downwind."""
    largest = _largest_gap(sizes)
    _block(axes, (-1.0, -0.12), 2.0, 0.24)
    _disc(axes, (0.0, 0.0), 0.86, facecolor=_BODY, linewidth=1.2)
    _disc(axes, (0.0, 0.0), 0.22)
    _text(axes, 0.0, 0.0, "shaft")
    for side, align, name in ((-1.0, "right", "starboard"), (1.0, "left", "port")):
        _block(axes, (side - 0.13, -0.18), 0.26, 0.36, facecolor="#9aa4af")
        _text(axes, 1.2 * side, 0.0, f"bushing\n{name}", ha=align)
    for channel in campaign.channels:
        position, direction = _SENSOR_POSITIONS[channel.sensor or "sbx"]
        at = np.array(position)
        if direction is None:
            _disc(axes, position, 0.09, edgecolor=GREY, linewidth=0.8)
        else:
            reach = 0.3 * np.array(direction)
            arrow = {"arrowstyle": "<->", "color": GREY}
            axes.annotate("", _point(at + reach), _point(at - reach), arrowprops=arrow)
        _gap_marks(axes, at, sizes.get(channel.name), largest)
        side = np.sign(at[0]) if abs(at[0]) > 0.2 else 0.0
        aside = 0.28 if channel.sensor in ("spy", "sbx") else 0.18
        x, y = at + np.array([0.24 * side, aside * np.sign(at[1])])
        align = {1.0: "left", -1.0: "right", 0.0: "center"}[float(side)]
        words = _size_words(channel.name, sizes, unit)
        _text(axes, x, y, words, ha=align, fontsize=8, color=BLACK)


def _element(axes: "Axes", campaign: CampaignOutline, sizes: _Sizes, unit: str) -> None:
    """Element between ground and its drive, with the channel."""
    drive = str(campaign.rig["drive"])
    axes.plot([-2.3, -2.3], [-0.75, 0.75], color=_EDGE, linewidth=1.6)
    for y in np.linspace(-0.75, 0.6, 7):
        axes.plot([-2.5, -2.3], [y, y + 0.15], color=_EDGE, linewidth=0.7)
    if drive == "base":
        arrow = {"arrowstyle": "<->", "color": BLACK}
        axes.annotate("", (-1.95, 1.0), (-2.65, 1.0), arrowprops=arrow)
        _text(axes, -2.3, 1.12, "base", va="bottom", fontsize=8, color=BLACK)
    coil = np.linspace(-2.0, -0.1, 60)
    axes.plot([-2.3, -2.0], [0.4, 0.4], color=_EDGE)
    axes.plot(coil, 0.4 + 0.16 * np.sin(np.linspace(0.0, 14.0 * np.pi, 60)), color=_EDGE)
    axes.plot([-0.1, 0.3], [0.4, 0.4], color=_EDGE)
    axes.plot([-2.3, -1.2], [-0.35, -0.35], color=_EDGE)
    axes.plot([-0.7, -1.2, -1.2, -0.7], [-0.15, -0.15, -0.55, -0.55], color=_EDGE)
    axes.plot([-0.9, -0.9], [-0.5, -0.2], color=_EDGE, linewidth=2.0)
    axes.plot([-0.9, 0.3], [-0.35, -0.35], color=_EDGE)
    _block(axes, (-2.1, -0.75), 2.2, 1.5, fill=False, edgecolor=ORANGE, linestyle="--")
    _text(axes, -1.0, -0.84, "the gap lies in here", va="top", fontsize=8, color=ORANGE)
    body, width, end = ("", 0.12, 0.42) if drive == "displacement" else ("mass", 0.8, 1.1)
    _block(axes, (0.3, -0.6), width, 1.2)
    _text(axes, 0.7, 0.0, body, fontsize=8, color=BLACK)
    if drive in ("force", "displacement"):
        arrow = {"arrowstyle": "<->" if drive == "displacement" else "<-", "color": BLACK}
        axes.annotate("", (end, 0.0), (end + 0.75, 0.0), arrowprops=arrow)
        _text(axes, end + 0.85, 0.0, f"{drive}\n(drive)", ha="left", fontsize=8, color=BLACK)
    words = f"sensor {_size_words(campaign.channels[0].name, sizes, unit)}"
    _text(axes, end - 0.1, 0.8, words, va="bottom", fontsize=8, color=BLACK)


#: Ranges of the drawing of the dimensions along and across the axis [m], and its height [in].
_ALONG, _ACROSS, _DIMENSIONS_HEIGHT = (-0.75, 1.15), (-0.54, 0.54), 2.4
#: Shorter lines have their number so far beside them [m].
_SHORT, _LABEL_OFFSET = 0.15, 0.045


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
_OUTER, _PINS, _HOLE, _WEB, _CLEAR = 0.435, 0.308, 0.160, 0.235, 0.219
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
    "pin_hole_diameter": _Line((-_HOLE / 2, _PINS), (_HOLE / 2, _PINS), True),
    "planet_clearance_radius": _Line((0.267, -0.154), (0.080, -0.040), True),
    "web_inner_radius": _Line((0.0, 0.0), (0.0, -_WEB), True),
}


def shown_dimensions(effects: tuple[str, ...]) -> list[str]:
    """Dimensions among some effects that stand on the drawing."""
    names = [name.removeprefix("geometry/") for name in effects if name.startswith("geometry/")]
    return [name for name in names if name in _LINES]


def carrier_figure(dimensions: list[str]) -> "Figure":
    """Section and face of the default carrier; dimension lines of what is named."""
    figure, axes = _sheet(_DIMENSIONS_HEIGHT, _ALONG, _ACROSS)
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
        _text(axes, x, y, str(number), color=BLACK, bbox=box)
    return figure


def _section(axes: "Axes") -> None:
    """Half above the axis through a pin, half below it through a web."""

    def block(x: float, y: float, width: float, height: float, colour: str = _BODY) -> None:
        _block(axes, (x + _SECTION_AT, y), width, height, facecolor=colour)

    for sign in (1.0, -1.0):
        block(-_HUB_LENGTH, sign * _BORE / 2, _HUB_LENGTH, sign * (_HUB - _BORE) / 2)
        block(0.0, sign * _BORE / 2, _UPWIND, sign * (_OUTER - _BORE / 2))
        downwind = _UPWIND + _GAP
        block(downwind, sign * _SEAT_BORE / 2, _DOWNWIND, sign * (_OUTER - _SEAT_BORE / 2))
        block(_END, sign * _SEAT_BORE / 2, _SEAT_LENGTH, sign * (_SEAT - _SEAT_BORE) / 2)
    block(_UPWIND, -_WEB, _GAP, _WEB - _OUTER)
    block(0.0, _PINS - _HOLE / 2, _END, _HOLE, "white")
    ends = [x + _SECTION_AT for x in (-_HUB_LENGTH - 0.04, _END + _SEAT_LENGTH + 0.04)]
    axes.plot(ends, [0.0, 0.0], "-.", color=BLACK, linewidth=0.6)


def _face(axes: "Axes") -> None:
    """Upwind plate from the planets' side: pin holes, webs and the room of the planets."""
    room = {"facecolor": "none", "linestyle": ":"}
    _disc(axes, (_FACE_AT, 0.0), _OUTER, facecolor=_BODY)
    _disc(axes, (_FACE_AT, 0.0), _WEB, **room)
    _disc(axes, (_FACE_AT, 0.0), _BORE / 2)
    for x, y in ((0.0, _PINS), (0.2667, -_PINS / 2), (-0.2667, -_PINS / 2)):
        _disc(axes, (x + _FACE_AT, y), _HOLE / 2)
        _disc(axes, (x + _FACE_AT, y), _CLEAR, **room)
