"""The formats of reduced bodies: what `carrierflex export` writes, and what it reads.

tools/site_pages.py reads the lists from the source, for the page "Which tool, which command".
"""

from typing import NamedTuple


class ExportFormat(NamedTuple):
    """A file of a body that this program or another one writes and reads."""

    name: str
    """Of the option --format."""
    tools: str
    """What reads it."""
    files: str
    """What is written."""
    checked: str
    """What the tests read it back with, and after which description."""
    reads: tuple[str, ...] = ()
    """Suffixes of the files that are read as a body."""
    taken: str = ""
    """What of them becomes the body, and what does not."""
    tried: str = ""
    """Files of the tests that another program wrote."""


# One entry a format.
# fmt: off
EXPORT_FORMATS = (
    ExportFormat("body", "carrierflex", "`.h5`: body file, without finite elements", "this program",
        (".h5",), "everything", "-"),
    ExportFormat("op4", "Nastran (external superelement)",
        "`.op4`, `.asm`, `.pch`, `.txt`: K, M, D",
        "pyyeti: op4, bulk, cbcheck",
        (".op4",), "with `.asm` and `.pch` beside it: K, M, B; every grid is a pilot, scalar "
        "points are modes; no inertia invariants", "MSC Nastran (in pyyeti 1.4)"),
    ExportFormat("dmig", "Nastran, Optistruct (bulk data)", "`.pch`, ten digits", "pyyeti",
        (".pch", ".bdf", ".dat"), "DMIG K, M, B with their GRID entries; with RBE2 or RBE3 their "
        "reference nodes are the pilots; no inertia invariants", "pyyeti 1.4"),
    ExportFormat("mbdyn", "MBDyn", "`.fem`: modal data with inertia invariants",
        "the tests' reader after MBDyn's manual"),
    ExportFormat("sid", "Simpack, Modelica", "`.SID_FEM`: standard input data (Wallrapp 1994)",
        "the tests' reader; sums over nodes",
        (".sid_fem", ".sid"), "ASCII form: the free body; nodes that move independently are "
        "pilots, the others sensors; no geometric stiffening", "PY_SID"),
    ExportFormat("exudyn", "Exudyn", "`.hdf5`: FEMinterface", "Exudyn",
        (".hdf5",), "FEMinterface, file version 3 or 4: matrices and mode basis; every set of "
        "three nodes or more is a pilot; no damping", "Exudyn 1.13"),
    ExportFormat("simscape", "Simscape Multibody", "`.mat`: P, K, M, C", "scipy",
        (".mat",), "P, K, M, C, on the top level or in a structure; no inertia invariants",
        "scipy"),
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
#: Suffixes of what is not read as a body, what it is, why not, and what to do.
NOT_READ = (
    ((".npz", ".npy", ".pkl"), "a body of Exudyn in pickled form", "it can run code when it is "
        "read", "in Exudyn: `fem.LoadFromFile(...)`, `fem.SaveToFile('body.hdf5')`"),
    ((".fbi",), "Simpack's binary body", "its form is not published", "export SID_FEM in ASCII"),
    ((".mnf",), "Adams' modal neutral file", "its form is not published", "export the matrices "
        "as OP4 or DMIG from the finite element program"),
    ((".sub",), "Ansys' superelement", "no public sample", "`HBMAT` or `.full`, then "
        "`carrierflex reduce --stiffness`"),
    ((".full", ".cdb", ".inp", ".msh", ".unv", ".med", ".nas"), "a full model, not reduced yet",
        "it has no modes", "reduce it first: `carrierflex reduce` with --interfaces and --mesh or "
        "--stiffness"),
    ((".fem",), "modal data of MBDyn", "one way only", "export SID or OP4 from the same tool"),
)
# fmt: on
