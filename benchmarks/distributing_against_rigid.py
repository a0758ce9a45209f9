"""Distributing couplings (RBE3) against rigid ones (RBE2).

The whole reduction of one body, in turns.

Run as `python benchmarks/distributing_against_rigid.py [SIZE [TURNS]]`; 0.045, 0.03, 0.022 make 59
000, 126 000 and 262 000 unknowns. Distributing couplings keep the nodes of the coupled surfaces,
which rigid ones remove. TURNS 0 runs the distributing one once, for its peak memory: 0.015 makes
683 000 unknowns.
"""

import sys

import fourteen_pilots
import numpy as np
from measured import measured, peak_gb, print_ratios

from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.reduction.craig_bampton import craig_bampton

N_MODES = 40


def main(size=0.045, turns=3):
    craig_bampton(
        fourteen_pilots.free_structure(fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(0.06))),
        1,
    )
    mesh = fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(size))
    structure = fourteen_pilots.free_structure(mesh)
    print(f"{structure.n_dofs} unknowns, {len(structure.pilots)} pilots, {N_MODES} modes")
    if turns < 1:
        print(f"distributing  {measured(lambda: craig_bampton(structure, N_MODES).modes.omega)}")
        print_ratios([("peak memory, 700 000 unknowns [GB]", "<= 11", f"{peak_gb():.2f}")])
        return
    ratios = []
    for _ in range(int(turns)):
        distributing = measured(lambda: craig_bampton(structure, N_MODES).modes.omega)
        rigid = measured(
            lambda: craig_bampton(rigidly_coupled(structure, mesh), N_MODES).modes.omega
        )
        print(f"distributing  {distributing}\nrigid         {rigid}", flush=True)
        ratios.append(distributing.wall / rigid.wall)
    reached = f"{np.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
    print_ratios([("distributing over rigid, wall", "<= 1", reached)])


if __name__ == "__main__":
    main(*map(float, sys.argv[1:3]))
