"""A curve of the mesh study by two levels against that by a factor of the same matrix.

    python -m benchmarks.mesh_study_against_factorisation [SIZE]

From the half sector's mesh to the curve of the carrier with bonded pins; CHOLMOD factorises where
MKL is not installed.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from benchmarks.measured import Measured, measured, peak_gb
from benchmarks.ratio import DIFFERENCE, MEMORY, PROCESSOR_TIME, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe import half_sector_curve as curve_module
from carrierflex.fe.deflection_curves import DeflectionCurve
from carrierflex.fe.factorisation import factorise
from carrierflex.fe.load_cases import bonded_pin_load
from carrierflex.fe.two_level_solution import two_level_solution
from carrierflex.geometry.carrier_mesh import stiff_half_sector
from carrierflex.geometry.parameters import CarrierParameters, PinParameters
from carrierflex.geometry.tet_mesh import TetMesh

QUICK = {"size": 0.02}


def ratios(size: float = 0.0125) -> Iterator[Ratio]:
    """Time and memory of both, and what their curves differ by.

    Parameters
    ----------
    size
        Element edge length [m].
    """
    carrier = CarrierParameters()
    half = stiff_half_sector(carrier, PinParameters(), size)
    coarse = stiff_half_sector(carrier, PinParameters(), 0.06)
    solutions = (two_level_solution, _by_factorisation)
    for solution in solutions:
        _curve(solution, coarse, carrier)  # compiles the kernels and loads the solver's library
    start = peak_gb()
    results, peaks = [], []
    # The factor comes last and takes more, so that the peak of the process is its own.
    for solution in solutions:
        results.append(measured(partial(_curve, solution, half, carrier)))
        peaks.append(peak_gb())
    ours, peer = results
    case = f"half sector of {half.points.size} unknowns"
    yield Ratio(case, TIME, ours.wall, "factorisation", peer.wall)
    yield Ratio(
        case, PROCESSOR_TIME, ours.processor, "factorisation", peer.processor, at_least(1.5)
    )
    yield Ratio(case, MEMORY, peaks[0], "factorisation", peaks[1], note=f"{start:.2f} GB before")
    yield Ratio(
        "axial curve", DIFFERENCE, _difference(ours, peer), "factorisation", wanted=at_most(1e-9)
    )


def _curve(solution: object, half: TetMesh, carrier: CarrierParameters) -> DeflectionCurve:
    # By its name in the module that calls it.
    name = "two_level_solution"
    setattr(curve_module, name, solution)
    try:
        load = bonded_pin_load(1, 1000.0, 0.0, carrier.n_planets)
        return curve_module.half_sector_curve(half, carrier, load)
    finally:
        setattr(curve_module, name, two_level_solution)


def _by_factorisation(
    A: sp.csr_array, P: sp.csr_array, b: NDArray[np.float64]
) -> NDArray[np.float64]:
    A.sort_indices()
    return factorise(A).solve(b)


def _difference(a: Measured[DeflectionCurve], b: Measured[DeflectionCurve]) -> float:
    return float(np.abs(a.result.axial - b.result.axial).max() / np.abs(b.result.axial).max())


if __name__ == "__main__":
    run_alone(ratios)
