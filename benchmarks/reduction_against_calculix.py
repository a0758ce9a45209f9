"""The whole reduction against CalculiX's forty modes alone on the same mesh, in two ways.

    python -m benchmarks.reduction_against_calculix [SIZE]

By symmetry blocks, and of the free mesh. Needs the command ``ccx``. CalculiX holds the nodes of all
pilots' surfaces, as rigid couplings with held pilots do, so that its frequencies are those of our
rigid reduction.
"""

import os
import re
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.fourteen_pilots import (
    N_MODES,
    compile_kernels,
    completed_mesh,
    free_structure,
    half_mesh,
    pilot_points,
    symmetric_structure,
)
from benchmarks.measured import measured
from benchmarks.ratio import DIFFERENCE, PROCESSOR_TIME, TIME, Absent, Ratio, at_least
from benchmarks.run import run_alone
from carrierflex.fe.materials import CAST_IRON
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.geometry.mesh_files import write_mesh
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.fixed_interface_modes import fixed_interface_modes
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

QUICK = {"size": 0.06}


def ratios(size: float = 0.022) -> Iterator[Ratio | Absent]:
    """Time from the mesh to the reduced body, and what the rigid frequencies differ by.

    Parameters
    ----------
    size
        Element edge length [m]; 0.022 makes 262 000 unknowns.
    """
    if shutil.which("ccx") is None:
        yield Absent("CalculiX", "no command ccx (Debian: apt-get install calculix-ccx)")
        return
    compile_kernels()
    _by_blocks(half_mesh(0.06))
    half = half_mesh(size)
    mesh = completed_mesh(half)
    case = f"{3 * len(mesh.points)} unknowns"
    works = {
        "by symmetry blocks": lambda: _by_blocks(half),
        "free mesh": lambda: craig_bampton(free_structure(mesh), N_MODES).model.n_coordinates,
    }
    ours = {name: measured(work) for name, work in works.items()}
    with tempfile.TemporaryDirectory() as folder:
        _write_deck(mesh, tuple(pilot_points()), Path(folder))
        before = _processor_of_children()
        calculix = measured(lambda: _calculix_omega(Path(folder)))
        processor = _processor_of_children() - before
    peer, wanted = "CalculiX, modes alone", at_least(25)
    for name, of_name in ours.items():
        yield Ratio(f"{name}, {case}", TIME, of_name.wall, peer, calculix.wall, wanted)
        yield Ratio(f"{name}, {case}", PROCESSOR_TIME, of_name.processor, peer, processor, wanted)
    difference = np.abs(calculix.result / _rigid_omega(mesh) - 1.0).max()
    note = "falls with the size"
    yield Ratio("frequencies, rigid", DIFFERENCE, difference, "CalculiX", note=note)


def _by_blocks(half: TetMesh) -> int:
    sector, sensors = symmetric_structure(half)
    return symmetric_craig_bampton(sector, N_MODES, sensors=sensors).model.n_coordinates


def _processor_of_children() -> float:
    """Processor time [s] of the programs that ended so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _write_deck(mesh: TetMesh, pilots: Sequence[str], folder: Path) -> None:
    """The mesh and a deck that holds the surfaces of all pilots and asks for the modes."""
    write_mesh(mesh, folder / "mesh.inp")
    fixed_nodes = np.unique(np.concatenate([np.unique(mesh.surface(name)) for name in pilots])) + 1
    lines = [
        "*INCLUDE, INPUT=mesh.inp",
        "*NSET, NSET=HELD",
        *(f"{node}," for node in fixed_nodes),
        "*MATERIAL, NAME=IRON",
        "*ELASTIC",
        f"{CAST_IRON.E:.12e}, {CAST_IRON.nu}",
        "*DENSITY",
        f"{CAST_IRON.rho:.12e}",
        *(f"*SOLID SECTION, ELSET={body}, MATERIAL=IRON" for body in mesh.bodies),
        "*BOUNDARY",
        "HELD, 1, 3",
        "*STEP",
        "*FREQUENCY",
        f"{N_MODES}",
        "*END STEP",
    ]
    (folder / "deck.inp").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _calculix_omega(folder: Path) -> NDArray[np.float64]:
    """Angular frequencies [rad/s] from the table that CalculiX prints, on all cores."""
    environment = {**os.environ, "OMP_NUM_THREADS": str(os.cpu_count())}
    run = subprocess.run(
        ["ccx", "-i", "deck"], cwd=folder, env=environment, capture_output=True, text=True
    )
    result = folder / "deck.dat"
    text = result.read_text(encoding="utf-8") if result.exists() else ""
    table = re.findall(r"^ +\d+ +(\S+) +(\S+) +\S+ +\S+ *$", text, flags=re.MULTILINE)
    if run.returncode or len(table) < N_MODES:
        raise RuntimeError(
            f"CalculiX printed {len(table)} modes, exit code {run.returncode}; expected {N_MODES}"
        )
    return np.sqrt([float(row[0]) for row in table[:N_MODES]])


def _rigid_omega(mesh: TetMesh) -> NDArray[np.float64]:
    """Angular frequencies [rad/s] of our rigid reduction with all pilots held."""
    rigid = rigidly_coupled(free_structure(mesh), mesh)
    body = GroundedBody(rigid.K, rigid.points, rigid.rigid_points)
    structure = HeldStructure(body, rigid.pilots)
    return fixed_interface_modes(structure, rigid.M, N_MODES, rng=np.random.default_rng(0)).omega


if __name__ == "__main__":
    run_alone(ratios)
