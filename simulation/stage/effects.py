"""Effects inside the stage that can be switched on one by one; each carries the id that diagnosis knows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry.parameters import N_PINS

_ONE_EACH = (1.0,) * N_PINS
_NONE_EACH = (0.0,) * N_PINS


@dataclass(frozen=True)
class StageEffects:
    """What departs from the symmetric, aligned stage; the default is none of it.

    Bearing clearance (id ``bearing_clearance``) is a property of the bearings: :class:`simulation.stage.stage_data.BearingData`.
    Effects of what the sensors read: :class:`simulation.stage.readings.ReadingEffects`. ``ntl_tilt`` and ``load_sharing_ntl`` are
    answers of the model to the radial load and cannot be switched.

    Raises
    ------
    ValueError
        Where a list does not hold one number a planet, or a factor is not positive.
    """

    phi_PLC: float = 0.0  # noqa: N815 - the paper's symbol
    """``carrier_tilt``: tilt of the carrier against the main shaft [rad], paper eq. 1."""
    theta_PLC: float = 0.0  # noqa: N815
    """``carrier_tilt``: carrier-frame angle of its axis [rad]."""
    pin_offset: tuple[float, ...] = _NONE_EACH
    """``unequal_load_sharing``: tangential position error of each pin, along increasing angle [m]."""
    sun_mesh_factor: tuple[float, ...] = _ONE_EACH
    """``unequal_load_sharing``: stiffness of each sun mesh over the nominal one."""
    ring_mesh_factor: tuple[float, ...] = _ONE_EACH
    """``unequal_load_sharing``: stiffness of each ring mesh over the nominal one."""
    planet_bearing_factor: tuple[float, ...] = _ONE_EACH
    """``unequal_load_sharing``: stiffness of each planet bearing over the nominal one."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.phi_PLC) and math.isfinite(self.theta_PLC)):
            raise ValueError(f"StageEffects: phi_PLC {self.phi_PLC} and theta_PLC {self.theta_PLC} must be finite")
        for name in ("pin_offset", "sun_mesh_factor", "ring_mesh_factor", "planet_bearing_factor"):
            values = getattr(self, name)
            if len(values) != N_PINS or not all(math.isfinite(value) for value in values):
                raise ValueError(f"StageEffects.{name} is {values}; expected {N_PINS} finite numbers, one a planet")
            if name.endswith("factor") and not min(values) > 0.0:
                raise ValueError(f"StageEffects.{name} is {values}; expected positive factors")

    @property
    def misalignment(self) -> NDArray[np.float64]:
        """Rotation of the carrier about y and z of its frame [rad], shape (2,); sign of the paper's eq. 1 (:mod:`simulation`)."""
        return self.phi_PLC * np.array([math.sin(self.theta_PLC), -math.cos(self.theta_PLC)])

    @property
    def ids(self) -> tuple[str, ...]:
        """Ids of the effects that are on."""
        found = []
        if self.phi_PLC != 0.0:
            found.append("carrier_tilt")
        nominal = StageEffects()
        if any(
            getattr(self, name) != getattr(nominal, name)
            for name in ("pin_offset", "sun_mesh_factor", "ring_mesh_factor", "planet_bearing_factor")
        ):
            found.append("unequal_load_sharing")
        return tuple(found)
