"""What the simulator of an element takes of a measured law: a force, dry friction, parts.

Beyond a table f and g go on with the slope of its outermost twentieth; h keeps its end value, so
that damping does not turn into a drive. Beyond a surface a force goes on along q with the slope of
the outermost cell at the same speed, and along v with that at the same deflection, which is never
taken as negative. Dry friction is no function of the speed where the motion sticks, so that it
stands beside both; so do stops, branches and loops
(:mod:`carrierflex.simulation.element.memory_laws`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from carrierflex.simulation.element.kernels import element_values, no_law, restoring_force
from carrierflex.simulation.element.memory_laws import MemoryParts, memory_parts
from carrierflex.simulation.force_effect import ForceEffect
from carrierflex.simulation.force_laws import LAW_SIGNATURE, ForceLaw
from carrierflex.simulation.laws import (
    COUPLED_DAMPING,
    DISSIPATION,
    ELEMENT,
    HYSTERESIS,
    MEMORY,
    TABULATED,
    Branch,
    Friction,
    Law,
    LawTerm,
    Stop,
    Surface,
    Table,
    end_slopes,
)

Array = NDArray[np.float64]
_NO_VALUES = np.empty(0)
#: Speed of rest, over which no law but dry friction changes.
_AT_REST = 1e-12
#: Steps between the nodes of a table differ by rounding alone where they are even.
_EVEN = 1e-9


@dataclass(frozen=True, eq=False)
class ElementLaw:
    """A measured law of size one as the simulator takes it.

    Parameters
    ----------
    effect_class : str
        Class of the effect.
    force : ForceLaw or None
        Force of size one, which is its first parameter, without dry friction; None of a law without
        table.
    friction : tuple of float
        Dry friction at positive and at negative speed.
    memory : MemoryParts
        Stops, branches, loops and dry friction over the deflection.
    """

    effect_class: str
    force: ForceLaw | None
    friction: tuple[float, float]
    memory: MemoryParts

    def of_size(self, size: float) -> ForceLaw | None:
        """Force of another size; None of a law without table."""
        if self.force is None:
            return None
        parameters = self.force.parameters.copy()
        parameters[0] = size
        return replace(self.force, parameters=parameters)


def element_law(law: Law) -> ElementLaw:
    """What the simulator takes of a law.

    Parameters
    ----------
    law : Law
        Measured law of kind element.
    """
    forces = [
        *(_table_force(table, law.effect_class) for table in law.of(Table)),
        *(_surface_force(surface) for surface in law.of(Surface)),
    ]
    friction = [(one.plus, one.minus) for one in law.of(Friction) if not one.x.size]
    return ElementLaw(
        law.effect_class,
        forces[0] if forces else None,
        friction[0] if friction else (0.0, 0.0),
        memory_parts(law),
    )


def law_of_effect(
    effect: ForceEffect,
    effect_class: str,
    values: Mapping[str, float],
    visited: Array,
    units: tuple[str, str],
) -> Law | None:
    """An effect of the library with its fitted values as a law without name.

    Parameters
    ----------
    effect : ForceEffect
        Effect.
    effect_class : str
        Class in which it was named.
    values : mapping of str to float
        Its parameters by name, SI units.
    visited : ndarray, shape (n,)
        Deflections, of a dissipation speeds, that the records visit.
    units : tuple of str
        Units of force and deflection.

    Returns
    -------
    Law or None
        None of an effect that depends on the baseline, as backlash on its stiffness, and of one
        that is no force.
    """
    ends = {"deflection": (float(visited.min()), float(visited.max()))}
    if effect.id == "elasto_plastic_friction":
        stop = Stop(ELEMENT, values["Fy"] / values["Kp"], values["Fy"])
        return Law("", ELEMENT, HYSTERESIS, units, (stop,), ends)
    if effect.id == "maxwell_branch":
        branch = Branch(ELEMENT, values["tau"], values["k"])
        return Law("", ELEMENT, MEMORY, units, (branch,), ends)
    if effect_class not in TABULATED or effect.measurement or effect.id == "backlash":
        return None
    p = element_values(
        {slot: value for name, value in values.items() for slot in effect.values_of(name)}
    )

    def force(q: Array, v: Array) -> Array:
        at_rest = np.array([1.0, np.finfo(float).tiny])
        return restoring_force(q, v, 0.0 * q, p, at_rest, no_law, no_law, _NO_VALUES, _NO_VALUES)

    still = np.zeros(visited.size)
    if effect_class == DISSIPATION:
        y = force(still, visited)
        plus, minus = np.abs(force(np.zeros(2), np.array([1.0, -1.0]) * _AT_REST)).tolist()
        smooth = y - np.where(visited > 0.0, plus, 0.0) + np.where(visited < 0.0, minus, 0.0)
        friction = (Friction(ELEMENT, plus, minus),) if plus or minus else ()
        terms: tuple[LawTerm, ...] = (Table(ELEMENT, visited, smooth), *friction)
    else:
        is_damping = effect_class == COUPLED_DAMPING
        terms = (Table(ELEMENT, visited, force(visited, still + float(is_damping))),)
    return Law("", ELEMENT, effect_class, units, terms)


def _table_force(table: Table, effect_class: str) -> ForceLaw:
    """Force of a table of size one: f(q), g(v) or h(q) of h(q) v, by the class."""
    ends = (0.0, 0.0) if effect_class == COUPLED_DAMPING else end_slopes(table.x, table.y)
    parameters = np.concatenate([[1.0, *ends], table.x, table.y])
    return ForceLaw(_TABLE_FORCES.get(effect_class, _over_deflection), parameters)


def table_cells(law: ForceLaw) -> tuple[Array, bool] | None:
    """Cells of a table over the deflection with even nodes, and whether the speed multiplies it.

    Parameters
    ----------
    law : ForceLaw
        Law of any form, as :attr:`ElementLaw.force` or a user's.

    Returns
    -------
    tuple of ndarray, shape (3, n + 1), and bool, or None
        Node, value and slope of each cell of the law of size one, see
        :func:`carrierflex.simulation.element.kernels.motions_together`; None of any other law.
    """
    if law.force not in (_over_deflection, _times_speed):
        return None
    (lower, upper), (x, y) = law.parameters[1:3], law.parameters[3:].reshape(2, -1)
    steps = np.diff(x)
    if np.ptp(steps) > _EVEN * steps.max():
        return None
    slopes = [lower, *(np.diff(y) / steps), upper]
    cells = np.array([np.append(x[0], x), np.append(y[0], y), slopes])
    return cells, law.force is _times_speed


def _surface_force(surface: Surface) -> ForceLaw:
    """Force of a surface of size one."""
    x, v, y = surface.x, surface.v, surface.y
    return ForceLaw(_over_both, np.concatenate([[1.0, x.size], x, v, np.ravel(y)]))


@njit(cache=True, inline="always", error_model="numpy")
def _of_table(at: float, p: Array) -> float:
    """Size times the value of a table; `p` as :func:`_table_force` makes it."""
    n = (p.size - 3) // 2
    x, y = p[3 : 3 + n], p[3 + n :]
    if at <= x[0]:
        value = y[0] + p[1] * (at - x[0])
    elif at >= x[n - 1]:
        value = y[n - 1] + p[2] * (at - x[n - 1])
    else:
        k = np.searchsorted(x, at, side="right") - 1
        value = y[k] + (y[k + 1] - y[k]) * (at - x[k]) / (x[k + 1] - x[k])
    return float(p[0] * value)


@njit(LAW_SIGNATURE, cache=True, error_model="numpy")
def _over_deflection(deflection: float, speed: float, p: Array) -> float:
    return _of_table(deflection, p)


@njit(LAW_SIGNATURE, cache=True, error_model="numpy")
def _over_speed(deflection: float, speed: float, p: Array) -> float:
    return _of_table(speed, p)


@njit(LAW_SIGNATURE, cache=True, error_model="numpy")
def _times_speed(deflection: float, speed: float, p: Array) -> float:
    return _of_table(deflection, p) * speed


@njit(LAW_SIGNATURE, cache=True, error_model="numpy")
def _over_both(deflection: float, speed: float, p: Array) -> float:
    """Force of a surface; `p` as :func:`_surface_force` makes it."""
    n = int(p[1])
    n_v = (p.size - 2 - n) // (n + 1)
    x, v = p[2 : 2 + n], p[2 + n : 2 + n + n_v]
    y = p[2 + n + n_v :].reshape(n, n_v)
    q = min(max(deflection, x[0]), x[n - 1])
    w = min(max(speed, v[0]), v[n_v - 1])
    i = min(max(np.searchsorted(x, q, side="right") - 1, 0), n - 2)
    k = min(max(np.searchsorted(v, w, side="right") - 1, 0), n_v - 2)
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
    return float(p[0] * (value + beyond))


_TABLE_FORCES = {DISSIPATION: _over_speed, COUPLED_DAMPING: _times_speed}
