"""Law of one element as a surface f(q, v): a table, and dry friction that depends on deflection.

Between its points the table is bilinear. Beyond them a force goes on along q with the slope of the
outermost cell at the same speed, and along v with that at the same deflection, which is never
taken as negative, so that damping does not turn into a drive. Dry friction is no function of the
speed where the motion sticks: its level over the deflection stands beside the table, and so do
stops, over which friction turns (:mod:`carrierflex.simulation.element.memory_laws`).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.element.memory_laws import NO_PARTS, MemoryLaw

if TYPE_CHECKING:
    from carrierflex.simulation.force_laws import Force

Array = NDArray[np.float64]

FORCE_SURFACE = "force_surface"


@dataclass(frozen=True, eq=False)
class SurfaceLaw:
    """A measured surface.

    Parameters
    ----------
    name : str
        Id of the effect.
    x, v : ndarray, shape (n,), (m,)
        Deflection and speed, increasing; their ends are those of the visited range.
    y : ndarray, shape (n, m)
        Force without dry friction.
    friction : ndarray, shape (n,)
        Dry friction at x, at least zero; linear between the points and constant beyond.
    stops : ndarray, shape (n_stops, 11)
        Rows by :class:`carrierflex.simulation.element.memory_laws.StopPlaces`.
    units : tuple of str
        Units of force and deflection; time is in seconds.
    measured_on : str
        Campaign whose records gave it; empty where unknown.
    """

    name: str
    x: Array
    v: Array
    y: Array
    friction: Array
    stops: Array
    units: tuple[str, str]
    measured_on: str = ""

    @property
    def effect_class(self) -> str:
        """Class of the effect."""
        return FORCE_SURFACE

    @property
    def beside_table(self) -> MemoryLaw:
        """Dry friction and stops alone."""
        levels = np.column_stack([self.x, self.friction])
        return MemoryLaw(
            self.name,
            FORCE_SURFACE,
            self.stops,
            NO_PARTS.branches,
            self.units,
            (float(self.x[0]), float(self.x[-1])),
            levels=levels if self.friction.any() else NO_PARTS.levels,
        )


def surface_force(law: SurfaceLaw) -> "Force":
    """Force of a table as a plain function that numba can compile; dry friction is not in it.

    Parameters
    ----------
    law : SurfaceLaw
        Surface.

    Returns
    -------
    callable
        ``(deflection, speed, (size,)) -> force``.
    """
    x, v, y = (np.ascontiguousarray(own) for own in (law.x, law.v, law.y))
    last_x, last_v = x.size - 2, v.size - 2

    def force(deflection: float, speed: float, parameters: Array) -> float:
        q = min(max(deflection, x[0]), x[last_x + 1])
        w = min(max(speed, v[0]), v[last_v + 1])
        i = min(max(np.searchsorted(x, q, side="right") - 1, 0), last_x)
        k = min(max(np.searchsorted(v, w, side="right") - 1, 0), last_v)
        width = x[i + 1] - x[i]
        height = v[k + 1] - v[k]
        s = (q - x[i]) / width
        t = (w - v[k]) / height
        lower = y[i, k] + s * (y[i + 1, k] - y[i, k])
        upper = y[i, k + 1] + s * (y[i + 1, k + 1] - y[i, k + 1])
        along_v = (upper - lower) / height
        left = y[i, k] + t * (y[i, k + 1] - y[i, k])
        right = y[i + 1, k] + t * (y[i + 1, k + 1] - y[i + 1, k])
        along_x = (right - left) / width
        value = lower + t * (upper - lower)
        beyond = along_x * (deflection - q) + max(along_v, 0.0) * (speed - w)
        return float(parameters[0] * (value + beyond))

    return force
