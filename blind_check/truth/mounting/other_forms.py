"""Causes of the mounting in forms that no law of a diagnosis has, with their classes.

Which bushing, which sensor, or what of a map it is, is not judged.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.mounting.form_laws import (
    AMOUNT,
    CHANGE,
    DEFLECTION,
    FAR_DAMPING,
    FIRST,
    HYPERBOLIC,
    LOOP,
    N_PARAMETERS,
    N_WAVES,
    NUMBER,
    ONE_SIDED,
    PLANE_LOOP,
    POWER_DAMPING,
    ROOT_DAMPING,
    RUBBER,
    SECOND,
    SHARES,
    SOFTENING,
    SPEED,
    TWO_STOPS,
    WARMING,
    WAVES,
)
from carrierflex.blind_check.truth.mounting.rig import RIG, SENSORS
from carrierflex.blind_check.truth.mounting.state import MountingState

FloatArray = NDArray[np.float64]

#: Force over that of the linear spring at the largest deflection; RMS of the change of form.
_SHARE, _CHANGE = (0.06, 0.3), (0.05, 0.3)
#: How often both bushings have different shares of a force, and by how much.
_UNEQUAL, _EXCESS = 0.4, (0.4, 1.0)

_FORCE, _DISSIPATION = "bushings/restoring_force", "bushings/dissipation"
_HYSTERESIS, _MEMORY = "bushings/hysteresis", "bushings/memory"
_COUPLED, _CHANGE_IN_TIME = "bushings/coupled_damping", "bushings/time_variation"
_STIFFNESS = "housing/stiffness"
_LOADS = "loads/map"
_GAIN = "sensors/gain"
_ZERO, _DELAY = "sensors/zero", "clock/delay"

#: Class ids of the contract of what has another name there.
_IDS = {
    _CHANGE_IN_TIME: "time_variation",
    _STIFFNESS: "stiffness_map",
    _LOADS: "input_map",
    _GAIN: "sensor_map",
    _ZERO: "sensor_map",
    _DELAY: "sensor_map",
}
#: Classes of the library's laws, from their equations.
CLASSES_OF_LAW: Mapping[str, tuple[str, ...]] = {
    "cubic_stiffness": (_FORCE,),
    "quintic_stiffness": (_FORCE,),
    "deflection_dependent_damping": (_COUPLED,),
    "fluid_branch": (_MEMORY,),
    "elasto_plastic_friction": (_HYSTERESIS,),
    "parasitic_torque": (_IDS[_LOADS],),
    "ntl_direction": (_IDS[_LOADS],),
    "axial_bushing_stiffness": (_IDS[_STIFFNESS],),
    "main_bearing_compliance": (_IDS[_STIFFNESS],),
    "unequal_bushings": (_IDS[_STIFFNESS],),
    "sensor_gain": (_IDS[_GAIN],),
    "sensor_zero": (_IDS[_ZERO],),
    "sensor_delay": (_IDS[_DELAY],),
}
#: Static matrices between three loads and six signals: slow loads leave the same signals of each.
STATIC_MAPS = tuple(_IDS[name] for name in (_STIFFNESS, _LOADS, _GAIN))

_Change = Callable[
    [MountingState, np.random.Generator, FloatArray, float], tuple[MountingState, float]
]


@dataclass(frozen=True)
class MountingForm:
    """One cause.

    Parameters
    ----------
    shape : str
        What it is; pairs are of two of these.
    change : callable
        State with the cause from state, random numbers, size of the motion and share of the drawn
        size, and its change of form.
    """

    shape: str
    change: _Change

    @property
    def class_id(self) -> str:
        """Class of the contract."""
        return _IDS.get(self.shape, self.shape)


def form_aliases(classes: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    """Sets that slow loads may not tell from the truth's: one static map for another."""
    aliases = set()
    for index, name in enumerate(classes):
        for other in STATIC_MAPS if name in STATIC_MAPS else ():
            changed = (*classes[:index], other, *classes[index + 1 :])
            aliases.add(tuple(sorted(set(changed))))
    return tuple(sorted(aliases - {classes}))


def _bushing(
    number: int, first: tuple[float, float], second: tuple[float, float] = (0.0, 0.0)
) -> _Change:
    """A form in the bushings, in both alike or not."""

    def change(
        state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
    ) -> tuple[MountingState, float]:
        """State with one more form."""
        p = np.zeros(N_PARAMETERS)
        p[NUMBER] = number
        p[FIRST], p[SECOND] = rng.uniform(*first), rng.uniform(*second)
        p[DEFLECTION], p[SPEED] = size
        excess = rng.choice((-1.0, 1.0)) * rng.uniform(*_EXCESS)
        is_unequal = rng.uniform() < _UNEQUAL
        p[SHARES : SHARES + 2] = [1.0 + excess, 1.0 - excess] if is_unequal else 1.0
        p[CHANGE] = rng.uniform(*_CHANGE)
        waves = rng.standard_normal(N_WAVES)
        p[WAVES : WAVES + N_WAVES] = waves * np.sqrt(2.0 / np.sum(waves**2))
        p[WAVES + N_WAVES :] = rng.uniform(0.0, 2.0 * np.pi, N_WAVES)
        force = _SHARE[0] * (_SHARE[1] / _SHARE[0]) ** rng.uniform()
        p[AMOUNT] = share * force * state.bushings.K1 * _unit(p, size)
        bushings = replace(state.bushings, forms=(*state.bushings.forms, p))
        return replace(state, bushings=bushings), float(p[CHANGE])

    return change


def _unit(p: FloatArray, size: FloatArray) -> float:
    """Factor at which a form has a linear spring's force at the largest deflection, or speed."""
    form = int(p[NUMBER])
    if form == TWO_STOPS:
        return float(1.0 / (1.0 - p[FIRST] + 0.35 * p[SECOND]))
    if form == ONE_SIDED:
        return float(1.0 / (1.0 - p[FIRST]))
    if form == HYPERBOLIC:
        return float(1.0 / (p[FIRST] * np.sinh(1.0 / p[FIRST]) - 1.0))
    if form in (LOOP, PLANE_LOOP):
        return float(0.5 / p[FIRST])
    if form in (POWER_DAMPING, FAR_DAMPING, ROOT_DAMPING):
        return float(size[0] / size[1])
    return 2.0


def _axial(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """Axial stiffness and damping of the bushings."""
    stiffer = 1.0 + share * rng.uniform(4.0, 14.0)
    damped = 1.0 + share * (rng.uniform(0.5, 3.0) - 1.0)
    bushings = replace(
        state.bushings,
        k_x=RIG["bushing_axial_stiffness"] * stiffer,
        c_x=RIG["bushing_axial_damping"] * damped,
    )
    return replace(state, bushings=bushings), 0.0


def _bearing(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """Bearing that gives way."""
    compliance = share * 2e-10 * 10.0 ** rng.uniform()
    return replace(state, bushings=replace(state.bushings, compliance=compliance)), 0.0


def _excess(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """One bushing stiffer than the other."""
    excess = share * rng.choice((-1.0, 1.0)) * rng.uniform(0.05, 0.25)
    return replace(state, bushings=replace(state.bushings, excess=float(excess))), 0.0


def _turned(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """Radial load in another direction, with a torque of its own."""
    sign = rng.choice((-1.0, 1.0))
    turned = replace(state, turned=float(share * sign * rng.uniform(0.03, 0.2)))
    return replace(turned, P_T=float(share * rng.uniform(-0.03, 0.03))), 0.0


def _lever(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """Radial load off the axis."""
    arm = share * rng.choice((-1.0, 1.0)) * rng.uniform(0.02, 0.12)
    return replace(state, P_T=float(arm)), 0.0


def _gains(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """One or two sensors too large or too small."""
    gain = state.gain.copy()
    for index in rng.choice(len(SENSORS), int(rng.integers(1, 3)), replace=False):
        gain[index] += share * rng.choice((-1.0, 1.0)) * rng.uniform(0.05, 0.2)
    return replace(state, gain=gain), 0.0


def _zeros(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """One or two sensors off from the beginning."""
    zero = state.zero.copy()
    for index in rng.choice(len(SENSORS), int(rng.integers(1, 3)), replace=False):
        zero[index] += share * rng.choice((-1.0, 1.0)) * rng.uniform(1e-4, 3e-4)
    return replace(state, zero=zero), 0.0


def _late(
    state: MountingState, rng: np.random.Generator, size: FloatArray, share: float
) -> tuple[MountingState, float]:
    """All sensors late."""
    return replace(state, delay=float(share * rng.uniform(0.02, 0.15))), 0.0


MOUNTING_FORMS: dict[str, MountingForm] = {
    "two_stops": MountingForm(_FORCE, _bushing(TWO_STOPS, (0.2, 0.45), (0.0, 3.0))),
    "one_sided_stop": MountingForm(_FORCE, _bushing(ONE_SIDED, (0.1, 0.4))),
    "softening_rubber": MountingForm(_FORCE, _bushing(SOFTENING, (0.2, 0.7))),
    "hyperbolic_bushing": MountingForm(_FORCE, _bushing(HYPERBOLIC, (0.25, 0.6))),
    "smooth_loop": MountingForm(_HYSTERESIS, _bushing(LOOP, (0.08, 0.35), (0.8, 3.0))),
    "plane_loop": MountingForm(_HYSTERESIS, _bushing(PLANE_LOOP, (0.08, 0.35))),
    "rubber": MountingForm(_MEMORY, _bushing(RUBBER, (0.01, 0.06), (0.1, 0.5))),
    "power_damping": MountingForm(_DISSIPATION, _bushing(POWER_DAMPING, (1.7, 2.6))),
    "far_damping": MountingForm(_COUPLED, _bushing(FAR_DAMPING, (0.3, 0.8))),
    "root_damping": MountingForm(_COUPLED, _bushing(ROOT_DAMPING, (0.7, 2.5))),
    "warming": MountingForm(_CHANGE_IN_TIME, _bushing(WARMING, (10.0, 50.0))),
    "stiff_axis": MountingForm(_STIFFNESS, _axial),
    "soft_bearing": MountingForm(_STIFFNESS, _bearing),
    "uneven_bushings": MountingForm(_STIFFNESS, _excess),
    "turned_load": MountingForm(_LOADS, _turned),
    "load_lever": MountingForm(_LOADS, _lever),
    "wrong_gains": MountingForm(_GAIN, _gains),
    "wrong_zeros": MountingForm(_ZERO, _zeros),
    "late_signals": MountingForm(_DELAY, _late),
}


def with_form(
    state: MountingState,
    name: str,
    rng: np.random.Generator,
    size: FloatArray,
    share: float = 1.0,
) -> tuple[MountingState, float]:
    """State with one more cause, and its change of form.

    Parameters
    ----------
    state : MountingState
        State so far.
    name : str
        Cause.
    rng : Generator
        Random numbers.
    size : ndarray, shape (2,)
        Largest radial deflection [m] and its speed [m/s] without the cause.
    share : float
        Share of the size that is drawn.
    """
    return MOUNTING_FORMS[name].change(state, rng, size, share)
