"""Rim signals of the carrier by the truth's own equations.

Vectors and Fourier series instead of the simulator's patterns.

The point of the carrier under a sensor at v has the housing coordinates ``y = -R sin v, z = R cos
v`` and, turned back by the carrier angle, ``y', z'``. A tilt with components ``(c, s)`` moves it by
``c y + s z`` along +x (the sign of the 2012 paper's equation 1). Deflections are Fourier series in
``v - theta`` of finite element curves of another carrier and mesh.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Values = Mapping[str, float]

NOMINAL_TORQUE = 360e3
RADIUS = 0.412
PIN_RADIUS = 0.308
N_PLANETS = 3
SADDLE = np.deg2rad(47.0)
#: Orders of the waves on the face.
WAVE_ORDERS = tuple(range(2, 9))
#: Orders of the curves' series; higher ones are below a nanometre at full torque.
_HIGHEST_ORDER = 30
#: Load [over the weight] in which a bearing that weight presses runs against its limit.
_LIMITING_SHARE = 0.3


@dataclass(frozen=True, eq=False)
class RimRecord:
    """What acts during one run, on the samples: arrays of shape (n,) or (n_channels, 1).

    `angle` is the true carrier angle [rad], `torque` the true torque [N m], `ntl_y`, `ntl_z` the
    radial load [N], `sensors` the true angles of the sensors [rad], `number` the place of the run.
    """

    number: int
    time: FloatArray
    angle: FloatArray
    torque: FloatArray
    ntl_y: FloatArray
    ntl_z: FloatArray
    sensors: FloatArray


@cache
def _series(curve: str) -> tuple[FloatArray, FloatArray]:
    """Cosine and sine amplitudes by order of a curve over one turn."""
    path = files("carrierflex.blind_check") / "data" / "curves_of_another_carrier.csv"
    lines = [
        line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#")
    ]
    column = lines[0].split(",").index(curve)
    values = np.array([float(line.split(",")[column]) for line in lines[1:]])
    transform = np.fft.rfft(values)[: _HIGHEST_ORDER + 1] * 2.0 / values.size
    return transform.real * np.r_[0.5, np.ones(_HIGHEST_ORDER)], -transform.imag


def curve_at(curve: str, angle: FloatArray) -> FloatArray:
    """Curve ``delta_s, delta_f`` [m/(kN m)] or ``g_s, g_f`` [m/N] at carrier-frame angles [rad]."""
    cosines, sines = _series(curve)
    turn = np.exp(1j * angle)
    # Horner's rule on c_n - j s_n: the real part of its sum with exp(j n angle) is the series.
    total = np.zeros_like(turn)
    for coefficient in (cosines - 1j * sines)[::-1]:
        total = total * turn + coefficient
    return np.asarray(total.real)


def _housing_point(record: RimRecord) -> tuple[FloatArray, FloatArray]:
    return -RADIUS * np.sin(record.sensors), RADIUS * np.cos(record.sensors)


def _carrier_point(record: RimRecord) -> FloatArray:
    """Carrier-frame angle under each sensor, shape (n_channels, n)."""
    return record.sensors - record.angle


def _tilt(record: RimRecord, values: Values, name: str) -> FloatArray:
    y, z = _housing_point(record)
    return values[f"phi_{name}"] * (
        np.cos(values[f"theta_{name}"]) * y + np.sin(values[f"theta_{name}"]) * z
    )


def _housing_tilt(record: RimRecord, values: Values) -> FloatArray:
    return _tilt(record, values, "H") + 0.0 * record.angle


def _torque_tilt(record: RimRecord, values: Values) -> FloatArray:
    return _tilt(record, values, "T") * record.torque / NOMINAL_TORQUE


def _carrier_tilt(record: RimRecord, values: Values) -> FloatArray:
    u = _carrier_point(record)
    c, s = (values["phi_PLC"] * trig(values["theta_PLC"]) for trig in (np.cos, np.sin))
    return RADIUS * (s * np.cos(u) - c * np.sin(u))


def _ntl_tilt(record: RimRecord, values: Values) -> FloatArray:
    y, z = _housing_point(record)
    along_y = values["a_y"] * record.ntl_y + values["a_z"] * record.ntl_z
    along_z = values["b_y"] * record.ntl_y + values["b_z"] * record.ntl_z
    return y * along_y + z * along_z


def _bearing_clearance(record: RimRecord, values: Values) -> FloatArray:
    """Tilt in the plane of the load, which runs against its limit as a tanh."""
    y, z = _housing_point(record)
    load = np.hypot(record.ntl_y, record.ntl_z)
    share = np.tanh(load / values["F_s"]) / np.maximum(load, 1.0)
    return values["phi_B"] * share * (y * record.ntl_y + z * record.ntl_z)


def _clearance_rocking(record: RimRecord, values: Values) -> FloatArray:
    """Two bearings that weight presses apart run against their limits as a tanh."""
    y, z = _housing_point(record)
    total = 0.0 * _carrier_point(record)
    for sign, weight in ((1.0, values["W_1"]), (-1.0, values["W_2"])):
        along_z = record.ntl_z + sign * weight
        load = np.hypot(record.ntl_y, along_z)
        limiting = _LIMITING_SHARE * weight
        share = np.tanh(load / limiting) / np.maximum(load, 1.0)
        at_rest = np.tanh(weight / limiting) * sign
        total += 0.5 * sign * (y * share * record.ntl_y + z * (share * along_z - at_rest))
    return values["phi_R"] * total


def _flexible_pins(record: RimRecord, values: Values) -> FloatArray:
    return values["rho_f"] * curve_at("delta_f", _carrier_point(record)) * record.torque / 1e3


def _stiff_pins(record: RimRecord, values: Values) -> FloatArray:
    return values["rho_s"] * curve_at("delta_s", _carrier_point(record)) * record.torque / 1e3


def _pin_clearance(record: RimRecord, values: Values) -> FloatArray:
    """Share that goes over from free to bonded pins."""
    # Three pins close one after the other, 5 % apart.
    u = _carrier_point(record)
    change = curve_at("delta_s", u) - curve_at("delta_f", u)
    closed = np.mean(
        [np.maximum(record.torque - values["T_c"] * f, 0.0) for f in (0.95, 1.0, 1.05)], axis=0
    )
    return values["c"] * change * closed / 1e3


def _pins(record: RimRecord, shares: list[FloatArray]) -> FloatArray:
    u = _carrier_point(record)
    force = record.torque / (N_PLANETS * PIN_RADIUS)
    loaded = [e * curve_at("g_f", u - 2.0 * np.pi * i / N_PLANETS) for i, e in enumerate(shares)]
    return force * np.sum(loaded, axis=0)


def _unequal_load_sharing(record: RimRecord, values: Values) -> FloatArray:
    e_1, e_2 = values["e_1"], values["e_2"]
    return _pins(record, [np.asarray(e_1), np.asarray(e_2), np.asarray(-e_1 - e_2)])


def _load_sharing_ntl(record: RimRecord, values: Values) -> FloatArray:
    shares = []
    for i in range(N_PLANETS):
        phase = np.exp(1j * (record.angle + 2.0 * np.pi * i / N_PLANETS))
        # The load in the frame whose real axis is z and whose imaginary axis is -y, turned to the
        # pin's own direction.
        turned = (record.ntl_z - 1j * record.ntl_y) * np.conj(phase)
        shares.append(values["kappa_r"] * turned.real + values["kappa_t"] * turned.imag)
    return _pins(record, shares)


def _flange_warp(record: RimRecord, values: Values) -> FloatArray:
    size = values["s_0"] + values["s_T"] * record.torque / NOMINAL_TORQUE
    size = size + values["s_y"] * record.ntl_y + values["s_z"] * record.ntl_z
    return np.cos(2.0 * (record.sensors - SADDLE)) * size


def _face_runout(record: RimRecord, values: Values) -> FloatArray:
    u = _carrier_point(record)
    total = np.zeros_like(u)
    for name, value in values.items():
        kind, order = name.split("_")
        total += value * (np.cos if kind == "a" else np.sin)(int(order) * u)
    return total


def _ring_pass(record: RimRecord, values: Values) -> FloatArray:
    y, z = _housing_point(record)
    phase = N_PLANETS * record.angle
    c = values["p_c"] + values["q_c"] * y + values["r_c"] * z
    s = values["p_s"] + values["q_s"] * y + values["r_s"] * z
    return (c * np.cos(phase) + s * np.sin(phase)) * record.torque / NOMINAL_TORQUE


def _thermal_drift(record: RimRecord, values: Values) -> FloatArray:
    """Warming towards a steady state, each run from its own start."""
    t = record.time - record.time[0]
    return (
        values[f"rise_{record.number}"] * (1.0 - np.exp(-t / values["tau"])) + 0.0 * record.sensors
    )


def _axial_offset(record: RimRecord, values: Values) -> FloatArray:
    return values[f"d_x of run{record.number + 1}"] + 0.0 * _carrier_point(record)


#: Signal of each effect that adds to the others, shape (n_channels, n).
SIGNALS: dict[str, Callable[[RimRecord, Values], FloatArray]] = {
    "axial_offset": _axial_offset,
    "housing_tilt": _housing_tilt,
    "torque_tilt": _torque_tilt,
    "carrier_tilt": _carrier_tilt,
    "flexible_pins": _flexible_pins,
    "stiff_pins": _stiff_pins,
    "pin_clearance": _pin_clearance,
    "unequal_load_sharing": _unequal_load_sharing,
    "load_sharing_ntl": _load_sharing_ntl,
    "ntl_tilt": _ntl_tilt,
    "bearing_clearance": _bearing_clearance,
    "clearance_rocking": _clearance_rocking,
    "flange_warp": _flange_warp,
    "face_runout": _face_runout,
    "ring_pass": _ring_pass,
    "thermal_drift": _thermal_drift,
}


def drawn_values(effect: str, rng: np.random.Generator, n_runs: int) -> dict[str, float]:
    """Parameters of an effect at a size of its own, to be scaled.

    Angles and shares of the parts are random.

    The sizes are about 30 micrometres at a sensor (rig: 360 kN m, 200 kN), so that the factor to
    reach a gap stays of order one.
    """
    angle = float(rng.uniform(-np.pi, np.pi))
    normal = [float(value) for value in rng.standard_normal(8)]
    if effect in ("housing_tilt", "torque_tilt", "carrier_tilt"):
        name = {"housing_tilt": "H", "torque_tilt": "T", "carrier_tilt": "PLC"}[effect]
        return {f"phi_{name}": 1e-4, f"theta_{name}": angle}
    if effect == "unequal_load_sharing":  # the three errors sum to zero; the largest is at most 0.1
        return {"e_1": 0.1 * np.cos(angle), "e_2": 0.1 * np.cos(angle + 2.0 * np.pi / 3.0)}
    if effect == "load_sharing_ntl":  # a tenth at 200 kN
        return {"kappa_r": 5e-7 * np.cos(angle), "kappa_t": 5e-7 * np.sin(angle)}
    if effect == "face_runout":
        first, second = rng.choice(WAVE_ORDERS, 2, replace=False)
        other = float(rng.uniform(-np.pi, np.pi))
        return {
            f"a_{first}": 4e-5 * np.cos(angle), f"b_{first}": 4e-5 * np.sin(angle),
            f"a_{second}": 2e-5 * np.cos(other), f"b_{second}": 2e-5 * np.sin(other),
        }  # fmt: skip
    if effect == "thermal_drift":
        rises = {
            f"rise_{k}": 4e-5 * (1.0 + 0.3 * value) for k, value in enumerate((normal * 2)[:n_runs])
        }
        return {"tau": float(rng.uniform(15.0, 60.0)), **rises}
    names, size = {
        "axial_offset": ([f"d_x of run{k + 1}" for k in range(n_runs)], 3e-5),
        "ntl_tilt": (["a_y", "a_z", "b_y", "b_z"], 4e-10),
        "flange_warp": (["s_0", "s_T", "s_y", "s_z"], 2e-5),
        "ring_pass": (["p_c", "p_s", "q_c", "q_s", "r_c", "r_s"], 3e-5),
    }.get(effect, ([], 0.0))
    if names:
        values = {name: size * value for name, value in zip(names, normal, strict=False)}
        if effect == "flange_warp":  # metres per newton: as large as the constant part at 100 kN
            values = {n: v / 1e5 if n in ("s_y", "s_z") else v for n, v in values.items()}
        if effect == "ring_pass":  # a tilt moves the rim by the radius
            values = {n: v if n.startswith("p") else v / RADIUS for n, v in values.items()}
        return values
    return {
        "flexible_pins": {"rho_f": 1.0},
        "stiff_pins": {"rho_s": 2.0},
        "pin_clearance": {"c": 1.0, "T_c": float(rng.uniform(120e3, 220e3))},
        "bearing_clearance": {
            "phi_B": 1e-4,
            "F_s": float(rng.uniform(3e4, 9e4)),
        },
        "clearance_rocking": {
            "phi_R": 1e-4,
            "W_1": float(rng.uniform(3e4, 9e4)),
            "W_2": float(rng.uniform(3e4, 15e4)),
        },
    }[effect]


#: Parameters that give the shape of an effect, not its size.
SHAPES = ("theta_H", "theta_T", "theta_PLC", "tau", "T_c", "F_s", "W_1", "W_2")


def scaled_values(values: Values, factor: float) -> dict[str, float]:
    """The same effect `factor` times as large."""
    return {
        name: value if name in SHAPES or name.startswith("form_") else factor * value
        for name, value in values.items()
    }
