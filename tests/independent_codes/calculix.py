"""Runs CalculiX on our mesh files: input decks in, matrices and displacements out."""

import os
import shutil
import subprocess

import numpy as np
import pytest
import scipy.sparse as sp

from carrierflex.geometry.mesh_files import write_mesh

needs_calculix = pytest.mark.skipif(
    shutil.which("ccx") is None,
    reason="CalculiX is not installed (Debian: apt-get install calculix-ccx)",
)


def run_calculix(folder, mesh, materials, step):
    """Write the mesh and a deck with its materials and the lines of `step`.

    Run CalculiX on one thread in `folder`.
    """
    write_mesh(mesh, folder / "mesh.inp")
    deck = ["*INCLUDE, INPUT=mesh.inp"]
    for body in mesh.bodies:
        material = materials[body]
        deck += [f"*MATERIAL, NAME=M_{body}", "*ELASTIC", f"{material.E:.12e},{material.nu:.12f}"]
        deck += [
            "*DENSITY",
            f"{material.rho:.12e}",
            f"*SOLID SECTION, ELSET={body}, MATERIAL=M_{body}",
        ]
    (folder / "job.inp").write_text("\n".join([*deck, *step]) + "\n")
    run = subprocess.run(
        ["ccx", "-i", "job"],
        cwd=folder,
        env={**os.environ, "OMP_NUM_THREADS": "1", "CCX_NPROC_EQUATION_SOLVER": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert run.returncode == 0, run.stdout[-2000:]
    assert "*ERROR" not in run.stdout, run.stdout[run.stdout.index("*ERROR") :][:500]


def stored_matrix(folder, suffix, n_nodes):
    """Matrix that MATRIXSTORAGE left.

    One triangle as row, column, value; rows are named node.direction in job.dof.
    """
    names = (folder / "job.dof").read_text().split()
    numbers = np.array([name.split(".") for name in names], dtype=int)
    dof = 3 * (numbers[:, 0] - 1) + numbers[:, 1] - 1
    row, column, value = np.loadtxt(folder / f"job.{suffix}", unpack=True)
    i, j = dof[row.astype(int) - 1], dof[column.astype(int) - 1]
    triangle = sp.coo_array((value, (i, j)), shape=(3 * n_nodes, 3 * n_nodes)).tocsr()
    return triangle + triangle.T - sp.diags_array(triangle.diagonal()).tocsr()


def printed_displacement(folder, n_nodes):
    """Displacement from the printed node table, zero at nodes not asked for, shape (n_nodes, 3)."""
    u = np.zeros((n_nodes, 3))
    for line in (folder / "job.dat").read_text().splitlines():
        words = line.split()
        if len(words) == 4 and words[0].isdigit():
            u[int(words[0]) - 1] = [float(word) for word in words[1:]]
    return u
