"""Craig-Bampton reduction against Exudyn's scipy path on the same matrices, in one run.

Run as `python benchmarks/reduction_against_exudyn.py [SIZE]`, SIZE the element edge length [m].

Exudyn's rigid couplings (RBE2) with ours: both give the same fixed-interface frequencies. Ours with distributing couplings
(RBE3) is timed beside them, everything from assembled matrices to the reduced ones.
"""

import contextlib
import io
import sys
import time

import numpy as np
from exudyn.FEM import FEMinterface, HCBstaticModeSelection

from fe.rigid_couplings import rigidly_coupled
from fe.structural_model import FLEXIBLE_CARRIER_PILOTS, structural_model
from geometry.carrier_mesh import flexible_carrier_mesh
from geometry.parameters import CarrierParameters
from reduction.craig_bampton import craig_bampton

N_MODES = 40


def timed(work):
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def exudyn_frequencies_hz(structure, mesh):
    fem = FEMinterface()
    fem.nodes = {"Position": mesh.points}
    fem.stiffnessMatrix, fem.massMatrix = structure.K.tocsr(), structure.M.tocsr()
    interfaces = [np.unique(mesh.surface(name)) for name in FLEXIBLE_CARRIER_PILOTS]
    with contextlib.redirect_stdout(io.StringIO()):
        fem.ComputeHurtyCraigBamptonModes(
            interfaces, N_MODES, useSparseSolver=True, computationMode=HCBstaticModeSelection.RBE2
        )
    return np.sort(fem.GetEigenFrequenciesHz())[-N_MODES:]


def main(size=0.045):
    carrier = CarrierParameters()
    mesh = flexible_carrier_mesh(carrier, size)
    structure = structural_model("carrier", mesh, carrier, FLEXIBLE_CARRIER_PILOTS)
    craig_bampton(structure, 1)  # loads the solver's library
    distributing, seconds_rbe3 = timed(lambda: craig_bampton(structure, N_MODES))
    rigid, seconds_rbe2 = timed(lambda: craig_bampton(rigidly_coupled(structure, mesh), N_MODES))
    theirs, seconds_exudyn = timed(lambda: exudyn_frequencies_hz(structure, mesh))
    ours = rigid.modes.omega / (2.0 * np.pi)
    print(f"{structure.n_dofs} unknowns, {len(structure.pilots)} pilots, {N_MODES} modes")
    print(
        f"ours, distributing: {seconds_rbe3:.1f} s; ours, rigid: {seconds_rbe2:.1f} s; Exudyn, rigid: {seconds_exudyn:.1f} s"
    )
    print(
        f"Exudyn over ours: {seconds_exudyn / seconds_rbe3:.1f} (distributing), {seconds_exudyn / seconds_rbe2:.1f} (rigid)"
    )
    print(f"largest difference of the rigid frequencies: {np.abs(ours / theirs - 1.0).max():.1e}")
    print(f"first distributing frequency {distributing.modes.omega[0] / (2.0 * np.pi):.1f} Hz, rigid {ours[0]:.1f} Hz")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
