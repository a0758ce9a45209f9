"""The law file of bushings: the measured shape of one class of their force."""

from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.files.toml_files import read_toml, write_toml
from carrierflex.simulation.case_kinds import BUSHING_LAW_FILE
from carrierflex.simulation.element.law_files import without_rounding
from carrierflex.simulation.mounting.measured_laws.bushing_laws import BushingLaw, BushingPart

_HEADING = (
    "# Measured shape of a force that the bushings lack, a candidate of `diagnose --law FILE`.",
    "# Tables add up, linear between the points, whose ends are those of the visited range; in y",
    "# and in z apart, or radially, along the deflection. Beyond a table forces go on with the",
    "# slope of their end, damping keeps its end value. Units: m, m/s, N, N s/m.",
)


def read_bushing_law(path: Path) -> BushingLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-bushing-law``.

    Returns
    -------
    BushingLaw
        Its tables.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds what is no table; all that is wrong, in one line.
    """
    # Late: pydantic takes longer to load than all else here.
    from carrierflex.simulation.mounting.measured_laws.bushing_law_tables import BushingLawDocument

    document = read_toml(path, BUSHING_LAW_FILE, BushingLawDocument)
    parts = tuple(
        BushingPart(part.acts, part.bushing, np.array(part.x), np.array(part.y))
        for part in document.part
    )
    return BushingLaw(document.name, document.effect_class, parts, document.measured_on or "")


def write_bushing_law(path: Path, law: BushingLaw) -> None:
    """Write a law file.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    law : BushingLaw
        Law.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    document: dict[str, Any] = {
        "name": law.name,
        "effect_class": law.effect_class,
        "measured_on": law.measured_on or None,
        "part": [
            {
                "acts": part.acts,
                "bushing": part.bushing,
                "x": without_rounding(part.x),
                "y": without_rounding(part.y),
            }
            for part in law.parts
        ],
    }
    write_toml(path, BUSHING_LAW_FILE, _HEADING, document)
