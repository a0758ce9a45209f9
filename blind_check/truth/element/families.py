"""What the truth can withhold of an element: its causes, their classes, and how they are drawn.

A cause that the library names too is listed with that law; every other has a form that no column
and no law of a diagnosis has. Classes follow from the cause's own equation.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.element.drives import DECAY, MULTISINE, NOISE, SINES, SWEEPS

FloatArray = NDArray[np.float64]
Draw = Callable[[np.random.Generator, float, float], tuple[float, ...]]

F = "restoring_force"
G = "dissipation"
H = "hysteresis"
M = "memory"
D = "delay"
C = "coupled_damping"
S = "force_surface"
T = "time_variation"
I = "drive_side"  # noqa: E741 - the symbol of the method

_ALL = (MULTISINE, NOISE, SWEEPS, SINES, DECAY)
_WIDE = (MULTISINE, NOISE)
#: Linear causes are absorbed by spring and damper at one frequency, and by a decay.
_SEVERAL_FREQUENCIES = (MULTISINE, NOISE, SWEEPS)
_DRIVEN = (MULTISINE, NOISE, SWEEPS, SINES)
_SPRINGS = ("cubic_stiffness", "quintic_stiffness")
_DRY = (
    "coulomb_friction",
    "stribeck_friction",
    "friction_asymmetry",
    "elasto_plastic_friction",
)
_DAMPERS = ("quadratic_damping", "cubic_damping")


@dataclass(frozen=True)
class Cause:
    """One cause that the truth can withhold.

    Parameters
    ----------
    law : str
        Law of the truth that computes it; empty where it is none (delay, drive side, disturbance).
    classes : tuple of str
        Its class ids; empty where no class holds it.
    draw : callable
        Parameters of the law from random numbers, natural frequency [rad/s] and duration [s].
    library : str
        Law of the library that has its form; empty where none has.
    kin : tuple of str
        Other laws of the library that a record of few samples may not tell from it.
    aliases : tuple of tuple of str
        Sets of class ids that records may not tell from its own.
    drives : tuple of str
        Drives that make it visible.
    """

    law: str
    classes: tuple[str, ...]
    draw: Draw
    library: str = ""
    kin: tuple[str, ...] = ()
    aliases: tuple[tuple[str, ...], ...] = ()
    drives: tuple[str, ...] = _ALL


def _fixed(*values: float) -> Draw:
    return lambda rng, omega, duration: values


def _between(*ranges: tuple[float, float]) -> Draw:
    return lambda rng, omega, duration: tuple(float(rng.uniform(*ends)) for ends in ranges)


def _one_of(*ranges: tuple[float, float]) -> Draw:
    return lambda rng, omega, duration: (float(rng.uniform(*ranges[rng.integers(len(ranges))])),)


def _either_sign(low: float, high: float) -> Draw:
    return _one_of((low, high), (-high, -low))


def _contact(power: float, low: float, high: float) -> Draw:
    return lambda rng, omega, duration: (
        float(rng.uniform(low, high)),
        power,
        float(rng.choice((-1.0, 1.0))),
    )


def _softening(rng: np.random.Generator, omega: float, duration: float) -> tuple[float, ...]:
    beta = float(rng.uniform(0.4, 0.8))
    pinch = (float(rng.uniform(0.5, 0.9)), float(rng.uniform(0.15, 0.4)))
    return (1.0 / rng.uniform(0.06, 0.4), float(rng.uniform(1.0, 2.0)), beta, 1.0 - beta, *pinch)


def _branches(*weights: float) -> Draw:
    """Maxwell branches whose times stand a random factor apart."""

    def draw(rng: np.random.Generator, omega: float, duration: float) -> tuple[float, ...]:
        first = rng.uniform(0.3, 2.0) / omega
        apart = rng.uniform(4.0, 10.0)
        times = (first, first * apart, first / apart)
        return tuple(float(value) for pair in zip(weights, times, strict=True) for value in pair)

    return draw


def _slow(rng: np.random.Generator, omega: float, duration: float) -> tuple[float, ...]:
    return float(rng.uniform(0.3, 1.0)) * duration, duration


def _per_omega(*ranges: tuple[float, float]) -> Draw:
    """First parameter in natural frequencies."""

    def draw(rng: np.random.Generator, omega: float, duration: float) -> tuple[float, ...]:
        first, *others = (float(rng.uniform(*ends)) for ends in ranges)
        return first * omega, *others

    return draw


def _heat(rng: np.random.Generator, omega: float, duration: float) -> tuple[float, ...]:
    return float(rng.uniform(0.3, 1.0)) * 3.0 / duration * 2.0, float(
        rng.uniform(0.1, 0.4)
    ) * duration


def _warmth(rng: np.random.Generator, omega: float, duration: float) -> tuple[float, ...]:
    """Heat that comes to about a half, and fades in a tenth of a run to all of it."""
    time = float(rng.uniform(0.1, 1.0)) * duration
    return float(rng.uniform(2.0, 6.0)) / time, time


def _dashpot(rng: np.random.Generator, omega: float, duration: float) -> tuple[float, ...]:
    return float(rng.uniform(1.0, 4.0)), float(rng.uniform(0.3, 1.0)) / omega


CAUSES: dict[str, Cause] = {
    "quadratic_spring": Cause(
        "even_power_spring", (F,), _fixed(2.0), "quadratic_stiffness"
    ),
    "cubic_spring": Cause("odd_power_spring", (F,), _fixed(3.0), "cubic_stiffness", _SPRINGS),
    "quintic_spring": Cause("odd_power_spring", (F,), _fixed(5.0), "quintic_stiffness", _SPRINGS),
    "gap_in_spring": Cause("dead_zone", (F,), _between((0.03, 0.25)), "backlash"),
    "hyperbolic_hardening": Cause(
        "hyperbolic_spring", (F,), _between((1.5, 4.0)), kin=_SPRINGS
    ),
    "power_spring": Cause(
        "odd_power_spring", (F,), _one_of((1.4, 1.7), (2.2, 2.6)), kin=_SPRINGS
    ),
    "one_sided_stop": Cause("one_sided_contact", (F,), _contact(1.0, 0.2, 0.6)),
    "hertz_contact": Cause("one_sided_contact", (F,), _contact(1.5, -0.3, 0.5)),
    "periodic_stiffness": Cause(
        "periodic_spring", (F,), _between((4.0, 12.0), (0.0, 6.3))
    ),
    "coulomb": Cause(
        "creeping_friction", (G,), _fixed(0.0, 1.0, 1.0), "coulomb_friction", _DRY, ((H,),)
    ),
    "unequal_friction": Cause(
        "creeping_friction", (G,),
        lambda rng, omega, duration: (0.0, 1.0, float(rng.uniform(0.4, 0.8))),
        "friction_asymmetry", _DRY, ((H,),),
    ),
    "stribeck": Cause(
        "creeping_friction", (G,), _between((0.4, 1.2), (0.05, 0.25), (1.0, 1.0)),
        "stribeck_friction", _DRY, ((H,),),
    ),
    "quadratic_damper": Cause(
        "power_damper", (G,), _fixed(2.0), "quadratic_damping", _DAMPERS
    ),
    "cubic_damper": Cause("power_damper", (G,), _fixed(3.0), "cubic_damping", _DAMPERS),
    "power_damper": Cause(
        "power_damper", (G,), _one_of((0.3, 0.6), (1.4, 1.7), (2.3, 2.7)), kin=(*_DAMPERS, *_DRY)
    ),
    "displaced_tanh": Cause(
        "displaced_tanh", (G,), _between((0.05, 0.3), (0.1, 0.4)), kin=_DRY
    ),
    "lugre": Cause(
        "lugre", (G,), _between((0.015, 0.04), (0.0, 0.6), (0.05, 0.2)), kin=_DRY,
        aliases=((H,),),
    ),
    "slider": Cause(
        "elasto_plastic", (H,), _between((0.06, 0.4)), "elasto_plastic_friction", _DRY
    ),
    "lopsided_slider": Cause(
        "elasto_plastic", (H,), _between((0.06, 0.4), (0.2, 0.5)), kin=_DRY
    ),
    "softening_bouc_wen": Cause("bouc_wen", (H,), _softening, kin=_DRY),
    "hardening_bouc_wen": Cause(
        "bouc_wen", (H,), _between((1.0, 2.5), (1.0, 1.0), (0.3, 0.5), (-0.9, -0.7))
    ),
    "pinched_bouc_wen": Cause("pinched_bouc_wen", (H,), _softening),
    "iwan": Cause(
        "iwan", (H,), _between((0.02, 0.1), (0.4, 1.0), (-1.0, 0.5)), kin=_DRY
    ),
    "play_with_friction": Cause(
        "play_with_friction",
        (F, H),
        _between((0.1, 0.4), (0.01, 0.05), (0.15, 0.4)),
        kin=("backlash", *_DRY),
        aliases=((F, G),),
    ),
    "maxwell": Cause(
        "maxwell_branches", (M,), _branches(1.0, 0.0, 0.0), "maxwell_branch",
        drives=_SEVERAL_FREQUENCIES,
    ),
    "two_maxwell": Cause(
        "maxwell_branches", (M,), _branches(1.0, 0.7, 0.0), kin=("maxwell_branch",),
        drives=_SEVERAL_FREQUENCIES,
    ),
    "rubber": Cause(
        "maxwell_branches", (M,), _branches(1.0, 0.6, 1.5), kin=("maxwell_branch",),
        drives=_SEVERAL_FREQUENCIES,
    ),
    "late_sensor": Cause("", (D,), _fixed(), "sensor_delay", drives=_SEVERAL_FREQUENCIES),
    "square_coupling": Cause(
        "square_coupling", (C,), _fixed(), "deflection_dependent_damping"
    ),
    "exponential_coupling": Cause(
        "exponential_coupling", (C,), _either_sign(0.8, 2.0),
        kin=("deflection_dependent_damping",),
    ),
    "bump_coupling": Cause(
        "bump_coupling", (C,), _between((-0.5, 0.5), (0.2, 0.5)),
        kin=("deflection_dependent_damping",),
    ),
    # Its loop does not depend on the rate: hysteresis that is wider on one side.
    "position_dependent_friction": Cause(
        "position_dependent_friction", (S,), _either_sign(0.6, 0.95), kin=_DRY, aliases=((H,),)
    ),
    "metered_orifice": Cause(
        "metered_orifice", (S,), _either_sign(0.8, 1.6), kin=_DAMPERS
    ),
    "visco_elastic_stop": Cause(
        "visco_elastic_stop", (F, C), _between((0.2, 0.6), (0.2, 0.6)), aliases=((S,),)
    ),
    "warming_spring": Cause("warming_spring", (T,), _slow, drives=_WIDE),
    "drifting_damper": Cause("drifting_damper", (T,), _slow, drives=_WIDE),
    "drifting_preload": Cause("drifting_preload", (T,), _slow, drives=_WIDE),
    "saturation": Cause("", (I,), _between((0.8, 2.0)), drives=_DRIVEN),
    "unequal_gain": Cause("", (I,), _fixed(), drives=_DRIVEN),
    "dead_band": Cause("", (I,), _between((0.1, 0.3)), drives=_DRIVEN),
    "random_disturbance": Cause("", (), _fixed()),
    "tuned_mass": Cause("tuned_mass", (), _per_omega((1.2, 1.8), (0.02, 0.05))),
    "fast_parametric_spring": Cause("fast_parametric_spring", (), _per_omega((0.4, 0.9))),
    "heated_friction": Cause("heated_friction", (), _heat),
    "spring_and_dashpot": Cause("spring_and_dashpot", (), _dashpot),
    # Drawn only where it is asked for by name.
    "heated_spring": Cause("heated_spring", (), _warmth, drives=()),
}  # fmt: skip

#: Causes of no class.
OUTSIDE_CAUSES = tuple(name for name, cause in CAUSES.items() if not cause.classes and cause.drives)
#: Causes withheld one at a time.
INSIDE_CAUSES = tuple(name for name, cause in CAUSES.items() if cause.classes)

#: Class of every law of the library; more than one where its equation lies in more.
CLASSES_OF_LAW: dict[str, tuple[str, ...]] = {
    "quadratic_stiffness": (F,), "cubic_stiffness": (F,), "quintic_stiffness": (F,),
    "backlash": (F,), "coulomb_friction": (G, H), "stribeck_friction": (G,),
    "friction_asymmetry": (G,), "quadratic_damping": (G,), "cubic_damping": (G,),
    "elasto_plastic_friction": (H,), "dahl_friction": (G, H), "maxwell_branch": (M,),
    "sensor_delay": (D,), "deflection_dependent_damping": (C,),
}  # fmt: skip


def acceptable_laws(name: str) -> tuple[str, ...]:
    """Laws of the library that may be named for a cause, its own first."""
    cause = CAUSES[name]
    laws = (cause.library,) if cause.library else ()
    return (*laws, *(law for law in cause.kin if law not in laws))


def _without_parts(ids: frozenset[str]) -> frozenset[str]:
    """Sets of ids with a surface: f(x) + g(v) + h(x) v beside f(x, v) is f(x, v) again."""
    return ids - {F, G, C} if S in ids else ids


def class_sets(names: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Class ids of causes that act together, and the sets that records may not tell from them.

    Parameters
    ----------
    names : tuple of str
        Causes.

    Returns
    -------
    tuple of (tuple of str, tuple of tuple of str)
        Sorted ids; sorted sets, one for each combination of the causes' own aliases.
    """
    combined: list[frozenset[str]] = [frozenset()]
    for name in names:
        cause = CAUSES[name]
        choices = [frozenset(cause.classes), *(frozenset(ids) for ids in cause.aliases)]
        combined = [before | choice for before in combined for choice in choices]
    first, *others = [_without_parts(ids) for ids in combined]
    different = {tuple(sorted(ids)) for ids in others if ids != first}
    return tuple(sorted(first)), tuple(sorted(different))
