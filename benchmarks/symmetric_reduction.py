"""Reduction by the blocks of the dihedral symmetry against the free mesh of the same carrier.

    python -m benchmarks.symmetric_reduction [SIZE] [--blocks-only]

Everything from the meshes to the reduced model is timed. With ``--blocks-only`` the free mesh is
left out, for sizes that it has no memory for.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.fourteen_pilots import (
    N_MODES,
    completed_mesh,
    free_structure,
    half_mesh,
    symmetric_structure,
)
from benchmarks.measured import measured, peak_gb
from benchmarks.ratio import DIFFERENCE, MEMORY, PROCESSOR_TIME, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

QUICK = {"size": 0.06}


def ratios(size: float = 0.045, *, blocks_only: bool = False) -> Iterator[Ratio]:
    """Time and memory of both, and what their reduced matrices differ by.

    Parameters
    ----------
    size
        Element edge length [m].
    blocks_only
        Leave the free mesh out.
    """
    coarse = half_mesh(0.06)
    _by_blocks(coarse)  # compiles the kernels and loads the solver's library
    half = half_mesh(size)
    case = f"half sector of {3 * len(half.points)} unknowns"
    start = peak_gb()
    blocks = measured(lambda: _by_blocks(half))
    peak = peak_gb()
    note = f"{start:.2f} GB before"
    if blocks_only:
        yield Ratio(case, MEMORY, peak, wanted=at_most(4), note=note)
        yield Ratio(case, TIME, blocks.wall, wanted=at_most(40))
        yield Ratio(case, PROCESSOR_TIME, blocks.processor)
        return
    _by_free_mesh(coarse)
    free = measured(lambda: _by_free_mesh(half))
    # The free mesh ran last and takes more, so that the peak of the process is its own.
    yield Ratio(case, MEMORY, peak, "free mesh", peak_gb(), note=note)
    yield Ratio(case, TIME, blocks.wall, "free mesh", free.wall, at_least(3))
    yield Ratio(case, PROCESSOR_TIME, blocks.processor, "free mesh", free.processor)
    for name, difference in _differences(blocks.result, free.result).items():
        yield Ratio(name, DIFFERENCE, difference, "free mesh", wanted=at_most(1e-8))


def _by_blocks(half: TetMesh) -> ReducedModel:
    structure, sensors = symmetric_structure(half)
    return symmetric_craig_bampton(structure, N_MODES, sensors=sensors).model


def _by_free_mesh(half: TetMesh) -> ReducedModel:
    return craig_bampton(free_structure(completed_mesh(half)), N_MODES).model


def _differences(a: ReducedModel, b: ReducedModel) -> dict[str, float]:
    """Largest relative differences of K_bb, M_bb and the fixed-interface frequencies."""
    m = 6 * len(b.pilots)
    omega_a, omega_b = (np.sqrt(model.K.diagonal()[m:]) for model in (a, b))
    return {
        "K_bb": _largest_difference(a.K[:m, :m], b.K[:m, :m]),
        "M_bb": _largest_difference(a.M[:m, :m], b.M[:m, :m]),
        "frequencies": float(np.abs(omega_a / omega_b - 1.0).max()),
    }


def _largest_difference(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    scale = np.sqrt(np.outer(b.diagonal(), b.diagonal()))
    return float((np.abs(a - b) / scale).max())


if __name__ == "__main__":
    run_alone(ratios)
