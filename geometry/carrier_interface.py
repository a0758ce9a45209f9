"""Where a carrier is held, loaded and measured, read from the named surfaces of its mesh.

For carriers without parameters.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.cad_faces import circle_through
from carrierflex.geometry.pins import pin_angles, planets_of
from carrierflex.geometry.tet_mesh import NamedSurfaces

#: Pins stand at equal angles from 0 to this angle [rad] ...
_PIN_ANGLE = 1e-3
#: ... and their distances from the axis and the stations of their bores agree to this length [m].
_PIN_POSITION = 1e-4
#: Deviation [m] of a bore's nodes from a cylinder along x.
_ROUND = 1e-5


@dataclass(frozen=True, eq=False)
class CarrierInterface:
    """Points and dimensions that loads and pilots need of a carrier.

    Parameters
    ----------
    points : mapping of str to ndarray, shape (3,)
        Pilot position of every surface [m]: on the axis of its cylinder, half-way along.
    pin_stations : tuple of float
        Stations [m] of the pins' upwind bores, mid-spans and downwind bores.
    centre_distance : float
        Distance of the pins from the carrier's axis [m].
    sensor_radius : float
        Radius [m] of the sensor circle: the inner edge of the rim face.
    """

    points: Mapping[str, NDArray[np.float64]]
    pin_stations: tuple[float, float, float]
    centre_distance: float
    sensor_radius: float

    @property
    def n_planets(self) -> int:
        """Number of planets: of pins among the points."""
        return planets_of(self.points)


def carrier_interface(mesh: NamedSurfaces) -> CarrierInterface:
    """Read the interface off the named surfaces of a carrier.

    They are ``shaft_face``, ``rim_face``, ``upwind_seat``, ``downwind_seat`` and ``pin_i_...``.

    Parameters
    ----------
    mesh : NamedSurfaces
        Carrier in its own frame, with or without bonded pins.

    Raises
    ------
    KeyError
        Where a surface is missing.
    ValueError
        Where a bore is no cylinder along x, the pins do not stand at equal angles from 0 at one
        distance and station, or upwind and downwind are exchanged.
    """
    points = {}
    n_planets = planets_of(mesh.surfaces)
    for name in ("shaft_face", "upwind_seat", "downwind_seat"):
        points[name] = np.array([_middle(mesh, name), 0.0, 0.0])
    stations, distances = [], []
    for number, angle in enumerate(pin_angles(n_planets), start=1):
        bores = [f"pin_{number}_{side}" for side in ("upwind", "downwind")]
        points |= {name: _on_axis(mesh, name) for name in bores}
        _refuse_exchanged(mesh, *bores)
        first, last = (_extent(mesh, name) for name in bores)
        midspan = (first[1] + last[0]) / 2.0
        points[f"pin_{number}_midspan"] = np.array([midspan, *points[bores[0]][1:]])
        stations.append((points[bores[0]][0], midspan, points[bores[1]][0]))
        distances += [_distance(name, points[name], float(angle), n_planets) for name in bores]
    _refuse_exchanged(mesh, "upwind_seat", "downwind_seat")
    if np.ptp(stations, axis=0).max() > _PIN_POSITION or np.ptp(distances) > _PIN_POSITION:
        shown = "; ".join(f"({a:.5g}, {m:.5g}, {b:.5g}) m" for a, m, b in stations)
        raise ValueError(
            f"the pins' bores differ: stations (upwind, middle, downwind) {shown}, distances from "
            f"the axis {min(distances):.5g} to {max(distances):.5g} m; expected {n_planets} alike "
            f"to {_PIN_POSITION} m"
        )
    first_station, midspan, last_station = np.mean(stations, axis=0)
    rim = mesh.points[np.unique(mesh.surface("rim_face"))]
    radius = float(np.hypot(rim[:, 1], rim[:, 2]).min())
    return CarrierInterface(
        points,
        (float(first_station), float(midspan), float(last_station)),
        float(np.mean(distances)),
        radius,
    )


def _refuse_exchanged(mesh: NamedSurfaces, upwind: str, downwind: str) -> None:
    at = {name: _middle(mesh, name) for name in (upwind, downwind)}
    if at[upwind] >= at[downwind]:
        raise ValueError(
            f"surface {upwind!r} is at station x = {at[upwind]:.5g} m and {downwind!r} at "
            f"{at[downwind]:.5g} m; expected the upwind one first, x points downwind: exchange the "
            "two names, or turn [frame] axis of the surfaces file"
        )


def _extent(mesh: NamedSurfaces, name: str) -> tuple[float, float]:
    """Least and greatest station of the surface [m]."""
    x = mesh.points[np.unique(mesh.surface(name)), 0]
    return float(x.min()), float(x.max())


def _middle(mesh: NamedSurfaces, name: str) -> float:
    return sum(_extent(mesh, name)) / 2.0


def _on_axis(mesh: NamedSurfaces, name: str) -> NDArray[np.float64]:
    flat = mesh.points[np.unique(mesh.surface(name))] * np.array([0.0, 1.0, 1.0])
    centre, radius, deviation = circle_through(flat)
    if deviation > _ROUND:
        raise ValueError(
            f"surface {name!r} deviates by {deviation:.2g} m from a cylinder of radius "
            f"{radius:.4g} m along x; expected a bore"
        )
    return centre + np.array([_middle(mesh, name), 0.0, 0.0])


def _distance(name: str, point: NDArray[np.float64], angle: float, n_planets: int) -> float:
    """Distance of the bore from the carrier's axis [m].

    ValueError where it does not stand at `angle` [rad].
    """
    angle_of_bore = math.atan2(-point[1], point[2])
    off = math.remainder(angle_of_bore - angle, 2.0 * math.pi)
    if abs(off) > _PIN_ANGLE:
        raise ValueError(
            f"surface {name!r} is at {math.degrees(angle_of_bore) % 360.0:.4g} deg about the x "
            f"axis; expected {math.degrees(angle):.4g} deg (pins 1 to {n_planets} at equal "
            "angles from z, turning about +x)"
        )
    return math.hypot(point[1], point[2])
