"""Craig-Bampton reduction against Exudyn's scipy path on the same matrices, in one run.

Run as `python benchmarks/reduction_against_exudyn.py [SIZE]`, SIZE the element edge length [m];
0.045 makes 59 000 unknowns.

Exudyn's rigid couplings (RBE2) with ours: both give the same fixed-interface frequencies. Ours with
distributing couplings (RBE3) is timed beside them, everything from assembled matrices to the
reduced ones, fastest of three where Exudyn runs once.
"""

import contextlib
import io
import sys

import fourteen_pilots
import numpy as np
from exudyn.FEM import FEMinterface, HCBstaticModeSelection
from measured import fastest, measured, print_ratios

from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.reduction.craig_bampton import craig_bampton

N_MODES = 40


def exudyn_frequencies_hz(structure, mesh):
    fem = FEMinterface()
    fem.nodes = {"Position": mesh.points}
    fem.stiffnessMatrix, fem.massMatrix = structure.K.tocsr(), structure.M.tocsr()
    interfaces = [np.unique(mesh.surface(pilot.name)) for pilot in structure.pilots]
    with contextlib.redirect_stdout(io.StringIO()):
        fem.ComputeHurtyCraigBamptonModes(
            interfaces, N_MODES, useSparseSolver=True, computationMode=HCBstaticModeSelection.RBE2
        )
    return np.sort(fem.GetEigenFrequenciesHz())[-N_MODES:]


def main(size=0.045):
    craig_bampton(
        fourteen_pilots.free_structure(fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(0.06))),
        1,
    )
    mesh = fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(size))
    structure = fourteen_pilots.free_structure(mesh)
    print(f"{structure.n_dofs} unknowns, {len(structure.pilots)} pilots, {N_MODES} modes")
    distributing = fastest(lambda: craig_bampton(structure, N_MODES).modes.omega, 3)
    print(f"ours, distributing  {distributing}", flush=True)
    rigid = fastest(lambda: craig_bampton(rigidly_coupled(structure, mesh), N_MODES).modes.omega, 3)
    print(f"ours, rigid         {rigid}", flush=True)
    exudyn = measured(lambda: exudyn_frequencies_hz(structure, mesh))
    print(f"Exudyn, rigid       {exudyn}", flush=True)
    difference = np.abs(rigid.result / (2.0 * np.pi * exudyn.result) - 1.0).max()
    print_ratios(
        [
            (
                "Exudyn's time over ours, distributing",
                ">= 8",
                f"{exudyn.wall / distributing.wall:.1f}",
            ),
            ("Exudyn's time over ours, rigid", ">= 8", f"{exudyn.wall / rigid.wall:.1f}"),
            ("distributing over rigid", "<= 1", f"{distributing.wall / rigid.wall:.2f}"),
            ("largest difference of the rigid frequencies", "< 1e-8", f"{difference:.1e}"),
        ]
    )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
