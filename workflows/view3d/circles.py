"""Circles, bands and pins around the axis, drawn in the carrier's frame."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.pins import pin_angles
from carrierflex.workflows.view3d.scene import FloatArray, Label, SceneObject

#: Circle of the pins and radius of a pin, over the radius of the sensors' circle: the default
#: carrier's.
_PIN_CIRCLE, _PIN = 0.75, 0.13
_GREY = "#8a939c"


def directions(angle: FloatArray) -> FloatArray:
    """Unit vectors away from the axis, ``e = (0, -sin v, cos v)``, shape (n, 3)."""
    return np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle)], axis=-1)


def closed(n: int) -> NDArray[np.int64]:
    """Lines that close a row of `n` points, shape (n, 2)."""
    first = np.arange(n)
    return np.stack([first, (first + 1) % n], axis=1)


def band(n: int) -> NDArray[np.int64]:
    """Triangles between two closed rows of `n` points, the second after the first."""
    first, second = closed(n).T
    return np.concatenate(
        [
            np.stack([first, second, first + n], axis=1),
            np.stack([second, second + n, first + n], axis=1),
        ]
    )


def circle(radius: float, n_entries: int, *, turns: bool = False) -> SceneObject:
    """Circle at rest around the axis [m]."""
    around = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    points = radius * directions(around)
    still = np.zeros((n_entries, *points.shape))
    return SceneObject("", closed(180), points, still, colour=_GREY, turns=turns)


def pins(
    radius: float, n_planets: int, n_entries: int, *, turns: bool = False
) -> Iterator[SceneObject]:
    """Circles of the pins inside the sensors' circle of a radius [m]."""
    around = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    for angle in pin_angles(n_planets):
        points = radius * (_PIN_CIRCLE * directions(np.array(angle)) + _PIN * directions(around))
        still = np.zeros((n_entries, *points.shape))
        yield SceneObject("", closed(48), points, still, colour=_GREY, turns=turns)


def pin_labels(radius: float, n_planets: int, *, turns: bool = False) -> Iterator[Label]:
    """Names of the pins."""
    for number, angle in enumerate(pin_angles(n_planets), start=1):
        x, y, z = _PIN_CIRCLE * radius * directions(np.array(angle))
        yield Label(f"pin {number}", (float(x), float(y), float(z)), turns)
