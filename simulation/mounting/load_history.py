"""The load history of figure 6 of the 2011 paper: its times and levels.

The inputs that it makes: :mod:`carrierflex.simulation.mounting.history_inputs`.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import pairwise

from carrierflex.files.problems import refuse


@dataclass(frozen=True, eq=False)
class LoadHistory:
    """Rest, radial load, start, an unplanned stop, and torque.

    Times are those of section 4; levels are read off the axes of figure 6 or assumed.

    Parameters
    ----------
    duration, sample_rate : float
        Length [s] and samples a second [1/s]; 655 s in section 4.
    radial_load_from, radial_load_to : float
        The radial load grows between these times [s].
    ntl_y, ntl_z : float
        Radial load reached [N].
    start, full_speed : float
        The shaft starts and reaches its speed [s].
    stop_from, stop_to : float
        The speed drops to zero and rises again between these times [s].
    speed : float
        Speed reached [rad/s]; 22.1 rpm.
    torque_from, torque_rise : float
        The torque begins to grow [s] and the time it takes [s].
    torque : float
        Torque reached [N m].
    torque_ripple, load_ripple : float
        Amplitude of the once-per-revolution part of torque and radial load, relative to the present
        value [-].

    Raises
    ------
    ValueError
        Where a value is not finite, a duration is not positive, or the times are out of order.
    """

    duration: float = 655.0
    sample_rate: float = 100.0
    radial_load_from: float = 60.0
    radial_load_to: float = 105.0
    ntl_y: float = 0.0
    ntl_z: float = -100e3
    start: float = 195.0
    full_speed: float = 530.0
    stop_from: float = 260.0
    stop_to: float = 300.0
    speed: float = 2.3143
    torque_from: float = 535.0
    torque_rise: float = 20.0
    torque: float = 80e3
    torque_ripple: float = 0.02
    load_ripple: float = 0.02

    def __post_init__(self) -> None:
        refuse(
            f"load history: {field.name} is {getattr(self, field.name)}; expected a finite number"
            for field in fields(self)
            if not math.isfinite(getattr(self, field.name))
        )
        refuse(self._conflicts())

    def _conflicts(self) -> Iterator[str]:
        order = (
            "radial_load_from",
            "radial_load_to",
            "start",
            "stop_from",
            "stop_to",
            "full_speed",
            "torque_from",
        )
        for before, after in pairwise(order):
            if not getattr(self, before) < getattr(self, after):
                yield (
                    f"load history: {before} is {getattr(self, before)} s and {after} "
                    f"{getattr(self, after)} s; expected them in that order"
                )
        if not (
            self.duration * self.sample_rate >= 2.0
            and self.torque_rise > 0.0
            and self.radial_load_from >= 0.0
        ):
            yield (
                f"load history: duration {self.duration} s, sample_rate {self.sample_rate} 1/s, "
                f"torque_rise {self.torque_rise} s, radial_load_from {self.radial_load_from} s; "
                "expected two samples or more and positive times"
            )
