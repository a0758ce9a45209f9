"""rim_motion.json: what the sensors of a carrier read over one turn, measured and simulated.

The report draws a part of it; ``carrierflex view`` turns the rim in space with all of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.diagnosis.report.words import added_effects
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.json_files import read_document, save_json
from carrierflex.files.result_reading import restored
from carrierflex.files.result_schemas import json_content, json_table
from carrierflex.files.shown_values import shown
from carrierflex.identification.campaign.campaign import Campaign

RIM_MOTION_FILE = "rim_motion.json"
_FORMAT, _VERSION = "carrierflex-rim-motion", 1
#: Signals that are written: some 5 kB each, and 40 kB of memory while they are.
_MOST_SIGNALS = 2000
#: Readings in the file's unit lie below, so that their squares are numbers.
_LARGEST = 1e100


@dataclass(frozen=True, eq=False)
class RimSignal:
    """Mean turn of one sensor in one run."""

    run: Annotated[str, "Run"]
    channel: Annotated[str, "Sensor"]
    direction: Annotated[
        str, "``axial`` or ``radial``: which displacement of the rim the sensor reads"
    ]
    sensor_angle: Annotated[float, "Housing angle of the sensor [rad]"]
    measured: Annotated[
        FloatArray, "Measured at the carrier angles ``2 pi k / n`` [unit], shape (n,)"
    ]
    simulated: Annotated[FloatArray, "Simulated by the baseline [unit]"]
    with_effects: Annotated[
        FloatArray | None,
        "Simulated with the effects that the diagnosis added; None where it added none, shape (n,)",
    ] = None


@dataclass(frozen=True, eq=False)
class RimMotion:
    """Motion of a carrier's rim at all sensors in all runs."""

    campaign: Annotated[str, "Name of the campaign"]
    unit: Annotated[str, "Unit of the signals"]
    n_planets: Annotated[int, "Number of pins"]
    radius: Annotated[float, "Radius of the sensors' circle [m]"]
    effects: Annotated[tuple[str, ...], "Effects that the diagnosis added"]
    signals: Annotated[tuple[RimSignal, ...], "Every sensor in every run"]


def rim_motion(diagnosis: Diagnosis, campaign: Campaign) -> RimMotion | None:
    """Motion of the rim that a diagnosis compared; None where the campaign has no rim.

    Of more runs than a file may hold, some of every condition are written.
    """
    if campaign.kind != "carrier" or diagnosis.signals is None:
        return None
    channels = {channel.name: channel for channel in campaign.channels}
    after: list[Any] = list(diagnosis.signals.after) or [None] * len(diagnosis.signals.before)
    chosen = _chosen_runs(campaign)
    signals = []
    for before, with_effects in zip(diagnosis.signals.before, after, strict=True):
        channel = channels[before.channel]
        if channel.angle is None or before.run not in chosen:
            continue
        # 90 samples of a turn, whose highest order is 12.
        one_turn = slice(0, before.x.size - 1, 2)
        signals.append(
            RimSignal(
                run=before.run,
                channel=before.channel,
                direction=channel.quantity.removesuffix("_displacement"),
                sensor_angle=channel.angle,
                measured=before.measured[one_turn],
                simulated=before.simulated[one_turn],
                with_effects=None if with_effects is None else with_effects.simulated[one_turn],
            )
        )
    return RimMotion(
        campaign=diagnosis.campaign,
        unit=diagnosis.unit,
        n_planets=int(campaign.rig["n_planets"]),
        radius=float(campaign.rig["sensor_radius"]),
        effects=added_effects(diagnosis.reduction),
        signals=tuple(signals),
    )


def _chosen_runs(campaign: Campaign) -> set[str]:
    """Names of the runs that are kept: the first of every condition, then the second of each."""
    most = max(1, _MOST_SIGNALS // len(campaign.channels))
    conditions = [run.condition for run in campaign.runs]
    nth = [conditions[:k].count(condition) for k, condition in enumerate(conditions)]
    return {campaign.runs[k].name for k in np.argsort(nth, kind="stable")[:most]}


_SIGNAL = json_table(
    "RimSignalEntry",
    "Mean turn of one sensor in one run.",
    {RimSignal: "run channel measured simulated with_effects"},
    direction=(Literal["axial", "radial"], "Displacement of the rim that it reads"),
    sensor_angle_deg=(float, "Housing angle of the sensor [deg]"),
)
#: rim_motion.json.
RIM_MOTION = json_table(
    "RimMotionDocument",
    "rim_motion.json, written by diagnose (kind carrier) and read by view.",
    {RimMotion: "campaign unit n_planets radius effects"},
    format=(Literal["carrierflex-rim-motion"], "Kind of the file"),
    version=(Literal[1], "Version of the format"),
    carrier_angle_deg=([float], "Angles of one turn [deg]"),
    signals=([_SIGNAL], "Every sensor in every run"),
)


def write_rim_motion(path: Path, motion: RimMotion) -> None:
    """Write rim_motion.json; its folder exists."""
    n = motion.signals[0].measured.size if motion.signals else 0
    angles = [360.0 * k / n for k in range(n)]
    signals = [
        json_content(
            _SIGNAL,
            signal,
            sensor_angle_deg=float(np.rad2deg(signal.sensor_angle)),
            measured=_shortened(signal.measured),
            simulated=_shortened(signal.simulated),
            with_effects=None if signal.with_effects is None else _shortened(signal.with_effects),
        )
        for signal in motion.signals
    ]
    save_json(path, json_content(RIM_MOTION, motion, carrier_angle_deg=angles, signals=signals))


def _shortened(values: FloatArray) -> list[float]:
    """Values with six digits: a millionth of the signal."""
    return [float(f"{value:.6g}") for value in values]


def read_rim_motion(path: Path) -> RimMotion:
    """Read rim_motion.json."""
    document = read_document(path, f"a {RIM_MOTION_FILE}", _FORMAT, _VERSION, 50_000_000)
    try:
        return _motion(document)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        reason = f"no key {error}" if isinstance(error, KeyError) else str(error)
        raise ValueError(f"{path}: {reason}; expected a file that diagnose wrote") from error


def _motion(document: Mapping[str, Any]) -> RimMotion:
    n = len(document["carrier_angle_deg"])
    if not 0 < n <= 10_000 or not document["signals"]:
        raise ValueError("key 'signals' holds nothing to draw")
    signals = [
        {**entry, "sensor_angle": float(np.deg2rad(float(entry["sensor_angle_deg"])))}
        for entry in document["signals"]
    ]
    motion: RimMotion = restored(RimMotion, {**document, "signals": signals})
    if not 0 < motion.n_planets <= 100:
        raise ValueError(f"key 'n_planets' is {motion.n_planets}")
    if not 0.0 < motion.radius < np.inf:
        raise ValueError(f"key 'radius' is {motion.radius}")
    for signal in motion.signals:
        _check(signal, n)
    return motion


def _check(signal: RimSignal, n: int) -> None:
    if signal.direction not in ("axial", "radial"):
        raise ValueError(f"key 'direction' is {shown(signal.direction)}")
    if not np.isfinite(signal.sensor_angle):
        raise ValueError("key 'sensor_angle_deg' is not finite")
    for key in ("measured", "simulated", "with_effects"):
        values = getattr(signal, key)
        if values is not None and (values.shape != (n,) or not (np.abs(values) < _LARGEST).all()):
            raise ValueError(
                f"key '{key}' has shape {values.shape}, not {n} numbers below {_LARGEST:g}"
            )
