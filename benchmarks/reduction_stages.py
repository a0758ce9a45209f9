"""Where a reduction's time goes, in factorisations of the same stiffness matrix.

    python -m benchmarks.reduction_stages [SIZE]

0.045, 0.022 and 0.015 make 59 000, 262 000 and 683 000 unknowns.
"""

from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.fourteen_pilots import (
    N_MODES,
    compile_kernels,
    completed_mesh,
    free_structure,
    half_mesh,
)
from benchmarks.measured import measured, peak_gb
from benchmarks.ratio import MEMORY, TIME, Ratio, at_most
from benchmarks.run import run_alone
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.reduction.ffrf_data import ffrf_data
from carrierflex.reduction.fixed_interface_modes import fixed_interface_modes
from carrierflex.reduction.held_structure import GroundedBody, HeldStructure

QUICK = {"size": 0.06}

#: Unknowns from which on the limit of the memory is meant.
_LARGE = 650_000

_FACTORISATION = "factorisation, one solve"

Result = TypeVar("Result")


def ratios(size: float = 0.045) -> Iterator[Ratio]:
    """Time of every stage beside one factorisation, and the peak memory.

    Parameters
    ----------
    size
        Element edge length [m].
    """
    compile_kernels()
    seconds: dict[str, float] = {}

    def stage(name: str, work: Callable[[], Result]) -> Result:
        run = measured(work)
        seconds[name] = run.wall
        return run.result

    mesh = stage("mesh", lambda: completed_mesh(half_mesh(size)))
    structure = stage("assembly of K and M, couplings", lambda: free_structure(mesh))
    T = _basis(structure, stage)
    stage("projection of M", lambda: T.T @ (structure.M @ T))
    stage("inertia invariants", lambda: ffrf_data(structure, T))
    for name, wall in seconds.items():
        yield Ratio(name, TIME, wall, "one factorisation", seconds[_FACTORISATION])
    wanted = at_most(11) if structure.n_dofs > _LARGE else None
    yield Ratio(f"{structure.n_dofs} unknowns", MEMORY, peak_gb(), wanted=wanted)


def _basis(structure: StructuralModel, stage: Callable[..., Any]) -> NDArray[np.float64]:
    """Craig-Bampton basis, stage by stage; the factor is freed before the projection."""
    body = GroundedBody(structure.K, structure.points)
    fixed_interface = HeldStructure(body, structure.pilots)
    stage(_FACTORISATION, lambda: body.displacement(np.ones(structure.n_dofs)))
    Psi, _ = stage("constraint modes", fixed_interface.constraint_modes)
    rng = np.random.default_rng(0)
    modes = stage(
        f"{N_MODES} fixed-interface modes",
        lambda: fixed_interface_modes(fixed_interface, structure.M, N_MODES, rng=rng),
    )
    return np.concatenate([Psi, modes.Phi], axis=1)


if __name__ == "__main__":
    run_alone(ratios)
