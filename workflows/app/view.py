"""Drawings as SVG, in millimetres: carrier or housing with its sensors, and the carrier's section.

Seen downwind, as in docs/glossary.md: z up, y to the left, angles clockwise from z.
"""

import math
from collections.abc import Iterable
from html import escape
from typing import NamedTuple

from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.pins import pin_angles
from carrierflex.simulation.mounting.rig import MountingRig

_MM = 1e3


class DrawnSensor(NamedTuple):
    """A channel whose sensor can be dragged."""

    number: int
    """Of the channel in the map."""
    name: str
    position: float | str | None
    """Angle [deg] at a rim, position on a housing; None where it is not known."""
    quantity: str


def face(carrier: CarrierParameters, sensors: Iterable[DrawnSensor] = ()) -> str:
    """Upwind face with pins; sensors of the axial plane at its rim, of the radial plane outside."""
    rim = _MM * carrier.outer_radius
    shapes = [
        _circle((0.0, 0.0), rim, "steel"),
        _circle((0.0, 0.0), _MM * carrier.sensor_radius, "dashed"),
        _circle((0.0, 0.0), _MM * carrier.hub_outer_diameter / 2.0, "edge"),
        _circle((0.0, 0.0), _MM * carrier.hub_inner_diameter / 2.0, "hole"),
    ]
    for number, turn in enumerate(pin_angles(carrier.n_planets), start=1):
        at = _at(_MM * carrier.centre_distance, math.degrees(turn))
        shapes += [
            _circle(at, _MM * carrier.planet_clearance_radius, "faint"),
            _circle(at, _MM * carrier.pin_hole_radius, "hole"),
            _text(at, f"pin {number}"),
        ]
    for angle, name in ((0.0, "z, 0°"), (90.0, "-y, 90°"), (180.0, "180°"), (270.0, "y, 270°")):
        shapes.append(_text(_at(1.36 * rim, angle), name, "axis"))
    shapes += [_rim_sensor(sensor, rim, _MM * carrier.sensor_radius) for sensor in sensors]
    reach = 1.52 * rim
    return _drawing(shapes, (-reach, -reach, 2.0 * reach, 2.0 * reach), "seen downwind")


def _rim_sensor(sensor: DrawnSensor, rim: float, radius: float) -> str:
    """Sensor at its angle: drawn at 0 deg and turned, as the script of the page turns it."""
    known = isinstance(sensor.position, float)
    angle = sensor.position if isinstance(sensor.position, float) else 0.0
    is_radial = sensor.quantity.startswith("radial")
    shape = f'<circle cy="{-radius:g}" r="24"/>'
    if is_radial:
        shape = f'<path d="M0 {-rim - 4:g} l-20 -48 h40 z"/>'
    y = -1.19 * rim
    kind = f"sensor{' radial' if is_radial else ''}{'' if known else ' open'}"
    return (
        f'<g class="{kind}" data-number="{sensor.number}" data-name="{escape(sensor.name)}" '
        f'transform="rotate({angle:g})">{shape}<text y="{y:g}" '
        f'transform="rotate({-angle:g} 0 {y:g})">{escape(sensor.name)} '
        f"{f'{angle:g}°' if known else '?'}</text></g>"
    )


def housing(sensors: Iterable[DrawnSensor]) -> str:
    """Housing with the places of its six sensors (2011 paper, figure 5), drawn apart, not to scale.

    Channels are dragged from place to place; those without one wait below.
    """
    rig = MountingRig()
    positions = {
        "ssx": (rig.R_z, rig.R_y, "x"), "spx": (-rig.R_z, rig.R_y, "x"),
        "ssz": (rig.R_x, -2.0 * rig.R_y, "z"), "spz": (-rig.R_x, -2.0 * rig.R_y, "z"),
        "spy": (-rig.R_x / 2.0, 0.0, "y"), "sbx": (0.0, -rig.R_b, "x"),
    }  # fmt: skip
    shapes = ['<rect class="steel" x="-700" y="-620" width="1400" height="1240" rx="260"/>']
    for name, (y, z, direction) in positions.items():
        at = (-_MM * y, -_MM * z)
        circle = _circle(at, 66.0, "place").replace("<circle", f'<circle data-place="{name}"')
        shapes += [circle, _text((at[0], at[1] + 105.0), f"{name}, along {direction}", "axis")]
    n_waiting = 0
    for sensor in sensors:
        y, z, direction = positions.get(str(sensor.position), (0.75 - 0.5 * n_waiting, -0.92, ""))
        n_waiting += not direction
        shapes.append(
            f'<g class="sensor housing{"" if direction else " open"}" '
            f'data-number="{sensor.number}" transform="translate({-_MM * y:g} {-_MM * z:g})">'
            f'<circle r="46"/><text y="-74">{escape(sensor.name)}</text></g>'
        )
    return _drawing(shapes, (-1000.0, -800.0, 2000.0, 1780.0), "housing, seen downwind")


def section(c: CarrierParameters) -> str:
    """Half section through a pin: x downwind to the right, the axis below."""
    hub, seat = c.hub_inner_diameter / 2.0, c.seat_inner_diameter / 2.0
    a = c.upwind_plate_thickness
    second, total = a + c.plate_gap, c.length_between_faces
    pin = c.centre_distance - c.pin_hole_radius
    boxes = (
        (0.0, hub, a, c.outer_radius, "steel"),
        (second, seat, total, c.outer_radius, "steel"),
        (-c.hub_length, hub, 0.0, c.hub_outer_diameter / 2.0, "steel"),
        (total, seat, total + c.seat_length, c.seat_outer_diameter / 2.0, "steel"),
        (a, c.web_inner_radius, second, c.outer_radius, "faint"),
        (0.0, pin, a, pin + c.pin_hole_diameter, "hole"),
        (second, pin, total, pin + c.pin_hole_diameter, "hole"),
    )
    shapes = [
        f'<rect class="{kind}" x="{_MM * x:.4g}" y="{-_MM * top:.4g}" '
        f'width="{_MM * (end - x):.4g}" height="{_MM * (top - low):.4g}"/>'
        for x, low, end, top, kind in boxes
    ]
    begin, end = _MM * (-c.hub_length - 0.04), _MM * (total + c.seat_length + 0.04)
    height = _MM * (c.outer_radius + 0.06)
    shapes.append(f'<path class="dashed" d="M{begin:.4g} 0 H{end:.4g}"/>')
    box = (begin, -height, end - begin, height + 30.0)
    return _drawing(shapes, box, "section through a pin, upwind to the left; webs light")


def _drawing(shapes: Iterable[str], box: tuple[float, ...], caption: str) -> str:
    frame = " ".join(f"{number:.5g}" for number in box)
    return (
        f'<figure><svg class="drawing" viewBox="{frame}" role="img" aria-label="{caption}">'
        f"{''.join(shapes)}</svg><figcaption>{caption}</figcaption></figure>"
    )


def _at(radius: float, angle_deg: float) -> tuple[float, float]:
    """Point of the drawing at an angle clockwise from the top."""
    turn = math.radians(angle_deg)
    return radius * math.sin(turn), -radius * math.cos(turn)


def _circle(at: tuple[float, float], radius: float, kind: str) -> str:
    return f'<circle class="{kind}" cx="{at[0]:.5g}" cy="{at[1]:.5g}" r="{radius:.5g}"/>'


def _text(at: tuple[float, float], text: str, kind: str = "words") -> str:
    return f'<text class="{kind}" x="{at[0]:.5g}" y="{at[1]:.5g}">{text}</text>'
