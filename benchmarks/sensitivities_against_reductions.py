"""Sensitivities to 20 parameters against two reductions of the same carrier.

    python -m benchmarks.sensitivities_against_reductions [SIZE]

The carrier with bonded pins. The sensitivities' time is that of everything beyond one reduction:
motion of the boundary, its extension, factorisation of the held body, derivatives of curves,
reduced matrices and frequencies. The reductions are of the same half sector by the blocks of its
symmetry, and of the whole body; assembly is included in both.
"""

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.measured import measured
from benchmarks.ratio import TIME, Ratio, at_least
from benchmarks.run import run_alone
from carrierflex.fe.curve_derivatives import half_sector_structure
from carrierflex.fe.structural_model import (
    stiff_carrier_pilots,
    structural_model,
)
from carrierflex.geometry.carrier_mesh import stiff_half_sector
from carrierflex.geometry.dihedral import completed
from carrierflex.geometry.named_surfaces import with_carrier_surfaces
from carrierflex.geometry.parameter_files import StageParameters
from carrierflex.geometry.tet_mesh import TetMesh
from carrierflex.reduction.carrier_sensitivities import parametric_problem, sensitivities
from carrierflex.reduction.craig_bampton import craig_bampton
from carrierflex.reduction.symmetric_craig_bampton import symmetric_craig_bampton

QUICK = {"size": 0.06}
N_MODES = 40
N_PARAMETERS = 20


def ratios(size: float = 0.03) -> Iterator[Ratio]:
    """Time of 20 sensitivities beside two reductions by blocks, and two of the whole body.

    Parameters
    ----------
    size
        Element edge length [m].
    """
    stage = StageParameters()
    coarse = stiff_half_sector(stage.carrier, stage.pin, 0.1)
    # Compiles the kernels and loads the solver's library.
    for work in (_by_blocks, _whole_body, _sensitivities):
        work(coarse, stage)
    half = stiff_half_sector(stage.carrier, stage.pin, size)
    blocks = measured(lambda: _by_blocks(half, stage))
    both = measured(lambda: _sensitivities(half, stage))
    full_body = measured(lambda: _whole_body(half, stage))
    beyond = both.wall - blocks.wall
    case = f"{N_PARAMETERS} parameters, half sector of {3 * len(half.points)} unknowns"
    note = f"one reduction by blocks {blocks.wall:.1f} s, with sensitivities {both.wall:.1f} s"
    yield Ratio(case, TIME, beyond, "two by blocks", 2.0 * blocks.wall, at_least(1), note)
    yield Ratio(case, TIME, beyond, "two of the whole body", 2.0 * full_body.wall, at_least(1))


def _by_blocks(half: TetMesh, stage: StageParameters) -> object:
    body, sensors = half_sector_structure(half, stage)
    return symmetric_craig_bampton(body, N_MODES, sensors=sensors)


def _sensitivities(half: TetMesh, stage: StageParameters) -> object:
    problem = parametric_problem(half, stage)
    chosen = replace(problem, changes=problem.changes[:N_PARAMETERS])
    return sensitivities(chosen, N_MODES)


def _whole_body(half: TetMesh, stage: StageParameters) -> object:
    n = stage.carrier.n_planets
    mesh = with_carrier_surfaces(completed(half, n), stage.carrier, stage.pin)
    structure = structural_model("stiff_carrier", mesh, stage.carrier, stiff_carrier_pilots(n))
    return craig_bampton(structure, N_MODES)


if __name__ == "__main__":
    run_alone(ratios)
