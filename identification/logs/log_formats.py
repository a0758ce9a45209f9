"""The files that `carrierflex import` and `new-campaign` read, by suffix; any other suffix is text.

tools/site_pages.py reads the list from the source, for the page "Which tool, which command".
"""

from pathlib import Path
from typing import NamedTuple


class LogFormat(NamedTuple):
    """A kind of file that a logger, a test system or a simulator writes."""

    suffixes: tuple[str, ...]
    """As of `Path.suffix`, in lower case."""
    words: str
    """For messages: ``a TDMS file``."""
    tools: str
    """What writes it."""
    taken: str
    """What becomes a column."""
    extra: str = ""
    """Extra of this project that installs the reader; empty where none is needed."""
    module: str = ""
    """Module of the reader."""


# One entry a format.
# fmt: off
LOG_FORMATS = (
    LogFormat((".parquet",), "a Parquet file", "pandas, Spark, data lakes",
        "columns of numbers, timestamps and text dates; metadata `unit` of a field"),
    LogFormat((".h5", ".hdf5"), "an HDF5 file", "h5py, MATLAB, DEWESoft's and others' exports",
        "datasets of one length share a clock; rows and columns of matrices up to 64 wide, "
        "compound datasets by field; attribute `unit` or `units`"),
    LogFormat((".mat",), "a MAT file", "MATLAB, Simulink (structure with time), test systems",
        "vectors and matrices, fields of structures (MAT 5), datasets as of HDF5 (MAT 7.3); "
        "`timeseries` objects and tables are not read: save their Time and Data as arrays"),
    LogFormat((".tdms",), "a TDMS file", "LabVIEW, FlexLogger",
        "channels of one length and waveform clock; `unit_string`", "tdms", "nptdms"),
    LogFormat((".uff", ".unv"), "a universal file (UFF)",
        "Simcenter Testlab, BK Connect, PULSE, ARTeMIS, pyuff",
        "time responses of data set 58 and 58b (function type 1, or type 0 over time); clock, "
        "node, direction and unit label. Data set 55 (mode shapes) holds no record of time",
        "uff", "pyuff"),
    LogFormat((".mf4", ".mdf"), "an MDF file", "Vector CANape and CANoe, INCA, DEWESoft, asammdf",
        "channels of every group over the group's master, in physical units (MDF 3 and 4)",
        "mdf", "asammdf"),
    LogFormat((".xlsx", ".xlsm"), "an Excel workbook", "Excel and what exports to it",
        "sheets that hold a table: preamble, names, line of units and dates are found as in text; "
        "sheets without a table are left out", "excel", "python_calamine"),
    LogFormat((".outb",), "OpenFAST's binary output", "OpenFAST, FAST.Farm",
        "every channel, with its unit; column `Time`", "openfast",
        "openfast_io.FAST_output_reader"),
)
# fmt: on

#: By suffix.
FORMAT_OF_SUFFIX = {suffix: own for own in LOG_FORMATS for suffix in own.suffixes}


def format_of(path: Path) -> LogFormat | None:
    """Format of a file by its suffix; None where it is text."""
    return FORMAT_OF_SUFFIX.get(path.suffix.lower())
