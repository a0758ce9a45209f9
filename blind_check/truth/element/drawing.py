"""Elements and their causes drawn at random, sized against the motion without them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.element.drives import (
    DECAY,
    Drive,
    Lines,
    largest_value,
)
from carrierflex.blind_check.truth.element.element import (
    MEMORY_LAWS,
    N_FORM,
    DriveSide,
    Element,
    Law,
)
from carrierflex.blind_check.truth.element.families import CAUSES
from carrierflex.blind_check.truth.element.reference import Reference, force_of
from carrierflex.blind_check.truth.element.static_laws import STATIC_LAWS
from carrierflex.blind_check.truth.noise import root_mean_square

FloatArray = NDArray[np.float64]

#: Force that a cause leaves beyond mass, spring and damper, over the spring's force (both RMS).
_SHARE = (0.02, 0.2)
#: RMS of a law's change of form over that of what the law leaves.
CHANGE = (0.05, 0.30)
#: Share of the library's own laws that keep their textbook form: their parameters are true.
_TEXTBOOK = 0.25
#: Wave numbers of a change of form over an argument from -1 to 1: features of half the range and
#: more.
_WAVE_NUMBERS = (1.0, 6.0)
_NUMBERS = STATIC_LAWS | MEMORY_LAWS
_PLAIN_FORM = np.zeros((3, N_FORM))


def drawn_element(rng: np.random.Generator, drive: str) -> Element:
    """Mass of 50 to 500 kg at 2 to 8 Hz with 3 to 10 % of critical damping; 1 to 8 % in a decay."""
    mass, omega = 10.0 ** rng.uniform(1.7, 2.7), 2.0 * np.pi * rng.uniform(2.0, 8.0)
    stiffness = mass * omega**2
    ratio = 10.0 ** rng.uniform(-2.0, -1.1) if drive == DECAY else rng.uniform(0.03, 0.1)
    preload = 1e-4 * stiffness * rng.uniform(-1.0, 1.0)
    by_force = drive == DECAY or bool(rng.integers(2))
    base = np.array([mass, stiffness, 2.0 * ratio * mass * omega, preload])
    return Element(base, omega, by_force)


def sized_drives(
    rng: np.random.Generator, plain: Element, drives: Sequence[Drive], n: int
) -> tuple[Drive, ...]:
    """Drives whose largest deflection is 0.3 to 3 mm."""
    if plain.by_force:
        unloaded = replace(plain, base=plain.base * (1.0, 1.0, 1.0, 0.0))
        largest = largest_value([unloaded.motion(drives[-1], 0, n)])
    else:
        time = plain.step * np.arange(float(n))
        largest = largest_value([drive.at(time) for drive in drives])
    wanted = 10.0 ** rng.uniform(-3.5, -2.5)
    return tuple(drive.scaled(wanted / largest) for drive in drives)


def drawn_size(rng: np.random.Generator, plain: Element, reference: Reference) -> float:
    """Force [N] that a cause is to leave beyond mass, spring and damper."""
    low, high = _SHARE
    spring = plain.base[1] * root_mean_square(reference.columns[:, 0])
    return float(spring * low * (high / low) ** rng.uniform())


def with_causes(
    rng: np.random.Generator,
    names: Sequence[str],
    plain: Element,
    reference: Reference,
    size: float,
    n_runs: int,
) -> tuple[Element, tuple[float, ...]]:
    """Element with causes that leave a force of a size, and the change of form of each."""
    element, changes = plain, []
    for name in names:
        change = drawn_change(rng, name)
        element = _with_cause(rng, name, change, size, element, reference, n_runs)
        changes.append(change)
    return element, tuple(changes)


def drawn_change(rng: np.random.Generator, name: str) -> float:
    """Change of a cause's form, none for a share of the library's own laws."""
    keeps = bool(CAUSES[name].library) and rng.uniform() < _TEXTBOOK
    change = float(rng.uniform(*CHANGE))
    return 0.0 if keeps or not CAUSES[name].classes else change


def drawn_form(rng: np.random.Generator) -> FloatArray:
    """Smooth random change of form, of no certain size."""
    return np.array(
        [
            rng.standard_normal(N_FORM),
            rng.uniform(*_WAVE_NUMBERS, N_FORM),
            rng.uniform(0.0, 2.0 * np.pi, N_FORM),
        ]
    )


def slightly_curved(
    rng: np.random.Generator, element: Element, reference: Reference, size: float
) -> Element:
    """Element whose own spring and damper are curved, so that its baseline is a little wrong.

    `size` [N] is what both leave beyond mass, spring and damper.
    """
    added = []
    for name in ("form_of_deflection", "form_of_speed"):
        scale = np.array([1.0, *reference.scale])
        law = Law(STATIC_LAWS[name], np.zeros(6), drawn_form(rng), scale)
        amplitude = size / np.sqrt(2.0) / reference.missing(force_of(law, reference))
        added.append(replace(law, scale=scale * np.array([amplitude, 1.0, 1.0])))
    return replace(element, laws=(*element.laws, *added))


def scaled(laws: Sequence[Law], factor: float) -> tuple[Law, ...]:
    """Laws whose forces are multiplied by a factor."""
    return tuple(replace(law, scale=law.scale * np.array([factor, 1.0, 1.0])) for law in laws)


def smaller(element: Element, factor: float) -> Element:
    """Element whose causes are smaller."""
    laws = scaled(element.laws, factor)
    side = element.drive_side
    side = None if side is None else replace(side, amplitude=factor * side.amplitude)
    disturbance = tuple(line.scaled(factor) for line in element.disturbance)
    return replace(
        element,
        laws=laws,
        drive_side=side,
        disturbance=disturbance,
        delay=factor * element.delay,
        lag=factor * element.lag,
    )


def _with_cause(
    rng: np.random.Generator,
    name: str,
    change: float,
    size: float,
    element: Element,
    reference: Reference,
    n_runs: int,
) -> Element:
    cause = CAUSES[name]
    duration = reference.step * len(reference.columns)
    parameters = cause.draw(rng, element.omega, duration)
    if name == "late_sensor":
        late = element.step * rng.uniform(0.2, 0.8)
        return replace(element, delay=late * (1.0 - change), lag=late * change)
    if name == "random_disturbance":
        lines = tuple(_disturbance(rng, size, element.omega) for _ in range(n_runs))
        return replace(element, disturbance=lines)
    if not cause.law:
        return replace(
            element, drive_side=_drive_side(rng, name, parameters, change, size, reference)
        )
    p = np.zeros(6)
    p[: len(parameters)] = parameters
    law = Law(_NUMBERS[cause.law], p, _PLAIN_FORM, np.array([1.0, *reference.scale]))
    law = _changed(rng, law, change, reference)
    if name == "gap_in_spring":
        # The gap is in the element's own spring.
        amplitude = element.base[1] * reference.scale[0]
    else:
        amplitude = size / reference.missing(force_of(law, reference))
    law = replace(law, scale=law.scale * np.array([amplitude, 1.0, 1.0]))
    return replace(element, laws=(*element.laws, law))


def _changed(rng: np.random.Generator, law: Law, change: float, reference: Reference) -> Law:
    """Law with its form changed by a share of what it leaves."""
    if change == 0.0:
        return law
    law_force = force_of(law, reference)
    if law.number == MEMORY_LAWS["maxwell_branches"]:
        # Linear memory stays linear: a branch of another time is added.
        p = law.p.copy()
        p[4] += 1.0
        added = reference.missing(force_of(replace(law, p=p), reference) - law_force)
        p[4] = law.p[4] + change * reference.missing(law_force) / added
        return replace(law, p=p)
    form = drawn_form(rng)
    added = reference.missing(force_of(replace(law, form=form), reference) - law_force)
    form[0] *= change * reference.missing(law_force) / added
    return replace(law, form=form)


def _drive_side(
    rng: np.random.Generator,
    name: str,
    parameters: tuple[float, ...],
    change: float,
    size: float,
    reference: Reference,
) -> DriveSide:
    largest = largest_value([reference.force])
    (parameter,) = parameters or (0.0,)
    side = DriveSide(name, parameter, _PLAIN_FORM, largest, 1.0)
    added_force = side.added(reference.force)
    form = drawn_form(rng)
    added = replace(side, form=form).added(reference.force) - added_force
    form[0] *= change * reference.missing(added_force) / reference.missing(added)
    return replace(side, form=form, amplitude=size / reference.missing(added_force))


def _disturbance(rng: np.random.Generator, size: float, omega: float) -> Lines:
    n = 80
    lines = omega * rng.uniform(0.2, 2.0, n)
    amplitude = size * np.sqrt(2.0 / n) * np.ones(n)
    return Lines(amplitude, lines, rng.uniform(0.0, 2.0 * np.pi, n), 1e-6)
