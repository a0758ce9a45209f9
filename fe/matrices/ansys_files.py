"""Stiffness and mass of Ansys' .full files, through the package ansys-mapdl-reader."""

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from carrierflex.fe.matrices.stored_matrix import DofNames, StoredMatrix, from_entries
from carrierflex.files.child_process import in_child, limited

_EXTRA = "pip install carrierflex[ansys]"


def read_full(path: Path, size: int, quantity: str) -> StoredMatrix:
    """Stiffness or mass of a .full file, with nodes and directions.

    Raises
    ------
    ValueError
        Where the reader is not installed, or the file is none that it reads.
    """
    return in_child(_by_reader, path, size, quantity, about=path, what="ansys-mapdl-reader")


def _by_reader(path: Path, size: int, quantity: str) -> StoredMatrix:
    try:
        from ansys.mapdl import reader
    except ImportError as error:
        raise ValueError(
            f"{path}: .full files are read by ansys-mapdl-reader, which is not installed; {_EXTRA}"
        ) from error
    try:
        with limited(60 + size // 500_000, 1_000_000_000 + 60 * size):
            dofs, K, M = reader.read_binary(str(path)).load_km(sort=False)
            chosen = sp.coo_array(K if quantity == "stiffness" else M)
            rows, columns = (np.asarray(i, dtype=np.int64) for i in chosen.coords)
            names = DofNames(
                np.asarray(dofs[:, 0], dtype=np.int64), np.asarray(dofs[:, 1], dtype=np.int64)
            )
            values = chosen.data.astype(np.float64)
            return StoredMatrix(from_entries(rows, columns, values, len(names)), names)
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(
            f"{path}: not a .full file that ansys-mapdl-reader takes ({reason})"
        ) from error
