"""Load records of the mounting.

Rest, radial load, speed, torque and quick changes, as in figure 6 of the 2011 paper but shorter.

The rig's controller sets a load at every sample and goes there in a straight line, so that what is
recorded is what acts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.noise import slow_ripple

FloatArray = NDArray[np.float64]

RATE = 50.0
_SECONDS, REST = 60.0, 4.0
_SPEED = 2.3143
_SPEED_RIPPLE = 0.01

#: By run: radial load y, z [N] from a time [s] on; torque [N m] by (time, level); amplitude [N m]
#: and [N] of quick changes of torque and radial load; speed over nominal.
CONDITIONS = (
    ("radial load, then torque", (0.0, -1e5), 6.0, ((25.0, 8e4), (45.0, 1.6e5)), (0.0, 0.0), 1.0),
    (
        "torque in steps",
        (0.0, 0.0),
        6.0,
        ((8.0, 1.2e5), (20.0, 2.4e5), (32.0, 3.6e5), (48.0, 1.2e5)),
        (0.0, 0.0),
        1.0,
    ),
    ("radial load to the side", (8e4, 5e4), 14.0, ((6.0, 1.2e5), (40.0, 0.0)), (0.0, 0.0), 0.7),
    ("quick changes at half load", (-4e4, 4e4), 6.0, ((8.0, 1e5),), (6e4, 3e4), 1.0),
    ("quick changes at full load", (6e4, -6e4), 6.0, ((8.0, 2.2e5),), (1.1e5, 6e4), 0.85),
)
#: The one record of a case with a single condition.
ALONE = 3
#: Those with a radial load: without one, what turns or carries it leaves nothing.
LOADED = (0, 2, 3, 4)
_QUICK = (0.3, 3.0)  # Hz
_N_QUICK = 12
_LARGEST_TORQUE = 3.6e5


@dataclass(frozen=True, eq=False)
class MountingRecord:
    """True loads of one run.

    Parameters
    ----------
    condition : str
        What is done.
    time, speed, angle : ndarray, shape (n,)
        Samples [s], speed [rad/s], carrier angle [rad].
    loads : ndarray, shape (n, 3)
        Torque, ntl_y, ntl_z.
    """

    condition: str
    time: FloatArray
    speed: FloatArray
    angle: FloatArray
    loads: FloatArray


def _rise(time: FloatArray, start: float, seconds: float) -> FloatArray:
    """Smooth rise from 0 to 1, twice differentiable."""
    s = np.clip((time - start) / seconds, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def drawn_record(rng: np.random.Generator, number: int) -> MountingRecord:
    """Loads of one of the conditions.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    number : int
        Place of the condition.

    Returns
    -------
    MountingRecord
        True loads.
    """
    condition, radial, radial_from, levels, quick, speed = CONDITIONS[number]
    time = np.arange(int(_SECONDS * RATE)) / RATE
    run_speed = (
        speed
        * _SPEED
        * _rise(time, REST + 0.5, 6.0)
        * (1.0 + slow_ripple(rng, time, size=_SPEED_RIPPLE))
    )
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (run_speed[1:] + run_speed[:-1]) * time[1])])
    torque, before = np.zeros_like(time), 0.0
    for start, level in levels:
        torque += (level - before) * _rise(time, start, float(rng.uniform(0.5, 2.0)))
        before = level
    # Once and three times a turn, as planets pass.
    torque *= 1.0 + 0.02 * np.sin(turned + rng.uniform(0.0, 6.0)) + 0.01 * np.sin(3.0 * turned)
    torque += quick[0] * _quick_changes(rng, time)
    grown = _rise(time, radial_from, 6.0)
    loads = np.array(
        [
            torque,
            *(component * grown + quick[1] * _quick_changes(rng, time) for component in radial),
        ]
    ).T
    return MountingRecord(condition, time, run_speed, turned, loads)


def gusty_record(rng: np.random.Generator, number: int) -> MountingRecord:
    """Loads that no condition of the check has: steps of torque, gusts of radial load, pitching.

    Parameters
    ----------
    rng : Generator
        Random numbers.
    number : int
        Place of the run; its name.
    """
    time = np.arange(int(_SECONDS * RATE)) / RATE
    speed = rng.uniform(0.6, 1.1) * _SPEED * _rise(time, REST + 0.5, 5.0)
    speed *= 1.0 + slow_ripple(rng, time, size=_SPEED_RIPPLE)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * time[1])])
    torque, level = np.zeros_like(time), 0.0
    for start in np.sort(rng.uniform(5.0, 55.0, 5)).tolist():
        wanted = float(rng.uniform(0.0, _LARGEST_TORQUE))
        torque += (wanted - level) * _rise(time, start, float(rng.uniform(0.3, 3.0)))
        level = wanted
    torque *= 1.0 + 0.02 * np.sin(turned + rng.uniform(0.0, 6.0)) + 0.01 * np.sin(3.0 * turned)
    torque += rng.uniform(0.0, 1e5) * _quick_changes(rng, time)
    radial = []
    for _ in range(2):
        load = rng.uniform(-8e4, 8e4) * _rise(time, float(rng.uniform(5.0, 15.0)), 5.0)
        for start in rng.uniform(8.0, 55.0, 4).tolist():
            load += rng.uniform(-6e4, 6e4) * _gust(time, start, float(rng.uniform(0.8, 4.0)))
        radial.append(load + rng.uniform(0.0, 5e4) * _quick_changes(rng, time))
    loads = np.array([torque, *radial]).T
    return MountingRecord(f"gusts {number + 1}", time, speed, turned, loads)


def asked_record(condition: str, time: FloatArray, loads: FloatArray) -> MountingRecord:
    """Record under loads that were asked for, at standstill: the motion does not depend on speed.

    Parameters
    ----------
    condition : str
        Its name.
    time : ndarray, shape (n,)
        Times [s], increasing.
    loads : ndarray, shape (n, 3)
        Torque, ntl_y, ntl_z, straight between them.
    """
    samples = np.arange(int((time[-1] - time[0]) * RATE)) / RATE
    resampled = np.array([np.interp(samples, time - time[0], load) for load in loads.T]).T
    return MountingRecord(
        condition, samples, np.zeros_like(samples), np.zeros_like(samples), resampled
    )


def _gust(time: FloatArray, start: float, seconds: float) -> FloatArray:
    """One wave of ``(1 - cos) / 2``."""
    s = np.clip((time - start) / seconds, 0.0, 1.0)
    return np.asarray(0.5 * (1.0 - np.cos(2.0 * np.pi * s)))


def _quick_changes(rng: np.random.Generator, time: FloatArray) -> FloatArray:
    """Sines of 0.3 to 3 Hz, random phases, growing after the radial load, amplitude about 1."""
    total = np.zeros_like(time)
    for frequency in np.geomspace(*_QUICK, _N_QUICK) * (1.0 + 0.02 * rng.standard_normal(_N_QUICK)):
        total += np.sin(2.0 * np.pi * frequency * time + rng.uniform(0.0, 2.0 * np.pi))
    return total / np.sqrt(_N_QUICK) * _rise(time, 14.0, 4.0)
