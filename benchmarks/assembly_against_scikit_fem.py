"""Assembly of K and M against scikit-fem's own elasticity forms.

    python -m benchmarks.assembly_against_scikit_fem [SIZE]

0.045, 0.03 and 0.022 make 59 000, 126 000 and 262 000 unknowns.
"""

from collections.abc import Iterator

from benchmarks.measured import fastest
from benchmarks.ratio import DIFFERENCE, TIME, Ratio, at_least, at_most
from benchmarks.run import run_alone
from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.materials import CAST_IRON
from carrierflex.fe.scikit_fem_path import stiffness_and_mass_by_scikit_fem
from carrierflex.geometry.carrier_mesh import flexible_carrier_mesh
from carrierflex.geometry.parameters import CarrierParameters

QUICK = {"size": 0.06}


def ratios(size: float = 0.045) -> Iterator[Ratio]:
    """Time of K and M together, and what the two codes' matrices differ by.

    Parameters
    ----------
    size
        Element edge length [m].
    """
    materials = {"carrier": CAST_IRON}
    # compiles the kernels
    assemble_stiffness_and_mass(flexible_carrier_mesh(CarrierParameters(), 0.1), materials)
    mesh = flexible_carrier_mesh(CarrierParameters(), size)
    case = f"{3 * len(mesh.points)} unknowns"
    ours = fastest(lambda: assemble_stiffness_and_mass(mesh, materials), 5)
    stock = fastest(lambda: stiffness_and_mass_by_scikit_fem(mesh, materials), 3)
    note = "fastest of five and of three"
    yield Ratio(case, TIME, ours.wall, "scikit-fem", stock.wall, at_least(20), note)
    for name, a, b in zip("KM", ours.result, stock.result, strict=True):
        difference = abs(a - b).max() / abs(b).max()
        note = "largest, over the largest entry"
        yield Ratio(
            f"{name}, {case}", DIFFERENCE, difference, "scikit-fem", None, at_most(1e-12), note
        )


if __name__ == "__main__":
    run_alone(ratios)
