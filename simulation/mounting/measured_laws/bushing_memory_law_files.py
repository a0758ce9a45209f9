"""The law file of bushings with a memory: stops or branches of one class of their force."""

from pathlib import Path
from typing import Any

from carrierflex.files.toml_files import read_toml, write_toml
from carrierflex.simulation.case_kinds import BUSHING_MEMORY_LAW_FILE
from carrierflex.simulation.mounting.measured_laws.bushing_memory_laws import (
    BushingBranch,
    BushingMemoryLaw,
    BushingStop,
)

_HEADING = (
    "# Measured force with a memory that the bushings lack, a candidate of `diagnose --law FILE`.",
    "# Forces of its parts add up: stops (a spring that slips, in y and in z apart, radially in",
    "# the plane or smoothly along its path) or branches (a spring in series with a damper).",
    "# Units: m, s, N, N/m.",
)


def read_bushing_memory_law(path: Path) -> BushingMemoryLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-bushing-memory-law``.

    Returns
    -------
    BushingMemoryLaw
        Its parts.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds no such parts; all that is wrong, in one line.
    """
    # Late: pydantic takes longer to load than all else here.
    from carrierflex.simulation.mounting.measured_laws.bushing_memory_law_tables import (
        BushingMemoryLawDocument,
    )

    document = read_toml(path, BUSHING_MEMORY_LAW_FILE, BushingMemoryLawDocument)
    stops = [
        BushingStop(own.acts, own.bushing, own.yield_deflection, own.force) for own in document.stop
    ]
    branches = [BushingBranch(own.bushing, own.tau, own.stiffness) for own in document.branch]
    return BushingMemoryLaw(
        document.name,
        document.effect_class,
        (*stops, *branches),
        document.visited,
        document.measured_on or "",
    )


def write_bushing_memory_law(path: Path, law: BushingMemoryLaw) -> None:
    """Write a law file.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    law : BushingMemoryLaw
        Law.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    document: dict[str, Any] = {
        "name": law.name,
        "effect_class": law.effect_class,
        "visited": law.visited,
        "measured_on": law.measured_on or None,
    }
    stops = [
        {
            "acts": part.acts,
            "bushing": part.bushing,
            "yield_deflection": part.yield_deflection,
            "force": part.force,
        }
        for part in law.parts
        if isinstance(part, BushingStop)
    ]
    branches = [
        {"bushing": part.bushing, "tau": part.tau, "stiffness": part.stiffness}
        for part in law.parts
        if isinstance(part, BushingBranch)
    ]
    if stops:
        document["stop"] = stops
    if branches:
        document["branch"] = branches
    write_toml(path, BUSHING_MEMORY_LAW_FILE, _HEADING, document)
