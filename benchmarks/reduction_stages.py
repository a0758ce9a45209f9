"""Where a reduction's time goes.

Assembly, factorisation, constraint modes, 40 modes, projection; one body, free mesh.

Run as `python benchmarks/reduction_stages.py [SIZE]`: 0.045, 0.022 and 0.015 make 59 000, 262 000
and 683 000 unknowns.
"""

import sys

import fourteen_pilots
import numpy as np
from measured import measured, peak_gb, print_ratios

from carrierflex.reduction.ffrf_data import ffrf_data
from carrierflex.reduction.fixed_interface_modes import fixed_interface_modes
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure

N_MODES = 40


def main(size=0.045):
    def stage(name, work):
        run = measured(work)
        print(f"{name:44} {run}   peak {peak_gb():5.2f} GB", flush=True)
        return run.result

    fourteen_pilots.free_structure(
        fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(0.06))
    )  # compiles the kernels
    mesh = stage("mesh", lambda: fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(size)))
    structure = stage(
        "assembly of K and M, couplings", lambda: fourteen_pilots.free_structure(mesh)
    )
    body: GroundedBody | None = GroundedBody(structure.K, structure.points)
    held: HeldStructure | None = HeldStructure(body, structure.pilots)
    stage("factorisation, one solve", lambda: body.displacement(np.ones(structure.n_dofs)))
    Psi, _ = stage("84 constraint modes", held.constraint_modes)
    modes = stage(
        f"{N_MODES} fixed-interface modes",
        lambda: fixed_interface_modes(held, structure.M, N_MODES, rng=np.random.default_rng(0)),
    )
    held = body = None  # the factor goes before the projection
    T = np.concatenate([Psi, modes.Phi], axis=1)
    stage("projection of M to 124 x 124", lambda: T.T @ (structure.M @ T))
    stage("inertia invariants", lambda: ffrf_data(structure, T))
    rows = [("memory at the end, 700 000 unknowns [GB]", "<= 11", f"{peak_gb():.2f}")]
    print(f"{structure.n_dofs} unknowns, {len(structure.pilots)} pilots")
    print_ratios(rows)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
