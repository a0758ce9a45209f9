"""The main shaft as an elastic body: its pilots and matrices."""

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.assembly import Assembly, assemble_stiffness_and_mass
from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.pilot_overlaps import refuse_dependent_pilots
from carrierflex.fe.structural_model import StructuralModel
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters
from carrierflex.geometry.tet_mesh import TetMesh

#: Interface of the main shaft.
MAIN_SHAFT_PILOTS = ("coupling_flange", "main_bearing_seat", "carrier_joint")


def main_shaft_pilot_points(
    carrier: CarrierParameters, shaft: MainShaftParameters
) -> dict[str, NDArray[np.float64]]:
    """Pilot positions [m] by surface name, in the carrier's frame.

    Shape (3,) each.

    The coupling's pilot stands at the hub, upwind of its flange: a force there loads the shaft as
    through a rigid hub.
    """
    bearing = shaft.bearing_x(carrier)
    x = {
        "coupling_flange": bearing - shaft.hub_to_bearing,
        "main_bearing_seat": bearing,
        "carrier_joint": shaft.joint_x(carrier),
    }
    return {name: np.array([x[name], 0.0, 0.0]) for name in MAIN_SHAFT_PILOTS}


def main_shaft_structure(
    mesh: TetMesh,
    carrier: CarrierParameters,
    shaft: MainShaftParameters,
    *,
    assembly: Assembly = assemble_stiffness_and_mass,
) -> StructuralModel:
    """Assemble the main shaft and couple its three pilots, distributing.

    Parameters
    ----------
    mesh : TetMesh
        From :func:`carrierflex.geometry.main_shaft_mesh.main_shaft_mesh`.
    carrier, shaft : CarrierParameters, MainShaftParameters
        Dimensions that place the pilots [m].
    assembly : callable
        What makes K and M of mesh and materials.

    Returns
    -------
    StructuralModel
        The free body ``main_shaft``, without sensors.

    Raises
    ------
    KeyError, ValueError
        Where a surface is missing or cannot hold a pilot.
    """
    points = main_shaft_pilot_points(carrier, shaft)
    pilots = tuple(
        distributing_pilot(mesh, surface, points[surface]) for surface in MAIN_SHAFT_PILOTS
    )
    refuse_dependent_pilots(pilots, mesh.points)
    K, M = assembly(mesh, BODY_MATERIALS)
    return StructuralModel("main_shaft", K, M, mesh.points, pilots)
