"""Drawing of the machine with its sensors and the gap at each of them. Matplotlib late."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from carrierflex.diagnosis.comparison.overlay import SignalComparison
from carrierflex.diagnosis.report.figures import BLACK, BLUE, GREY, ORANGE, WIDTH
from carrierflex.diagnosis.report.report_data import CampaignOutline, ReportData
from carrierflex.diagnosis.report.words import sized
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


def machine_figure(data: ReportData, pattern: int | None) -> "Figure":
    """The machine with its sensors, out of scale; beside each the gap before and after.

    `pattern` is the number of circumferential waves of the largest part of the gap at the rim.
    """
    from matplotlib.figure import Figure

    campaign, sizes, unit = data.campaign, data.sizes, data.diagnosis.unit
    signals = data.diagnosis.signals
    figure = Figure(figsize=(WIDTH, _HEIGHT))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_aspect("equal")
    axes.axis("off")
    axes.set_xlim(-_HALF_WIDTH, _HALF_WIDTH)
    axes.set_ylim(-_HALF_HEIGHT, _HALF_HEIGHT)
    if campaign.kind == "carrier":
        _carrier(axes, campaign, sizes, unit)
        if pattern is not None and signals is not None:
            _rim_pattern(axes, campaign, signals, pattern)
    elif campaign.kind == "mounting":
        _mounting(axes, campaign, sizes, unit)
    else:
        _element(axes, campaign, sizes, unit)
    return figure


def _size_words(name: str, sizes: _Sizes, unit: str) -> str:
    """Name of a channel and its gap, ``s047: 171 to 12 µm``."""
    if name not in sizes:
        return name
    before, after = sizes[name]
    text = f"{name}\n{sized(before, unit)}"
    return f"{text} → {sized(after, unit)}" if np.isfinite(after) else text


def _carrier(axes: "Axes", campaign: CampaignOutline, sizes: _Sizes, unit: str) -> None:
    """Seen downwind: z up, angles clockwise."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle((0.0, 0.0), 1.0, facecolor=_BODY, edgecolor=_EDGE, linewidth=1.2))
    axes.add_patch(Circle((0.0, 0.0), 0.42, facecolor="white", edgecolor=_EDGE, linewidth=0.9))
    n_pins = int(campaign.rig.get("n_planets", 3))
    for k in range(n_pins):
        at = _PIN_CIRCLE * _unit(2.0 * np.pi * k / n_pins)
        axes.add_patch(Circle(_point(at), _PIN, facecolor="white", edgecolor=_EDGE, linewidth=0.9))
        axes.text(at[0], at[1], str(k + 1), ha="center", va="center", fontsize=7, color=_EDGE)
    axes.annotate(
        "",
        _point(0.3 * _unit(0.9)),
        _point(0.3 * _unit(-0.9)),
        arrowprops={"arrowstyle": "->", "color": _EDGE, "connectionstyle": "arc3,rad=-0.5"},
    )
    axes.text(0.0, 0.0, "turns", ha="center", va="center", fontsize=7, color=_EDGE)
    largest = max((before for before, _ in sizes.values()), default=0.0) or 1.0
    placed = _apart(campaign.channels)
    for channel, turned in zip(campaign.channels, placed, strict=True):
        if channel.angle is None:
            continue
        at = 1.06 * _unit(channel.angle)
        _gap_marks(axes, at, sizes.get(channel.name, (0.0, 0.0)), largest)
        words = 1.36 * _unit(turned) * np.array([1.0, 0.93])
        side = "left" if words[0] > 0.15 else "right" if words[0] < -0.15 else "center"
        words[0] += 0.1 * np.sign(words[0]) if side != "center" else 0.0
        axes.text(
            words[0],
            words[1],
            _size_words(channel.name, sizes, unit),
            ha=side,
            va="center",
            fontsize=8,
        )


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


def _point(at: np.ndarray) -> tuple[float, float]:
    return float(at[0]), float(at[1])


def _unit(angle: float) -> np.ndarray:
    """Direction of an angle about x from z, seen downwind: y points to the left."""
    return np.array([np.sin(angle), np.cos(angle)])


def _gap_marks(axes: "Axes", at: np.ndarray, sizes: tuple[float, float], largest: float) -> None:
    """Discs of areas as the gap before and after."""
    from matplotlib.patches import Circle

    for size, colour in zip(sizes, (ORANGE, BLUE), strict=True):
        if np.isfinite(size) and size > 0.0:
            radius = 0.15 * float(np.sqrt(size / largest))
            axes.add_patch(
                Circle(_point(at), radius, facecolor=colour, edgecolor="white", linewidth=0.6)
            )


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
    from matplotlib.patches import Circle, Rectangle

    largest = max((before for before, _ in sizes.values()), default=0.0) or 1.0
    axes.add_patch(Rectangle((-1.0, -0.12), 2.0, 0.24, facecolor=_BODY, edgecolor=_EDGE))
    axes.add_patch(Circle((0.0, 0.0), 0.86, facecolor=_BODY, edgecolor=_EDGE, linewidth=1.2))
    axes.add_patch(Circle((0.0, 0.0), 0.22, facecolor="white", edgecolor=_EDGE))
    axes.text(0.0, 0.0, "shaft", ha="center", va="center", fontsize=7, color=_EDGE)
    for side, name in ((-1.0, "starboard"), (1.0, "port")):
        axes.add_patch(
            Rectangle((side - 0.13, -0.18), 0.26, 0.36, facecolor="#9aa4af", edgecolor=_EDGE)
        )
        axes.text(
            1.2 * side,
            0.0,
            f"bushing\n{name}",
            ha="left" if side > 0.0 else "right",
            va="center",
            fontsize=7,
            color=_EDGE,
        )
    for channel in campaign.channels:
        position, direction = _SENSOR_POSITIONS[channel.sensor or "sbx"]
        at = np.array(position)
        if direction is None:
            axes.add_patch(Circle(position, 0.09, facecolor="white", edgecolor=GREY, linewidth=0.8))
        else:
            reach = 0.3 * np.array(direction)
            arrow = {"arrowstyle": "<->", "color": GREY}
            axes.annotate("", _point(at + reach), _point(at - reach), arrowprops=arrow)
        _gap_marks(axes, at, sizes.get(channel.name, (0.0, 0.0)), largest)
        words = _size_words(channel.name, sizes, unit)
        side = np.sign(at[0]) if abs(at[0]) > 0.2 else 0.0
        aside = 0.28 if channel.sensor in ("spy", "sbx") else 0.18
        where = at + np.array([0.24 * side, aside * np.sign(at[1])])
        align = {1.0: "left", -1.0: "right", 0.0: "center"}[float(side)]
        axes.text(where[0], where[1], words, ha=align, va="center", fontsize=8)


def _element(axes: "Axes", campaign: CampaignOutline, sizes: _Sizes, unit: str) -> None:
    """Element between ground and its drive, with the channel."""
    from matplotlib.patches import Rectangle

    drive = str(campaign.rig["drive"])
    moving = drive == "base"
    axes.plot([-2.3, -2.3], [-0.75, 0.75], color=_EDGE, linewidth=1.6)
    for y in np.linspace(-0.75, 0.6, 7):
        axes.plot([-2.5, -2.3], [y, y + 0.15], color=_EDGE, linewidth=0.7)
    if moving:
        arrow = {"arrowstyle": "<->", "color": BLACK}
        axes.annotate("", (-1.95, 1.0), (-2.65, 1.0), arrowprops=arrow)
        axes.text(-2.3, 1.12, "base", ha="center", va="bottom", fontsize=8)
    coil = np.linspace(-2.0, -0.1, 60)
    axes.plot([-2.3, -2.0], [0.4, 0.4], color=_EDGE)
    axes.plot(coil, 0.4 + 0.16 * np.sin(np.linspace(0.0, 14.0 * np.pi, 60)), color=_EDGE)
    axes.plot([-0.1, 0.3], [0.4, 0.4], color=_EDGE)
    axes.plot([-2.3, -1.2], [-0.35, -0.35], color=_EDGE)
    axes.plot([-0.7, -1.2, -1.2, -0.7], [-0.15, -0.15, -0.55, -0.55], color=_EDGE)
    axes.plot([-0.9, -0.9], [-0.5, -0.2], color=_EDGE, linewidth=2.0)
    axes.plot([-0.9, 0.3], [-0.35, -0.35], color=_EDGE)
    axes.add_patch(Rectangle((-2.1, -0.75), 2.2, 1.5, fill=False, edgecolor=ORANGE, linestyle="--"))
    axes.text(-1.0, -0.84, "the gap lies in here", ha="center", va="top", fontsize=8, color=ORANGE)
    body = "mass" if drive != "displacement" else ""
    axes.add_patch(
        Rectangle((0.3, -0.6), 0.8 if body else 0.12, 1.2, facecolor=_BODY, edgecolor=_EDGE)
    )
    axes.text(0.7, 0.0, body, ha="center", va="center", fontsize=8)
    end = 1.1 if body else 0.42
    if drive in ("force", "displacement"):
        arrow = {"arrowstyle": "<->" if drive == "displacement" else "<-", "color": BLACK}
        axes.annotate("", (end, 0.0), (end + 0.75, 0.0), arrowprops=arrow)
        axes.text(end + 0.85, 0.0, f"{drive}\n(drive)", ha="left", va="center", fontsize=8)
    channel = campaign.channels[0]
    at = np.array([end - 0.1, 0.8])
    axes.text(
        at[0],
        at[1],
        f"sensor {_size_words(channel.name, sizes, unit)}",
        ha="center",
        va="bottom",
        fontsize=8,
    )
