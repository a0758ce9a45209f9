"""Drawings of the machine with the gap at its sensors, and of named dimensions. Matplotlib late."""

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from carrierflex.diagnosis.report.figures import BLACK, BLUE, GREY, ORANGE, WIDTH
from carrierflex.diagnosis.report.report_data import ReportData
from carrierflex.files.quantities import sized
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.identification.campaign.declarations import Channel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BODY, _EDGE = "#e6e9ed", "#57606a"
_Point = tuple[float, float]


def machine_figure(data: ReportData, pattern: int | None) -> "Figure":
    """The machine with its sensors, out of scale; beside each the gap before and after.

    `pattern` is the number of circumferential waves of the largest part of the gap at the rim.
    """
    # Ranges in radii of the rim.
    figure, axes = _sheet(2.1, (-3.14, 3.14), (-1.5, 1.5))
    if data.campaign.kind == "carrier":
        _carrier(axes, data)
        if pattern is not None:
            _rim_pattern(axes, data, pattern)
    elif data.campaign.kind == "mounting":
        _mounting(axes, data)
    else:
        _element(axes, data)
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


def _arrow(
    axes: "Axes", end: np.ndarray | _Point, start: np.ndarray | _Point, **style: Any
) -> None:
    """Arrow with two heads where the style does not say otherwise."""
    tip, tail = ((float(at[0]), float(at[1])) for at in (end, start))
    axes.annotate("", tip, tail, arrowprops={"arrowstyle": "<->", "color": BLACK} | style)


def _size_words(name: str, data: ReportData) -> str:
    """Name of a channel and its gap, ``s047: 171 to 12 µm``."""
    if name not in data.sizes:
        return name
    before, after = data.sizes[name]
    text = f"{name}\n{sized(before, data.diagnosis.unit)}"
    return f"{text} → {sized(after, data.diagnosis.unit)}" if np.isfinite(after) else text


def _carrier(axes: "Axes", data: ReportData) -> None:
    """Seen downwind: z up, angles clockwise."""
    _disc(axes, (0.0, 0.0), 1.0, facecolor=_BODY, linewidth=1.2)
    _disc(axes, (0.0, 0.0), 0.42, linewidth=0.9)
    n_pins = int(data.campaign.rig.get("n_planets", 3))
    for k in range(n_pins):
        at = 0.75 * _unit(2.0 * np.pi * k / n_pins)
        _disc(axes, at, 0.13, linewidth=0.9)
        _text(axes, at[0], at[1], str(k + 1))
    turn = {"arrowstyle": "->", "color": _EDGE, "connectionstyle": "arc3,rad=-0.5"}
    _arrow(axes, 0.3 * _unit(0.9), 0.3 * _unit(-0.9), **turn)
    _text(axes, 0.0, 0.0, "turns")
    channels = data.campaign.channels
    for channel, turned in zip(channels, _apart(channels), strict=True):
        if channel.angle is None:
            continue
        _gap_marks(axes, 1.06 * _unit(channel.angle), channel.name, data)
        words = 1.36 * _unit(turned) * np.array([1.0, 0.93])
        side = "left" if words[0] > 0.15 else "right" if words[0] < -0.15 else "center"
        words[0] += 0.1 * np.sign(words[0]) if side != "center" else 0.0
        text = _size_words(channel.name, data)
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


def _unit(angle: float) -> np.ndarray:
    """Direction of an angle about x from z, seen downwind: y points to the left."""
    return np.array([np.sin(angle), np.cos(angle)])


def _gap_marks(axes: "Axes", at: np.ndarray, name: str, data: ReportData) -> None:
    """Discs of areas as the gap of a channel before and after."""
    largest = max((before for before, _ in data.sizes.values()), default=0.0) or 1.0
    for size, colour in zip(data.sizes.get(name, ()), (ORANGE, BLUE), strict=False):
        if np.isfinite(size) and size > 0.0:
            radius = 0.15 * float(np.sqrt(size / largest))
            _disc(axes, at, radius, facecolor=colour, edgecolor="white", linewidth=0.6)


def _rim_pattern(axes: "Axes", data: ReportData, waves: int) -> None:
    """The pattern around the rim at the instant at which it is largest."""
    overlays = data.diagnosis.signals.before if data.diagnosis.signals is not None else ()
    gaps = {one.channel: one.measured - one.simulated for one in overlays}
    sensors = [
        channel
        for channel in data.campaign.channels
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
    radius = 1.0 + 0.16 * shape / reach
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


def _mounting(axes: "Axes", data: ReportData) -> None:
    """Gearbox housing between its bushings, seen downwind."""
    _block(axes, (-1.0, -0.12), 2.0, 0.24)
    _disc(axes, (0.0, 0.0), 0.86, facecolor=_BODY, linewidth=1.2)
    _disc(axes, (0.0, 0.0), 0.22)
    _text(axes, 0.0, 0.0, "shaft")
    for side, align, name in ((-1.0, "right", "starboard"), (1.0, "left", "port")):
        _block(axes, (side - 0.13, -0.18), 0.26, 0.36, facecolor="#9aa4af")
        _text(axes, 1.2 * side, 0.0, f"bushing\n{name}", ha=align)
    for channel in data.campaign.channels:
        position, direction = _SENSOR_POSITIONS[channel.sensor or "sbx"]
        at = np.array(position)
        if direction is None:
            _disc(axes, position, 0.09, edgecolor=GREY, linewidth=0.8)
        else:
            reach = 0.3 * np.array(direction)
            _arrow(axes, at + reach, at - reach, color=GREY)
        _gap_marks(axes, at, channel.name, data)
        side = np.sign(at[0]) if abs(at[0]) > 0.2 else 0.0
        aside = 0.28 if channel.sensor in ("spy", "sbx") else 0.18
        x, y = at + np.array([0.24 * side, aside * np.sign(at[1])])
        align = {1.0: "left", -1.0: "right", 0.0: "center"}[float(side)]
        words = _size_words(channel.name, data)
        _text(axes, x, y, words, ha=align, fontsize=8, color=BLACK)


def _element(axes: "Axes", data: ReportData) -> None:
    """Element between ground and its drive, with the channel."""
    drive = str(data.campaign.rig["drive"])
    axes.plot([-2.3, -2.3], [-0.75, 0.75], color=_EDGE, linewidth=1.6)
    for y in np.linspace(-0.75, 0.6, 7):
        axes.plot([-2.5, -2.3], [y, y + 0.15], color=_EDGE, linewidth=0.7)
    if drive == "base":
        _arrow(axes, (-1.95, 1.0), (-2.65, 1.0))
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
        heads = "<->" if drive == "displacement" else "<-"
        _arrow(axes, (end, 0.0), (end + 0.75, 0.0), arrowstyle=heads)
        _text(axes, end + 0.85, 0.0, f"{drive}\n(drive)", ha="left", fontsize=8, color=BLACK)
    words = f"sensor {_size_words(data.campaign.channels[0].name, data)}"
    _text(axes, end - 0.1, 0.8, words, va="bottom", fontsize=8, color=BLACK)


class _Line(NamedTuple):
    """A dimension line: its ends [m] in the view of the section or of the face."""

    start: _Point
    end: _Point
    is_of_face: bool = False
    number_at: float = 0.5


#: The default carrier, which is drawn, and its length along the pins.
_DRAWN = CarrierParameters()
_GAP_END = _DRAWN.upwind_plate_thickness + _DRAWN.plate_gap
_END = _GAP_END + _DRAWN.downwind_plate_thickness
_PINS, _HOLE = _DRAWN.centre_distance, _DRAWN.pin_hole_diameter / 2
#: Where the section through a pin (axis horizontal, upwind on the left) and the face stand.
_SECTION_AT, _FACE_AT = -0.55, 0.55


def _across(x: float, diameter: float, number_at: float = 0.5) -> _Line:
    """Line over a diameter of the section."""
    return _Line((x, -diameter / 2), (x, diameter / 2), number_at=number_at)


_LINES = {
    "upwind_plate_thickness": _Line((0.0, 0.46), (_DRAWN.upwind_plate_thickness, 0.46)),
    "plate_gap": _Line((_DRAWN.upwind_plate_thickness, 0.46), (_GAP_END, 0.46)),
    "downwind_plate_thickness": _Line((_GAP_END, 0.46), (_END, 0.46)),
    "hub_length": _Line((-_DRAWN.hub_length, -0.46), (0.0, -0.46)),
    "seat_length": _Line((_END, -0.46), (_END + _DRAWN.seat_length, -0.46)),
    "hub_outer_diameter": _across(-0.09, _DRAWN.hub_outer_diameter, 0.3),
    "hub_inner_diameter": _across(-0.045, _DRAWN.hub_inner_diameter),
    "seat_outer_diameter": _across(_END + 0.045, _DRAWN.seat_outer_diameter, 0.3),
    "seat_inner_diameter": _across(_END + 0.02, _DRAWN.seat_inner_diameter),
    "outer_radius": _Line((0.0, 0.0), (-0.217, -0.377), True),
    "centre_distance": _Line((0.0, 0.0), (0.0, _PINS), True),
    "pin_hole_diameter": _Line((-_HOLE, _PINS), (_HOLE, _PINS), True),
    "planet_clearance_radius": _Line((0.267, -0.154), (0.080, -0.040), True),
    "web_inner_radius": _Line((0.0, 0.0), (0.0, -_DRAWN.web_inner_radius), True),
}


def shown_dimensions(effects: tuple[str, ...]) -> list[str]:
    """Dimensions among some effects that stand on the drawing."""
    names = [name.removeprefix("geometry/") for name in effects if name.startswith("geometry/")]
    return [name for name in names if name in _LINES]


def carrier_figure(dimensions: list[str]) -> "Figure":
    """Section and face of the default carrier; dimension lines of what is named."""
    figure, axes = _sheet(2.4, (-0.75, 1.15), (-0.54, 0.54))
    _section(axes)
    _face(axes)
    for number, name in enumerate(dimensions, start=1):
        line = _LINES[name]
        at = _FACE_AT if line.is_of_face else _SECTION_AT
        ends = [(x + at, y) for x, y in (line.start, line.end)]
        _arrow(axes, ends[1], ends[0], color=ORANGE, shrinkA=0, shrinkB=0)
        x, y = (a + line.number_at * (b - a) for a, b in zip(*ends, strict=True))
        if math.dist(*ends) < 0.15:
            y += math.copysign(0.045, y)
        box = {"boxstyle": "circle,pad=0.15", "facecolor": "white", "edgecolor": ORANGE}
        _text(axes, x, y, str(number), color=BLACK, bbox=box)
    return figure


def _section(axes: "Axes") -> None:
    """Half above the axis through a pin, half below it through a web."""

    def block(x: float, low: float, width: float, high: float, colour: str = _BODY) -> None:
        """Block between two distances from the axis."""
        _block(axes, (x + _SECTION_AT, low), width, high - low, facecolor=colour)

    drawn, outer, plate = _DRAWN, _DRAWN.outer_radius, _DRAWN.upwind_plate_thickness
    bore, seat_bore = drawn.hub_inner_diameter / 2, drawn.seat_inner_diameter / 2
    for sign in (1.0, -1.0):
        block(-drawn.hub_length, sign * bore, drawn.hub_length, sign * drawn.hub_outer_diameter / 2)
        block(0.0, sign * bore, plate, sign * outer)
        block(_GAP_END, sign * seat_bore, drawn.downwind_plate_thickness, sign * outer)
        block(_END, sign * seat_bore, drawn.seat_length, sign * drawn.seat_outer_diameter / 2)
    block(plate, -drawn.web_inner_radius, drawn.plate_gap, -outer)
    block(0.0, _PINS - _HOLE, _END, _PINS + _HOLE, "white")
    ends = [x + _SECTION_AT for x in (-drawn.hub_length - 0.04, _END + drawn.seat_length + 0.04)]
    axes.plot(ends, [0.0, 0.0], "-.", color=BLACK, linewidth=0.6)


def _face(axes: "Axes") -> None:
    """Upwind plate from the planets' side: pin holes, webs and the room of the planets."""
    room = {"facecolor": "none", "linestyle": ":"}
    _disc(axes, (_FACE_AT, 0.0), _DRAWN.outer_radius, facecolor=_BODY)
    _disc(axes, (_FACE_AT, 0.0), _DRAWN.web_inner_radius, **room)
    _disc(axes, (_FACE_AT, 0.0), _DRAWN.hub_inner_diameter / 2)
    for x, y in ((0.0, _PINS), (0.2667, -_PINS / 2), (-0.2667, -_PINS / 2)):
        _disc(axes, (x + _FACE_AT, y), _HOLE)
        _disc(axes, (x + _FACE_AT, y), _DRAWN.planet_clearance_radius, **room)
