"""The file law.toml of a measured law with a memory."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.toml_files import read_toml, write_toml
from carrierflex.simulation.case_kinds import MEMORY_LAW_FILE
from carrierflex.simulation.element.memory_laws import (
    AT,
    LOOP_FORCE,
    LOOP_HALF_RANGE,
    LOOP_LENGTH,
    LOOP_STIFFNESS,
    MemoryLaw,
    StopPlaces,
)

if TYPE_CHECKING:
    from carrierflex.simulation.element.memory_law_tables import LoopTable, StopTable

_HEADING = (
    "# Measured law with a memory, taken as a candidate by `diagnose --law FILE`. Forces of its",
    "# parts add up: stops (a spring that slips) and smooth loops, or branches (a spring in series",
    "# with a damper).",
)


def read_memory_law(path: Path) -> MemoryLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-memory-law``.

    Returns
    -------
    MemoryLaw
        Its parts.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds no such parts; all that is wrong, in one line.
    """
    # Late: pydantic takes longer to load than all else here.
    from carrierflex.simulation.element.memory_law_tables import MemoryLawDocument

    document = read_toml(path, MEMORY_LAW_FILE, MemoryLawDocument)
    branches = [[branch.tau, branch.stiffness] for branch in document.branch]
    return MemoryLaw(
        document.name,
        document.effect_class,
        stop_rows(document.stop),
        np.array(branches, dtype=np.float64).reshape(-1, 2),
        (document.force_unit, document.deflection_unit),
        document.visited,
        document.measured_on or "",
        loops=loop_rows(document.loop),
    )


def write_memory_law(path: Path, law: MemoryLaw) -> None:
    """Write a law file.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    law : MemoryLaw
        Law.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    document: dict[str, Any] = {
        "name": law.name,
        "effect_class": law.effect_class,
        "force_unit": law.units[0],
        "deflection_unit": law.units[1],
        "visited": list(law.visited),
        "measured_on": law.measured_on or None,
    }
    if law.stops.size:
        document["stop"] = stop_tables(law.stops)
    if law.loops.size:
        document["loop"] = loop_tables(law.loops)
    if law.branches.size:
        document["branch"] = [
            {"tau": tau, "stiffness": stiffness} for tau, stiffness in law.branches.tolist()
        ]
    write_toml(path, MEMORY_LAW_FILE, _HEADING, document)


def stop_rows(tables: "Sequence[StopTable]") -> NDArray[np.float64]:
    """Rows of the stops of a file, shape (n_stops, 11)."""
    rows = [[getattr(stop, name) for name in StopPlaces._fields] for stop in tables]
    return np.array(rows, dtype=np.float64).reshape(-1, len(AT))


def stop_tables(stops: NDArray[np.float64]) -> list[dict[str, float]]:
    """Tables of stops for a file, without the forces that are zero."""
    rows = [dict(zip(StopPlaces._fields, row, strict=True)) for row in stops.tolist()]
    return [
        {name: value for name, value in row.items() if value or name == "middle"} for row in rows
    ]


def loop_rows(tables: "Sequence[LoopTable]") -> NDArray[np.float64]:
    """Rows of the smooth loops of a file, shape (n_loops, LOOP_LENGTH)."""
    rows = [[loop.half_range, loop.force, *loop.stiffness] for loop in tables]
    return np.array(rows, dtype=np.float64).reshape(-1, LOOP_LENGTH)


def loop_tables(loops: NDArray[np.float64]) -> list[dict[str, float | list[float]]]:
    """Tables of smooth loops for a file."""
    return [
        {
            "half_range": row[LOOP_HALF_RANGE],
            "force": row[LOOP_FORCE],
            "stiffness": row[LOOP_STIFFNESS:],
        }
        for row in loops.tolist()
    ]
