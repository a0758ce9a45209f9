"""Pictures in space with words on them: a rendered scene and where its points stand in it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from carrierflex.geometry.view import new_plotter, taken_with_pixels
from carrierflex.workflows.figures.sketching import Point

#: White margin that stays around a cropped picture [pixels].
_MARGIN = 12


@dataclass(frozen=True, eq=False)
class Scene:
    """A picture, cropped to what is on it, and the pixels (column, row) of named points."""

    image: NDArray[np.uint8]
    pixels: Mapping[str, Point]

    def show(self, axes: Axes, *, left: float = 0.0, right: float = 0.0, above: float = 0.0,
             below: float = 0.0) -> None:  # fmt: skip
        """Put the picture on axes, with room for words around it in shares of its size."""
        height, width, _ = self.image.shape
        axes.imshow(self.image)
        axes.set(
            xlim=(-left * width, (1.0 + right) * width),
            ylim=((1.0 + below) * height, -above * height),
        )
        axes.axis("off")

    def at(self, name: str, right: float = 0.0, down: float = 0.0) -> Point:
        """Pixel of a point, shifted by shares of the picture's width and height."""
        column, row = self.pixels[name]
        height, width, _ = self.image.shape
        return column + right * width, row + down * height


def rendered(
    add: Callable[[Any], None],
    points: Mapping[str, Sequence[float] | NDArray[np.float64]],
    viewpoint: Sequence[float],
    *,
    zoom: float = 1.0,
) -> Scene:
    """Render what `add` puts on a plotter, seen from a direction, and crop it.

    Parameters
    ----------
    add : callable
        Adds meshes, points and arrows to the plotter.
    points : mapping of str to array, shape (3,)
        Points [m] to find in the picture.
    viewpoint : sequence of float
        Direction from the scene to the viewer; z is up.
    zoom : float
        Size over that which fits.
    """
    plotter = new_plotter()
    plotter.enable_anti_aliasing("ssaa")
    add(plotter)
    image, pixels = taken_with_pixels(
        plotter,
        np.array([*points.values()], dtype=np.float64).reshape(-1, 3),
        viewpoint=viewpoint,
        window_centre=(0.0, 0.0),
        zoom=zoom,
    )
    drawn = image.min(axis=2) < 250
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    top, left = max(int(rows[0]) - _MARGIN, 0), max(int(columns[0]) - _MARGIN, 0)
    cropped = image[top : rows[-1] + _MARGIN, left : columns[-1] + _MARGIN]
    return Scene(
        cropped,
        {
            name: (float(pixel[0]) - left, float(pixel[1]) - top)
            for name, pixel in zip(points, pixels, strict=True)
        },
    )
