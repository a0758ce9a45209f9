"""The file law.toml: the measured shape of one class of effect of an element."""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.toml_files import read_toml, write_toml
from carrierflex.simulation.case_kinds import LAW_FILE
from carrierflex.simulation.element.tabulated_laws import TabulatedLaw

_HEADING = (
    "# Measured shape of a missing effect, taken as a candidate by `diagnose --law FILE`.",
    "# Linear between the points, whose ends are those of the visited range. Beyond it f(x) and",
    "# g(v) go on with the slope of their end, h(x) keeps its end value.",
)
#: Share of the largest value below which a value is written as zero.
_ZERO = 1e-12
#: Units stand in a comment, which ends with its line.
_ONE_LINE = re.compile(r"[\x00-\x1f\x7f-\x9f]")


def read_law(path: Path) -> TabulatedLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-law``.

    Returns
    -------
    TabulatedLaw
        Its table.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds what is no table; all that is wrong, in one line.
    """
    # Late: pydantic takes longer to load than all else here.
    from carrierflex.simulation.element.law_tables import LawDocument

    document = read_toml(path, LAW_FILE, LawDocument)
    table = document.table
    return TabulatedLaw(
        document.name,
        document.effect_class,
        np.array(table.x),
        np.array(table.y),
        (document.force_unit, document.deflection_unit),
        (table.friction_plus, table.friction_minus),
        document.measured_on or "",
    )


def write_law(path: Path, law: TabulatedLaw) -> None:
    """Write a law file.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    law : TabulatedLaw
        Law.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    table: dict[str, Any] = {"x": without_rounding(law.x), "y": without_rounding(law.y)}
    if any(law.friction):
        table |= {"friction_plus": law.friction[0], "friction_minus": law.friction[1]}
    document: dict[str, Any] = {
        "name": law.name,
        "effect_class": law.effect_class,
        "force_unit": law.units[0],
        "deflection_unit": law.units[1],
        "measured_on": law.measured_on or None,
        "table": table,
    }
    units = f"# x [{law.x_unit}], y [{law.y_unit}], dry friction [{law.units[0]}]"
    heading = (*_HEADING, _ONE_LINE.sub(" ", units))
    write_toml(path, LAW_FILE, heading, document)


def without_rounding(values: NDArray[np.float64]) -> list[float]:
    """Values with zero for what is too small for any reader."""
    least = _ZERO * float(np.abs(values).max())
    return [0.0 if abs(value) <= least else value for value in values.tolist()]
