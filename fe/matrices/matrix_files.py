"""Which reader takes a file of a stiffness or a mass matrix."""

import re
from collections.abc import Callable
from pathlib import Path

from carrierflex.fe.matrices.abaqus_files import read_abaqus_matrix
from carrierflex.fe.matrices.ansys_files import read_full
from carrierflex.fe.matrices.array_files import read_matrix_market, read_npz
from carrierflex.fe.matrices.dmig_input_files import read_dmig
from carrierflex.fe.matrices.harwell_boeing_files import read_harwell_boeing
from carrierflex.fe.matrices.op4_input_files import read_op4
from carrierflex.fe.matrices.stored_matrix import StoredMatrix
from carrierflex.files.plain_files import check_plain_file, plain_content

#: Larger files [bytes] are refused: some hundred million entries in text.
MOST_BYTES = 20_000_000_000
#: Suffixes, and what a file of that suffix is.
SUFFIXES = {
    ".op4": "Nastran output4",
    ".pch": "Nastran DMIG punch",
    ".bdf": "Nastran DMIG bulk data",
    ".dat": "Nastran DMIG bulk data",
    ".mtx": "Abaqus matrix or MatrixMarket",
    ".mm": "MatrixMarket",
    ".sti": "CalculiX stiffness",
    ".mas": "CalculiX mass",
    ".rsa": "Harwell-Boeing",
    ".hb": "Harwell-Boeing",
    ".matrix": "Harwell-Boeing",
    ".npz": "scipy sparse matrix",
    ".full": "Ansys, needs the extra ansys",
}
_EXPECTED = "a stiffness or mass matrix"
_Reader = Callable[[Path, bytes, str], StoredMatrix]


def read_matrix(path: Path, quantity: str) -> StoredMatrix:
    """Read the stiffness or mass matrix of another program.

    Parameters
    ----------
    path : Path
        File; :data:`SUFFIXES` lists what is known. A .mtx file is MatrixMarket where it begins with
        that word, else Abaqus.
    quantity : str
        ``stiffness`` or ``mass``: which one of a file that holds both.

    Returns
    -------
    StoredMatrix
        Its numbers as printed, with the names of the degrees of freedom where the file has them.

    Raises
    ------
    FileNotFoundError
        Where there is no such file.
    ValueError
        Where it is of no known kind, damaged, or holds no such matrix; the message names it.
    """
    suffix = path.suffix.lower()
    if suffix == ".full":
        return read_full(path, check_plain_file(path, _EXPECTED, MOST_BYTES), quantity)
    if suffix not in SUFFIXES:
        check_plain_file(path, _EXPECTED, MOST_BYTES)
        known = ", ".join(SUFFIXES)
        raise ValueError(f"{path}: suffix {path.suffix!r}; expected one of {known}")
    content = plain_content(path, _EXPECTED, MOST_BYTES)
    return _reader(suffix, content)(path, content, quantity)


def _reader(suffix: str, content: bytes) -> _Reader:
    if suffix == ".op4":
        return read_op4
    if suffix in (".pch", ".bdf", ".dat"):
        return read_dmig
    if suffix == ".npz":
        return lambda path, content, quantity: read_npz(path, content)
    if suffix in (".rsa", ".hb", ".matrix"):
        return lambda path, content, quantity: read_harwell_boeing(path, content)
    if suffix == ".mm" or re.match(rb"%%MatrixMarket", content, re.I):
        return lambda path, content, quantity: read_matrix_market(path, content)
    return read_abaqus_matrix
