"""Reading of stage cases (TOML): runs of the whole planetary stage, its effects and its sensors."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carrierflex.files.problems import refuse, repeated_names
from carrierflex.files.toml_files import read_toml
from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.case_kinds import STAGE_CASE
from carrierflex.simulation.sensing import SensorError
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.readings import ReadingEffects
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.statics import SteadyLoad

if TYPE_CHECKING:
    from carrierflex.simulation.stage.stage_tables import (
        ReadingTable,
        StageCaseDocument,
        StageSensorTable,
    )


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
    main_shaft : str
        Default main shaft: ``beam`` or ``finite_elements``.
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
    main_shaft: str = "beam"
    rest_angle: float | None = None

    def __post_init__(self) -> None:
        refuse(repeated_names([sensor.name for sensor in self.sensors], "sensor name"))
        refuse(repeated_names([run.name for run in self.runs], "run name"))


def read_stage_case(path: Path) -> StageCase:
    """Read a stage case; the shipped ones show its keys.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is too large or not TOML, or keys are unknown, missing or wrong (all at once).
    """
    from carrierflex.simulation.stage.stage_tables import StageCaseDocument

    document = read_toml(path, STAGE_CASE, StageCaseDocument)
    sensors = tuple(
        Sensor(
            table.name,
            table.quantity,
            float(np.deg2rad(table.angle_deg)),
            document.rig.sensor_radius,
        )
        for table in document.sensors
    )
    zeroing = document.zeroing
    return StageCase(
        name=document.name,
        seed=document.seed,
        speed=document.speed_rpm * np.pi / 30.0,
        duration=document.duration,
        sample_rate=document.sample_rate_hz,
        step=document.step,
        pin_fit_stiffness=document.pin_fit_stiffness,
        rig=document.rig.model_dump(),
        data=_data(document),
        effects=StageEffects(**_radians(document.effects.given())),
        reading=_reading(document.reading, document.sensors),
        sensors=sensors,
        runs=tuple(
            StageRun(
                run.name,
                run.condition,
                SteadyLoad(run.torque, run.ntl_y, run.ntl_z, document.gravity),
            )
            for run in document.runs
        ),
        bodies={name: path.parent / file for name, file in document.bodies.given().items()},
        main_shaft=document.main_shaft,
        rest_angle=None if zeroing is None else float(np.deg2rad(zeroing.carrier_angle_deg)),
    )


def _data(document: "StageCaseDocument") -> StageData:
    nominal = StageData()
    tables = {
        name: replace(getattr(nominal, name), **getattr(document, name).given())
        for name in ("housing", "planet", "sun", "ring")
    }
    return StageData(
        gear=document.gear,
        mesh=document.mesh,
        bearings=document.bearings,
        chain=document.chain,
        mounting=document.mounting,
        planet_rollers=document.planet_rollers,
        damping_ratio=document.damping_ratio,
        **tables,
    )


def _reading(table: "ReadingTable", sensors: "list[StageSensorTable]") -> ReadingEffects:
    values = _radians(table.given())
    values["runout"] = {
        entry.order: (entry.amplitude, float(np.deg2rad(entry.phase_deg))) for entry in table.runout
    }
    errors = {
        sensor.name: SensorError(
            sensor.gain,
            float(np.deg2rad(sensor.angle_error_deg)),
            sensor.zero,
        )
        for sensor in sensors
    }
    return ReadingEffects(**values, sensors=errors)


def _radians(values: Mapping[str, Any]) -> dict[str, Any]:
    """Copy with every ``*_deg`` key in radians under its plain name."""
    return {
        name.removesuffix("_deg"): float(np.deg2rad(value)) if name.endswith("_deg") else value
        for name, value in values.items()
    }
