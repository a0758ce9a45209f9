"""The law file of a carrier: the measured shape of one class at its rim."""

from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.files.toml_files import read_toml, write_toml
from carrierflex.simulation.carrier.measured_laws.carrier_laws import (
    CarrierLaw,
    LawPart,
    WaveTable,
)
from carrierflex.simulation.case_kinds import CARRIER_LAW_FILE
from carrierflex.simulation.element.law_files import without_rounding

_HEADING = (
    "# Measured shape of what the sensors at a carrier's rim show, a candidate of",
    "# `diagnose --law FILE` that `simulate --law FILE` adds to a carrier's case. Parts add up; a",
    "# wave is cosine cos(m v - n theta) + sine sin(m v - n theta): n order, m lobes, v the angle",
    "# of the sensor in the housing, theta the carrier angle. Amplitudes are linear between the",
    "# points and go on with the slope of their end. Units: N m, N, m; m/(N m) of load_sharing.",
)


def read_carrier_law(path: Path) -> CarrierLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-carrier-law``.

    Returns
    -------
    CarrierLaw
        Its tables.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds what is no table; all that is wrong, in one line.
    """
    # Late: pydantic takes longer to load than all else here.
    from carrierflex.simulation.carrier.measured_laws.carrier_law_tables import CarrierLawDocument

    document = read_toml(path, CARRIER_LAW_FILE, CarrierLawDocument)
    parts = tuple(
        LawPart(
            part.follows,
            np.array(part.x or [], dtype=np.float64),
            tuple(
                WaveTable(
                    wave.quantity,
                    wave.order,
                    wave.lobes,
                    np.array(wave.cosine),
                    np.array(wave.sine),
                )
                for wave in part.wave
            ),
            part.along or "",
        )
        for part in document.part
    )
    return CarrierLaw(
        document.name,
        f"{document.frame}/{document.pattern}",
        document.n_planets,
        document.sensor_radius,
        parts,
        {name: (low, high) for name, (low, high) in document.visited},
        document.measured_on or "",
    )


def write_carrier_law(path: Path, law: CarrierLaw) -> None:
    """Write a law file.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    law : CarrierLaw
        Law.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    frame, pattern = law.pattern.split("/")
    document: dict[str, Any] = {
        "name": law.name,
        "frame": frame,
        "pattern": pattern,
        "n_planets": law.n_planets,
        "sensor_radius": law.sensor_radius,
        "measured_on": law.measured_on or None,
        "visited": {name: list(ends) for name, ends in law.visited.items()},
        "part": [_part_table(part) for part in law.parts],
    }
    write_toml(path, CARRIER_LAW_FILE, _HEADING, document)


def _part_table(part: LawPart) -> dict[str, Any]:
    table: dict[str, Any] = {"follows": part.follows}
    if part.along:
        table["along"] = part.along
    if part.x.size:
        table["x"] = without_rounding(part.x)
    table["wave"] = [
        {
            "quantity": wave.quantity,
            "order": wave.order,
            "lobes": wave.lobes,
            "cosine": without_rounding(wave.cosine),
            "sine": without_rounding(wave.sine),
        }
        for wave in part.waves
    ]
    return table
