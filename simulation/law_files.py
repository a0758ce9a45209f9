"""Files of measured laws, of one element or of bushings, told apart by their format."""

from pathlib import Path

from carrierflex.files.toml_files import toml_document
from carrierflex.simulation.case_kinds import BUSHING_LAW_FILE, LAW_FILE
from carrierflex.simulation.element.law_files import read_law, write_law
from carrierflex.simulation.element.tabulated_laws import TabulatedLaw
from carrierflex.simulation.mounting.measured_laws.bushing_law_files import (
    read_bushing_law,
    write_bushing_law,
)
from carrierflex.simulation.mounting.measured_laws.bushing_laws import BushingLaw

#: Measured shape of a class as a law.
MeasuredLaw = TabulatedLaw | BushingLaw


def read_measured_law(path: Path) -> MeasuredLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-law`` or ``carrierflex-bushing-law``.

    Returns
    -------
    TabulatedLaw or BushingLaw
        Its tables.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds what is no table; all that is wrong, in one line.
    """
    is_of_bushings = toml_document(path, LAW_FILE).get("format") == BUSHING_LAW_FILE.format
    return read_bushing_law(path) if is_of_bushings else read_law(path)


def write_measured_law(path: Path, law: MeasuredLaw) -> None:
    """Write a law file; an older one is replaced in one step.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    if isinstance(law, BushingLaw):
        write_bushing_law(path, law)
    else:
        write_law(path, law)
