"""What a page in space shows: bodies that move between states, and what stands around them.

A scene has entries (a mode, a load, a run's sensor) of which one is shown. In each entry a control
runs through stops; every shape and colour is linear between two stops. So the viewer needs the
stops alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.pins import pin_angles

#: Circle of the pins and radius of a pin, over the radius of the sensors' circle: the default
#: carrier's.
_PIN_CIRCLE, _PIN = 0.75, 0.13
_GREY = "#8a939c"
FloatArray = NDArray[np.float64]
#: Colour of what has no name.
UNNAMED_COLOUR = "#c9ced4"


@dataclass(frozen=True)
class Control:
    """What the slider runs through.

    Name, unit, position in the beginning, and the stops [unit] between which all is linear.
    """

    name: str
    unit: str
    start: float
    stops: tuple[float, ...]


@dataclass(frozen=True)
class Entry:
    """One state of the scene that can be chosen: its name, its words, its colours.

    Words say how large it is drawn; `legend` is the quantity and unit of the colours, which run
    from -limit to limit. A legend without a limit means the colours of the surfaces.
    """

    name: str
    words: str
    legend: str = ""
    limit: float = 0.0


@dataclass(frozen=True, eq=False)
class SceneObject:
    """Triangles or lines that move and change their colour."""

    name: Annotated[str, "Label of its switch, where it has a colour of its own"]
    cells: Annotated[NDArray[np.int64], "Triangles or lines, shape (k, 3) or (k, 2)"]
    rest: Annotated[FloatArray, "Points at rest [m], shape (n, 3)"]
    moved: Annotated[
        FloatArray,
        "What every entry adds to them at full deflection [m], magnified as it is drawn, shape "
        "(n_entries, n, 3)",
    ]
    values: Annotated[
        FloatArray | None,
        "Colour at full deflection, in shares of the entry's limit; of a single colour without, "
        "shape (n_entries, n)",
    ] = None
    colour: Annotated[str, "Colour without values, and in entries without a legend"] = (
        UNNAMED_COLOUR
    )
    follows: Annotated[
        bool,
        "Whether shape and colour are those of full deflection times the control, as in a "
        "vibration; else they are those of full deflection at all its stops",
    ] = True
    turns: Annotated[bool, "Whether it is turned about x by the control [deg]"] = False
    width: Annotated[float, "Of lines [m]; 0: one pixel"] = 0.0


@dataclass(frozen=True)
class Label:
    """Words at a point [m]; they may turn with the control."""

    text: str
    point: tuple[float, float, float]
    turns: bool = False


@dataclass(frozen=True, eq=False)
class Scene:
    """All of a page."""

    title: Annotated[str, "Heading"]
    words: Annotated[str, "What it is and where it comes from, one sentence"]
    control: Annotated[Control, "The slider"]
    entries: Annotated[tuple[Entry, ...], "What can be chosen; the first is shown first"]
    objects: Annotated[tuple[SceneObject, ...], "What is drawn"]
    labels: Annotated[tuple[Label, ...], "Words in space"] = field(default=())
    first: Annotated[int, "Entry that is shown in the beginning"] = 0
    eye: Annotated[
        tuple[float, float, float],
        "From the middle of the scene to the viewer; by default upwind, above and to the side, "
        "as in the still pictures",
    ] = (-1.5, 0.85, 0.75)

    @cached_property
    def size(self) -> float:
        """Largest extent of what is drawn at rest [m]."""
        points = np.concatenate([item.rest for item in self.objects])
        return float(np.ptp(points, axis=0).max())

    def with_entries(self, n: int) -> "Scene":
        """The scene with its first `n` entries."""
        objects = tuple(
            replace(
                item,
                moved=item.moved[:n],
                values=None if item.values is None else item.values[:n],
            )
            for item in self.objects
        )
        return replace(
            self, entries=self.entries[:n], objects=objects, first=min(self.first, n - 1)
        )


def feature_edges(
    points: FloatArray, triangles: NDArray[np.int64], marks: Sequence[int] | NDArray[np.int64]
) -> NDArray[np.int64]:
    """Edges at which a surface bends by more than 30 degrees or its mark changes, shape (k, 2).

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Points [m].
    triangles : ndarray of int, shape (m, 3)
        Triangles of a closed surface.
    marks : sequence of int, shape (m,)
        Surface that each belongs to.
    """
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    first, second = owner[:-1][same], owner[1:][same]
    marks = np.asarray(marks)
    bends = np.einsum("ij,ij->i", normals[first], normals[second]) < np.cos(np.deg2rad(30.0))
    return np.asarray(edges[:-1][same][bends | (marks[first] != marks[second])])


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
