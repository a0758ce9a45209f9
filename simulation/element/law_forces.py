"""What the simulator of an element takes of a measured law: a force, dry friction, parts.

Beyond a table f and g go on with the slope of its outermost twentieth; h keeps its end value, so
that damping does not turn into a drive. Beyond a surface a force goes on along q with the slope of
the outermost cell at the same speed, and along v with that at the same deflection, which is never
taken as negative. Dry friction is no function of the speed where the motion sticks, so that it
stands beside both; so do stops, branches and loops
(:mod:`carrierflex.simulation.element.memory_laws`).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.element.memory_laws import MemoryParts, memory_parts
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    Friction,
    Law,
    Surface,
    Table,
    end_slopes,
)

if TYPE_CHECKING:
    from carrierflex.simulation.force_laws import Force

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ElementLaw:
    """A measured law of size one as the simulator takes it.

    Parameters
    ----------
    effect_class : str
        Class of the effect.
    force : callable or None
        ``(deflection, speed, (size,)) -> force`` that numba can compile, without dry friction;
        None of a law without table.
    friction : tuple of float
        Dry friction at positive and at negative speed.
    parts : MemoryParts
        Stops, branches, loops and dry friction over the deflection.
    """

    effect_class: str
    force: "Force | None"
    friction: tuple[float, float]
    parts: MemoryParts


def element_law(law: Law) -> ElementLaw:
    """What the simulator takes of a law.

    Parameters
    ----------
    law : Law
        Measured law of kind element.
    """
    forces = [
        *(table_force(table, law.effect_class) for table in law.of(Table)),
        *(surface_force(surface) for surface in law.of(Surface)),
    ]
    friction = [(one.plus, one.minus) for one in law.of(Friction) if not one.x.size]
    return ElementLaw(
        law.effect_class,
        forces[0] if forces else None,
        friction[0] if friction else (0.0, 0.0),
        memory_parts(law),
    )


def table_force(table: Table, effect_class: str) -> "Force":
    """Force of a table as a plain function that numba can compile.

    Parameters
    ----------
    table : Table
        Points.
    effect_class : str
        Whether they are f(q), g(v) or h(q) of h(q) v.

    Returns
    -------
    callable
        ``(deflection, speed, (size,)) -> force``.
    """
    x, y = np.ascontiguousarray(table.x), np.ascontiguousarray(table.y)
    along_speed, times_speed = effect_class == DISSIPATION, effect_class == COUPLED_DAMPING
    low, high = (0.0, 0.0) if times_speed else end_slopes(x, y)
    last = x.size - 1

    def force(deflection: float, speed: float, parameters: Array) -> float:
        at = speed if along_speed else deflection
        if at <= x[0]:
            value = y[0] + low * (at - x[0])
        elif at >= x[last]:
            value = y[last] + high * (at - x[last])
        else:
            k = np.searchsorted(x, at, side="right") - 1
            value = y[k] + (y[k + 1] - y[k]) * (at - x[k]) / (x[k + 1] - x[k])
        return float(parameters[0] * value * (speed if times_speed else 1.0))

    return force


def surface_force(surface: Surface) -> "Force":
    """Force of a surface as a plain function that numba can compile.

    Parameters
    ----------
    surface : Surface
        Points.

    Returns
    -------
    callable
        ``(deflection, speed, (size,)) -> force``.
    """
    x, v, y = (np.ascontiguousarray(values) for values in (surface.x, surface.v, surface.y))
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
        lower_v = y[i, k] + t * (y[i, k + 1] - y[i, k])
        upper_v = y[i + 1, k] + t * (y[i + 1, k + 1] - y[i + 1, k])
        along_x = (upper_v - lower_v) / width
        value = lower + t * (upper - lower)
        beyond = along_x * (deflection - q) + max(along_v, 0.0) * (speed - w)
        return float(parameters[0] * (value + beyond))

    return force
