"""Sizes of the withheld effects of a carrier.

Scaled to the wanted gap, within what a machine could have.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from carrierflex.blind_check.labels import FORM, OUTSIDE, SEVERAL, CasePlan
from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS, drawn_form
from carrierflex.blind_check.truth.carrier.rig import N_SENSORS, CarrierState
from carrierflex.blind_check.truth.carrier.signals import drawn_values, scaled_values
from carrierflex.blind_check.truth.noise import largest_leak

#: Steps of the search for the size of an effect; sizes that act through a threshold or a sine need
#: more than one.
_SIZE_STEPS, _SIZE_TOLERANCE = 30, 1e-4
#: Largest factor on an effect of unit size that a machine could have: pin loads that stay positive,
#: gains off by 30 %, a sensor 5 degrees from its place, 0.15 s of delay, deflections of three times
#: the model's.
_LARGEST = {
    "unequal_load_sharing": 5.0, "load_sharing_ntl": 5.0, "flexible_pins": 3.0, "stiff_pins": 1.5,
    "pin_clearance": 1.5,
    "sensor_gain": 3.0, "sensor_angle": 3.0, "sensor_delay": 5.0,
}  # fmt: skip
#: Noise of a case [m], drawn between the first two; down to the last where an effect cannot grow to
#: the wanted gap.
_NOISE, _LEAST_NOISE = (2e-6, 5e-6), 0.3e-6
#: Forms that are drawn until the loads show one.
_REDRAWS = 50
#: Largest errors of the sensors, gain and angle [rad]; every size up to them is as likely.
LARGEST_GAIN, LARGEST_ANGLE = 0.03, float(np.deg2rad(0.5))

Gap = Callable[[CarrierState], float]


def sized_state(
    plan: CasePlan, rng: np.random.Generator, known: CarrierState, n_runs: int, gap: Gap
) -> tuple[CarrierState, float]:
    """State with the withheld effects, and the noise.

    Parameters
    ----------
    plan : CasePlan
        Effects and wanted gap over the noise; every effect of a pair leaves the same gap by itself,
        each of several what is drawn for it.
    rng : Generator
        Random numbers.
    known : CarrierState
        What the baseline holds.
    n_runs : int
        Number of runs.
    gap : callable
        RMS [m] of what a state leaves after the baseline's refit.

    Returns
    -------
    tuple of (CarrierState, float)
        State, and standard deviation of the noise [m].
    """
    floor = float(np.exp(rng.uniform(*np.log(_NOISE))))
    units = [_unit_effect(plan.family, name, rng, n_runs) for name in plan.effects]
    if plan.family in (FORM, SEVERAL):
        units = [
            _shown(unit, name, rng, known, gap)
            for name, unit in zip(plan.effects, units, strict=True)
        ]
    ratios = plan.own_ratios or (plan.ratio / np.sqrt(max(len(units), 1)),) * len(units)
    for name, unit, share in zip(plan.effects, units, ratios, strict=True):
        if name in _LARGEST:
            floor = min(floor, gap(_with(known, unit, _LARGEST[name])) / share)
    floor = max(floor, _LEAST_NOISE)
    state = known
    for name, unit, share in zip(plan.effects, units, ratios, strict=True):
        state = _with(
            state, unit, _factor(known, unit, share * floor, _LARGEST.get(name, np.inf), gap)
        )
    return state, floor


def _factor(
    known: CarrierState, unit: CarrierState, wanted: float, largest: float, gap: Gap
) -> float:
    """Factor on a unit effect at which it leaves the wanted gap, or its physical limit."""
    factor = 1.0
    for _ in range(_SIZE_STEPS):
        reached = gap(_with(known, unit, factor))
        if abs(reached / wanted - 1.0) < _SIZE_TOLERANCE or reached == 0.0:
            break
        factor = min(factor * wanted / reached, largest)
    return factor


def with_sensor_errors(
    state: CarrierState,
    plan: CasePlan,
    rng: np.random.Generator,
    floor: float,
    leak: Callable[[CarrierState], float],
) -> tuple[CarrierState, float]:
    """State before sensors up to 3 % and 0.5 degrees off.

    The errors are smaller where they would leave more than `largest_leak`.

    Parameters
    ----------
    state : CarrierState
        State with the withheld effects.
    plan : CasePlan
        Family and ratio of the case.
    rng : Generator
        Random numbers.
    floor : float
        Noise [m].
    leak : callable
        RMS [m] of what the errors of a state leave after the baseline's refit.

    Returns
    -------
    tuple of (CarrierState, float)
        The same effects, read with errors, and the share of the largest errors up to which they
        are drawn.
    """
    gain = rng.uniform(-LARGEST_GAIN, LARGEST_GAIN, N_SENSORS)
    turned = rng.uniform(-LARGEST_ANGLE, LARGEST_ANGLE, N_SENSORS)
    leaked = leak(replace(state, gain_error=gain, angle_error=turned)) / floor
    share = min(1.0, largest_leak(plan) / leaked) if leaked > 0.0 else 1.0
    return replace(state, gain_error=share * gain, angle_error=share * turned), share


def _unit_effect(family: str, name: str, rng: np.random.Generator, n_runs: int) -> CarrierState:
    """A state that holds one effect alone, of about 30 micrometres."""
    if family == OUTSIDE:
        return CarrierState({}, outside=(name, 3e-5))
    if name in OTHER_FORMS:
        return CarrierState({name: drawn_form(name, rng)})
    gains = np.zeros(N_SENSORS)
    gains[rng.integers(N_SENSORS)] = rng.choice((-1.0, 1.0))
    if name == "sensor_gain":
        return CarrierState({}, gain=0.1 * gains)
    if name == "sensor_angle":
        return CarrierState({}, turned=0.03 * gains)
    if name == "sensor_zero":
        return CarrierState({}, zero=3e-5 * gains)
    if name == "sensor_delay":
        return CarrierState({}, delay=0.03 * float(gains.sum()))
    return CarrierState({name: drawn_values(name, rng, n_runs)})


def _shown(
    unit: CarrierState, name: str, rng: np.random.Generator, known: CarrierState, gap: Gap
) -> CarrierState:
    """Unit effect of a form that these loads show, drawn anew until they do.

    A tilt that grows up to half the torque is a constant one where every run has more.
    """
    for _ in range(_REDRAWS):
        if gap(_with(known, unit, 1.0)) > _LEAST_NOISE:
            return unit
        unit = CarrierState({name: drawn_form(name, rng)})
    raise ArithmeticError(f"no form of {name} shows under the drawn loads")


def _with(state: CarrierState, effect: CarrierState, factor: float) -> CarrierState:
    """State with one more effect, `factor` times its unit."""
    more = {name: scaled_values(values, factor) for name, values in effect.effects.items()}
    return replace(
        state,
        effects={**state.effects, **more},
        gain=state.gain + factor * effect.gain,
        turned=state.turned + factor * effect.turned,
        zero=state.zero + factor * effect.zero,
        delay=state.delay + factor * effect.delay,
        outside=(effect.outside[0], factor * effect.outside[1])
        if effect.outside[0]
        else state.outside,
    )
