"""Springs of the stage.

Planet, carrier, sun and main bearings, ring bolts, pins in bores, shafts and meshes of the parallel
stages.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.pins import pin_angles
from carrierflex.simulation.stage.coordinate_layout import CoordinateLayout, motion_at
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.roller_bearing import roller_set, stiffness_at
from carrierflex.simulation.stage.stage_data import BearingData, MountingData


@dataclass(frozen=True, eq=False)
class Spring:
    """A connection: elongation ``u = G q - free``, force ``-Gᵀ k u``, linear but for a play.

    Parameters
    ----------
    G : ndarray, shape (m, n)
        Elongations [m or rad] from the coordinates.
    stiffness : ndarray, shape (m,)
        [N/m or N m/rad].
    free : ndarray, shape (m,)
        Elongation without force.
    clearance : float
        Play of rows 1 and 2 together [m or rad]; 0 for none.
    """

    G: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    free: NDArray[np.float64]
    clearance: float = 0.0


def stage_springs(layout: CoordinateLayout, effects: StageEffects) -> dict[str, Spring]:
    """Every connection by name.

    Mount and planetary meshes stand elsewhere, they change with the carrier angle.
    """
    bearings, points = layout.data.bearings, layout.body.model.pilots
    planets = range(1, layout.n_planets + 1)
    springs = {f"planet_{i}": _planet_bearing(layout, effects, i) for i in planets}

    def bearing(
        G: NDArray[np.float64],
        stiffness: tuple[float, float, float, float, float],
        clearance: float = 0.0,
    ) -> Spring:
        axial, radial, _, tilt, torsion = stiffness
        return Spring(
            G, np.array([axial, radial, radial, torsion, tilt, tilt]), np.zeros(6), clearance
        )

    for side, axial in (("upwind", bearings.carrier_axial), ("downwind", 0.0)):
        seat = f"{side}_seat"
        G = layout.pilot_motion(seat) - layout.part_motion("housing", points[seat])
        # Of unequal stiffnesses the mean over a turn; the rest turns (unequal_bearings).
        radial = _mean_radial(bearings, side)
        stiffness = (axial, radial, radial, getattr(bearings, f"{side}_tilt"), 0.0)
        springs[seat] = bearing(G, stiffness, getattr(bearings, f"{side}_clearance"))
    main = (bearings.main_axial, bearings.main_radial, bearings.main_radial, 0.0, 0.0)
    springs["main_bearing"] = bearing(layout.pilot_motion("main_bearing_seat"), main)
    centre = layout.centre("sun")
    sun = (bearings.sun_axial, bearings.sun_radial, bearings.sun_radial, bearings.sun_tilt, 0.0)
    springs["sun"] = bearing(
        layout.part_motion("sun", centre) - layout.part_motion("housing", centre),
        sun,
        # A spline with friction has a law of its own, clearance included.
        0.0 if bearings.sun_friction > 0.0 else bearings.sun_clearance,
    )
    centre, bolted = layout.centre("ring"), bearings.ring_to_housing
    at_radius = bolted * (layout.data.gear.centre_distance * 1.65) ** 2
    ring = (bolted, bolted, bolted, at_radius, at_radius)
    springs["ring"] = bearing(
        layout.part_motion("ring", centre) - layout.part_motion("housing", centre), ring
    )
    return springs | _parallel_stages(layout) | _pin_fits(layout, effects)


def _mean_radial(bearings: BearingData, side: str) -> float:
    """Radial stiffness of a carrier bearing, mean of y and z [N/m]."""
    factor: float = getattr(bearings, f"{side}_y_factor")
    return float(getattr(bearings, f"{side}_radial")) * 0.5 * (1.0 + factor)


def unequal_bearings(bearings: BearingData) -> dict[str, NDArray[np.float64]]:
    """Stiffness along the housing's y and z of carrier bearings where the two differ [N/m].

    By their spring's name, shape (2,) each.
    """
    unequal = {}
    for side in ("upwind", "downwind"):
        factor, radial = getattr(bearings, f"{side}_y_factor"), getattr(bearings, f"{side}_radial")
        if factor != 1.0:
            unequal[f"{side}_seat"] = radial * np.array([factor, 1.0])
    return unequal


def _pin_fits(layout: CoordinateLayout, effects: StageEffects) -> dict[str, Spring]:
    """Bearing of every pin on the edges of its two bores, where there is a play.

    Relative rotation about y and z.
    """
    if effects.pin_fit_play == 0.0:
        return {}
    stiffness, springs = np.array([0.0, effects.pin_fit_closed, effects.pin_fit_closed]), {}
    for pin in range(1, layout.n_planets + 1):
        for side in ("upwind", "downwind"):
            bore, pin_side = f"pin_{pin}_{side}", f"pin_{pin}_{side}_of_pin"
            missing = {bore, pin_side} - layout.body.model.pilots.keys()
            if missing:
                raise ValueError(
                    f"{layout.body.model.name} has no pilot {min(missing)!r}; expected pins as "
                    "bodies of their own where "
                    "pin_fit_play is given"
                )
            G = (layout.pilot_motion(pin_side) - layout.pilot_motion(bore))[3:]
            springs[f"{bore}_fit"] = Spring(G, stiffness, np.zeros(3), effects.pin_fit_play)
    return springs


def _planet_bearing(layout: CoordinateLayout, effects: StageEffects, planet: int) -> Spring:
    bearings, pilot = layout.data.bearings, layout.body.planet_pilots[planet - 1]
    planet_body = f"planet_{planet}"
    G = layout.part_motion(planet_body, layout.body.model.pilots[pilot]) - layout.pilot_motion(
        pilot
    )
    angle = float(pin_angles(layout.n_planets)[planet - 1])
    offset = effects.of_planets("pin_offset", layout.n_planets)[planet - 1]
    free = np.zeros(6)
    free[1:3] = offset * np.array([-np.cos(angle), -np.sin(angle)])
    data, clearance = layout.data, bearings.planet_clearance
    radial, tilt = bearings.planet_radial, bearings.planet_tilt
    if data.planet_rollers is not None:
        # The rollers take over; the linear part keeps what they answer at their reference load.
        radial, tilt = stiffness_at(
            roller_set(data.planet_rollers, data.gear, clearance, (1.0,) * layout.n_planets),
            data.planet_rollers.reference_load,
        )
        clearance = 0.0
    stiffness = np.array([bearings.planet_axial, radial, radial, 0.0, tilt, tilt])
    factor = effects.of_planets("planet_bearing_factor", layout.n_planets)[planet - 1]
    return Spring(G, stiffness * factor, free, clearance)


def _parallel_stages(layout: CoordinateLayout) -> dict[str, Spring]:
    """Torsion of the sun shaft and the generator's coupling.

    The parallel meshes, whose centres the housing carries.
    """
    chain = layout.data.chain
    rows = layout.rows
    n = layout.n
    low_ratio = chain.low_teeth[1] / chain.low_teeth[0]
    high_ratio = chain.high_teeth[1] / chain.high_teeth[0]

    def row(factors: Mapping[str, float]) -> NDArray[np.float64]:
        G = np.zeros((1, n))
        for name, factor in factors.items():
            G[0, rows[name][3] if len(rows[name]) == 6 else rows[name][0]] += factor
        return G

    first, second = chain.low_base_radius, chain.high_base_radius
    meshes = (
        ("low_mesh", {"low_speed": first, "intermediate": first * low_ratio,
        "housing": -first * (1.0 + low_ratio)},
         chain.low_stiffness),
        ("high_mesh", {"intermediate": second, "high_speed": second * high_ratio,
        "housing": -second * (1.0 + high_ratio)},
         chain.high_stiffness),
        ("sun_shaft", {"sun": 1.0, "low_speed": -1.0}, chain.sun_shaft_torsion),
        ("coupling", {"high_speed": 1.0, "generator": -1.0}, chain.coupling_torsion),
    )  # fmt: skip
    return {
        name: Spring(row(factors), np.array([stiffness]), np.zeros(1))
        for name, factors, stiffness in meshes
    }


def mount_matrices(
    mounting: MountingData, centre: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and damping of both bushings at the housing's centre [m], fixed frame, (6, 6)."""
    K, C = np.zeros((6, 6)), np.zeros((6, 6))
    for y in (-mounting.arm, mounting.arm):
        G = motion_at(np.array([mounting.x, y, 0.0]) - centre)
        tilt = [0.0, mounting.tilt_stiffness, mounting.tilt_stiffness]
        stiffness = [mounting.axial_stiffness, *2 * [mounting.radial_stiffness], *tilt]
        K += G.T @ np.diag(stiffness) @ G
        C += G[:3].T @ np.diag([mounting.axial_damping] + 2 * [mounting.radial_damping]) @ G[:3]
    return K, C
