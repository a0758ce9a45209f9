"""Causes of the carrier in forms that no law and no column of a diagnosis has, with their classes.

A class is ``frame/pattern/follows``: what turns or stays, its pattern over the sensors, and the
load it follows. Sizes are about 30 micrometres at a sensor at 360 kN m and 200 kN.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.truth.carrier.signals import (
    N_PLANETS,
    NOMINAL_TORQUE,
    RimRecord,
    Values,
    curve_at,
)

FloatArray = NDArray[np.float64]

_SIZE = 3e-5
#: Radial load at which a cause has its size [N], and time after which a drift has it [s].
_LOAD, _TIME = 2e5, 30.0

#: Frame and pattern of the library's laws, from their equations.
CLASSES_OF_LAW: Mapping[str, tuple[str, ...]] = {
    "axial_offset": ("housing/offset",),
    "thermal_drift": ("housing/offset",),
    "housing_tilt": ("housing/tilt",),
    "torque_tilt": ("housing/tilt",),
    "ntl_tilt": ("housing/tilt",),
    "bearing_clearance": ("housing/tilt",),
    "clearance_rocking": ("housing/tilt",),
    "flange_warp": ("housing/saddle",),
    "ring_pass": ("housing/planet_pass",),
    "load_sharing_ntl": ("housing/load_sharing",),
    "carrier_tilt": ("carrier/tilt",),
    "radial_offset": ("housing/tilt",),
    "eccentricity": ("carrier/tilt",),
    "flexible_pins": ("carrier/waves",),
    "stiff_pins": ("carrier/waves",),
    "pin_clearance": ("carrier/waves",),
    "face_runout": ("carrier/waves",),
    "unequal_load_sharing": ("carrier/load_sharing",),
    "sensor_gain": ("channel/gain",),
    "sensor_zero": ("channel/zero",),
    "sensor_angle": ("channel/angle",),
    "sensor_delay": ("clock/delay",),
}


@dataclass(frozen=True)
class OtherForm:
    """One cause.

    Parameters
    ----------
    shape, follows : str
        Its frame and pattern, and what it follows.
    signal : callable
        Signal of a run, shape (n_channels, n), of unit size; its values are those drawn.
    draw : callable
        Values of its form from random numbers.
    """

    shape: str
    follows: str
    signal: Callable[[RimRecord, Values], FloatArray]
    draw: Callable[[np.random.Generator], dict[str, float]]


def other_form_signal(name: str, record: RimRecord, values: Values) -> FloatArray:
    """Signal of a cause [m], shape (n_channels, n)."""
    return values["size"] * OTHER_FORMS[name].signal(record, values)


def drawn_form(name: str, rng: np.random.Generator) -> dict[str, float]:
    """Values of a cause: its size [m] and those of its form, which no size changes."""
    return {"size": _SIZE, **OTHER_FORMS[name].draw(rng)}


def _drawn(**ranges: tuple[float, float]) -> Callable[[np.random.Generator], dict[str, float]]:
    """Values between limits; their names say that they are of the form."""

    def draw(rng: np.random.Generator) -> dict[str, float]:
        """Uniform values of every range."""
        return {f"form_{name}": float(rng.uniform(*ends)) for name, ends in ranges.items()}

    return draw


_ANY_ANGLE = (-np.pi, np.pi)


def _torque(record: RimRecord) -> FloatArray:
    return record.torque / NOMINAL_TORQUE


def _power(record: RimRecord, values: Values) -> FloatArray:
    return np.asarray(_torque(record) ** values["form_power"])


def _bounded(record: RimRecord, values: Values) -> FloatArray:
    """Grows with torque up to a limit, and stays."""
    return np.minimum(_torque(record) / values["form_limit"], 1.0)


def _load(record: RimRecord) -> tuple[FloatArray, FloatArray]:
    """Size of the radial load over the largest, and its direction in the housing."""
    size = np.hypot(record.ntl_y, record.ntl_z)
    return size / _LOAD, np.arctan2(record.ntl_y, record.ntl_z)


def _along_load(record: RimRecord, values: Values, height: FloatArray) -> FloatArray:
    """Tilt of the housing in a plane that turns with the load."""
    _, direction = _load(record)
    return height * np.cos(record.sensors + direction - values["form_angle"])


def _root_tilt(record: RimRecord, values: Values) -> FloatArray:
    size, _ = _load(record)
    return _along_load(record, values, size ** values["form_power"])


def _hyperbolic_tilt(record: RimRecord, values: Values) -> FloatArray:
    size, _ = _load(record)
    return _along_load(record, values, size / (size + values["form_limit"]))


def _late_tilt(record: RimRecord, values: Values) -> FloatArray:
    """Nothing up to a load, a tilt along it beyond."""
    size, _ = _load(record)
    return _along_load(record, values, np.maximum(size - values["form_limit"], 0.0))


def _torque_tilt(record: RimRecord, values: Values) -> FloatArray:
    return np.cos(record.sensors - values["form_angle"]) * _power(record, values)


def _bounded_tilt(record: RimRecord, values: Values) -> FloatArray:
    return np.cos(record.sensors - values["form_angle"]) * _bounded(record, values)


def _saddle(record: RimRecord) -> FloatArray:
    # Four sensors see one of the two saddles.
    return np.cos(2.0 * record.sensors - np.deg2rad(94.0))


def _torque_saddle(record: RimRecord, values: Values) -> FloatArray:
    return _saddle(record) * _power(record, values)


def _load_saddle(record: RimRecord, values: Values) -> FloatArray:
    size, direction = _load(record)
    return _saddle(record) * size ** values["form_power"] * np.cos(direction - values["form_angle"])


def _pass(record: RimRecord, values: Values) -> FloatArray:
    """Offset and tilt of the housing at the planets' order."""
    phase = N_PLANETS * record.angle
    return np.cos(phase - values["form_phase"]) + values["form_tilt"] * np.cos(
        phase - values["form_other"]
    ) * np.cos(record.sensors - values["form_angle"])


def _torque_pass(record: RimRecord, values: Values) -> FloatArray:
    return _pass(record, values) * _power(record, values)


def _bent_face(record: RimRecord, values: Values) -> FloatArray:
    """Two halves that meet in kinks."""
    return np.abs(np.cos(record.sensors - record.angle - values["form_angle"]))


def _dented_face(record: RimRecord, values: Values) -> FloatArray:
    """One bump on the face."""
    u = record.sensors - record.angle - values["form_angle"]
    return 2.0 * np.exp((np.cos(u) - 1.0) / values["form_width"] ** 2)


def _bounded_lobes(record: RimRecord, values: Values) -> FloatArray:
    u = N_PLANETS * (record.sensors - record.angle - values["form_angle"])
    return (np.cos(u) + values["form_third"] * np.cos(3.0 * u)) * _bounded(record, values)


def _stiffening_lobes(record: RimRecord, values: Values) -> FloatArray:
    u = N_PLANETS * (record.sensors - record.angle - values["form_angle"])
    return np.exp(0.8 * np.cos(u)) * _power(record, values)


def _uneven_lobes(record: RimRecord, values: Values) -> FloatArray:
    """One planet carries more, by a share that itself follows the torque."""
    u = record.sensors - record.angle
    other = 2.0 * np.pi / N_PLANETS * (1.0 if values["form_other"] < 0.0 else 2.0)
    first, second = (curve_at("g_f", u - pin) for pin in (0.0, other))
    height = np.abs(curve_at("g_f", np.linspace(0.0, 2.0 * np.pi, 60))).max()
    return (first - second) / height * _power(record, values)


def _changing_pins(record: RimRecord, values: Values) -> FloatArray:
    """Planet loads that change once a turn with a radial load that saturates."""
    size, direction = _load(record)
    height = np.tanh(size / values["form_limit"]) * _torque(record)
    u = record.sensors - record.angle
    largest = np.abs(curve_at("g_f", np.linspace(0.0, 2.0 * np.pi, 60))).max()
    total = np.zeros_like(u)
    for k in range(N_PLANETS):
        pin = 2.0 * np.pi * k / N_PLANETS
        share = np.cos(record.angle + pin + direction - values["form_angle"])
        total += share * curve_at("g_f", u - pin) / largest
    return height * total


def _rooted_drift(record: RimRecord, values: Values) -> FloatArray:
    """All sensors drift as a power of the time."""
    t = (record.time - record.time[0]) / _TIME
    return t ** values["form_power"] + 0.0 * record.sensors


def _bent_drift(record: RimRecord, values: Values) -> FloatArray:
    """A drift that sets in after a while and comes to rest."""
    t = (record.time - record.time[0]) / _TIME
    return 1.0 / (1.0 + np.exp(-6.0 * (t - values["form_limit"]))) + 0.0 * record.sensors


OTHER_FORMS: dict[str, OtherForm] = {
    "root_tilt": OtherForm(
        "housing/tilt", "radial_load", _root_tilt, _drawn(power=(0.4, 0.8), angle=_ANY_ANGLE)
    ),
    "hyperbolic_tilt": OtherForm(
        "housing/tilt", "radial_load", _hyperbolic_tilt, _drawn(limit=(0.1, 0.5), angle=_ANY_ANGLE)
    ),
    "late_tilt": OtherForm(
        "housing/tilt", "radial_load", _late_tilt, _drawn(limit=(0.1, 0.2), angle=_ANY_ANGLE)
    ),
    "torque_power_tilt": OtherForm(
        "housing/tilt", "torque", _torque_tilt, _drawn(power=(1.5, 2.5), angle=_ANY_ANGLE)
    ),
    "bounded_torque_tilt": OtherForm(
        "housing/tilt", "torque", _bounded_tilt, _drawn(limit=(0.4, 0.7), angle=_ANY_ANGLE)
    ),
    "torque_saddle": OtherForm(
        "housing/saddle", "torque", _torque_saddle, _drawn(power=(0.6, 2.0))
    ),
    "load_saddle": OtherForm(
        "housing/saddle", "radial_load", _load_saddle, _drawn(power=(0.5, 0.9), angle=_ANY_ANGLE)
    ),
    "torque_power_pass": OtherForm(
        "housing/planet_pass",
        "torque",
        _torque_pass,
        _drawn(
            power=(0.5, 2.0),
            phase=_ANY_ANGLE,
            other=_ANY_ANGLE,
            angle=_ANY_ANGLE,
            tilt=(0.0, 1.0),
        ),
    ),
    "steady_pass": OtherForm(
        "housing/planet_pass",
        "none",
        _pass,
        _drawn(phase=_ANY_ANGLE, other=_ANY_ANGLE, angle=_ANY_ANGLE, tilt=(0.0, 1.0)),
    ),
    "bent_face": OtherForm("carrier/waves", "none", _bent_face, _drawn(angle=_ANY_ANGLE)),
    "dented_face": OtherForm(
        "carrier/waves", "none", _dented_face, _drawn(angle=_ANY_ANGLE, width=(0.5, 0.9))
    ),
    "bounded_lobes": OtherForm(
        "carrier/waves",
        "torque",
        _bounded_lobes,
        _drawn(angle=_ANY_ANGLE, third=(0.0, 0.6), limit=(0.4, 0.7)),
    ),
    "stiffening_lobes": OtherForm(
        "carrier/waves", "torque", _stiffening_lobes, _drawn(angle=_ANY_ANGLE, power=(1.3, 2.2))
    ),
    "uneven_lobes": OtherForm(
        "carrier/load_sharing", "torque", _uneven_lobes, _drawn(power=(0.5, 2.0), other=(-1.0, 1.0))
    ),
    "changing_pins": OtherForm(
        "housing/load_sharing",
        "torque+radial_load",
        _changing_pins,
        _drawn(limit=(0.2, 0.8), angle=_ANY_ANGLE),
    ),
    "rooted_drift": OtherForm("housing/offset", "time", _rooted_drift, _drawn(power=(0.5, 1.5))),
    "bent_drift": OtherForm("housing/offset", "time", _bent_drift, _drawn(limit=(0.4, 1.0))),
}
