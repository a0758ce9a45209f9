"""Distributing couplings (RBE3) against rigid ones (RBE2): the reduction of one body, in turns.

    python -m benchmarks.distributing_against_rigid [SIZE [TURNS]]

0.045, 0.03 and 0.022 make 59 000, 126 000 and 262 000 unknowns. Distributing couplings keep the
nodes of the coupled surfaces, which rigid ones remove. TURNS 0 runs the distributing one once, for
its peak memory: 0.015 makes 683 000 unknowns.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.fourteen_pilots import (
    N_MODES,
    compile_kernels,
    completed_mesh,
    free_structure,
    half_mesh,
)
from benchmarks.measured import measured, peak_gb
from benchmarks.ratio import MEMORY, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe.rigid_couplings import rigidly_coupled
from carrierflex.reduction.craig_bampton import craig_bampton

QUICK = {"size": 0.06, "turns": 1}

#: Unknowns from which on the limit of the memory is meant.
_LARGE = 650_000


def ratios(size: float = 0.045, turns: int = 3) -> Iterator[Ratio]:
    """Time of both, the median of their turns, and the peak memory of the distributing one.

    Parameters
    ----------
    size
        Element edge length [m].
    turns
        Times that each is run; 0 runs the distributing one alone.
    """
    compile_kernels()
    mesh = completed_mesh(half_mesh(size))
    structure = free_structure(mesh)
    case = f"{structure.n_dofs} unknowns"
    limit = at_most(11) if structure.n_dofs > _LARGE else None
    distributing: list[float] = []
    rigid: list[float] = []
    for turn in range(max(turns, 1)):
        ours = measured(lambda: craig_bampton(structure, N_MODES).modes.omega)
        distributing.append(ours.wall)
        if turn == 0:
            yield Ratio(case, MEMORY, peak_gb(), wanted=limit, note=f"in {ours.wall:.0f} s")
        if turns:
            other = measured(
                lambda: craig_bampton(rigidly_coupled(structure, mesh), N_MODES).modes.omega
            )
            rigid.append(other.wall)
    if turns:
        ratio = np.array(rigid) / np.array(distributing)
        note = f"ratios of {turns} turns {ratio.min():.2f} to {ratio.max():.2f}"
        middle = np.argsort(ratio)[turns // 2]
        times = distributing[middle], rigid[middle]
        yield Ratio(case, TIME, times[0], "rigid couplings", times[1], at_least(1), note)


if __name__ == "__main__":
    run_alone(ratios)
