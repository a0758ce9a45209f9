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
    checked: str
    """What wrote the files of the tests."""
    extra: str = ""
    """Extra of this project that installs the reader; empty where none is needed."""
    module: str = ""
    """Module of the reader."""


# One entry a format.
# fmt: off
LOG_FORMATS = (
    LogFormat((".parquet",), "a Parquet file", "pandas, Spark",
        "columns of numbers, timestamps and text dates; metadata `unit` of a field", "pyarrow"),
    LogFormat((".h5", ".hdf5"), "an HDF5 file", "h5py, MATLAB, exports of loggers",
        "datasets of one length share a clock; rows and columns of matrices up to 64 wide, "
        "compound datasets by field; attribute `unit` or `units`", "h5py"),
    LogFormat((".mat",), "a MAT file", "MATLAB, Simulink (structure with time)",
        "vectors and matrices, fields of structures (MAT 5), datasets as of HDF5 (MAT 7.3)",
        "scipy, h5py"),
    LogFormat((".tdms",), "a TDMS file", "LabVIEW, FlexLogger",
        "channels of one length and waveform clock; `unit_string`", "npTDMS", "tdms", "nptdms"),
    LogFormat((".uff", ".unv"), "a universal file (UFF)", "modal and vibration test systems, pyuff",
        "time responses of data sets 58 and 58b (function type 1, or 0 over time): clock, name or "
        "node and direction, unit label", "pyuff 2.5.8, text and binary; by hand, field by field, "
        "after the description of data set 58 (University of Cincinnati)", "uff", "pyuff"),
    LogFormat((".mf4", ".mdf"), "an MDF file", "CANape, CANoe, INCA, asammdf",
        "channels of every group over its master (column `time`), in physical units",
        "asammdf 8.8.28, versions 4.10 (compressed) and 3.30", "mdf", "asammdf"),
    LogFormat((".xlsx", ".xlsm"), "an Excel workbook", "Excel",
        "sheets that hold a table: preamble, names, line of units and dates are found as in text; "
        "sheets without a table are left out", "openpyxl 3.1.5", "excel", "python_calamine"),
    LogFormat((".outb",), "OpenFAST's binary output", "OpenFAST, FAST.Farm",
        "every channel and `Time`, with units; `.out` is text and needs no extra",
        "by hand, after ReadFASTbinary.m of OpenFAST's MATLAB toolbox, formats 2, 3 and 4",
        "openfast", "openfast_io.FAST_output_reader"),
)

#: What is not read: tool and file, why, and what to do in its place.
NOT_READ = (
    ("MATLAB: `timeseries` objects and tables in .mat",
        "no public sample of a timeseries was found; how MATLAB stores objects is not published",
        "s.time = ts.Time; s.data = ts.Data; save('run.mat', '-struct', 's')"),
    ("UFF: data set 55 (mode shapes) and functions of frequency",
        "hold no record of time; pyuff reads no data set 55 of analysis type 4 (transient)",
        "export the records of time as data set 58"),
    ("Excel: .xls", "not tested", "save as .xlsx"),
    ("Simpack, Adams, Bladed: result files",
        "neither a public sample nor a public description was found", "export as CSV"),
)
# fmt: on

#: By suffix.
FORMAT_OF_SUFFIX = {suffix: entry for entry in LOG_FORMATS for suffix in entry.suffixes}


def format_of(path: Path) -> LogFormat | None:
    """Format of a file by its suffix; None where it is text."""
    return FORMAT_OF_SUFFIX.get(path.suffix.lower())
