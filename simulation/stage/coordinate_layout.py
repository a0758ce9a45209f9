"""Where every coordinate of the stage stands.

The elastic body, the rigid parts, the parallel stages.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.pins import pin_angles
from carrierflex.reduction.rigid_body_checks import geometric_rigid_modes
from carrierflex.simulation.stage.stage_body import StageBody
from carrierflex.simulation.stage.stage_data import RigidPart, StageData

#: Rotations about x after the rigid parts, in this order.
SHAFTS = ("low_speed", "intermediate", "high_speed", "generator")
_PART_COORDINATES = ("Tx [m]", "Ty [m]", "Tz [m]", "Rx [rad]", "Ry [rad]", "Rz [rad]")


def motion_at(arm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Displacement and rotation of a rigid part's point from its six coordinates, shape (6, 6).

    Parameters
    ----------
    arm : ndarray, shape (3,)
        From the part's centre to the point [m].
    """
    x, y, z = arm
    G = np.eye(6)
    G[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return G


@dataclass(frozen=True, eq=False)
class CoordinateLayout:
    """Coordinates of the stage before the carrier angle is split off.

    Parameters
    ----------
    body : StageBody
        Elastic body.
    data : StageData
        Rigid parts and parallel stages.
    """

    body: StageBody
    data: StageData

    @property
    def n_planets(self) -> int:
        """Number of planets."""
        return self.body.n_planets

    @property
    def hub(self) -> str:
        """Pilot where rotor loads enter.

        The shaft's coupling flange where it has one, else the main bearing.
        """
        return (
            "coupling_flange"
            if "coupling_flange" in self.body.model.pilots
            else "main_bearing_seat"
        )

    def arm_at_hub(self, arm: float) -> float:
        """Distance upwind of the hub pilot [m] of a point `arm` [m] upwind of the main bearing."""
        pilots = self.body.model.pilots
        return arm - float(pilots["main_bearing_seat"][0] - pilots[self.hub][0])

    @cached_property
    def rigid_bodies(self) -> dict[str, RigidPart]:
        """Rigid parts by name in the order of their coordinates."""
        planets = {f"planet_{i}": self.data.planet for i in range(1, self.n_planets + 1)}
        return {
            **planets,
            "sun": self.data.sun,
            "ring": self.data.ring,
            "housing": self.data.housing,
        }

    @cached_property
    def rows(self) -> dict[str, NDArray[np.int64]]:
        """Rows of every rigid part (6) and shaft of the parallel stages (1)."""
        start = self.body.model.n_coordinates
        rows = {name: start + 6 * i + np.arange(6) for i, name in enumerate(self.rigid_bodies)}
        start += 6 * len(rows)
        return rows | {name: np.array([start + i]) for i, name in enumerate(SHAFTS)}

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.body.model.n_coordinates + 6 * len(self.rigid_bodies) + len(SHAFTS)

    @property
    def labels(self) -> tuple[str, ...]:
        """Every coordinate in words."""
        labels = [
            f"{name} {coordinate}" for name in self.rigid_bodies for coordinate in _PART_COORDINATES
        ]
        return (*self.body.model.labels, *labels, *(f"{shaft} Rx [rad]" for shaft in SHAFTS))

    def centre(self, name: str) -> NDArray[np.float64]:
        """Centre of a rigid part in the carrier frame [m]."""
        point = np.array([self.rigid_bodies[name].x, 0.0, 0.0])
        if name.startswith("planet"):
            angle = float(pin_angles(self.n_planets)[int(name[-1]) - 1])
            point[1:] = self.data.gear.centre_distance * np.array([-np.sin(angle), np.cos(angle)])
        return point

    def part_motion(self, name: str, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rows (6, n): displacement and rotation of a rigid part at `point` [m]."""
        G = np.zeros((6, self.n))
        G[:, self.rows[name]] = motion_at(point - self.centre(name))
        return G

    def pilot_motion(self, pilot: str) -> NDArray[np.float64]:
        """Rows (6, n): displacement and rotation of a pilot of the body."""
        G = np.zeros((6, self.n))
        G[np.arange(6), self.body.model.coordinates_of(pilot)] = 1.0
        return G

    @cached_property
    def _body_modes(self) -> NDArray[np.float64]:
        return geometric_rigid_modes(self.body.model)

    @cached_property
    def translations(self) -> NDArray[np.float64]:
        """Rigid translation of everything that has a place, along x, y and z, shape (n, 3)."""
        R = np.zeros((self.n, 3))
        R[: self.body.model.n_coordinates] = self._body_modes[:, :3]
        for name in self.rigid_bodies:
            R[self.rows[name][:3], [0, 1, 2]] = 1.0
        return R

    @cached_property
    def drive_motion(self) -> NDArray[np.float64]:
        """Rigid drive motion ``r_0``.

        Everything's coordinates per radian of carrier angle, ring and housing standing still.
        """
        gear, chain = self.data.gear, self.data.chain
        r = np.zeros(self.n)
        r[: self.body.model.n_coordinates] = self._body_modes[:, 3]
        for i, angle in enumerate(pin_angles(self.n_planets), start=1):
            rows = self.rows[f"planet_{i}"]
            r[rows[1:3]] = gear.centre_distance * np.array([-np.cos(angle), -np.sin(angle)])
            r[rows[3]] = 1.0 - gear.ring_teeth / gear.planet_teeth
        r[self.rows["sun"][3]] = r[self.rows["low_speed"]] = gear.ratio
        low, high = (
            chain.low_teeth[0] / chain.low_teeth[1],
            chain.high_teeth[0] / chain.high_teeth[1],
        )
        r[self.rows["intermediate"]] = -gear.ratio * low
        r[self.rows["high_speed"]] = r[self.rows["generator"]] = gear.ratio * low * high
        return r

    @cached_property
    def turning(self) -> NDArray[np.float64]:
        """Matrix J (n, n): ``x ×`` of every vector among the coordinates.

        Zero on modal amplitudes and on the parallel stages.
        """
        J = np.zeros((self.n, self.n))
        pilots = self.body.model.pilot_coordinates.values()
        for rows in (*pilots, *(self.rows[name] for name in self.rigid_bodies)):
            for y, z in ((rows[1], rows[2]), (rows[4], rows[5])):
                J[y, z], J[z, y] = -1.0, 1.0
        return J
