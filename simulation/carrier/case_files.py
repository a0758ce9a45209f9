"""Reading of simulation cases (TOML): rig, sensors and runs with the true motion of the carrier."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.files.problems import Problems, refuse, repeated_names
from carrierflex.files.toml_files import read_toml
from carrierflex.simulation.carrier.run_cases import CarrierMotion, RunCase, Sensor, rim_factors
from carrierflex.simulation.case_kinds import CARRIER_CASE

if TYPE_CHECKING:
    from carrierflex.simulation.carrier.case_tables import CarrierCaseDocument, RunTable


@dataclass(frozen=True, eq=False)
class SimulationCase:
    """A set of runs on one rig.

    Parameters
    ----------
    name : str
        Title.
    seed : int
        Seed of the random generator for ripple and noise.
    noise_std : float
        Standard deviation of the noise of every sensor [m].
    rig : mapping
        ``nominal_torque`` [N m], ``sensor_radius`` [m], ``n_planets``.
    sensors : tuple of Sensor
        Sensors.
    runs : tuple of RunCase
        Runs with their truth.
    """

    name: str
    seed: int
    noise_std: float
    rig: Mapping[str, Any]
    sensors: tuple[Sensor, ...]
    runs: tuple[RunCase, ...]

    def __post_init__(self) -> None:
        refuse(repeated_names([sensor.name for sensor in self.sensors], "sensor name"))
        refuse(repeated_names([run.name for run in self.runs], "run name"))


def shipped_case(name: str = "carrier_lc1_to_lc4") -> Path:
    """Path of a case file that comes with the package.

    Parameters
    ----------
    name : str
        File name without suffix.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        Where there is no such case; the message lists those there are.
    """
    folder = files("carrierflex.simulation") / "cases"
    known = sorted(
        entry.name.removesuffix(".toml")
        for entry in folder.iterdir()
        if entry.name.endswith(".toml")
    )
    if name not in known:
        raise ValueError(
            f"case '{name}' does not come with the package; expected one of {', '.join(known)}",
        )
    with as_file(folder / f"{name}.toml") as path:
        return path


def read_case(path: Path, delta_f: DeflectionCurve) -> SimulationCase:
    """Read a case file.

    Parameters
    ----------
    path : Path
        TOML file; the shipped cases show its keys.
    delta_f : DeflectionCurve
        Flexible curve, which turns the rim's amplitude of the planets' order into rho_f.

    Returns
    -------
    SimulationCase
        The case, in SI units and radians.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is too large or not TOML, or keys are unknown, missing or wrong (all at once).
    """
    from carrierflex.simulation.carrier.case_tables import CarrierCaseDocument

    document = read_toml(path, CARRIER_CASE, CarrierCaseDocument)
    radius = document.rig.sensor_radius
    sensors = tuple(
        Sensor(table.name, table.quantity, float(np.deg2rad(table.angle_deg)), radius)
        for table in document.sensors
    )
    runs, problems = [], Problems()
    for number, table in enumerate(document.runs, start=1):
        with problems.at(f"[[runs]] {number}"):
            runs.append(_run_case(table, document, delta_f))
    refuse(problems.messages, str(path))
    return SimulationCase(
        document.name,
        document.seed,
        document.noise_std,
        document.rig.model_dump(),
        sensors,
        tuple(runs),
    )


def _run_case(
    run: "RunTable",
    document: "CarrierCaseDocument",
    delta_f: DeflectionCurve,
) -> RunCase:
    """Build one run; the keys that all runs share stand at the top of the document."""
    truth = run.motion
    rho_s, rho_f = rim_factors(
        truth.rim_order3_amplitude,
        truth.stiff_share,
        run.torque,
        delta_f,
        document.rig.n_planets,
    )
    motion = CarrierMotion(
        d_x=truth.d_x,
        phi_H=truth.phi_H,
        theta_H=float(np.deg2rad(truth.theta_H_deg)),
        phi_PLC=truth.phi_PLC,
        theta_PLC=float(np.deg2rad(truth.theta_PLC_deg)),
        rho_s=rho_s,
        rho_f=rho_f,
        saddle=truth.saddle,
    )
    return RunCase(
        name=run.name,
        condition=run.condition,
        torque=run.torque,
        ntl_y=run.ntl_y,
        ntl_z=run.ntl_z,
        speed=document.speed_rpm * 2.0 * np.pi / 60.0,
        duration=document.duration,
        sample_rate=document.sample_rate_hz,
        motion=motion,
        speed_ripple=document.speed_ripple,
        torque_ripple=document.torque_ripple,
    )
