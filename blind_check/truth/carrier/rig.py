"""What four axial probes read of a carrier that carries some effects.

The probes are not quite as declared.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.carrier.other_forms import OTHER_FORMS, other_form_signal
from carrierflex.blind_check.truth.carrier.signals import (
    NOMINAL_TORQUE,
    RADIUS,
    SIGNALS,
    RimRecord,
)
from carrierflex.blind_check.truth.noise import slow_ripple
from carrierflex.identification.campaign.declarations import Channel

FloatArray = NDArray[np.float64]

N_SENSORS = 4
SENSOR_NAMES = ("s047", "s137", "s227", "s317")
SENSOR_ANGLES = np.deg2rad([47.0, 137.0, 227.0, 317.0])
#: What a campaign says of the machine.
RIG = {"nominal_torque": NOMINAL_TORQUE, "sensor_radius": RADIUS, "n_planets": 3}
RATE = 20.0
_SPEED_RIPPLE, _TORQUE_RIPPLE = 0.01, 0.02


def _none() -> FloatArray:
    return np.zeros(N_SENSORS)


def rim_channels(
    noise_std: float, gain_std: float, angle_std: float | None = None
) -> tuple[Channel, ...]:
    """The four probes as a campaign declares them.

    Parameters
    ----------
    noise_std : float
        Standard deviation of the noise [m].
    gain_std, angle_std : float
        Standard deviations of gain and angle [rad]; None where the angle's is not declared.
    """
    return tuple(
        Channel(
            name,
            "axial_displacement",
            "m",
            angle=float(angle),
            radius=RADIUS,
            noise_std=noise_std,
            gain_std=gain_std,
            angle_std=angle_std,
        )
        for name, angle in zip(SENSOR_NAMES, SENSOR_ANGLES, strict=True)
    )


@dataclass(frozen=True, eq=False)
class CarrierState:
    """The true state of a rig.

    Parameters
    ----------
    effects : dict
        Values by effect, of those that add to one another.
    gain, turned, zero : ndarray, shape (4,)
        Withheld effects of the sensors: gain error, angle error [rad], offset [m].
    delay : float
        Withheld delay of all channels [s].
    gain_error, angle_error : ndarray, shape (4,)
        What is wrong with every probe besides: gain error, angle error [rad].
    outside : tuple of (str, float)
        A cause of no library, and its size [m].
    """

    effects: dict[str, dict[str, float]]
    gain: FloatArray = field(default_factory=_none)
    turned: FloatArray = field(default_factory=_none)
    zero: FloatArray = field(default_factory=_none)
    delay: float = 0.0
    gain_error: FloatArray = field(default_factory=_none)
    angle_error: FloatArray = field(default_factory=_none)
    outside: tuple[str, float] = ("", 0.0)

    def read(self, records: Sequence[RimRecord]) -> list[FloatArray]:
        """Signals of every run without noise, each shape (4, n)."""
        return [self._read(record) for record in records]

    def _read(self, record: RimRecord) -> FloatArray:
        angle = _angle_before(record, self.delay) if self.delay else record.angle
        shifted = replace(
            record, angle=angle, sensors=record.sensors + (self.turned + self.angle_error)[:, None]
        )
        total = _outside(*self.outside, shifted)
        for name, values in self.effects.items():
            if name in OTHER_FORMS:
                total = total + other_form_signal(name, shifted, values)
            else:
                total = total + SIGNALS[name](shifted, values)
        gain = (1.0 + self.gain) * (1.0 + self.gain_error)
        return gain[:, None] * total + self.zero[:, None]


@dataclass(frozen=True)
class AddedRun:
    """A run that is measured after those of a case.

    Parameters
    ----------
    torque : float
        Torque over nominal.
    ntl_y, ntl_z : float
        Radial load [N].
    speed : float
        Speed [rad/s].
    seconds : float
        Length.
    """

    torque: float
    ntl_y: float
    ntl_z: float
    speed: float
    seconds: float

    @property
    def load(self) -> tuple[float, float, float, float]:
        """What acts, as the loads of a check are written."""
        return self.torque, self.ntl_y, self.ntl_z, self.speed


def drawn_record(
    rng: np.random.Generator, number: int, load: Sequence[float], seconds: float
) -> RimRecord:
    """One run: torque and speed with slow ripple, constant radial load.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    number : int
        Place of the run.
    load : sequence of float
        Torque over nominal, radial load along y and z [N], speed [rad/s].
    seconds : float
        Length.

    Returns
    -------
    RimRecord
        True inputs.
    """
    time = np.arange(int(seconds * RATE)) / RATE
    speed = load[3] * (1.0 + slow_ripple(rng, time, size=_SPEED_RIPPLE))
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) / RATE)])
    torque = load[0] * NOMINAL_TORQUE * (1.0 + slow_ripple(rng, time, size=_TORQUE_RIPPLE))
    still = np.zeros_like(time)
    angle = rng.uniform(0.0, 2.0 * np.pi) + turned
    return RimRecord(
        number, time, angle, torque, load[1] + still, load[2] + still, SENSOR_ANGLES[:, None]
    )


def _angle_before(record: RimRecord, delay: float) -> FloatArray:
    """Carrier angle a while before each sample; beyond the record's ends at its mean speed."""
    late = record.time - delay
    time = record.time
    angle = record.angle
    speed = (angle[-1] - angle[0]) / (time[-1] - time[0])
    inside = np.interp(late, time, angle)
    inside = np.where(late < time[0], angle[0] + speed * (late - time[0]), inside)
    return np.where(late > time[-1], angle[-1] + speed * (late - time[-1]), inside)


def _outside(name: str, size: float, record: RimRecord) -> FloatArray:
    """Causes that no library holds."""
    v, t = record.sensors, record.time
    if name == "thermal_bow":  # a tilt of the carrier that grows as the shaft warms on one side
        return size * (1.0 - np.exp(-t / 20.0)) * np.sin(record.angle - v + 0.7)
    if name == "oil_whirl":  # the shaft whirls at 0.43 of its speed
        return size * np.sin(0.43 * record.angle - v)
    if (
        name == "loose_probe_bracket"
    ):  # one probe's bracket rocks at its own frequency, whatever turns
        rocking = size * np.sin(2.0 * np.pi * 0.83 * t + 0.3 * np.sin(0.9 * t))
        return rocking * np.array([[0.0], [1.0], [0.0], [0.0]])
    return np.zeros((N_SENSORS, t.size))
