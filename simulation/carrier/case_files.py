"""Reading of simulation cases (TOML): rig, sensors and runs with the true motion of the carrier."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.simulation.carrier.run_cases import (
    AXIAL,
    RADIAL,
    CarrierMotion,
    RunCase,
    Sensor,
    rim_factors,
)
from carrierflex.simulation.toml_tables import (
    COUNT,
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    POSITIVE_COUNT,
    TABLE,
    TABLES,
    TEXT,
    checked_table,
    one_of,
)

#: A case file is written by hand; anything larger than this [bytes] is something else.
_LARGEST_CASE_FILE = 1_000_000

_CASE_KEYS = {
    "format": one_of("carrierflex-case"),
    "version": POSITIVE_COUNT,
    "name": TEXT,
    "seed": COUNT,
    "noise_std": NOT_NEGATIVE,
    "sample_rate_hz": POSITIVE,
    "duration": POSITIVE,
    "speed_rpm": NUMBER,
    "speed_ripple": NOT_NEGATIVE,
    "torque_ripple": NOT_NEGATIVE,
    "rig": TABLE,
    "sensors": TABLES,
    "runs": TABLES,
}
_RIG_KEYS = {"nominal_torque": POSITIVE, "sensor_radius": POSITIVE, "n_planets": POSITIVE_COUNT}
_SENSOR_KEYS = {"name": TEXT, "quantity": one_of(AXIAL, RADIAL), "angle_deg": NUMBER}
_RUN_KEYS = {
    "name": TEXT,
    "condition": TEXT,
    "torque": NUMBER,
    "ntl_y": NUMBER,
    "ntl_z": NUMBER,
    "motion": TABLE,
}
_MOTION_KEYS = {
    "d_x": NUMBER,
    "phi_H": NUMBER,
    "theta_H_deg": NUMBER,
    "phi_PLC": NUMBER,
    "theta_PLC_deg": NUMBER,
    "rim_order3_amplitude": NOT_NEGATIVE,
    "stiff_share": NOT_NEGATIVE,
    "saddle": NUMBER,
}


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
        for what, names in (
            ("sensor", [s.name for s in self.sensors]),
            ("run", [r.name for r in self.runs]),
        ):
            repeated = {name for name in names if names.count(name) > 1}
            if repeated:
                raise ValueError(
                    f"{what} name '{min(repeated)}' stands twice; expected different names"
                )


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
            f"case '{name}' does not come with the package; expected one of {', '.join(known)}"
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
        Flexible curve, which turns the rim's order-3 amplitude into rho_f.

    Returns
    -------
    SimulationCase
        The case, in SI units and radians.

    Raises
    ------
    ValueError
        Where the file is missing, too large, not TOML, or a key is unknown, missing or wrong.
    """
    document = checked_table(read_case_document(path), path.name, required=_CASE_KEYS)
    if document["version"] > 1:
        raise ValueError(
            f"{path.name}: version is {document['version']}, written by a newer version; expected 1"
        )
    rig = checked_table(document["rig"], f"{path.name}, [rig]", required=_RIG_KEYS)
    sensors = []
    for number, table in enumerate(document["sensors"], start=1):
        keys = checked_table(table, f"{path.name}, [[sensors]] {number}", required=_SENSOR_KEYS)
        angle = float(np.deg2rad(keys["angle_deg"]))
        sensors.append(Sensor(keys["name"], keys["quantity"], angle, float(rig["sensor_radius"])))
    try:
        runs = tuple(
            _run_case(table, document, f"{path.name}, [[runs]] {number}", delta_f)
            for number, table in enumerate(document["runs"], start=1)
        )
        return SimulationCase(
            document["name"],
            document["seed"],
            float(document["noise_std"]),
            rig,
            tuple(sensors),
            runs,
        )
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(path.name) else f"{path.name}: {text}") from error


def _run_case(
    table: Mapping[str, Any], document: Mapping[str, Any], where: str, delta_f: DeflectionCurve
) -> RunCase:
    """Build one run; the keys that all runs share stand at the top of the document."""
    run = checked_table(table, where, required=_RUN_KEYS)
    truth = checked_table(run["motion"], f"{where}, [motion]", required=_MOTION_KEYS)
    rho_s, rho_f = rim_factors(
        truth["rim_order3_amplitude"], truth["stiff_share"], run["torque"], delta_f
    )
    motion = CarrierMotion(
        d_x=truth["d_x"],
        phi_H=truth["phi_H"],
        theta_H=float(np.deg2rad(truth["theta_H_deg"])),
        phi_PLC=truth["phi_PLC"],
        theta_PLC=float(np.deg2rad(truth["theta_PLC_deg"])),
        rho_s=rho_s,
        rho_f=rho_f,
        saddle=truth["saddle"],
    )
    return RunCase(
        name=run["name"],
        condition=run["condition"],
        torque=float(run["torque"]),
        ntl_y=float(run["ntl_y"]),
        ntl_z=float(run["ntl_z"]),
        speed=float(document["speed_rpm"]) * 2.0 * np.pi / 60.0,
        duration=float(document["duration"]),
        sample_rate=float(document["sample_rate_hz"]),
        motion=motion,
        speed_ripple=float(document["speed_ripple"]),
        torque_ripple=float(document["torque_ripple"]),
    )


def read_case_document(path: Path) -> dict[str, Any]:
    """Parse a small TOML file; every failure becomes one line that names the file.

    Raises
    ------
    ValueError
        Where the file is missing, too large or not TOML.
    """
    if not path.is_file():
        raise ValueError(f"{path}: no such file; expected a case file (TOML)")
    if path.stat().st_size > _LARGEST_CASE_FILE:
        raise ValueError(
            f"{path.name}: {path.stat().st_size} bytes; expected at most {_LARGEST_CASE_FILE}"
        )
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path.name}: not a TOML file: {error}") from error
