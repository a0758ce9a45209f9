"""Reading of stage cases (TOML): runs of the whole planetary stage, its effects and its sensors."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.simulation.carrier.run_cases import AXIAL, RADIAL, Sensor
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.readings import ReadingEffects, SensorError
from carrierflex.simulation.stage.roller_bearing import RollerBearingData
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.statics import SteadyLoad
from carrierflex.simulation.toml_tables import (
    COUNT,
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    POSITIVE_COUNT,
    TABLE,
    TABLES,
    TEXT,
    Value,
    checked_table,
    one_of,
)

#: First line of a stage case.
STAGE_FORMAT = "carrierflex-stage-case"
_LARGEST_CASE_FILE = 1_000_000


def _numbers(count: str, n: int) -> Value:
    def accepts(value: Any) -> bool:
        return (
            isinstance(value, list)
            and len(value) == n
            and all(NUMBER.accepts(item) for item in value)
        )

    return Value(f"{count} finite numbers", accepts)


_THREE = _numbers("three", 3)
_CASE_KEYS = {
    "format": one_of(STAGE_FORMAT), "version": POSITIVE_COUNT, "name": TEXT, "seed": COUNT, "speed_rpm": POSITIVE,
    "duration": POSITIVE, "sample_rate_hz": POSITIVE, "step": POSITIVE, "pin_fit_stiffness": NOT_NEGATIVE,
    "rig": TABLE, "sensors": TABLES, "runs": TABLES,
}  # fmt: skip
_RIG_KEYS = {"nominal_torque": POSITIVE, "sensor_radius": POSITIVE, "n_planets": POSITIVE_COUNT}
_SENSOR_KEYS = {"name": TEXT, "quantity": one_of(AXIAL, RADIAL), "angle_deg": NUMBER}
_SENSOR_ERRORS = {"gain": NUMBER, "angle_error_deg": NUMBER, "zero": NUMBER}
_RUN_KEYS = {"name": TEXT, "condition": TEXT, "torque": NUMBER, "ntl_y": NUMBER, "ntl_z": NUMBER}
_STAGE_EFFECTS = {
    "phi_PLC": NUMBER, "theta_PLC_deg": NUMBER, "pin_offset": _THREE, "sun_mesh_factor": _THREE, "ring_mesh_factor": _THREE,
    "planet_bearing_factor": _THREE, "pin_fit_play": NOT_NEGATIVE, "pin_fit_closed": POSITIVE,
    "ring_pass_offset": _numbers("two", 2), "ring_pass_tilt": _numbers("four", 4),
}  # fmt: skip
_READING_EFFECTS = {
    "axial_offset": NUMBER, "phi_H": NUMBER, "theta_H_deg": NUMBER, "phi_face": NUMBER, "theta_face_deg": NUMBER,
    "saddle": _THREE, "runout": TABLES, "drift_rate": NUMBER, "delay": NUMBER, "noise_std": NOT_NEGATIVE,
}  # fmt: skip
_RUNOUT_KEYS = {"order": POSITIVE_COUNT, "amplitude": NUMBER, "phase_deg": NUMBER}
#: Tables of the case that change fields of the data of the same name.
_DATA_TABLES = ("mesh", "bearings", "chain", "mounting")
#: Bodies that a case may bring as files of ``carrierflex reduce``, relative to the case.
BODIES = ("carrier", "pin", "shaft")
#: Table that puts rollers in place of the planet bearings' springs; it may be empty.
_ROLLERS = "planet_rollers"
_ZERO_KEYS = {"carrier_angle_deg": NUMBER}


@dataclass(frozen=True, eq=False)
class StageRun:
    """One run: name, condition and load."""

    name: str
    condition: str
    load: SteadyLoad


@dataclass(frozen=True, eq=False)
class StageCase:
    """A set of runs of the planetary stage; SI units and radians.

    Parameters
    ----------
    name : str
        Title.
    seed : int
        Of the noise.
    speed : float
        Mean carrier speed [rad/s].
    duration, sample_rate, step : float
        Length of every run [s], samples a second [1/s], longest step [s].
    pin_fit_stiffness : float
        Bending stiffness of each pin interface [N m/rad].
    rig : mapping
        ``nominal_torque`` [N m], ``sensor_radius`` [m], ``n_planets``.
    data : StageData
        Rigid parts, springs, gears.
    effects : StageEffects
        Inside the stage.
    reading : ReadingEffects
        Between motion and record.
    sensors : tuple of Sensor
        Sensors.
    runs : tuple of StageRun
        Runs.
    bodies : mapping of str to Path
        Body files in place of the default carrier, pin or main shaft.
    rest_angle : float or None
        Carrier angle [rad] of the rest reading that the signals count from; None where they count
        from the unloaded model.
    """

    name: str
    seed: int
    speed: float
    duration: float
    sample_rate: float
    step: float
    pin_fit_stiffness: float
    rig: Mapping[str, Any]
    data: StageData
    effects: StageEffects
    reading: ReadingEffects
    sensors: tuple[Sensor, ...]
    runs: tuple[StageRun, ...]
    bodies: Mapping[str, Path] = field(default_factory=dict)
    rest_angle: float | None = None

    def __post_init__(self) -> None:
        for what, names in (
            ("sensor", [s.name for s in self.sensors]),
            ("run", [r.name for r in self.runs]),
        ):
            repeated = {name for name in names if names.count(name) > 1}
            if repeated:
                raise ValueError(
                    f"{what} name '{min(repeated)}' stands twice; expected different names"
                )


def _parsed(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path.name}: not a TOML file: {error}") from error


def read_stage_case(path: Path) -> StageCase:
    """Read a stage case; the shipped ones show its keys.

    Raises
    ------
    ValueError
        Where the file is missing or too large, not TOML, or a key is unknown, missing or wrong.
    """
    if not path.is_file() or path.stat().st_size > _LARGEST_CASE_FILE:
        raise ValueError(
            f"{path}: expected a case file (TOML) of at most {_LARGEST_CASE_FILE} bytes"
        )
    tables = dict.fromkeys(
        (*_DATA_TABLES, _ROLLERS, "effects", "reading", "bodies", "zeroing"), TABLE
    )
    document = checked_table(_parsed(path), path.name, required=_CASE_KEYS, optional=tables)
    if document["version"] > 1:
        raise ValueError(
            f"{path.name}: version is {document['version']}, written by a newer version; expected 1"
        )
    rig = checked_table(document["rig"], f"{path.name}, [rig]", required=_RIG_KEYS)
    try:
        sensors, errors = _sensors(document, path.name, float(rig["sensor_radius"]))
        return StageCase(
            document["name"], document["seed"], float(document["speed_rpm"]) * np.pi / 30.0, float(document["duration"]),
            float(document["sample_rate_hz"]), float(document["step"]), float(document["pin_fit_stiffness"]), rig,
            _data(document, path.name), _stage_effects(document, path.name), _reading(document, path.name, errors),
            sensors, _runs(document, path.name), _bodies(document, path), _rest_angle(document, path.name),
        )  # fmt: skip
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(path.name) else f"{path.name}: {text}") from error


def _data(document: Mapping[str, Any], where: str) -> StageData:
    data = StageData()
    for table in _DATA_TABLES:
        part = getattr(data, table)
        known = {
            own.name: NUMBER
            for own in fields(part)
            if isinstance(getattr(part, own.name), int | float)
        }
        given = checked_table(
            document.get(table, {}), f"{where}, [{table}]", required={}, optional=known
        )
        data = replace(data, **{table: replace(part, **given)})
    if _ROLLERS not in document:
        return data
    known = dict.fromkeys((entry.name for entry in fields(RollerBearingData)), NUMBER)
    counts = {name: POSITIVE_COUNT for name in known if name.startswith("n_")}
    given = checked_table(
        document[_ROLLERS], f"{where}, [{_ROLLERS}]", required={}, optional=known | counts
    )
    return replace(data, planet_rollers=RollerBearingData(**given))


def _bodies(document: Mapping[str, Any], path: Path) -> dict[str, Path]:
    where = f"{path.name}, [bodies]"
    given = checked_table(
        document.get("bodies", {}), where, required={}, optional=dict.fromkeys(BODIES, TEXT)
    )
    return {name: path.parent / file for name, file in given.items()}


def _rest_angle(document: Mapping[str, Any], where: str) -> float | None:
    if "zeroing" not in document:
        return None
    given = checked_table(document["zeroing"], f"{where}, [zeroing]", required=_ZERO_KEYS)
    return float(np.deg2rad(given["carrier_angle_deg"]))


def _stage_effects(document: Mapping[str, Any], where: str) -> StageEffects:
    given = checked_table(
        document.get("effects", {}), f"{where}, [effects]", required={}, optional=_STAGE_EFFECTS
    )
    values: dict[str, Any] = {
        n: tuple(v) if isinstance(v, list) else v for n, v in _radians(given).items()
    }
    return StageEffects(**values)


def _radians(table: Mapping[str, Any]) -> dict[str, Any]:
    """Copy with every ``*_deg`` key in radians under its plain name."""
    return {
        name.removesuffix("_deg"): float(np.deg2rad(value)) if name.endswith("_deg") else value
        for name, value in table.items()
    }


def _reading(
    document: Mapping[str, Any], where: str, errors: Mapping[str, SensorError]
) -> ReadingEffects:
    given = checked_table(
        document.get("reading", {}), f"{where}, [reading]", required={}, optional=_READING_EFFECTS
    )
    values = _radians(given)
    runout = {}
    for table in values.pop("runout", []):
        entry = _radians(
            checked_table(table, f"{where}, [[reading.runout]]", required=_RUNOUT_KEYS)
        )
        runout[entry["order"]] = (float(entry["amplitude"]), entry["phase"])
    values["saddle"] = tuple(values.get("saddle", (0.0, 0.0, 0.0)))
    return ReadingEffects(**values, runout=runout, sensors=errors)


def _sensors(
    document: Mapping[str, Any], where: str, radius: float
) -> tuple[tuple[Sensor, ...], dict[str, SensorError]]:
    sensors, errors = [], {}
    for number, table in enumerate(document["sensors"], start=1):
        keys = checked_table(
            table, f"{where}, [[sensors]] {number}", required=_SENSOR_KEYS, optional=_SENSOR_ERRORS
        )
        sensors.append(
            Sensor(keys["name"], keys["quantity"], float(np.deg2rad(keys["angle_deg"])), radius)
        )
        angle = float(np.deg2rad(keys.get("angle_error_deg", 0.0)))
        errors[keys["name"]] = SensorError(keys.get("gain", 0.0), angle, keys.get("zero", 0.0))
    return tuple(sensors), errors


def _runs(document: Mapping[str, Any], where: str) -> tuple[StageRun, ...]:
    runs = []
    for number, table in enumerate(document["runs"], start=1):
        run = checked_table(table, f"{where}, [[runs]] {number}", required=_RUN_KEYS)
        load = SteadyLoad(float(run["torque"]), float(run["ntl_y"]), float(run["ntl_z"]))
        runs.append(StageRun(run["name"], run["condition"], load))
    return tuple(runs)
