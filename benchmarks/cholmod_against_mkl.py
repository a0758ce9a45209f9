"""What leaving MKL out costs: the whole reduction with CHOLMOD, which everybody has, and PARDISO.

    python -m benchmarks.cholmod_against_mkl [SIZE]

MKL is an extra with a licence of its own (docs/decisions/0004). Both factorise the same matrices.
"""

from collections.abc import Iterator
from typing import Any

from benchmarks.fourteen_pilots import (
    N_MODES,
    compile_kernels,
    completed_mesh,
    free_structure,
    half_mesh,
)
from benchmarks.measured import Measured, measured
from benchmarks.ratio import PROCESSOR_TIME, TIME, Absent, Ratio, Row, at_least
from benchmarks.run import run_alone
from carrierflex.fe import factorisation
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.craig_bampton import craig_bampton

QUICK = {"size": 0.06}


def ratios(size: float = 0.045) -> Iterator[Row]:
    """Time of a whole reduction with either library.

    Parameters
    ----------
    size
        Element edge length [m].
    """
    # Looked for, not loaded: beside the threads of a loaded MKL, CHOLMOD's BLAS is slow.
    if factorisation._packaged_library("mkl", "libmkl_rt.so") is None:
        yield Absent("MKL", "the package mkl is not installed")
        return
    structure = free_structure(completed_mesh(half_mesh(size)))
    case = f"free mesh of {structure.K.shape[0]} unknowns"
    cholmod = _reduced(structure, factorisation._Cholmod)
    mkl = _reduced(structure, factorisation._Pardiso)
    wanted = at_least(1.0 / 1.5)
    yield Ratio(case, TIME, cholmod.wall, "MKL PARDISO", mkl.wall, wanted)
    yield Ratio(case, PROCESSOR_TIME, cholmod.processor, "MKL PARDISO", mkl.processor, wanted)


def _reduced(structure: StructuralModel, library: type) -> Measured[Any]:
    """Reduction with one library."""
    usual = factorisation._factoriser
    factorisation._factoriser = lambda: library  # type: ignore[assignment]
    try:
        compile_kernels()
        return measured(lambda: craig_bampton(structure, N_MODES))
    finally:
        factorisation._factoriser = usual


if __name__ == "__main__":
    run_alone(ratios)
