"""Reading of simulation cases of kind ``mounting`` (TOML): rig, truth and load histories."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from carrierflex.simulation.carrier.case_files import read_case_document
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameters import PARAMETERS, ParameterArray, parameter_array
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.toml_tables import (
    COUNT,
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    POSITIVE_COUNT,
    TABLE,
    TABLES,
    TEXT,
    THREE_POSITIVE,
    checked_table,
    one_of,
)

_CASE_KEYS = {
    "format": one_of("carrierflex-case"),
    "version": POSITIVE_COUNT,
    "kind": one_of("mounting"),
    "name": TEXT,
    "seed": COUNT,
    "noise_std": NOT_NEGATIVE,
    "rig": TABLE,
    "truth": TABLE,
    "runs": TABLES,
}
_RIG_KEYS = {
    field.name: NUMBER for field in fields(MountingRig) if field.name != "axial_motion"
} | {
    "housing_inertia": THREE_POSITIVE,
    "zeroing_samples": POSITIVE_COUNT,
}
_TRUTH_KEYS = {parameter.name: NUMBER for parameter in PARAMETERS}
_RUN_KEYS = {"name": TEXT, "condition": TEXT, "history": TABLE}
_HISTORY_KEYS = {field.name: NUMBER for field in fields(LoadHistory)}


@dataclass(frozen=True, eq=False)
class MountingRun:
    """One run: its name, condition and loads."""

    name: str
    condition: str
    history: LoadHistory


@dataclass(frozen=True, eq=False)
class MountingCase:
    """A set of runs on the mounting rig with their truth.

    Parameters
    ----------
    name : str
        Title.
    seed : int
        Seed of the random generator for the noise.
    noise_std : float
        Standard deviation of the noise of every sensor [m].
    rig : MountingRig
        Nominal rig, as a campaign states it.
    truth : ndarray
        Flat parameter set of the true mounting.
    runs : tuple of MountingRun
        Runs.
    step : float, optional
        Largest step [s] of nonlinear bushings; chosen from their stiffness where the case has none.
    """

    name: str
    seed: int
    noise_std: float
    rig: MountingRig
    truth: ParameterArray
    runs: tuple[MountingRun, ...]
    step: float | None = None


def read_mounting_case(path: Path) -> MountingCase:
    """Read a case file of kind ``mounting``.

    Parameters
    ----------
    path : Path
        TOML file; ``cases/mounting_2011.toml`` shows its keys. Keys of the rig and of a history
        that are left out have the defaults of :class:`MountingRig` and :class:`LoadHistory`.

    Returns
    -------
    MountingCase
        The case in SI units.

    Raises
    ------
    ValueError
        Where the file is missing, not TOML, or a key is unknown, missing or wrong.
    """
    document = checked_table(
        read_case_document(path), path.name, required=_CASE_KEYS, optional={"step": POSITIVE}
    )
    if document["version"] > 1:
        raise ValueError(
            f"{path.name}: version is {document['version']}, written by a newer version; expected 1"
        )
    rig_table = checked_table(
        document["rig"], f"{path.name}, [rig]", required={}, optional=_RIG_KEYS
    )
    if "housing_inertia" in rig_table:
        rig_table["housing_inertia"] = tuple(rig_table["housing_inertia"])
    truth = checked_table(
        document["truth"], f"{path.name}, [truth]", required={}, optional=_TRUTH_KEYS
    )
    try:
        rig = MountingRig(**rig_table)
        runs = tuple(
            _run(table, f"[[runs]] {number}")
            for number, table in enumerate(document["runs"], start=1)
        )
        values = parameter_array(rig, truth)
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from error
    return MountingCase(
        document["name"],
        document["seed"],
        float(document["noise_std"]),
        rig,
        values,
        runs,
        document.get("step"),
    )


def _run(table: Mapping[str, Any], where: str) -> MountingRun:
    run = checked_table(table, where, required=_RUN_KEYS)
    history = checked_table(
        run["history"], f"{where}, [history]", required={}, optional=_HISTORY_KEYS
    )
    return MountingRun(run["name"], run["condition"], LoadHistory(**history))
