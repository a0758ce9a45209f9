"""The whole reduction against CalculiX's forty modes alone on the same mesh, in one run.

Needs `ccx` (Debian's calculix-ccx).

Run as `python benchmarks/reduction_against_calculix.py [SIZE]`, SIZE the element edge length [m];
0.022 makes 262 000 unknowns. CalculiX holds the nodes of all pilots' surfaces, as rigid couplings
with held pilots do, so that its frequencies are those of our rigid reduction.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import fourteen_pilots
import numpy as np
from measured import measured, print_ratios

from carrierflex.fe.materials import CAST_IRON
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.fixed_interface_modes import fixed_interface_modes
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure

N_MODES = 40


def write_deck(mesh, pilots, path):
    held = np.unique(np.concatenate([np.unique(mesh.surface(name)) for name in pilots])) + 1
    with path.open("w") as file:
        file.write("*NODE, NSET=NALL\n")
        for number, point in enumerate(mesh.points, start=1):
            file.write(f"{number}, {point[0]:.12e}, {point[1]:.12e}, {point[2]:.12e}\n")
        file.write("*ELEMENT, TYPE=C3D10, ELSET=EALL\n")
        for number, nodes in enumerate(mesh.tets + 1, start=1):
            file.write(f"{number}, {', '.join(map(str, nodes))}\n")
        file.write("*NSET, NSET=HELD\n" + "".join(f"{node},\n" for node in held))
        file.write(
            f"*MATERIAL, NAME=IRON\n*ELASTIC\n{CAST_IRON.E:.12e}, {CAST_IRON.nu}\n*DENSITY\n{CAST_IRON.rho}\n"
        )
        file.write("*SOLID SECTION, ELSET=EALL, MATERIAL=IRON\n*BOUNDARY\nHELD, 1, 3\n")
        file.write(f"*STEP\n*FREQUENCY\n{N_MODES}\n*END STEP\n")


def calculix_omega(folder):
    environment = {**os.environ, "OMP_NUM_THREADS": str(os.cpu_count())}
    subprocess.run(
        ["ccx", "-i", "deck"], cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL
    )
    table = re.findall(
        r"^ +\d+ +(\S+) +(\S+) +\S+ +\S+ *$", (folder / "deck.dat").read_text(), flags=re.MULTILINE
    )
    return np.sqrt([float(row[0]) for row in table[:N_MODES]])


def our_rigid_omega(structure, mesh):
    rigid = rigidly_coupled(structure, mesh)
    held = HeldStructure(GroundedBody(rigid.K, rigid.points, rigid.rigid_points), rigid.pilots)
    return fixed_interface_modes(held, rigid.M, N_MODES, rng=np.random.default_rng(0)).omega


def main(size=0.022):
    if shutil.which("ccx") is None:
        sys.exit("ccx is not installed; expected CalculiX, as in `apt-get install calculix-ccx`")
    craig_bampton(
        fourteen_pilots.free_structure(fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(0.06))),
        1,
    )
    mesh = fourteen_pilots.whole_mesh(fourteen_pilots.half_mesh(size))
    names = tuple(fourteen_pilots.pilot_points())
    ours = measured(
        lambda: craig_bampton(fourteen_pilots.free_structure(mesh), N_MODES).model.n_coordinates
    )
    print(f"{3 * len(mesh.points)} unknowns, {len(names)} pilots, {N_MODES} modes")
    print(f"ours, mesh to reduced body  {ours}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        write_deck(mesh, names, Path(folder) / "deck.inp")
        theirs = measured(lambda: calculix_omega(Path(folder)))
    print(f"CalculiX, forty modes       {theirs.wall:8.2f} s wall", flush=True)
    omega = our_rigid_omega(fourteen_pilots.free_structure(mesh), mesh)
    difference = np.abs(theirs.result / omega - 1.0).max()
    print_ratios(
        [
            ("CalculiX's time over ours", ">= 6", f"{theirs.wall / ours.wall:.1f}"),
            ("largest difference of the frequencies, falls with SIZE", "", f"{difference:.1e}"),
        ]
    )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
