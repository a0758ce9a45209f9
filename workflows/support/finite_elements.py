"""Who assembles and solves the finite elements: the choice behind ``--assembly``."""

from dataclasses import dataclass

from carrierflex.fe.assembly import Assembly, assemble_stiffness_and_mass
from carrierflex.fe.scikit_fem_path import (
    displacement_by_scikit_fem,
    stiffness_and_mass_by_scikit_fem,
)
from carrierflex.fe.static import HeldSolver, held_displacement


@dataclass(frozen=True)
class FiniteElements:
    """What makes K and M of a mesh, and what solves K u = f."""

    assembly: Assembly
    solver: HeldSolver


COMPILED = FiniteElements(assemble_stiffness_and_mass, held_displacement)

#: By name on the command line.
FINITE_ELEMENTS: dict[str, FiniteElements] = {
    "compiled": COMPILED,
    "scikit-fem": FiniteElements(stiffness_and_mass_by_scikit_fem, displacement_by_scikit_fem),
}
