"""Nominal facts of the mounting rig, and the six motion sensors on the housing."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Motion sensors in the order of equation (8).
SENSORS = ("ssx", "spx", "ssz", "spz", "spy", "sbx")

#: Components of the housing's motion at the origin, equation (9).
HOUSING_MOTION = ("d_x", "d_y", "d_z", "theta_x", "theta_y", "theta_z")

_POSITIVE = (
    "R_x",
    "bushing_radial_stiffness",
    "housing_mass",
    "main_bearing_x",
    "gear_ratio",
    "zeroing_samples",
)
_NOT_NEGATIVE = (
    "bushing_radial_damping",
    "bushing_axial_stiffness",
    "bushing_axial_damping",
    "shaft_mass",
    "coupling_mass",
)


@dataclass(frozen=True)
class MountingRig:
    """Geometry, masses and bushings; the rig keys of a campaign of kind ``mounting``.

    Parameters
    ----------
    R_x, R_y, R_z, R_b, R_yz : float
        Positions of the sensors and of the bushings, figure 5 [m]. R_x, R_y, R_z are the paper's;
        R_b and R_yz are not printed: assumed, cond(T) is about 3.
    bushing_radial_stiffness, bushing_radial_damping : float
        Of each bushing in y and z [N/m, N s/m]; stiffness of table 3 (Lin). The damping of table 3,
        4.83e6, would nearly lock the roll at its frequency; the default is 2 % of it, about a tenth
        of critical.
    bushing_axial_stiffness, bushing_axial_damping : float
        Of each bushing in x [N/m, N s/m]; assumed: the trunnion pins slide axially.
    housing_mass, housing_inertia, housing_cg_x : float, tuple of 3 float, float
        Mass [kg], inertia about its own centre [kg m²] and the centre's x [m]. Housing parts of
        2.37 t with the shafts of the parallel stages (GRC parts list); inertia and centre assumed.
    shaft_mass, shaft_cg_x : float
        Main shaft with carrier and planets [kg], centre [m]: 1460 + 1232 kg (GRC parts list);
        centre assumed.
    coupling_mass, coupling_arm : float
        Equivalent mass of the dynamometer's coupling [kg] and its distance upwind of the main
        bearing [m]: section 3.
    main_bearing_x : float
        Distance of the main bearing upwind of the bushings [m]: shaft length of 2.1 m and half a
        gearbox flange; assumed.
    gear_ratio : float
        Speed of the generator over that of the main shaft: 120/21 · 82/23 · 88/22.
    zeroing_samples : int
        Samples at rest whose mean is the zero of every sensor (equation 14).
    axial_motion : bool
        Whether the housing may move along x on its axial bushing stiffness, as in the paper's
        model. Not a key of a campaign, whose baseline has no axial motion.

    Raises
    ------
    ValueError
        Where a value is not finite, negative or zero where it must not be.
    """

    R_x: float = 0.75
    R_y: float = 0.1575
    R_z: float = 0.75
    R_b: float = 0.6
    R_yz: float = 0.2
    bushing_radial_stiffness: float = 20.2e6
    bushing_radial_damping: float = 1.0e5
    bushing_axial_stiffness: float = 1.0e6
    bushing_axial_damping: float = 1.0e4
    housing_mass: float = 3310.0
    housing_inertia: tuple[float, float, float] = (1000.0, 900.0, 900.0)
    housing_cg_x: float = 0.25
    shaft_mass: float = 2692.0
    shaft_cg_x: float = -0.8
    coupling_mass: float = 4100.0
    coupling_arm: float = 1.75
    main_bearing_x: float = 2.3
    gear_ratio: float = 81.491
    zeroing_samples: int = 20
    axial_motion: bool = False

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            values = value if isinstance(value, tuple) else (value,)
            positive = field.name in _POSITIVE or field.name == "housing_inertia"
            if (
                not all(math.isfinite(number) for number in values)
                or (positive and min(values) <= 0.0)
                or (field.name in _NOT_NEGATIVE and min(values) < 0.0)
            ):
                what = "a positive number" if positive else "a finite number"
                what = "a number >= 0" if field.name in _NOT_NEGATIVE else what
                raise ValueError(f"rig: {field.name} is {value}; expected {what}")
        if len(self.housing_inertia) != 3:
            raise ValueError(
                f"rig: housing_inertia holds {len(self.housing_inertia)} numbers; expected 3"
            )

    @classmethod
    def from_table(cls, table: Mapping[str, Any]) -> "MountingRig":
        """Rig of a campaign's ``[rig]`` table; the campaign's contract has checked its keys."""
        return cls(**{**table, "housing_inertia": tuple(table["housing_inertia"])})

    def table(self) -> dict[str, Any]:
        """Rig as the ``[rig]`` table of a campaign."""
        table = {
            field.name: getattr(self, field.name)
            for field in fields(self)
            if field.name != "axial_motion"
        }
        return {**table, "housing_inertia": list(self.housing_inertia)}

    @property
    def sensor_matrix(self) -> "NDArray[np.float64]":
        """Matrix T of equation (8), shape (6, 6): sensors over the housing's motion at the origin.

        The row of spy leaves out the motion ``-z theta_x`` of its point, as printed: the sensor
        sits at the height of the axis.
        """
        # Late, here and below: a case's keys are checked without a library of arrays.
        import numpy as np

        R_x = self.R_x
        R_y = self.R_y
        R_z = self.R_z
        R_b = self.R_b
        R_yz = self.R_yz
        return np.array(
            [
                [1.0, 0.0, 0.0, 0.0, R_y, -R_z],
                [1.0, 0.0, 0.0, 0.0, R_y, R_z],
                [0.0, 0.0, 1.0, R_x, 0.0, 0.0],
                [0.0, 0.0, 1.0, -R_x, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0, 0.0, -R_yz],
                [1.0, 0.0, 0.0, 0.0, -R_b, 0.0],
            ]
        )

    def housing_motion(self, signals: "NDArray[np.float64]") -> "NDArray[np.float64]":
        """Motion of the housing from the sensors, ``d = T⁻¹ s`` (equation 10).

        Parameters
        ----------
        signals : ndarray, shape (n, 6)
            Displacements [m] in the order of :data:`SENSORS`.

        Returns
        -------
        ndarray, shape (n, 6)
            ``d_x, d_y, d_z`` [m], ``theta_x, theta_y, theta_z`` [rad].
        """
        import numpy as np

        return np.asarray(np.linalg.solve(self.sensor_matrix, signals.T).T, dtype=np.float64)
