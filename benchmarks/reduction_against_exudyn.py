"""Craig-Bampton reduction against Exudyn's scipy path on the same matrices.

    python -m benchmarks.reduction_against_exudyn [SIZE]

Exudyn has rigid couplings (RBE2); ours with rigid ones gives the same fixed-interface frequencies,
ours with distributing ones (RBE3) is timed beside it. Everything from assembled matrices to the
reduced ones, fastest of REPEATS where Exudyn runs once.
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
)
from benchmarks.measured import fastest, measured
from benchmarks.ratio import DIFFERENCE, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.craig_bampton import craig_bampton

QUICK = {"size": 0.06, "repeats": 1}


def ratios(size: float = 0.045, *, repeats: int = 3) -> Iterator[Ratio]:
    """Time of the reduction with either coupling, and what the rigid frequencies differ by.

    Parameters
    ----------
    size
        Element edge length [m]; 0.045 makes 59 000 unknowns.
    repeats
        Times that ours is run, the fastest counting.
    """
    compile_kernels()
    mesh = completed_mesh(half_mesh(size))
    structure = free_structure(mesh)
    case = f"{structure.n_dofs} unknowns"
    distributing = fastest(lambda: craig_bampton(structure, N_MODES).modes.omega, repeats)
    rigid = fastest(
        lambda: craig_bampton(rigidly_coupled(structure, mesh), N_MODES).modes.omega, repeats
    )
    exudyn = measured(lambda: _exudyn_frequencies_hz(structure, mesh))
    for name, ours in (("distributing", distributing), ("rigid", rigid)):
        wanted = at_least(8)
        yield Ratio(f"{name}, {case}", TIME, ours.wall, "Exudyn, rigid", exudyn.wall, wanted)
    difference = np.abs(rigid.result / (2.0 * np.pi * exudyn.result) - 1.0).max()
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
