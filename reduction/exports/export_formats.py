"""The formats that `carrierflex export` writes.

tools/site_pages.py reads the list from the source, for the page "Which tool, which command".
"""

from typing import NamedTuple


class ExportFormat(NamedTuple):
    """A file that another program reads."""

    name: str
    """Of the option --format."""
    tools: str
    """What reads it."""
    files: str
    """What is written."""
    checked: str
    """What the tests read it back with, and after which description."""


# One entry a format.
# fmt: off
EXPORT_FORMATS = (
    ExportFormat("op4", "Nastran (external superelement)",
        "`.op4`, `.asm`, `.pch`, `.txt`: K, M, D",
        "pyyeti: op4, bulk, cbcheck"),
    ExportFormat("dmig", "Nastran, Optistruct (bulk data)", "`.pch`, ten digits", "pyyeti"),
    ExportFormat("mbdyn", "MBDyn", "`.fem`: modal data with inertia invariants",
        "the tests' reader after MBDyn's manual"),
    ExportFormat("sid", "Simpack, Modelica", "`.SID_FEM`: standard input data (Wallrapp 1994)",
        "the tests' reader; sums over nodes"),
    ExportFormat("exudyn", "Exudyn", "`.hdf5`: FEMinterface", "Exudyn"),
    ExportFormat("simscape", "Simscape Multibody", "`.mat`: P, K, M, C", "scipy"),
    ExportFormat("openfast", "OpenFAST, module ExtPtfm, form of pull request 3210",
        "`.dat`, `_SE.dat`, `_Conn.dat`: superelement, self-weight, connection points",
        "openfast-io 5.0.0; the tests' reader after ExtPtfm_MCKF_IO.f90 and the page of its input "
        "files"),
    ExportFormat("openfast-flex5",
        "OpenFAST 2.4 and later, module ExtPtfm before pull request 3210",
        "`.dat`, `_SE.dat`: FlexASCII superelement, self-weight as load",
        "the tests' reader after ExtPtfm_MCKF_IO.f90 and the page of its input files"),
    ExportFormat("statespace", "MATLAB, numpy, python-control",
        "`.mat` or `.npz`: A, B, C, D, names, units, operating point; of a body, a joined group, a "
        "mounting or a stage", "scipy, numpy, python-control"),
)
# fmt: on
