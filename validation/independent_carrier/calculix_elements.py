"""Stiffness by CalculiX of a stack of wedges, and its solution in one symmetry class.

CalculiX makes and assembles the elements and writes the matrix; a node of the half sector's cut
planes moves as its mirror image does.
"""

import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from kvxopt import cholmod, matrix, spmatrix
from numpy.typing import NDArray

from validation.independent_carrier.section_mesh import HALF_SECTOR, FloatArray
from validation.independent_carrier.stack import Stack

#: Motions that mirroring at the pin's plane keeps: moves along x and z and the turn about y.
SYMMETRIC = (0, 2, 4)
#: Motions whose sign it turns.
ANTISYMMETRIC = (1, 3, 5)
_SECONDS = 600


@dataclass(frozen=True)
class Elastic:
    """Isotropic material: Young's modulus [Pa] and Poisson's ratio."""

    E: float
    nu: float


def stiffness(stack: Stack, materials: Mapping[str, Elastic]) -> sp.csc_array:
    """Stiffness [N/m] of the free half sector, its lower triangle, shape (3 n, 3 n).

    Raises
    ------
    RuntimeError
        Where CalculiX is not installed or ends with an error.
    """
    if shutil.which("ccx") is None:
        raise RuntimeError("ccx is not installed; expected CalculiX (apt-get install calculix-ccx)")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        deck = [*_body_lines(stack, materials), "*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1"]
        (folder / "job.inp").write_text("\n".join([*deck, "*END STEP"]) + "\n")
        run = subprocess.run(
            ["ccx", "-i", "job"],
            cwd=folder,
            env={**os.environ, "OMP_NUM_THREADS": "1", "CCX_NPROC_STIFFNESS": "1"},
            capture_output=True,
            text=True,
            check=False,
            timeout=_SECONDS,
        )
        if not (folder / "job.sti").is_file() or "*ERROR" in run.stdout:
            raise RuntimeError(f"CalculiX: {run.stdout[-800:]}")
        names = np.array([word.split(".") for word in (folder / "job.dof").read_text().split()])
        row, column, value = np.fromfile(folder / "job.sti", sep=" ").reshape(-1, 3).T
    node, axis = names.astype(np.int64).T
    dof = 3 * (node - 1) + axis - 1
    i, j = dof[row.astype(np.int64) - 1], dof[column.astype(np.int64) - 1]
    n = stack.points.size
    return sp.csc_array((value, (np.maximum(i, j), np.minimum(i, j))), shape=(n, n))


def _body_lines(stack: Stack, materials: Mapping[str, Elastic]) -> list[str]:
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k},{x:.12e},{y:.12e},{z:.12e}" for k, (x, y, z) in enumerate(stack.points, 1)]
    number = 1
    for body, wedges in stack.wedges.items():
        lines.append(f"*ELEMENT, TYPE=C3D15, ELSET={body}")
        for nodes in (wedges + 1).tolist():
            lines.append(",".join(map(str, [number, *nodes])))
            number += 1
        material = materials[body]
        lines += [f"*MATERIAL, NAME=M_{body}", "*ELASTIC", f"{material.E:.12e},{material.nu:.12f}"]
        # Statics alone is wanted; CalculiX writes the mass too.
        lines += ["*DENSITY", "1.0", f"*SOLID SECTION, ELSET={body}, MATERIAL=M_{body}"]
    return lines


def displacement(
    stack: Stack,
    K: sp.csc_array,
    motions: tuple[int, ...],
    fixed: NDArray[np.bool_],
    forces: FloatArray,
) -> FloatArray:
    """Displacement [m] under loads of one symmetry class.

    Parameters
    ----------
    stack : Stack
        Half sector.
    K : csc_array
        Lower triangle of :func:`stiffness`.
    motions : tuple of int
        :data:`SYMMETRIC` or :data:`ANTISYMMETRIC`.
    fixed : ndarray of bool, shape (n, 3)
        Directions that are held besides those of the symmetry.
    forces : ndarray, shape (k, n, 3)
        Nodal forces [N] of every load.

    Returns
    -------
    ndarray, shape (k, n, 3)
    """
    T = _admitted(stack, motions, fixed)
    symmetric = K + sp.tril(K, -1).T
    lower = sp.coo_array(sp.tril(T.T @ symmetric @ T))
    A = spmatrix(matrix(lower.data), matrix(lower.row), matrix(lower.col), size=lower.shape)
    factor = cholmod.symbolic(A)
    cholmod.numeric(A, factor)
    b = matrix(np.asfortranarray(T.T @ forces.reshape(len(forces), -1).T))
    cholmod.solve(factor, b)
    return np.asarray((T @ np.array(b)).T.reshape(forces.shape))


def _admitted(stack: Stack, motions: tuple[int, ...], supported: NDArray[np.bool_]) -> sp.csr_array:
    """Displacement of all nodes from the unknowns that the symmetry and the supports leave."""
    symmetric = motions == SYMMETRIC
    on_pin, on_web = stack.on_pin_plane, stack.on_web_plane
    fixed = supported.copy()
    fixed[on_pin] |= [not symmetric, symmetric, not symmetric]
    c, s = math.cos(HALF_SECTOR), math.sin(HALF_SECTOR)
    blocks = np.tile(np.eye(3), (len(stack.points), 1, 1))
    # Of a node on the web's plane the unknowns are along x, along its radius and across the plane.
    blocks[on_web] = np.array([[1.0, 0.0, 0.0], [0.0, -s, -c], [0.0, c, -s]])
    fixed[on_web] |= [not symmetric, not symmetric, symmetric]
    # Full width: a held node of the web's plane is held in all directions or in none but x.
    n = len(stack.points)
    T = sp.csc_array(sp.bsr_array((blocks, np.arange(n), np.arange(n + 1))))
    return sp.csr_array(T[:, np.flatnonzero(~fixed.ravel())])
