"""Truth of the kind "element".

A mass on one element under a multisine of four amplitudes, or the force of a driven element.

The drive is 1 % wrong, noise has a memory, laws are those of
:mod:`carrierflex.blind_check.truth.element.laws`, with a finer and other integration than any fit.
The noise is set so that the gap over the floor is the wanted one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import ALIASED, ONE_CONDITION, OUTSIDE, CasePlan, Label
from carrierflex.blind_check.truth.alias_table import same_class
from carrierflex.blind_check.truth.element.laws import LAWS, driven_motion, force_along, phasor_sums
from carrierflex.blind_check.truth.element.refit import ForcedRefit, Refit, driven_refit
from carrierflex.blind_check.truth.noise import (
    case_rng,
    coloured_noise,
    noise_rng,
    root_mean_square,
)
from carrierflex.identification.campaign.campaign import Baseline, Campaign, Channel
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

_SAMPLES = 2400
_SETTLE = 300
_FINE = 24
_LEVELS = (0.4, 0.7, 1.0, 1.4)
_CONSTANT = (1.0, 1.0, 1.0)
_MEMORY, _DRIVE_ERROR = 0.5, 0.01
#: Samples in a period of the natural frequency, and the band of the drive over it.
_PER_PERIOD, _BAND = 32, (0.15, 2.5)
_LINES = 60
#: Force of the withheld law over the spring's, at the largest amplitude.
_SHARE = (0.08, 0.3)


@dataclass(frozen=True, eq=False)
class Element:
    """One element under its drive.

    `base` mass, stiffness, damping, constant force; `omega` natural frequency [rad/s]; `by_force`
    the drive; `laws` withheld laws as (name, p, size); `delay` [s] of the channel.
    """

    base: FloatArray
    omega: float
    by_force: bool
    laws: tuple[tuple[str, FloatArray, FloatArray], ...] = ()
    delay: float = 0.0

    @property
    def step(self) -> float:
        """Sampling interval [s]."""
        return 2.0 * np.pi / self.omega / _PER_PERIOD


@dataclass(frozen=True, eq=False)
class Drive:
    """A multisine that grows from rest.

    Amplitudes, frequencies [rad/s], phases, and the time of growth [s].
    """

    amplitude: FloatArray
    omega: FloatArray
    phase: FloatArray
    growth: float

    def at(self, time: FloatArray) -> FloatArray:
        """Value at given times."""
        return self.motion_at(time)[0]

    def motion_at(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Value and its first two derivatives at evenly spaced times."""
        turn = (
            np.exp(1j * (np.outer(self.omega, time[:1]) + self.phase[:, None]))[:, 0]
            * self.amplitude
        )
        advance = np.exp(1j * self.omega * (time[1] - time[0]))
        sums = phasor_sums(turn, advance, self.omega, time.size)
        s = np.clip(time / self.growth, 0.0, 1.0)
        w = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        w_1 = 30.0 * s**2 * (1.0 - s) ** 2 / self.growth
        w_2 = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / self.growth**2
        return (
            sums[0] * w,
            sums[1] * w + sums[0] * w_1,
            sums[2] * w + 2.0 * sums[1] * w_1 + sums[0] * w_2,
        )


def element_case(plan: CasePlan, repeat: int = 0) -> tuple[Campaign, Label]:
    """Campaign and label of one case.

    Parameters
    ----------
    plan : CasePlan
        What to withhold and how large its gap shall be.
    repeat : int
        Number of the noise: the truth and the loads of a case are the same in all.

    Returns
    -------
    tuple of (Campaign, Label)
        Records with noise, and the truth.
    """
    rng = case_rng(plan)
    levels = {ALIASED: _CONSTANT, ONE_CONDITION: (1.0,)}.get(plan.family, _LEVELS)
    plain = _drawn_element(rng)
    drives = [_drawn_drive(rng, plain, level) for level in levels]
    element = _with_effects(plan, rng, plain, drives)
    time = _times(plain.step, _SAMPLES)
    error = 1.0 + _DRIVE_ERROR * float(rng.choice((-1.0, 1.0)))
    inputs = [error * drive.at(time) for drive in drives]
    clean = [response(element, applied) for applied in drives]
    before = _refit(drives, clean, plain)
    gap = root_mean_square(np.array(before.residuals)) if plan.effects else 0.0
    signal = root_mean_square(np.array(clean)[:, _SETTLE:])
    floor = gap / plan.ratio if plan.effects else signal * 10.0 ** rng.uniform(-3.0, -2.0)
    own_noise = noise_rng(plan, repeat)
    noise = [floor * coloured_noise(own_noise, (_SAMPLES,), memory=_MEMORY) for _ in drives]
    measured = [response_of_run + more for response_of_run, more in zip(clean, noise, strict=True)]
    # With the true effect in the model, noise is all that is left: the error of the drive goes into
    # mass, spring and damper.
    settled = np.array(noise)[:, _SETTLE:]
    held_out = np.array(before.held_out) + settled
    inside = () if plan.family == OUTSIDE else plan.effects
    one_load = plan.family in (ALIASED, ONE_CONDITION)
    label = Label(
        case=plan.name,
        kind="element",
        family=plan.family,
        effects=inside,
        acceptable=tuple(same_class("element", effect, one_load=one_load) for effect in inside),
        present=(),
        gap_over_floor=gap / floor,
        floor=floor,
        rho=root_mean_square(settled) / root_mean_square(held_out) if plan.effects else 1.0,
        parameters={name: _named_parameters(name, element) for name in inside},
        where={"run": f"run{1 + int(np.argmax([root_mean_square(r) for r in before.residuals]))}"}
        if inside
        else {},
    )
    return _campaign(plan, plain, time, inputs, measured, floor), label


def response(element: Element, drive: Drive) -> FloatArray:
    """Channel of a run without noise, shape (n,): deflection, or force of a driven element."""
    if element.by_force:
        fine = _motion(element, drive)
    else:
        fine = _driven_force(element, drive)
    at = (np.arange(_SAMPLES) - element.delay / element.step) * _FINE
    return np.asarray(np.interp(at, np.arange(fine.size), fine))


def _times(step: float, n: int) -> FloatArray:
    return step * np.arange(n, dtype=np.float64)


def _motion(element: Element, drive: Drive) -> FloatArray:
    step = element.step / _FINE
    force = drive.at(_times(step / 3.0, 3 * (_SAMPLES - 1) * _FINE + 1))
    names = [name for name, _, _ in element.laws]
    laws = np.array([LAWS[name] for name in names], dtype=np.float64)
    p = np.array([parameters for _, parameters, _ in element.laws]).reshape(-1, 4)
    size = np.array([sizes for _, _, sizes in element.laws]).reshape(-1, 2)
    motion = np.asarray(driven_motion(force, step, element.base, laws, p, size))
    if not np.isfinite(motion).all():
        raise ArithmeticError(
            f"the motion grows without bound at {_FINE} steps a sample; expected softer forces "
            f"than {names}"
        )
    return motion


def _driven_force(element: Element, drive: Drive) -> FloatArray:
    step = element.step / _FINE
    q, v, a = drive.motion_at(_times(step, (_SAMPLES - 1) * _FINE + 1))
    m, k, c, f0 = element.base
    force = m * a + c * v + k * q + f0
    for name, p, size in element.laws:
        force = force + force_along(q, v, step, LAWS[name], p, size)
    return np.asarray(force)


def _refit(drives: Sequence[Drive], signals: Sequence[FloatArray], plain: Element) -> Refit:
    """The baseline's own refit; the drive's constant error would change its parameters only."""
    if not plain.by_force:
        time = _times(plain.step, _SAMPLES)
        return driven_refit([drive.motion_at(time) for drive in drives], signals, settle=_SETTLE)
    fine = 8
    time = _times(plain.step / fine, (_SAMPLES - 1) * fine + 1)
    # A constant force of zero could not be scaled.
    start = plain.base.copy()
    start[3] = 1e-4 * start[1]
    return ForcedRefit(
        [drive.at(time) for drive in drives], signals, plain.step / fine, fine, start, _SETTLE
    ).refit()


def _drawn_element(rng: np.random.Generator) -> Element:
    """Mass of 50 to 500 kg at 2 to 8 Hz with 3 to 10 % of critical damping."""
    mass, omega = 10.0 ** rng.uniform(1.7, 2.7), 2.0 * np.pi * rng.uniform(2.0, 8.0)
    stiffness = mass * omega**2
    damping = 2.0 * rng.uniform(0.03, 0.1) * mass * omega
    preload = 1e-4 * stiffness * rng.uniform(-1.0, 1.0)
    return Element(np.array([mass, stiffness, damping, preload]), omega, bool(rng.integers(2)))


def _drawn_drive(rng: np.random.Generator, element: Element, level: float) -> Drive:
    """Multisine of a flat force, or of a motion that falls above the natural frequency."""
    omega = element.omega * np.linspace(*_BAND, _LINES) * (1.0 + 1e-3 * rng.standard_normal(_LINES))
    amplitude = np.full(_LINES, level * 1e-3 / np.sqrt(_LINES))
    amplitude = amplitude * (
        element.base[1] if element.by_force else 1.0 / (1.0 + (omega / element.omega) ** 2)
    )
    return Drive(
        amplitude, omega, rng.uniform(0.0, 2.0 * np.pi, _LINES), _SETTLE * element.step / 2.0
    )


def _with_effects(
    plan: CasePlan, rng: np.random.Generator, plain: Element, drives: Sequence[Drive]
) -> Element:
    """Element with the withheld effects, sized against its motion without them."""
    if not plan.effects:
        return plain
    largest = max(drives, key=lambda drive: float(drive.amplitude.max()))
    fine = plain.step / 4.0
    if plain.by_force:
        q = response(plain, largest)
        speed = root_mean_square(np.diff(q)) / plain.step
    else:
        q, v, _ = largest.motion_at(_times(fine, 4 * _SAMPLES))
        speed = root_mean_square(v)
    size = 2.0 * np.array([root_mean_square(q - q.mean()), speed])
    element = plain
    for name in plan.effects:
        if name == "sensor_delay":
            element = replace(element, delay=plain.step * float(rng.uniform(0.2, 0.8)))
        else:
            law = (name, _drawn_parameters(name, rng, plain, size), size)
            element = replace(element, laws=(*element.laws, law))
    return element


def _drawn_parameters(
    name: str, rng: np.random.Generator, plain: Element, size: FloatArray
) -> FloatArray:
    """Parameters p of a law whose force is a drawn share of the spring's."""
    k = plain.base[1]
    share = float(_SHARE[0] * (_SHARE[1] / _SHARE[0]) ** rng.uniform())
    u, (deflection, speed) = float(rng.uniform()), size
    force = share * k * deflection
    first = {
        "quadratic_stiffness": (force / deflection**2,),
        "cubic_stiffness": (force / deflection**3,),
        "quintic_stiffness": (force / deflection**5,),
        "quadratic_damping": (force / speed**2,),
        "cubic_damping": (force / speed**3,),
        "deflection_dependent_damping": (force / (deflection**2 * speed),),
        "backlash": ((0.05 + 0.15 * u) * deflection,),
        "coulomb_friction": (0.5 * force,),
        "stribeck_friction": (0.4 * force, (0.4 + 0.4 * u) * force, 0.2 * speed),
        "friction_asymmetry": (0.6 * force, (0.2 + 0.15 * u) * force),
        "elasto_plastic_friction": (
            2.0 * share * k,
            2.0 * share * k * (0.15 + 0.25 * u) * deflection,
        ),
        "maxwell_branch": (2.0 * share * k, (0.5 + 1.5 * u) / plain.omega),
        "softening_in_time": (share * k, 0.3 * _SAMPLES * plain.step),
        "attached_absorber": (share * plain.base[0], (1.2 + 0.6 * u) * plain.omega),
        "unmeasured_force": (force, (0.6 + 0.3 * u) * plain.omega),
        "end_stop": (3.0 * share * k, (0.2 + 0.4 * u) * deflection),
    }[name]
    return np.array([*first, *[0.0] * (3 - len(first)), k])


#: Names of the parameters p in the contract's symbols.
_NAMES = {
    "quadratic_stiffness": ("K2",), "cubic_stiffness": ("K3",), "quintic_stiffness": ("K5",),
    "quadratic_damping": ("C2",),
    "cubic_damping": ("C3",), "deflection_dependent_damping": ("C1",), "backlash": ("gap",),
    "coulomb_friction": ("Fc",),
    "stribeck_friction": ("Fc", "Fs", "v_s"), "friction_asymmetry": ("F_plus", "F_minus"),
    "elasto_plastic_friction": ("Kp", "Fy"), "maxwell_branch": ("k", "tau"),
}  # fmt: skip


def _named_parameters(name: str, element: Element) -> dict[str, float]:
    if name == "sensor_delay":
        return {"delay": element.delay}
    p = next(parameters for law, parameters, _ in element.laws if law == name)
    return {symbol: float(value) for symbol, value in zip(_NAMES[name], p, strict=False)}


def _campaign(
    plan: CasePlan,
    plain: Element,
    time: FloatArray,
    inputs: Sequence[FloatArray],
    measured: Sequence[FloatArray],
    floor: float,
) -> Campaign:
    """Records in the form of a measurement campaign; its words tell nothing about the truth."""
    drive, channel = ("force", "displacement") if plain.by_force else ("displacement", "force")
    runs = tuple(
        Run(
            f"run{k + 1}",
            f"run{k + 1}.parquet",
            f"drive {k + 1}" if len(inputs) > 1 else "one drive",
            time,
            {drive: series},
            {f"measured_{channel}": signal},
        )
        for k, (series, signal) in enumerate(zip(inputs, measured, strict=True))
    )
    unit = "m" if plain.by_force else "N"
    return Campaign(
        kind="element",
        name=plan.name,
        baseline=Baseline("model"),
        rig={"drive": drive, "settle_samples": _SETTLE},
        channels=(Channel(f"measured_{channel}", channel, unit, noise_std=floor),),
        runs=runs,
    )
