"""Simulate the same runs with many parameter sets.

How far the readings of the housing change with its bushings.

Reads a table with one parameter set a row, simulates every run of a case of kind ``mounting`` with
each of them, and writes the RMS of the six sensors beside the sets. A good answer: every row runs
to its end; rows whose run diverges are named, not left out.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.mounting.batch import rms_of_sensors, simulate_batch
from carrierflex.simulation.mounting.case_files import (
    read_mounting_case,
    refuse_long_runs,
)
from carrierflex.simulation.mounting.history_inputs import history_inputs
from carrierflex.simulation.mounting.parameters import INDEX, PARAMETERS
from carrierflex.simulation.mounting.rig import SENSORS
from carrierflex.simulation.mounting.time_integration import DivergedError
from carrierflex.workflows.executors import check_workers, work_executor
from carrierflex.workflows.outputs import prepared_folder, save_table
from carrierflex.workflows.progress import Stages

#: File in the output folder.
RESULT = "variants.csv"


@dataclass(frozen=True, eq=False)
class Variants:
    """Sets, their names, RMS [m] of six sensors by run, (n_sets, 6), NaN if diverged; the file."""

    names: tuple[str, ...]
    sets: NDArray[np.float64]
    rms: dict[str, NDArray[np.float64]]
    file: Path


def main(
    case: Path,
    *,
    variants: Path,
    out: Path,
    workers: int = 1,
    scheduler: str | None = None,
    quiet: bool = False,
) -> Variants:
    """Simulate every run of a mounting case with many parameter sets; write the sensors' RMS.

    Parameters
    ----------
    case : Path
        Case file of kind mounting (TOML); what a set does not name keeps the case's truth.
    variants : Path
        CSV: a header of parameter names of [truth], then one set a row in SI units.
    out : Path
        Folder for variants.csv.
    workers : int
        Processes; 1 runs in this process.
    scheduler : str, optional
        Address of a Dask scheduler instead of workers.
    quiet : bool
        Show no progress.

    Raises
    ------
    ValueError
        Where the case, the table or a set is refused; before anything runs.
    """
    check_workers(workers, scheduler)
    what = read_mounting_case(case)
    refuse_long_runs(what, str(case))
    names, sets = _read(variants)
    parameters = np.tile(what.truth, (len(sets), 1))
    parameters[:, [INDEX[name] for name in names]] = sets
    prepared_folder(out)
    stages = Stages(len(what.runs), quiet)
    rms = {}
    with work_executor(workers, scheduler) as executor:
        for run in what.runs:
            with stages.stage(f"{run.name} with {len(sets)} parameter sets"):
                results = simulate_batch(
                    what.rig,
                    parameters,
                    history_inputs(run.history),
                    summary=rms_of_sensors,
                    executor=executor,
                    step=what.step,
                )
                run_rms = [
                    np.full(6, np.nan) if isinstance(result, DivergedError) else result
                    for result in results
                ]
                rms[run.name] = np.array(run_rms)
    _write(out / RESULT, names, sets, rms)
    return Variants(names, sets, rms, out / RESULT)


def _read(path: Path) -> tuple[tuple[str, ...], NDArray[np.float64]]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            header, *rows = [row for row in csv.reader(file) if row] or [[]]
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(
            f"{path}: cannot be read ({error}); expected a CSV file of parameter sets"
        ) from error
    names = tuple(name.strip() for name in header)
    for name in names:
        if name not in INDEX:
            raise ValueError(
                f"{path}: unknown parameter {name!r}; expected one of {', '.join(INDEX)}"
            )
    if not rows or len(set(names)) != len(names):
        raise ValueError(
            f"{path}: columns {', '.join(names)}, {len(rows)} sets; expected different names and a "
            "set or more"
        )
    try:
        return names, np.array([[float(cell) for cell in row] for row in rows]).reshape(
            len(rows), len(names)
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}; expected {len(names)} numbers in every row") from error


def _write(
    path: Path,
    names: tuple[str, ...],
    sets: NDArray[np.float64],
    rms: dict[str, NDArray[np.float64]],
) -> None:
    units = {parameter.name: parameter.unit for parameter in PARAMETERS}
    header = [
        "run",
        *(f"{name} [{units[name]}]" for name in names),
        *(f"rms_{sensor} [m]" for sensor in SENSORS),
    ]
    rows = [
        [run, *parameters, *values]
        for run, by_set in rms.items()
        for parameters, values in zip(sets, by_set, strict=True)
    ]
    save_table(path, header, rows)
