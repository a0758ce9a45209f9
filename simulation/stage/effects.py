"""Effects inside the stage that can be switched on one by one.

Each carries the id that diagnosis knows.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from carrierflex.geometry.parameters import FEWEST_PLANETS, MOST_PLANETS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

#: Numbers that stand one a planet, and the nominal one.
_EACH_PLANET = {
    "pin_offset": 0.0,
    "sun_mesh_factor": 1.0,
    "ring_mesh_factor": 1.0,
    "planet_bearing_factor": 1.0,
}


@dataclass(frozen=True)
class StageEffects:
    """What departs from the symmetric, aligned stage; the default is none of it.

    Bearing clearance (id ``bearing_clearance``) is a property of the bearings:
    :class:`carrierflex.simulation.stage.stage_data.BearingData`. Effects of what the sensors read:
    :class:`carrierflex.simulation.stage.readings.ReadingEffects`. ``ntl_tilt`` and
    ``load_sharing_ntl`` are answers of the model to the radial load and cannot be switched.

    Raises
    ------
    ValueError
        Where a list does not hold one number a planet, or a factor is not positive.
    """

    phi_PLC: float = 0.0
    """``carrier_tilt``: tilt of the carrier against the main shaft [rad], paper eq. 1."""
    theta_PLC: float = 0.0
    """``carrier_tilt``: carrier-frame angle of its axis [rad]."""
    pin_offset: tuple[float, ...] = ()
    """``unequal_load_sharing``: tangential position error of each pin, along increasing angle
    [m]; as the three lists that follow empty where all planets are nominal."""
    sun_mesh_factor: tuple[float, ...] = ()
    """``unequal_load_sharing``: stiffness of each sun mesh over the nominal one."""
    ring_mesh_factor: tuple[float, ...] = ()
    """``unequal_load_sharing``: stiffness of each ring mesh over the nominal one."""
    planet_bearing_factor: tuple[float, ...] = ()
    """``unequal_load_sharing``: stiffness of each planet bearing over the nominal one."""
    pin_fit_play: float = 0.0
    """``pin_clearance``: angle by which a pin bends in its bore before it bears on the bore's edges
    [rad]; 0 for no such contact.

    Diametral clearance over the bore's length: 0.5 mrad is 0.03 mm over 65 mm."""
    pin_fit_closed: float = 1e8
    """Stiffness of each interface beyond the play, on top of the pin fit's [N m/rad]. Derived: from
    1e8 on the beam model of a pin in the carrier deflects with six peaks; acts only where there is
    a play."""
    ring_pass_offset: tuple[float, ...] = (0.0, 0.0)
    """``ring_pass``: axial motion of the housing's flange under the sensors per torque, as cos and
    sin of the planets' number times the carrier angle [m/N m]."""
    ring_pass_tilt: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    """``ring_pass``: tilt of the flange per torque, about the housing angle 0 as cos and sin, then
    about 90 deg [rad/N m]; its sign is that of the housing's tilt
    (:mod:`carrierflex.simulation`)."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.phi_PLC) and math.isfinite(self.theta_PLC)):
            raise ValueError(
                f"[effects] phi_PLC is {self.phi_PLC} and theta_PLC is {self.theta_PLC}; expected "
                "finite numbers"
            )
        for name in _EACH_PLANET:
            values = getattr(self, name)
            one_each = not values or FEWEST_PLANETS <= len(values) <= MOST_PLANETS
            if not (one_each and all(math.isfinite(value) for value in values)):
                raise ValueError(
                    f"[effects] {name} is {values}; expected {FEWEST_PLANETS} to {MOST_PLANETS} "
                    "finite numbers, one a planet"
                )
            if name.endswith("factor") and not min(values, default=1.0) > 0.0:
                raise ValueError(f"[effects] {name} is {values}; expected positive factors")
        for name, n in (("ring_pass_offset", 2), ("ring_pass_tilt", 4)):
            values = getattr(self, name)
            if len(values) != n or not all(math.isfinite(value) for value in values):
                raise ValueError(f"[effects] {name} is {values}; expected {n} finite numbers")
        if not (
            self.pin_fit_play >= 0.0
            and self.pin_fit_closed > 0.0
            and math.isfinite(self.pin_fit_closed)
        ):
            raise ValueError(
                f"[effects] pin_fit_play {self.pin_fit_play} rad and pin_fit_closed "
                f"{self.pin_fit_closed} N m/rad; expected "
                "a play >= 0 and a positive stiffness"
            )

    def of_planets(self, name: str, n_planets: int) -> tuple[float, ...]:
        """Numbers of one of the lists, one a planet of a stage; nominal ones where it is empty.

        Raises
        ------
        ValueError
            Where the list has another length than the stage has planets.
        """
        values: tuple[float, ...] = getattr(self, name) or (_EACH_PLANET[name],) * n_planets
        if len(values) != n_planets:
            raise ValueError(
                f"[effects] {name} holds {len(values)} numbers; expected {n_planets}, one a "
                "planet of this stage"
            )
        return values

    @property
    def misalignment(self) -> "NDArray[np.float64]":
        """Rotation of the carrier about y and z of its frame [rad], shape (2,).

        Sign of the paper's eq. 1 (:mod:`carrierflex.simulation`).
        """
        # Late: a case's keys are checked without a library of arrays.
        import numpy as np

        return self.phi_PLC * np.array([math.sin(self.theta_PLC), -math.cos(self.theta_PLC)])

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the effects that are on."""
        ids = []
        if self.phi_PLC != 0.0:
            ids.append("carrier_tilt")
        if any(
            value != nominal
            for name, nominal in _EACH_PLANET.items()
            for value in getattr(self, name)
        ):
            ids.append("unequal_load_sharing")
        if self.pin_fit_play > 0.0:
            ids.append("pin_clearance")
        if any(self.ring_pass_offset + self.ring_pass_tilt):
            ids.append("ring_pass")
        return tuple(ids)
