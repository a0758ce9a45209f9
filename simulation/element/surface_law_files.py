"""The file law.toml of a measured surface."""

from pathlib import Path
from typing import Any

import numpy as np

from carrierflex.files.toml_files import read_toml, write_toml
from carrierflex.simulation.case_kinds import SURFACE_LAW_FILE
from carrierflex.simulation.element.law_files import without_rounding
from carrierflex.simulation.element.memory_law_files import stop_rows, stop_tables
from carrierflex.simulation.element.surface_laws import SurfaceLaw

_HEADING = (
    "# Measured force f(x, v), taken as a candidate by `diagnose --law FILE`. Bilinear between the",
    "# points, whose ends are those of the visited range; beyond it the force goes on with the",
    "# slope of its end. Dry friction stands beside the table: its level over x, and stops",
    "# (springs that slip), over which it turns.",
)


def read_surface_law(path: Path) -> SurfaceLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-surface-law``.

    Returns
    -------
    SurfaceLaw
        Its table and stops.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds no surface; all that is wrong, in one line.
    """
    # Late: pydantic takes longer to load than all else here.
    from carrierflex.simulation.element.surface_law_tables import SurfaceLawDocument

    document = read_toml(path, SURFACE_LAW_FILE, SurfaceLawDocument)
    table = document.table
    return SurfaceLaw(
        document.name,
        np.array(table.x),
        np.array(table.v),
        np.array(table.y),
        np.array(table.friction) if table.friction else np.zeros(len(table.x)),
        stop_rows(document.stop),
        (document.force_unit, document.deflection_unit),
        document.measured_on or "",
    )


def write_surface_law(path: Path, law: SurfaceLaw) -> None:
    """Write a law file.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    law : SurfaceLaw
        Law.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    y = np.reshape(without_rounding(law.y.ravel()), law.y.shape)
    table = {"x": without_rounding(law.x), "v": without_rounding(law.v), "y": y.tolist()}
    if law.friction.any():
        table["friction"] = without_rounding(law.friction)
    document: dict[str, Any] = {
        "name": law.name,
        "force_unit": law.units[0],
        "deflection_unit": law.units[1],
        "measured_on": law.measured_on or None,
        "table": table,
    }
    if law.stops.size:
        document["stop"] = stop_tables(law.stops)
    write_toml(path, SURFACE_LAW_FILE, _HEADING, document)
