"""Law files: measured laws of an element, of bushings or of a carrier, written and read."""

from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from carrierflex.files.toml_files import read_toml, write_toml
from carrierflex.simulation.case_kinds import LAW_FILE
from carrierflex.simulation.laws import Law, LawTerm

_HEADING = (
    "# Measured shape of a missing effect, a candidate of `diagnose --law FILE`. Parts add up;",
    "# tables are linear between their points. `carrierflex schema law` explains every key.",
)
#: Share of the largest value below which a value is written as zero.
_ZERO = 1e-12


def read_law(path: Path) -> Law:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-law``.

    Returns
    -------
    Law
        The law.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds what is no law; all that is wrong, in one line.
    """
    # Late: pydantic takes longer to load than all else here.
    from carrierflex.simulation.law_tables import LawDocument

    return read_toml(path, LAW_FILE, LawDocument).law()


def write_law(path: Path, law: Law) -> None:
    """Write a law file.

    Parameters
    ----------
    path : Path
        File; an older one is replaced in one step.
    law : Law
        Law.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    document: dict[str, Any] = {
        "name": law.name,
        "kind": law.kind,
        "effect_class": law.effect_class,
        "measured_on": law.measured_on or None,
        "units": dict(zip(("force", "deflection"), law.units, strict=True)),
        "rig": dict(law.rig) or None,
        "visited": {name: list(ends) for name, ends in law.visited.items()} or None,
        "part": [_part_table(term) for term in law.terms],
    }
    write_toml(path, LAW_FILE, _HEADING, document)


def _part_table(term: LawTerm) -> dict[str, Any]:
    """Keys of a part without those at their defaults."""
    table: dict[str, Any] = {"type": term.type}
    for field in fields(term):
        value = getattr(term, field.name)
        if isinstance(value, np.ndarray):
            if value.size or field.default_factory is MISSING:
                table[field.name] = _without_rounding(value)
        elif value != field.default:
            table[field.name] = value
    return table


def _without_rounding(values: NDArray[np.float64]) -> Any:
    """Values with zero for what is too small for any reader."""
    least = _ZERO * float(np.abs(values).max(initial=0.0))
    return np.where(np.abs(values) <= least, 0.0, values).tolist()
