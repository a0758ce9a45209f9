"""Reduction by the blocks of the dihedral symmetry against the free mesh of the same carrier.

Time, memory, agreement.

Run as `python benchmarks/symmetric_reduction.py [SIZE] [blocks]`. Everything from the meshes to the
reduced model is timed. With `blocks` the free mesh is left out, so that the peak memory is that of
the blocks alone.
"""

import sys

import fourteen_pilots
import numpy as np
from measured import measured, peak_gb, print_ratios

from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

N_MODES = 40


def by_blocks(half):
    structure, sensors = fourteen_pilots.symmetric_structure(half)
    return symmetric_craig_bampton(structure, N_MODES, sensors=sensors).model


def free(half):
    return craig_bampton(
        fourteen_pilots.free_structure(fourteen_pilots.whole_mesh(half)), N_MODES
    ).model


def largest_difference(a, b):
    scale = np.sqrt(np.outer(b.diagonal(), b.diagonal()))
    return f"{(np.abs(a - b) / scale).max():.1e}"


def main(size=0.045, which="both"):
    coarse = fourteen_pilots.half_mesh(0.06)
    by_blocks(coarse), free(coarse)  # compiles the kernels and loads the solver's library
    half = fourteen_pilots.half_mesh(size)
    print(f"half sector of {3 * len(half.points)} unknowns, {N_MODES} modes")
    blocks = measured(lambda: by_blocks(half))
    print(f"by blocks  {blocks}   peak {peak_gb():.2f} GB", flush=True)
    rows = [("peak by blocks, 700 000 unknowns [GB]", "<= 5", f"{peak_gb():.2f}")]
    if which == "both":
        whole = measured(lambda: free(half))
        print(f"free mesh  {whole}   peak {peak_gb():.2f} GB")
        m, one, other = 6 * len(whole.result.pilots), blocks.result, whole.result
        omega = np.sqrt([one.K.diagonal()[m:], other.K.diagonal()[m:]])
        rows += [
            ("free mesh over blocks, wall", ">= 3", f"{whole.wall / blocks.wall:.1f}"),
            ("free mesh over blocks, processor", "", f"{whole.processor / blocks.processor:.1f}"),
            ("K_bb", "< 1e-8", largest_difference(one.K[:m, :m], other.K[:m, :m])),
            ("M_bb", "< 1e-8", largest_difference(one.M[:m, :m], other.M[:m, :m])),
            ("frequencies", "< 1e-8", f"{np.abs(omega[0] / omega[1] - 1.0).max():.1e}"),
        ]
    print_ratios(rows)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]), *sys.argv[2:3])
