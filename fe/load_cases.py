"""Loads on the carrier from a drive torque: equations (4)-(6) of the 2012 paper and their pilots.

A positive torque T drives the carrier towards increasing angle. The planets hold their pins back:
the force on each pin is ``-F_PLC t`` (t tangential, towards increasing angle). The helix adds a
moment ``+M_t t``: on the left-handed planet the sun's tooth force has an axial part along +x at the
inner contact and the ring's one along -x at the outer contact, and ``-r e × F_a x + r e × (-F_a x)
= 2 r F_a t``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.carrier_interface import CarrierInterface
from carrierflex.geometry.parameters import CarrierParameters, GearData
from carrierflex.geometry.pins import pin_angles

#: Six components at a pilot: force x y z [N], moment x y z [N m].
PilotLoad = NDArray[np.float64]


@dataclass(frozen=True)
class GearForces:
    """Forces of one planet under a drive torque, all for the torque they were computed from.

    Parameters
    ----------
    F_PLC : float
        Tangential force on the pin [N].
    F_t : float
        Tangential force of each mesh, sun and ring [N].
    F_n : float
        Force normal to the tooth in the transverse plane [N], F_n' of equation (4).
    F_a : float
        Axial force of each mesh [N], equation (5).
    M_t : float
        Tilting moment on the planet [N m], equation (6).
    """

    F_PLC: float
    F_t: float
    F_n: float
    F_a: float
    M_t: float


def gear_forces(torque: float, gear: GearData, n_planets: int) -> GearForces:
    """Forces of one of `n_planets` under the drive `torque` [N m], as the paper computes them.

    ``F_n' = F_t / cos α`` (4), ``F_a = F_n' tan β`` (5), ``M_t = d F_a`` (6) with d the planet's
    working pitch diameter. For 1 kN m on three planets this gives 30.36 N m; the paper prints 30.3.

    Notes
    -----
    The usual axial force of a helical gear is ``F_t tan β``, 6 % smaller;
    :func:`standard_tilting_moment` has it.
    """
    F_PLC = torque / (n_planets * gear.centre_distance)
    F_t = F_PLC / 2.0
    F_n = F_t / math.cos(gear.pressure_angle)
    F_a = F_n * math.tan(gear.helix_angle)
    return GearForces(F_PLC, F_t, F_n, F_a, gear.planet_pitch_diameter * F_a)


def standard_tilting_moment(torque: float, gear: GearData, n_planets: int) -> float:
    """Tilting moment [N m] with the usual axial force ``F_t tan β``.

    It takes the place of the paper's equation (5).
    """
    return gear_forces(torque, gear, n_planets).M_t * math.cos(gear.pressure_angle)


def tangential(angle: float) -> NDArray[np.float64]:
    """Unit vector towards increasing angle, ``t = (0, -cos v, -sin v)``.

    Shape (3,), carrier-frame angle v [rad].
    """
    return np.array([0.0, -math.cos(angle), -math.sin(angle)])


def radial(angle: float) -> NDArray[np.float64]:
    """Unit vector away from the axis, ``e = (0, -sin v, cos v)``.

    Shape (3,), carrier-frame angle v [rad].
    """
    return np.array([0.0, -math.sin(angle), math.cos(angle)])


def bonded_pin_load(pin: int, force: float, moment: float, n_planets: int) -> dict[str, PilotLoad]:
    """Load on a bonded pin's mid-span pilot.

    `force` [N] against increasing angle, `moment` [N m] about t.

    Parameters
    ----------
    pin : int
        Pin number, from 1 on.
    force, moment : float
        F_PLC and M_t of a positive torque are positive.
    n_planets : int
        Pins of the carrier.
    """
    t = tangential(float(pin_angles(n_planets)[pin - 1]))
    return {f"pin_{pin}_midspan": np.concatenate([-force * t, moment * t])}


def simply_supported_pin_load(
    pin: int, force: float, moment: float, carrier: CarrierParameters | CarrierInterface
) -> dict[str, PilotLoad]:
    """Forces of an absent, simply supported pin on its two bores.

    The pin's own equilibrium (lever rule).

    The pin rests on the bores' middles x1 and x2 and carries `force` and `moment` at mid-span x_m,
    signs as in :func:`bonded_pin_load`. A moment about t is held by a couple of radial forces,
    ``(x2 - x1) x × (M / (x2 - x1)) e = M t``.
    """
    angle = float(pin_angles(carrier.n_planets)[pin - 1])
    t, e = tangential(angle), radial(angle)
    x1, x_m, x2 = carrier.pin_stations
    span = x2 - x1
    upwind = -force * (x2 - x_m) / span * t - moment / span * e
    downwind = -force * (x_m - x1) / span * t + moment / span * e
    none = np.zeros(3)
    return {
        f"pin_{pin}_upwind": np.concatenate([upwind, none]),
        f"pin_{pin}_downwind": np.concatenate([downwind, none]),
    }


def together(*loads: Mapping[str, PilotLoad]) -> dict[str, PilotLoad]:
    """Sum of several pilot loads."""
    total: dict[str, PilotLoad] = {}
    for load in loads:
        for pilot, components in load.items():
            total[pilot] = total.get(pilot, np.zeros(6)) + components
    return total
