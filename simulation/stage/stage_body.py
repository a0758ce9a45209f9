"""The elastic body of the stage.

Carrier with pins and main shaft as one reduced body, with an imposed misalignment.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.parameters import GearData
from carrierflex.geometry.pins import pin_angles, planets_of
from carrierflex.reduction.assembly import Joint, assembled, imposed_motion
from carrierflex.reduction.reduced_model import PILOT_COORDINATES, MassProperties, ReducedModel

#: Where the stage takes hold of its elastic body.
FIXED_PILOTS = ("main_bearing_seat", "upwind_seat", "downwind_seat")
#: Planets and pins farther apart than this [m] do not belong together.
_SAME_PLACE = 1e-3
#: Sensor rows of the rim, one a degree: the names the recovery matrix has for them.
RIM_AXIAL, RIM_RADIAL = "rim_axial_", "rim_radial_"


@dataclass(frozen=True, eq=False)
class StageBody:
    """Elastic body with the load and the reading of a unit misalignment.

    Parameters
    ----------
    model : ReducedModel
        Body with the pilots ``main_bearing_seat``, ``upwind_seat``, ``downwind_seat`` and one pilot
        a planet.
    planet_pilots : tuple of str
        Where planets 1, 2, 3 ... sit.
    misalignment_load : ndarray, shape (n, 2)
        Force of a carrier tilted against the shaft by 1 rad about y and z of the carrier frame,
        held unbent.
    misalignment_reading : ndarray, shape (n_sensors, 2)
        What that tilt adds to the sensors' displacement [m/rad].

    Raises
    ------
    ValueError
        Where a pilot or the rim's sensor rows are missing.
    """

    model: ReducedModel
    planet_pilots: tuple[str, ...]
    misalignment_load: NDArray[np.float64]
    misalignment_reading: NDArray[np.float64]

    @property
    def n_planets(self) -> int:
        """Number of planets."""
        return len(self.planet_pilots)

    def __post_init__(self) -> None:
        refuse_missing_pilots(self.model, (*FIXED_PILOTS, *self.planet_pilots))
        _refuse_blind(self.model)


def refuse_missing_pilots(model: ReducedModel, pilots: Sequence[str]) -> None:
    """Raise ValueError naming the first of the pilots that a body does not have."""
    for pilot in pilots:
        if pilot not in model.pilots:
            raise ValueError(
                f"{model.name} has no pilot {pilot!r}, which the planetary stage takes hold of; it "
                "has "
                f"{', '.join(model.pilots)}"
            )


def _refuse_blind(model: ReducedModel) -> None:
    if not any(name.startswith(RIM_AXIAL) for name in model.sensor_names):
        raise ValueError(
            f"{model.name} has no sensor rows {RIM_AXIAL}...; expected the rim's recovery rows"
        )


def holds_pins(carrier: ReducedModel) -> bool:
    """Whether a carrier comes with its pins, bonded or joined: planets sit on its own pilots."""
    return any(name in carrier.pilots for name in ("pin_1_midspan", "pin_1_midspan_of_pin"))


def refuse_unfit_carrier(carrier: ReducedModel, gear: GearData) -> None:
    """Check a carrier before it is joined to pins and shaft.

    Raises
    ------
    ValueError
        Where a pilot or the rim's sensor rows are missing, or a planet would sit elsewhere than its
        gears' centre distance says.
    """
    refuse_missing_pilots(carrier, ("shaft_face", *FIXED_PILOTS[1:]))
    _refuse_blind(carrier)
    n_planets = planets_of(carrier.pilots)
    if holds_pins(carrier):
        pilots = _planet_pilots(carrier)
    else:
        pilots = tuple(
            f"pin_{pin}_{side}"
            for pin in range(1, n_planets + 1)
            for side in ("upwind", "downwind")
        )
    refuse_missing_pilots(carrier, pilots)
    for pilot in pilots:
        angle = float(pin_angles(n_planets)[int(pilot[4]) - 1])
        wanted = gear.centre_distance * np.array([-math.sin(angle), math.cos(angle)])
        position = np.asarray(carrier.pilots[pilot])[1:]
        if np.abs(position - wanted).max() > _SAME_PLACE:
            raise ValueError(
                f"{carrier.name} has {pilot} at y, z = {position[0]:.4f}, {position[1]:.4f} m; "
                f"expected {wanted[0]:.4f}, "
                f"{wanted[1]:.4f} m, the centre distance of the gears"
            )


@dataclass(frozen=True)
class ShaftData:
    """Uniform main shaft from the main bearing to the carrier.

    Raises
    ------
    ValueError
        Where a dimension is not positive or the bore is as wide as the shaft.
    """

    length: float = 2.1
    """GRC: WISDEM's GRC example [m]."""
    outer_diameter: float = 0.341
    """Derived: 50 MN m/rad over the length (2011 paper) [m]."""
    inner_diameter: float = 0.060
    """Derived, as above [m]."""
    youngs_modulus: float = 210e9
    """Chosen: steel [Pa]."""
    shear_modulus: float = 79.3e9
    """Derived: the one behind the diameter [Pa]."""
    density: float = 7850.0
    """Chosen: steel [kg/m^3]."""

    def __post_init__(self) -> None:
        for name in ("length", "outer_diameter", "youngs_modulus", "shear_modulus", "density"):
            if not getattr(self, name) > 0.0:
                raise ValueError(
                    f"[shaft] {name} is {getattr(self, name)}; expected a positive number"
                )
        if not 0.0 <= self.inner_diameter < self.outer_diameter:
            raise ValueError(
                f"[shaft] inner_diameter is {self.inner_diameter} m; expected less than "
                f"{self.outer_diameter} m"
            )


def beam_shaft(shaft: ShaftData, end: NDArray[np.float64]) -> ReducedModel:
    """Shaft as Timoshenko beam, pilots ``main_bearing_seat`` and ``carrier_joint`` at `end` [m]."""
    K, M = _beam_matrices(
        shaft.length,
        shaft.outer_diameter / 2.0,
        shaft.inner_diameter / 2.0,
        moduli=(shaft.youngs_modulus, shaft.shear_modulus),
        density=shaft.density,
    )
    pilots = {"main_bearing_seat": end - np.array([shaft.length, 0.0, 0.0]), "carrier_joint": end}
    mass = float(M[0, 0] + 2.0 * M[0, 6] + M[6, 6])
    polar = float(M[3, 3] + 2.0 * M[3, 9] + M[9, 9])
    across = polar / 2.0 + mass * shaft.length**2 / 12.0
    centre = end - np.array([shaft.length / 2.0, 0.0, 0.0])
    return ReducedModel(
        name="beam_shaft",
        K=K,
        M=M,
        D=np.zeros((12, 12)),
        labels=tuple(
            f"{pilot} {coordinate}" for pilot in pilots for coordinate in PILOT_COORDINATES
        ),
        pilots=pilots,
        pilot_coordinates={"main_bearing_seat": np.arange(6), "carrier_joint": np.arange(6, 12)},
        sensor_names=(),
        sensor_rows=np.zeros((0, 12)),
        mass_properties=MassProperties(mass, centre, np.diag([polar, across, across])),
    )


def joined_to_shaft(carrier: ReducedModel, shaft: ReducedModel) -> StageBody:
    """Tie the carrier's ``shaft_face`` to the shaft's ``carrier_joint``, all six coordinates.

    See :mod:`carrierflex.reduction.shaft_joint`.

    Parameters
    ----------
    carrier : ReducedModel
        Carrier with its pins: pilots ``pin_i_midspan`` or, joined in the reduced space,
        ``pin_i_midspan_of_pin``.
    shaft : ReducedModel
        Main shaft with the pilots ``main_bearing_seat`` and ``carrier_joint``, finite elements or
        :func:`beam_shaft`.

    Returns
    -------
    StageBody
        The joined body; its frame is the carrier's.

    Raises
    ------
    KeyError, ValueError
        Where a pilot is missing or the ends do not meet.
    """
    joint = Joint("carrier_joint", "shaft_face", math.inf, math.inf)
    bodies = [shaft, carrier]
    model = assembled(f"{carrier.name}_with_shaft", bodies, [joint])
    tilts = [imposed_motion(bodies, [joint], {joint.second: motion}) for motion in np.eye(6)[4:]]
    load = np.stack([tilt.load for tilt in tilts], axis=1)
    reading = np.stack([tilt.sensor_offset for tilt in tilts], axis=1)
    return StageBody(model, _planet_pilots(carrier), load, reading)


def _planet_pilots(carrier: ReducedModel) -> tuple[str, ...]:
    """Pilot of each planet.

    On the pin where pins are bodies of their own, else at the bonded pin's mid-span.
    """
    names = []
    for pin in range(1, planets_of(carrier.pilots) + 1):
        pin_pilot = f"pin_{pin}_midspan_of_pin"
        names.append(pin_pilot if pin_pilot in carrier.pilots else f"pin_{pin}_midspan")
    return tuple(names)


def _beam_matrices(
    length: float, outer: float, inner: float, *, moduli: tuple[float, float], density: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and consistent mass of a Timoshenko beam along x.

    With ``Phi = 12 E I / (kappa G A l^2)`` the bending stiffness is ``E I / (l^3 (1 + Phi)) [[12, 6
    l, ...], ...]``; the bending mass is that of the slender beam's cubic with its rotary inertia.

    References
    ----------
    Przemieniecki (1968), Theory of Matrix Structural Analysis, eqs 5.116 and 11.30.
    """
    E, G = moduli
    area = math.pi * (outer**2 - inner**2)
    second = math.pi / 4.0 * (outer**4 - inner**4)
    K, M = np.zeros((12, 12)), np.zeros((12, 12))
    bar = np.array([[1.0, -1.0], [-1.0, 1.0]])
    bar_mass = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    for row, stiffness, mass in (
        (0, E * area, density * area),
        (3, 2.0 * G * second, 2.0 * density * second),
    ):
        pair = np.ix_([row, row + 6], [row, row + 6])
        K[pair] += stiffness / length * bar
        M[pair] += mass * length * bar_mass
    # Shear coefficient of a round section (Cowper 1966, nu = 0.3).
    Phi = 12.0 * E * second / (0.89 * G * area * length**2)
    bending, bending_mass = _bending(length, E * second, Phi, density * area, density * second)
    # In the plane x-y the slope is +rz, in x-z it is -ry.
    for rows, signs in (
        ([1, 5, 7, 11], [1.0, 1.0, 1.0, 1.0]),
        ([2, 4, 8, 10], [1.0, -1.0, 1.0, -1.0]),
    ):
        S = np.diag(signs)
        K[np.ix_(rows, rows)] += S @ bending @ S
        M[np.ix_(rows, rows)] += S @ bending_mass @ S
    return K, M


def _bending(
    length: float, flexural: float, Phi: float, line_mass: float, line_inertia: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Stiffness and mass for (deflection, slope) at both ends."""
    a = length
    K = np.array([
        [12.0, 6.0 * a, -12.0, 6.0 * a],
        [6.0 * a, (4.0 + Phi) * a * a, -6.0 * a, (2.0 - Phi) * a * a],
        [-12.0, -6.0 * a, 12.0, -6.0 * a],
        [6.0 * a, (2.0 - Phi) * a * a, -6.0 * a, (4.0 + Phi) * a * a],
    ])  # fmt: skip
    M = np.array([
        [156.0, 22.0 * a, 54.0, -13.0 * a],
        [22.0 * a, 4.0 * a * a, 13.0 * a, -3.0 * a * a],
        [54.0, 13.0 * a, 156.0, -22.0 * a],
        [-13.0 * a, -3.0 * a * a, -22.0 * a, 4.0 * a * a],
    ])  # fmt: skip
    rotary = np.array([
        [36.0, 3.0 * a, -36.0, 3.0 * a],
        [3.0 * a, 4.0 * a * a, -3.0 * a, -a * a],
        [-36.0, -3.0 * a, 36.0, -3.0 * a],
        [3.0 * a, -a * a, -3.0 * a, 4.0 * a * a],
    ])  # fmt: skip
    return flexural / (a**3 * (1.0 + Phi)) * K, line_mass * a / 420.0 * M + line_inertia / (
        30.0 * a
    ) * rotary
