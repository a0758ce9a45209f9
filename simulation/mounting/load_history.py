"""The load history of figure 6 of the 2011 paper, as a generator of inputs."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.problems import refuse
from carrierflex.simulation.mounting.inputs import MountingInputs

Array = NDArray[np.float64]


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
            if not np.isfinite(getattr(self, field.name))
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

    def inputs(self, first: float = 0.0, last: float | None = None) -> MountingInputs:
        """Inputs from `first` to `last` seconds of the history, every ``1 / sample_rate``.

        Parameters
        ----------
        first, last : float
            Part of the record [s]; the paper leaves out the first and the last part of it and
            simulates 520 s.

        Returns
        -------
        MountingInputs
            Time counts from the beginning of the history.
        """
        count = round(((self.duration if last is None else last) - first) * self.sample_rate)
        return self.at(first + np.arange(count) / self.sample_rate)

    def pieces(self, size: int) -> Iterator[MountingInputs]:
        """Inputs of the whole history in pieces of `size` samples, the last one of up to one more.

        Parameters
        ----------
        size : int
            Samples of a piece, two or more.
        """
        count = round(self.duration * self.sample_rate)
        first = 0
        while first < count:
            # A piece of one sample has no interval: it joins the one before.
            last = count if count - first <= size + 1 else first + size
            yield self.at(np.arange(first, last) / self.sample_rate)
            first = last

    def at(self, time: Array) -> MountingInputs:
        """Inputs at given times [s]."""
        speed = self._speed(time)
        angle = self._angle(time)
        radial = _smooth_rise(time, self.radial_load_from, self.radial_load_to)
        radial = radial * (1.0 + self.load_ripple * np.sin(angle))
        torque = self.torque * _smooth_rise(
            time, self.torque_from, self.torque_from + self.torque_rise
        )
        torque = torque * (1.0 + self.torque_ripple * np.sin(angle))
        return MountingInputs(time, torque, speed, angle, self.ntl_y * radial, self.ntl_z * radial)

    def _knots(self) -> tuple[Array, Array]:
        """Corners of the speed: start, up, down to zero within the stop, up to full speed."""
        middle = 0.5 * (self.stop_from + self.stop_to)
        reached = self.speed * (self.stop_from - self.start) / (self.full_speed - self.start)
        regained = self.speed * (self.stop_to - self.start) / (self.full_speed - self.start)
        times = np.array([self.start, self.stop_from, middle, self.stop_to, self.full_speed])
        return times, np.array([0.0, reached, 0.0, regained, self.speed])

    def _speed(self, time: Array) -> Array:
        return np.interp(time, *self._knots())

    def _angle(self, time: Array) -> Array:
        """Angle of the shaft [rad]: the exact integral of the piecewise linear speed."""
        times, speeds = self._knots()
        turned = np.concatenate(
            [[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))]
        )
        piece = np.clip(np.searchsorted(times, time) - 1, 0, len(times) - 2)
        inside = np.clip(time, times[0], times[-1]) - times[piece]
        slope = np.diff(speeds) / np.diff(times)
        after = np.maximum(time - times[-1], 0.0)
        return (
            turned[piece]
            + speeds[piece] * inside
            + 0.5 * slope[piece] * inside**2
            + self.speed * after
        )


def _smooth_rise(time: Array, begin: float, end: float) -> Array:
    """From 0 to 1 between two times, with zero slope at both."""
    s = np.clip((time - begin) / (end - begin), 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)
