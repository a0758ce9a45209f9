"""Laws of one element as tables: f(q), g(v) with dry friction, h(q) v, linear between points.

Beyond the table f and g go on with the slope of its outermost twentieth; h keeps its end value, so
that damping does not turn into a drive.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from carrierflex.simulation.force_laws import Force

Array = NDArray[np.float64]

RESTORING_FORCE = "restoring_force"
DISSIPATION = "dissipation"
COUPLED_DAMPING = "coupled_damping"
#: What a table holds: force over deflection, force over speed, damping over deflection.
TABULATED = (RESTORING_FORCE, DISSIPATION, COUPLED_DAMPING)
#: Share of the range whose chord is the slope beyond the table.
_END_SHARE = 0.05


@dataclass(frozen=True, eq=False)
class TabulatedLaw:
    """One measured shape.

    Parameters
    ----------
    name : str
        Id of the effect.
    effect_class : str
        One of :data:`TABULATED`.
    x : ndarray, shape (n,)
        Deflection (of dissipation: speed), increasing; its ends are those of the visited range.
    y : ndarray, shape (n,)
        Force, or damping (of coupled damping).
    units : tuple of str
        Units of force and deflection; time is in seconds.
    friction : tuple of float
        Dry friction at positive and at negative speed, beside y.
    measured_on : str
        Campaign whose records gave it; empty where unknown.
    """

    name: str
    effect_class: str
    x: Array
    y: Array
    units: tuple[str, str]
    friction: tuple[float, float] = (0.0, 0.0)
    measured_on: str = ""

    @property
    def along_speed(self) -> bool:
        """Whether x is a speed."""
        return self.effect_class == DISSIPATION

    @property
    def x_unit(self) -> str:
        """Unit of x."""
        return f"{self.units[1]}/s" if self.along_speed else self.units[1]

    @property
    def y_unit(self) -> str:
        """Unit of y."""
        force, length = self.units
        return f"{force} s/{length}" if self.effect_class == COUPLED_DAMPING else force

    def end_slopes(self) -> tuple[float, float]:
        """Slopes of y below and above the table."""
        return (0.0, 0.0) if self.effect_class == COUPLED_DAMPING else end_slopes(self.x, self.y)


def end_slopes(x: Array, y: Array) -> tuple[float, float]:
    """Slopes of the outermost twentieth of a table at its lower and its upper end."""
    step = _END_SHARE * (x[-1] - x[0])
    low = min(max(int(np.searchsorted(x, x[0] + step)), 1), x.size - 1)
    high = max(min(int(np.searchsorted(x, x[-1] - step, side="right")) - 1, x.size - 2), 0)
    return (
        float((y[low] - y[0]) / (x[low] - x[0])),
        float((y[-1] - y[high]) / (x[-1] - x[high])),
    )


def tabulated_force(law: TabulatedLaw) -> "Force":
    """Force of a table as a plain function that numba can compile; dry friction is not in it.

    Parameters
    ----------
    law : TabulatedLaw
        Table.

    Returns
    -------
    callable
        ``(deflection, speed, (size,)) -> force``.
    """
    x, y = np.ascontiguousarray(law.x), np.ascontiguousarray(law.y)
    low, high = law.end_slopes()
    along_speed, times_speed = law.along_speed, law.effect_class == COUPLED_DAMPING
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
