"""A reduced body from a file of any program that is read."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import scipy.linalg

from carrierflex.reduction.body_files import read_body
from carrierflex.reduction.exports.export_formats import EXPORT_FORMATS, NOT_READ
from carrierflex.reduction.imports.exudyn_input_files import read_exudyn
from carrierflex.reduction.imports.imported_body import UNIT_SYSTEMS, ImportedBody, in_si
from carrierflex.reduction.imports.sid_input_files import read_sid
from carrierflex.reduction.imports.superelement_files import (
    partners_of,
    read_simscape,
    read_superelement,
)

_READERS: Mapping[str, Callable[[Path], ImportedBody]] = {
    "body": lambda path: ImportedBody(read_body(path)),
    "sid": read_sid,
    "exudyn": read_exudyn,
    "op4": read_superelement,
    "dmig": read_superelement,
    "simscape": read_simscape,
}
#: Name of the format by suffix.
FORMAT_OF_SUFFIX = {
    suffix: export_format.name for export_format in EXPORT_FORMATS for suffix in export_format.reads
}


def read_any_body(path: Path, units: str = "m-N") -> ImportedBody:
    """Read a reduced body, of this program or of another one.

    Parameters
    ----------
    path : Path
        File; its suffix tells the format, as :data:`EXPORT_FORMATS` lists them.
    units : str
        Units of length and force in the file, one of :data:`UNIT_SYSTEMS`; a body file (.h5) is in
        SI units.

    Returns
    -------
    ImportedBody
        The body in SI units and what was lost.

    Raises
    ------
    FileNotFoundError, ValueError
        Where the file is missing, damaged, or of a format that is not read; one line that names it
        and what to do.
    """
    suffix = path.suffix.lower()
    for suffixes, what, why, do in NOT_READ:
        if suffix in suffixes:
            raise ValueError(f"{path}: {what} is not read as a body ({why}); {do}")
    name = FORMAT_OF_SUFFIX.get(suffix)
    if name is None:
        raise ValueError(
            f"{path}: suffix {path.suffix!r} is that of no body that is read; expected "
            f"{', '.join(FORMAT_OF_SUFFIX)}"
        )
    if name == "body" and units != "m-N":
        raise ValueError(
            f"--units is {units}, and {path} is a body file, which is in SI units; leave it out"
        )
    if units not in UNIT_SYSTEMS:
        raise ValueError(f"--units is {units!r}; expected one of {', '.join(UNIT_SYSTEMS)}")
    try:
        # Overflow and 0 / 0 of numbers that no body has.
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            imported = _READERS[name](path)
            return ImportedBody(in_si(imported.model, units), imported.losses)
    except (FloatingPointError, np.linalg.LinAlgError, scipy.linalg.LinAlgWarning) as error:
        names = [partner.name for partner in partners_of(path)]
        files = f", with {' and '.join(names)}" if names else ""
        raise ValueError(
            f"{path}{files}: its numbers make no body ({error}); expected stiffness and mass of "
            "one body with the places of its nodes"
        ) from error
