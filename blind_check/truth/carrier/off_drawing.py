"""Truth of the kind "carrier" where the carrier itself differs from its drawing.

Rim curves of carriers with a dimension or constant off its drawing, or two, come as a table, which
``python -m validation.independent_carrier`` makes with a finite element code that shares nothing
with the project's: this module, as every truth, imports no finite elements. The pins have any fit,
as the drawing leaves it open.
"""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.blind_check.labels import MODEL, CasePlan, Label
from carrierflex.blind_check.truth.alias_table import same_class
from carrierflex.blind_check.truth.carrier.rig import RIG, drawn_record
from carrierflex.blind_check.truth.carrier.signals import (
    N_PLANETS,
    RADIUS,
    SIGNALS,
    RimRecord,
    curve_at,
    drawn_values,
    scaled_values,
)
from carrierflex.blind_check.truth.linear_refit import LinearBaseline
from carrierflex.blind_check.truth.noise import (
    case_rng,
    coloured_noise,
    largest_leak,
    noise_rng,
    root_mean_square,
    uniform_std,
)
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Baseline, Channel, InputSignal
from carrierflex.identification.campaign.records import Run

FloatArray = NDArray[np.float64]

#: Stands among the effects of a plan for whatever is off a carrier's drawing.
OFF_DRAWING = "off_drawing"
#: Causes beside it, or alone: fixed to housing or carrier, by load, torque or neither.
OTHERS = ("torque_tilt", "flange_warp", "ntl_tilt", "face_runout", "ring_pass")
#: Key of a label: the fit of the pins, a value of no cause.
PIN_FIT = "pins/fit"
#: Key of a label: gap over the floor of the carrier beyond every curve that the drawing allows.
BEYOND = "beyond_drawing"
#: File of the drawing's curves in a campaign's folder.
CURVES_FILE = "deflection_curves.csv"
#: Pin fits of a case [N m/rad], by name in the table; a rigid one ends the drawing's family.
FITS = ("0", "1e+06", "1e+07", "3e+07", "1e+08")
_FREE, _RIGID = "0", "inf"
#: What the baseline holds besides the carrier's curve, and the signs of its tilts' columns.
_KNOWN = ("axial_offset", "housing_tilt", "carrier_tilt")
_TILT = (np.sin, np.cos)
#: Angles of the sensors [deg]; a case turns all by one angle. To the first, a quarter turn apart,
#: planets that pass are waves of the carrier.
_LAYOUTS = (
    (47.0, 137.0, 227.0, 317.0),
    (20.0, 95.0, 205.0, 290.0),
    (10.0, 82.0, 154.0, 226.0, 298.0),
    (0.0, 50.0, 130.0, 175.0, 245.0, 310.0),
    (0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0),
)
_TORQUES = (1.0, 0.5, 0.75, 0.25)
_FEWEST_RUNS, _MOST_RUNS = 2, 8
_LARGEST_LOAD, _SECONDS = 2e5, 48.0
#: Coefficient of the noise.
MEMORY = 0.5
#: Noise [m]: least and most; of a case with nothing off.
_LEAST_NOISE, _MOST_NOISE, _PLAIN_NOISE = 0.3e-6, 20e-6, (1e-6, 5e-6)
#: Carriers that are drawn until one leaves the wanted gap.
_REDRAWS = 10
_TORQUE, _GAIN, _ANGLE = 0.01, 0.03, float(np.deg2rad(0.5))
#: Standard deviation that a drawing's values are declared with, over the value; the distance of
#: the pins is bored more closely.
_TOLERANCE, _CLOSE_TOLERANCE = 0.05, 0.01
_CLOSE = ("centre_distance",)
#: Share of the cases that take the program's default curves as the drawing's: another mesh.
_OWN_CURVES = 0.2
_CURVE_ERROR, _OWN_CURVE_ERROR = 0.01, 0.03
#: Values that may be off, as drawn [m, Pa, 1].
DRAWN = {
    "outer_radius": 0.435,
    "upwind_plate_thickness": 0.065,
    "downwind_plate_thickness": 0.045,
    "plate_gap": 0.240,
    "centre_distance": 0.308,
    "pin_hole_diameter": 0.160,
    "web_inner_radius": 0.235,
    "planet_clearance_radius": 0.219,
    "hub_outer_diameter": 0.460,
    "hub_inner_diameter": 0.320,
    "E": 176e9,
    "nu": 0.275,
    "pin_E": 210e9,
}
#: Constants of a material, and those of the pins.
_MATERIAL, _OF_PINS = ("E", "nu", "pin_E"), ("pin_E",)


@dataclass(frozen=True, eq=False)
class MadeCarrier:
    """A carrier as made.

    Parameters
    ----------
    off : mapping of str to float
        Values off the drawing, in SI units; empty of the drawing's own.
    curves : mapping of str to ndarray, shape (2, n_orders)
        Cosine and sine amplitudes [m per kN m] at orders 0, 3, 6 ... by pin fit.
    radial : mapping of str to ndarray, shape (2, n_orders)
        The same of the radial displacement; empty of a carrier whose it was not computed.
    """

    off: Mapping[str, float]
    curves: Mapping[str, FloatArray]
    radial: Mapping[str, FloatArray]


@cache
def made_carriers() -> tuple[MadeCarrier, ...]:
    """Every carrier of the table; the first is as drawn."""
    offs, curves = _table("curves_off_drawing.csv")
    _, radial = _table("radial_curves_off_drawing.csv")
    return tuple(
        MadeCarrier(offs[number], curves[number], radial.get(number, {})) for number in sorted(offs)
    )


def _table(name: str) -> tuple[dict[int, dict[str, float]], dict[int, dict[str, FloatArray]]]:
    """What is off each carrier of a table, and its amplitudes by pin fit, by number."""
    path = files("carrierflex.blind_check") / "data" / name
    lines = [row for row in path.read_text(encoding="utf-8").splitlines() if row[0] != "#"]
    offs: dict[int, dict[str, float]] = {}
    curves: dict[int, dict[str, FloatArray]] = {}
    for row in csv.DictReader(lines):
        number = int(row.pop("carrier"))
        words = (word.split("=") for word in row.pop("off").split())
        offs[number] = {name: float(value) for name, value in words}
        fit = row.pop("fit")
        values = np.array([float(value) for value in row.values()]).reshape(-1, 2).T
        curves.setdefault(number, {})[fit] = values
    return offs, curves


def effect_of(name: str) -> str:
    """Id of the effect that a value off the drawing is."""
    return f"{'material' if name in _MATERIAL else 'geometry'}/{name}"


def class_of_value(name: str) -> str:
    """Id of its class."""
    return "model/pins" if name in _OF_PINS else "model/carrier"


def write_drawn_curves(path: Path) -> None:
    """Write the drawing's curves as a campaign holds them: bonded pins, none, one pin's force.

    The last are of another carrier and mesh; no cause of this truth acts through them.
    """
    drawn = made_carriers()[0]
    angle = np.deg2rad(np.arange(360.0))
    columns = [series_at(drawn.curves[fit], angle) for fit in ("bonded", _FREE)]
    columns += [curve_at(name, angle) for name in ("g_s", "g_f")]
    columns += [series_at(drawn.radial[fit], angle) for fit in ("bonded", _FREE)]
    lines = ["theta_deg,delta_s,delta_f,g_s,g_f,delta_s_radial,delta_f_radial"]
    for k, values in enumerate(zip(*columns, strict=True)):
        lines.append(",".join([str(k), *(f"{value:.6e}" for value in values)]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def series_at(series: FloatArray, angle: FloatArray) -> FloatArray:
    """Curve [m per kN m] of amplitudes (2, n_orders) at carrier-frame angles [rad]."""
    turn = np.exp(1j * N_PLANETS * angle)
    # Horner's scheme over the orders 0, N, 2 N ...
    total = np.zeros_like(turn)
    for cosine, sine in series.T[::-1]:
        total = total * turn + (cosine - 1j * sine)
    return np.asarray(total.real)


@dataclass(frozen=True, eq=False)
class _Rig:
    """Runs, sensors and what a diagnosis refits, of one case.

    Parameters
    ----------
    records : tuple of RimRecord
        What acts, with the sensors where they are declared.
    torque_error : float
        Declared torque over the true one.
    """

    records: tuple[RimRecord, ...]
    torque_error: float

    @property
    def sensors(self) -> FloatArray:
        """Declared angles of the sensors [rad], shape (n_channels,)."""
        return self.records[0].sensors[:, 0]

    def of_curve(self, series: FloatArray) -> list[FloatArray]:
        """Signals of a curve under the true torque, by run, each shape (n_channels, n)."""
        return [
            series_at(series, record.sensors - record.angle) * record.torque / 1e3
            for record in self.records
        ]

    def read(self, name: str, values: Mapping[str, float]) -> list[FloatArray]:
        """Signals of a cause of the library."""
        return [SIGNALS[name](record, values) for record in self.records]

    def baseline(self, *, pin_fit: bool = False) -> LinearBaseline:
        """Refit of tilts of housing and carrier and offsets; with the pin fit the drawing's curves.

        A rigid fit adds its curve less that without pins, a looser one a share of it.
        """
        drawn = made_carriers()[0].curves
        columns = []
        for record in self.records:
            u = record.sensors - record.angle
            still = np.zeros_like(u)
            rows = [RADIUS * f(angle) + still for angle in (record.sensors, u) for f in _TILT]
            if pin_fit:
                torque = record.torque * self.torque_error / 1e3
                rows.append(series_at(drawn[_RIGID] - drawn[_FREE], u) * torque)
            columns.append(np.array([row.ravel() for row in rows]).T)
        share = columns[0].shape[1] - 1
        return LinearBaseline(columns, own_offset=True, not_negative=(share,) if pin_fit else ())


def model_case(plan: CasePlan, repeat: int = 0, *, n_radial: int = 0) -> tuple[Campaign, Label]:
    """Campaign and label of a case whose carrier may be off its drawing.

    Parameters
    ----------
    plan : CasePlan
        What acts, :data:`OFF_DRAWING`, one of :data:`OTHERS`, both or none, and the wanted gap.
    repeat : int
        Number of the noise.
    n_radial : int
        Radial sensors, at the angles of the first axial ones and zeroed without load; the carrier
        is then one whose radial curves were computed.
    """
    rng = case_rng(plan)
    others = [name for name in plan.effects if name != OFF_DRAWING]
    rig = _drawn_rig(rng, tells_waves="ring_pass" in others)
    drawn = made_carriers()[0]
    baseline = rig.baseline()
    wanted = plan.ratio / math.sqrt(max(len(plan.effects), 1))
    if OFF_DRAWING in plan.effects:
        carrier, fit, change = _drawn_carrier(rig, baseline, wanted, rng, n_radial > 0)
        # The carrier is what it is: its gap is set against the noise.
        floor = float(np.clip(change / wanted, _LEAST_NOISE, _MOST_NOISE))
    else:
        carrier, fit = drawn, str(rng.choice(FITS))
        floor = float(np.exp(rng.uniform(*np.log(_PLAIN_NOISE))))
    as_drawn = rig.of_curve(drawn.curves[fit])
    made = signals = rig.of_curve(carrier.curves[fit])
    causes = [
        _differences(rig.of_curve(_curve_of_value(name, value, fit)), as_drawn)
        for name, value in carrier.off.items()
    ]
    for name in others:
        unit = drawn_values(name, rng, len(rig.records))
        size = _size(baseline.residuals(rig.read(name, unit)))
        causes.append(rig.read(name, scaled_values(unit, wanted * floor / size)))
        signals = _sums(signals, causes[-1])
    effect = _differences(signals, as_drawn)
    free = rig.of_curve(drawn.curves[_FREE])
    family = rig.baseline(pin_fit=True)
    beyond = _size(family.residuals(_differences(made, free)))
    for name in _KNOWN:
        values = scaled_values(drawn_values(name, rng, len(rig.records)), rng.uniform(0.6, 1.5))
        signals = _sums(signals, rig.read(name, values))
    most = largest_leak(plan) * floor
    measured, share = _misread(rig, signals, carrier.curves[fit], most, rng)
    noise_generator = noise_rng(plan, repeat)
    measured = [
        signal + floor * coloured_noise(noise_generator, signal.shape, memory=MEMORY)
        for signal in measured
    ]
    without = _differences(measured, free)
    rho = _size(family.held_out(_differences(without, effect))) / _size(family.held_out(without))
    gap = _size(baseline.residuals(effect))
    label = _label(plan, carrier, fit, (floor, gap, beyond, rho))
    if len(causes) > 1:
        alone = tuple(_size(baseline.residuals(cause)) / floor for cause in causes)
        label = replace(label, own_gaps=alone)
    has_file = bool(rng.uniform() > _OWN_CURVES)
    campaign = _campaign(plan, rig, measured, (floor, share), has_file=has_file)
    if n_radial:
        series = carrier.radial[fit]
        campaign = _with_radial_sensors(
            campaign, rig, series, (n_radial, floor, share), noise_generator
        )
    return campaign, label


def _with_radial_sensors(
    campaign: Campaign,
    rig: _Rig,
    series: FloatArray,
    sizes: tuple[int, float, float],
    rng: np.random.Generator,
) -> Campaign:
    """Campaign with so many radial sensors; their gains are off as much as those of the others."""
    n, floor, share = sizes
    gain = 1.0 + share * rng.uniform(-_GAIN, _GAIN, (n, 1))
    channels = tuple(
        replace(channel, name=f"r{channel.name[1:]}", quantity="radial_displacement")
        for channel in campaign.channels[:n]
    )
    runs = []
    for run, curve in zip(campaign.runs, rig.of_curve(series), strict=True):
        noise = floor * coloured_noise(rng, curve[:n].shape, memory=MEMORY)
        read = zip(channels, gain * curve[:n] + noise, strict=True)
        signals = {channel.name: values for channel, values in read}
        runs.append(replace(run, signals={**run.signals, **signals}))
    return replace(campaign, channels=(*campaign.channels, *channels), runs=tuple(runs))


def _drawn_rig(rng: np.random.Generator, *, tells_waves: bool) -> _Rig:
    """Two to eight runs of any torque and radial load, four to eight sensors."""
    layout = _LAYOUTS[int(rng.integers(1 if tells_waves else 0, len(_LAYOUTS)))]
    angles = np.mod(np.deg2rad(np.array(layout)) + rng.uniform(0.0, 2.0 * np.pi), 2.0 * np.pi)
    records = []
    for k in range(int(rng.integers(_FEWEST_RUNS, _MOST_RUNS + 1))):
        size = _LARGEST_LOAD * float(rng.uniform(0.1, 1.0)) if k % 2 else 0.0
        turn, speed = float(rng.uniform(-np.pi, np.pi)), float(rng.uniform(1.4, 2.4))
        load = (_TORQUES[k % len(_TORQUES)], size * np.cos(turn), size * np.sin(turn), speed)
        records.append(replace(drawn_record(rng, k, load, _SECONDS), sensors=angles[:, None]))
    return _Rig(tuple(records), 1.0 + _TORQUE * float(rng.choice((-1.0, 1.0))))


def _drawn_carrier(
    rig: _Rig, baseline: LinearBaseline, wanted: float, rng: np.random.Generator, has_radial: bool
) -> tuple[MadeCarrier, str, float]:
    """A carrier off its drawing, its pin fit, and what it leaves at the drawn sizes [m]."""
    drawn, *others = made_carriers()
    others = [carrier for carrier in others if carrier.radial or not has_radial]
    for number in rng.permutation(len(others))[:_REDRAWS]:
        carrier, fit = others[number], str(rng.choice(FITS))
        made, as_drawn = (rig.of_curve(made_from.curves[fit]) for made_from in (carrier, drawn))
        change = _size(baseline.residuals(_differences(made, as_drawn)))
        if change >= wanted * _LEAST_NOISE:
            break
    return carrier, fit, change


def _curve_of_value(name: str, value: float, fit: str) -> FloatArray:
    """Curve of a carrier with one value off, as far along from the drawing's as the nearest one."""
    drawn, *others = made_carriers()
    alone = [carrier for carrier in others if carrier.off.keys() == {name}]
    nearest = min(alone, key=lambda carrier: abs(carrier.off[name] - value))
    share = (value - DRAWN[name]) / (nearest.off[name] - DRAWN[name])
    return drawn.curves[fit] + share * (nearest.curves[fit] - drawn.curves[fit])


def _misread(
    rig: _Rig,
    signals: Sequence[FloatArray],
    series: FloatArray,
    most: float,
    rng: np.random.Generator,
) -> tuple[list[FloatArray], float]:
    """Signals of sensors of a few per cent and half a degree off, which leave at most so much.

    The second result is the share of the largest errors up to which they were drawn.
    """
    n = len(rig.sensors)
    gain, turned = rng.uniform(-_GAIN, _GAIN, n), rng.uniform(-_ANGLE, _ANGLE, n)
    slopes = [
        series_at(_derivative(series), record.sensors - record.angle) * record.torque / 1e3
        for record in rig.records
    ]
    errors = [
        gain[:, None] * signal + turned[:, None] * slope
        for signal, slope in zip(signals, slopes, strict=True)
    ]
    leak = _size(rig.baseline(pin_fit=True).residuals(errors))
    share = min(1.0, most / leak)
    return [signal + share * error for signal, error in zip(signals, errors, strict=True)], share


def _derivative(series: FloatArray) -> FloatArray:
    """Amplitudes of the slope of a curve, per rad."""
    cosine, sine = series
    order = N_PLANETS * np.arange(len(cosine))
    return np.array([order * sine, -order * cosine])


def _label(
    plan: CasePlan, carrier: MadeCarrier, fit: str, sizes: tuple[float, float, float, float]
) -> Label:
    floor, gap, beyond, rho = sizes
    others = tuple(name for name in plan.effects if name != OFF_DRAWING)
    of_model = {effect_of(name): value - DRAWN[name] for name, value in carrier.off.items()}
    effects = (*of_model, *others)
    return Label(
        case=plan.name,
        kind="carrier",
        family=MODEL,
        effects=effects,
        acceptable=(
            *((effect,) for effect in of_model),
            *(same_class("carrier", effect) for effect in others),
        ),
        present=("sensor_gain", "sensor_angle") if effects else (),
        gap_over_floor=gap / floor,
        floor=floor,
        rho=rho,
        parameters={
            **{effect: {"change": change} for effect, change in of_model.items()},
            PIN_FIT: {"k": float(fit)},
        },
        where={BEYOND: beyond / floor},
        classes=tuple(sorted({class_of_value(name) for name in carrier.off})),
    )


def _campaign(
    plan: CasePlan,
    rig: _Rig,
    measured: Sequence[FloatArray],
    sizes: tuple[float, float],
    *,
    has_file: bool,
) -> Campaign:
    """Records as a campaign of a user with a drawing and its tolerances."""
    floor, share = sizes
    names = [f"s{round(np.rad2deg(angle)) % 360:03d}" for angle in rig.sensors]
    channels = tuple(
        Channel(
            name,
            "axial_displacement",
            "m",
            angle=float(angle),
            radius=RADIUS,
            noise_std=floor,
            gain_std=uniform_std(share * _GAIN),
            angle_std=uniform_std(share * _ANGLE),
        )
        for name, angle in zip(names, rig.sensors, strict=True)
    )
    runs = []
    for record, signals in zip(rig.records, measured, strict=True):
        name = f"run{record.number + 1}"
        inputs = {
            "carrier_angle": record.angle,
            "torque": record.torque * rig.torque_error,
            "ntl_y": record.ntl_y,
            "ntl_z": record.ntl_z,
        }
        columns = dict(zip(names, signals, strict=True))
        load = f"load {record.number + 1}"
        runs.append(Run(name, f"{name}.parquet", load, record.time, inputs, columns))
    tolerances = {
        name: value * (_CLOSE_TOLERANCE if name in _CLOSE else _TOLERANCE)
        for name, value in DRAWN.items()
    }
    file = {"deflection_curves": CURVES_FILE} if has_file else {}
    error = _CURVE_ERROR if has_file else _OWN_CURVE_ERROR
    return Campaign(
        kind="carrier",
        name=plan.name,
        baseline=Baseline("model", (*_KNOWN, "flexible_pins")),
        rig={**RIG, **file, "tolerances": {**tolerances, "curves": error}},
        channels=channels,
        runs=tuple(runs),
        inputs=(InputSignal("torque", "N m", gain_std=_TORQUE),),
    )


def _sums(signals: Sequence[FloatArray], others: Sequence[FloatArray]) -> list[FloatArray]:
    return [signal + other for signal, other in zip(signals, others, strict=True)]


def _differences(signals: Sequence[FloatArray], others: Sequence[FloatArray]) -> list[FloatArray]:
    return [signal - other for signal, other in zip(signals, others, strict=True)]


def _size(signals: Sequence[FloatArray]) -> float:
    return root_mean_square(np.concatenate([signal.reshape(-1) for signal in signals]))
