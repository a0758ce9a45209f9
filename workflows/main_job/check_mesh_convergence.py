"""Is the mesh fine enough? Orders N and 2 N of both torque curves over the element size.

Computed on the half sector; of a carrier from a STEP file on whole meshes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.mesh_limits import mesh_limit
from carrierflex.geometry.parameter_files import StageParameters

if TYPE_CHECKING:
    from carrierflex.workflows.geometry.carrier_files import CarrierFiles

#: Element sizes of the study [m].
STUDY_SIZES = (0.025, 0.016, 0.0125)


def study_orders(n_planets: int) -> tuple[int, int]:
    """Orders that the study follows: those that rule the flexible and the stiff curve."""
    return n_planets, 2 * n_planets


@dataclass(frozen=True, eq=False)
class MeshStudy:
    """Amplitudes [m per kN m] by element size (rows) and order (columns), tangential load."""

    sizes: Annotated[tuple[float, ...], "Element edge lengths [m]"]
    n_dofs: Annotated[tuple[int, ...], "Unknowns: stiff half sector, or whole from a file"]
    flexible: Annotated[
        NDArray[np.float64], "Amplitudes of orders N and 2 N of N planets, shape (n_sizes, 2)"
    ]
    stiff: Annotated[NDArray[np.float64], "The same of the stiff variant"]

    @property
    def last_change(self) -> float:
        """Largest relative change of an order ruling a curve, between the two finest meshes."""
        return max(float(np.abs(a[-1] / a[-2] - 1.0).max()) for a in (self.flexible, self.stiff))

    @property
    def limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Both variants' amplitudes at elements of no size, by a line in the size, shapes (2,)."""
        return mesh_limit(self.sizes, self.flexible)[0], mesh_limit(self.sizes, self.stiff)[0]


def main(
    stage: StageParameters,
    sizes: tuple[float, ...] = STUDY_SIZES,
) -> MeshStudy:
    """Solve both variants' torque case at each element size.

    Parameters
    ----------
    stage
        Dimensions of carrier, pins and gears.
    sizes
        Element edge lengths [m], descending.

    Returns
    -------
    MeshStudy
        In a good study both orders change by less than 2 % between the two finest meshes.
    """
    n_planets = stage.carrier.n_planets

    from carrierflex.fe.carrier_curves import UNIT_TORQUE
    from carrierflex.fe.half_sector_curve import half_sector_curve
    from carrierflex.fe.load_cases import bonded_pin_load, gear_forces, simply_supported_pin_load
    from carrierflex.geometry.carrier_mesh import flexible_half_sector, stiff_half_sector

    force, orders = gear_forces(UNIT_TORQUE, stage.gear, n_planets).F_PLC, study_orders(n_planets)
    n_dofs = []
    flexible = []
    stiff = []
    for size in sizes:
        half = flexible_half_sector(stage.carrier, size)
        load = simply_supported_pin_load(1, force, 0.0, stage.carrier)
        flexible.append(
            half_sector_curve(half, stage.carrier, load).axial_order_content()[list(orders)]
        )
        half = stiff_half_sector(stage.carrier, stage.pin, size)
        load = bonded_pin_load(1, force, 0.0, n_planets)
        stiff.append(
            half_sector_curve(half, stage.carrier, load).axial_order_content()[list(orders)]
        )
        n_dofs.append(3 * len(half.points))
    return MeshStudy(tuple(sizes), tuple(n_dofs), np.array(flexible), np.array(stiff))


def study_of_files(
    stage: StageParameters,
    files: CarrierFiles,
    sizes: tuple[float, ...],
) -> MeshStudy:
    """The study of a carrier from a STEP file, on whole meshes; parameters as of :func:`main`."""
    from carrierflex.workflows.fe.carrier_variants import solved_carrier

    amplitudes: dict[str, list[NDArray[np.float64]]] = {"flexible": [], "stiff": []}
    n_dofs = []
    for size in sizes:
        for name, of_variant in amplitudes.items():
            variant = solved_carrier(name, stage, size, files)
            orders = study_orders(variant.n_planets)
            curve = variant.deflection.curves["tangential"]
            of_variant.append(curve.axial_order_content()[list(orders)])
        n_dofs.append(variant.mesh.points.size)
    return MeshStudy(
        tuple(sizes),
        tuple(n_dofs),
        np.array(amplitudes["flexible"]),
        np.array(amplitudes["stiff"]),
    )
