"""The true state of a mounting rig.

Bushings, loads and sensors with the withheld effects in them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from carrierflex.blind_check.truth.mounting.loads import RATE, MountingRecord
from carrierflex.blind_check.truth.mounting.refit import zeroed
from carrierflex.blind_check.truth.mounting.rig import RIG, SENSORS, Bodies
from carrierflex.blind_check.truth.mounting.time_integration import (
    FINE,
    LAWS,
    LEAVES,
    Bushings,
    housing_motion,
)

FloatArray = NDArray[np.float64]

_LAWS = {**LAWS, **LEAVES, "fluid_branch": LAWS["maxwell_branch"]}
#: Force of a withheld law over that of the linear spring, at the largest deflection.
_SHARE = (0.05, 0.25)


def _none() -> FloatArray:
    return np.zeros(len(SENSORS))


@dataclass(frozen=True, eq=False)
class MountingState:
    """What acts and what reads.

    Parameters
    ----------
    bushings : Bushings
        Bushings and main bearing.
    P_T : float
        Torque by vertical radial load [m].
    turned : float
        Angle of the radial load [rad].
    gain, zero : ndarray, shape (6,)
        Gain errors, offsets [m] of the sensors.
    delay : float
        Delay of all sensors [s].
    outside : tuple of (str, float)
        A cause of no library that shows beside the motion, and its size [m].
    parameters : dict
        Values of the withheld effects in the contract's symbols.
    """

    bushings: Bushings
    P_T: float = 0.0
    turned: float = 0.0
    gain: FloatArray = field(default_factory=_none)
    zero: FloatArray = field(default_factory=_none)
    delay: float = 0.0
    outside: tuple[str, float] = ("", 0.0)
    parameters: dict[str, dict[str, float]] = field(default_factory=dict)

    def read(
        self, bodies: Bodies, records: Sequence[MountingRecord], *, fine: int = FINE
    ) -> list[FloatArray]:
        """Zeroed signals of every run without noise, each shape (n, 6)."""
        return [self._read(bodies, record, fine) for record in records]

    def _read(self, bodies: Bodies, record: MountingRecord, fine: int) -> FloatArray:
        torque, y, z = record.loads.T
        turned = np.exp(1j * self.turned) * (y + 1j * z)
        # What acts on the housing: the parasitic torque follows the load that is meant, not the one
        # that is turned.
        loads = np.array([torque + self.P_T * z, turned.real, turned.imag]).T
        signals = housing_motion(bodies, self.bushings, loads, 1.0 / RATE, fine=fine)
        signals += _outside(*self.outside, record.time)
        if self.delay:
            late = np.clip(record.time - self.delay, record.time[0], record.time[-1])
            signals = CubicSpline(record.time, signals)(late)
        return zeroed(signals) * (1.0 + self.gain) + self.zero


def _outside(name: str, size: float, time: FloatArray) -> FloatArray:
    shaken = size * np.sin(2.0 * np.pi * 0.71 * time + 0.4 * np.sin(0.6 * time))
    if name == "ground_motion":  # the frame of all vertical sensors shakes with a machine nearby
        return shaken[:, None] * np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    if name == "loose_probe_bracket":  # one sensor rocks
        return shaken[:, None] * np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    return np.zeros((time.size, len(SENSORS)))


def with_effect(
    state: MountingState, name: str, rng: np.random.Generator, size: FloatArray
) -> MountingState:
    """State with one more effect.

    Parameters
    ----------
    state : MountingState
        State so far.
    name : str
        Effect id, or a cause of no library.
    rng : Generator
        Random numbers.
    size : ndarray, shape (2,)
        Largest radial deflection [m] and its speed [m/s] without the effect.

    Returns
    -------
    MountingState
        The same with the effect and its parameters.
    """
    if name in _LAW_PARAMETERS:
        return _with_law(state, name, rng, size)
    if name in ("ground_motion", "loose_probe_bracket"):
        return replace(state, outside=(name, 0.1 * float(size[0])))
    changed, parameters = _CHANGES[name](
        state, float(rng.uniform()), float(rng.choice((-1.0, 1.0))), rng
    )
    return replace(changed, parameters={**state.parameters, name: parameters})


def _with_law(
    state: MountingState, name: str, rng: np.random.Generator, size: FloatArray
) -> MountingState:
    share = state.bushings.K1 * float(_SHARE[0] * (_SHARE[1] / _SHARE[0]) ** rng.uniform())
    symbols, values = _LAW_PARAMETERS[name](
        share, float(rng.uniform()), float(size[0]), float(size[1])
    )
    p = np.array([*values, *[0.0] * (3 - len(values)), state.bushings.K1])
    law = (_LAWS[name], p, size)
    named = dict(zip(symbols, values, strict=False))
    return replace(
        state,
        bushings=replace(state.bushings, laws=(*state.bushings.laws, law)),
        parameters={**state.parameters, name: named},
    )


#: Symbols and values of a law from its stiffness at the largest deflection, a random number,
#: largest deflection and speed.
_LAW_PARAMETERS: dict[
    str, Callable[[float, float, float, float], tuple[tuple[str, ...], tuple[float, ...]]]
] = {
    "cubic_stiffness": lambda k, u, q, v: (("K3",), (k / q**2,)),
    "quintic_stiffness": lambda k, u, q, v: (("K5",), (k / q**4,)),
    "deflection_dependent_damping": lambda k, u, q, v: (("C3",), (k / (q * v),)),
    "fluid_branch": lambda k, u, q, v: (("k", "tau"), (2.0 * k, 0.03 * 10.0**u)),
    "elasto_plastic_friction": lambda k, u, q, v: (
        ("Kp", "Fy"),
        (2.0 * k, 2.0 * k * (0.1 + 0.3 * u) * q),
    ),
    "softening_in_time": lambda k, u, q, v: ((), (k, 40.0)),
}
#: Laws of no library: they have no parameters in the contract's symbols.
_OUTSIDE_LAWS = ("softening_in_time",)
_Change = Callable[
    [MountingState, float, float, np.random.Generator], tuple[MountingState, dict[str, float]]
]


def _one(rng: np.random.Generator, value: float) -> FloatArray:
    errors = _none()
    errors[rng.integers(len(SENSORS))] = value
    return errors


def _parasitic_torque(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = sign * (0.02 + 0.1 * u)
    return replace(s, P_T=value), {"P_T": value}


def _axial(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = RIG["bushing_axial_stiffness"] * (4.0 + 12.0 * u)
    return replace(s, bushings=replace(s.bushings, k_x=value)), {"k_x": value}


def _compliance(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = 2e-10 * 10.0**u
    return replace(s, bushings=replace(s.bushings, compliance=value)), {
        "main_bearing_compliance": value
    }


def _direction(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = sign * (0.03 + 0.15 * u)
    return replace(s, turned=value), {"ntl_angle": value}


def _unequal(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = sign * (0.05 + 0.2 * u)
    return replace(s, bushings=replace(s.bushings, excess=value)), {"starboard_excess": value}


def _gain(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = sign * (0.06 + 0.15 * u)
    return replace(s, gain=_one(rng, value)), {"g": value}


def _zero(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = sign * (1e-4 + 2e-4 * u)
    return replace(s, zero=_one(rng, value)), {"z": value}


def _delay(
    s: MountingState, u: float, sign: float, rng: np.random.Generator
) -> tuple[MountingState, dict[str, float]]:
    value = 0.02 + 0.08 * u
    return replace(s, delay=value), {"delay": value}


_CHANGES: dict[str, _Change] = {
    "parasitic_torque": _parasitic_torque,
    "axial_bushing_stiffness": _axial,
    "main_bearing_compliance": _compliance,
    "ntl_direction": _direction,
    "unequal_bushings": _unequal,
    "sensor_gain": _gain,
    "sensor_zero": _zero,
    "sensor_delay": _delay,
}
#: Effects of the contract that this truth withholds.
EFFECTS = (*(name for name in _LAW_PARAMETERS if name not in _OUTSIDE_LAWS), *_CHANGES)
