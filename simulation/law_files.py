"""Files of measured laws, of one element, of bushings or of a carrier, told by their format."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from carrierflex.files.toml_files import toml_document
from carrierflex.simulation.carrier.measured_laws.carrier_law_files import (
    read_carrier_law,
    write_carrier_law,
)
from carrierflex.simulation.carrier.measured_laws.carrier_laws import CarrierLaw
from carrierflex.simulation.case_kinds import (
    BUSHING_LAW_FILE,
    BUSHING_MEMORY_LAW_FILE,
    CARRIER_LAW_FILE,
    LAW_FILE,
    MEMORY_LAW_FILE,
    SURFACE_LAW_FILE,
)
from carrierflex.simulation.element.law_files import read_law, write_law
from carrierflex.simulation.element.measured_laws import MeasuredElementLaw
from carrierflex.simulation.element.memory_law_files import read_memory_law, write_memory_law
from carrierflex.simulation.element.memory_laws import MemoryLaw
from carrierflex.simulation.element.surface_law_files import (
    read_surface_law,
    write_surface_law,
)
from carrierflex.simulation.element.surface_laws import SurfaceLaw
from carrierflex.simulation.element.tabulated_laws import TabulatedLaw
from carrierflex.simulation.mounting.measured_laws.bushing_law_files import (
    read_bushing_law,
    write_bushing_law,
)
from carrierflex.simulation.mounting.measured_laws.bushing_laws import (
    BushingLaw,
    MeasuredBushingLaw,
)
from carrierflex.simulation.mounting.measured_laws.bushing_memory_law_files import (
    read_bushing_memory_law,
    write_bushing_memory_law,
)
from carrierflex.simulation.mounting.measured_laws.bushing_memory_laws import BushingMemoryLaw

#: Measured shape of a class as a law.
MeasuredLaw = MeasuredElementLaw | MeasuredBushingLaw | CarrierLaw
#: Reader by format of a file.
_READERS: Mapping[str, Callable[[Path], MeasuredLaw]] = {
    LAW_FILE.format: read_law,
    MEMORY_LAW_FILE.format: read_memory_law,
    SURFACE_LAW_FILE.format: read_surface_law,
    BUSHING_LAW_FILE.format: read_bushing_law,
    BUSHING_MEMORY_LAW_FILE.format: read_bushing_memory_law,
    CARRIER_LAW_FILE.format: read_carrier_law,
}
#: Writer by kind of a law.
_WRITERS: Mapping[type, Callable[[Path, Any], None]] = {
    TabulatedLaw: write_law,
    MemoryLaw: write_memory_law,
    SurfaceLaw: write_surface_law,
    BushingLaw: write_bushing_law,
    BushingMemoryLaw: write_bushing_memory_law,
    CarrierLaw: write_carrier_law,
}


def read_measured_law(path: Path) -> MeasuredLaw:
    """Law of a file.

    Parameters
    ----------
    path : Path
        File of the format ``carrierflex-law``, ``carrierflex-memory-law``,
        ``carrierflex-surface-law``, ``carrierflex-bushing-law``,
        ``carrierflex-bushing-memory-law`` or ``carrierflex-carrier-law``.

    Returns
    -------
    TabulatedLaw, MemoryLaw, SurfaceLaw, BushingLaw, BushingMemoryLaw or CarrierLaw
        Its tables.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is no such file, or holds what is no table; all that is wrong, in one line.
    """
    own = str(toml_document(path, LAW_FILE).get("format"))
    return _READERS.get(own, read_law)(path)


def write_measured_law(path: Path, law: MeasuredLaw) -> None:
    """Write a law file; an older one is replaced in one step.

    Raises
    ------
    OSError
        Where it cannot be written.
    """
    _WRITERS[type(law)](path, law)
