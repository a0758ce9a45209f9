"""Craig-Bampton reduction against Exudyn's scipy path on the same matrices.

    python -m benchmarks.reduction_against_exudyn [SIZE]

Exudyn has rigid couplings (RBE2); ours with rigid ones gives the same fixed-interface frequencies,
ours with distributing ones (RBE3) is timed beside it, as a free mesh and by symmetry blocks.
Everything from assembled matrices to the reduced ones, in turn; medians of PAIRS.
"""

import contextlib
import io
from collections.abc import Iterator

import numpy as np
from exudyn.FEM import FEMinterface, HCBstaticModeSelection
from numpy.typing import NDArray

from benchmarks.fourteen_pilots import (
    N_MODES,
    compile_kernels,
    completed_mesh,
    free_structure,
    half_mesh,
    symmetric_structure,
)
from benchmarks.measured import measured, medians
from benchmarks.ratio import DIFFERENCE, PROCESSOR_TIME, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

QUICK = {"size": 0.06, "pairs": 1}

#: Times as fast as Exudyn.
_WANTED = {"by symmetry blocks": 25.0, "distributing": 12.0, "rigid": 12.0}


def ratios(size: float = 0.045, *, pairs: int = 5) -> Iterator[Ratio]:
    """Time of the reduction in three ways, and what the rigid frequencies differ by.

    Parameters
    ----------
    size
        Element edge length [m]; 0.045 makes 59 000 unknowns.
    pairs
        Times that all of them are run.
    """
    compile_kernels()
    coarse, sensors = symmetric_structure(half_mesh(0.06))
    symmetric_craig_bampton(coarse, N_MODES, sensors=sensors)
    half = half_mesh(size)
    mesh = completed_mesh(half)
    structure = free_structure(mesh)
    sector, sensors = symmetric_structure(half)
    works = {
        "by symmetry blocks": lambda: (
            symmetric_craig_bampton(sector, N_MODES, sensors=sensors).basis.omega
        ),
        "distributing": lambda: craig_bampton(structure, N_MODES).modes.omega,
        "rigid": lambda: craig_bampton(rigidly_coupled(structure, mesh), N_MODES).modes.omega,
        "Exudyn": lambda: _exudyn_frequencies_hz(structure, mesh),
    }
    runs = [{name: measured(work) for name, work in works.items()} for _ in range(pairs)]
    of = {name: medians([run[name] for run in runs]) for name in works}
    exudyn = of["Exudyn"]
    for name, wanted in _WANTED.items():
        case, least = f"{name}, {structure.n_dofs} unknowns", at_least(wanted)
        yield Ratio(case, TIME, of[name].wall, "Exudyn, rigid", exudyn.wall, least)
        processor = of[name].processor
        yield Ratio(case, PROCESSOR_TIME, processor, "Exudyn, rigid", exudyn.processor, least)
    difference = np.abs(of["rigid"].result / (2.0 * np.pi * exudyn.result) - 1.0).max()
    yield Ratio("frequencies, rigid", DIFFERENCE, difference, "Exudyn", wanted=at_most(1e-8))


def _exudyn_frequencies_hz(structure: StructuralModel, mesh: TetMesh) -> NDArray[np.float64]:
    fem = FEMinterface()
    fem.nodes = {"Position": mesh.points}
    fem.stiffnessMatrix = structure.K.tocsr()
    fem.massMatrix = structure.M.tocsr()
    interfaces = [np.unique(mesh.surface(pilot.name)) for pilot in structure.pilots]
    with contextlib.redirect_stdout(io.StringIO()):
        fem.ComputeHurtyCraigBamptonModes(
            interfaces, N_MODES, useSparseSolver=True, computationMode=HCBstaticModeSelection.RBE2
        )
    return np.sort(fem.GetEigenFrequenciesHz())[-N_MODES:]


if __name__ == "__main__":
    run_alone(ratios)
