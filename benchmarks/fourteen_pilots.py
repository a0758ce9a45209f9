"""The carrier with fourteen pilots that the benchmarks reduce.

Every surface on which a load or a neighbour acts.
"""

from dataclasses import replace

import numpy as np

from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.half_sector_sensors import half_sector_sensors
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.structural_model import (
    FLEXIBLE_CARRIER_PILOTS,
    StructuralModel,
    carrier_pilot_points,
)
from carrierflex.fe.symmetry_blocks import half_sector
from carrierflex.geometry.carrier_mesh import flexible_half_sector
from carrierflex.geometry.dihedral import completed, rotation_about_x
from carrierflex.geometry.named_surfaces import with_carrier_surfaces
from carrierflex.geometry.parameters import HALF_SECTOR_ANGLE, CarrierParameters
from carrierflex.geometry.tet_mesh import boundary_facets

CARRIER = CarrierParameters()
#: Distance [m] at which a node counts as lying on a surface.
ON = 1e-7


def pilot_points():
    """Shaft flange, bearing seats and six bores as in a reduction, and rim face, hub bore and the three webs' outer faces."""
    points = carrier_pilot_points(CARRIER)
    pilots = {name: points[name] for name in FLEXIBLE_CARRIER_PILOTS}
    pilots["rim_face"] = np.zeros(3)
    pilots["hub_bore"] = np.array([-CARRIER.hub_length / 4.0, 0.0, 0.0])
    middle = (CARRIER.upwind_bore_x[1] + CARRIER.downwind_bore_x[0]) / 2.0
    for number in range(3):
        turned = rotation_about_x((2 * number + 1) * HALF_SECTOR_ANGLE)
        pilots[f"web_{number + 1}"] = turned @ [middle, 0.0, CARRIER.outer_radius]
    return pilots


def with_more_surfaces(mesh):
    """Copy of a carrier mesh with the surfaces ``hub_bore`` and ``web_i`` beside its own, none sharing nodes with another."""
    facets = boundary_facets(mesh.tets)
    x = mesh.points[facets]
    r = np.hypot(x[..., 1], x[..., 2])
    between = (x[..., 0] > CARRIER.upwind_bore_x[1] - ON) & (
        x[..., 0] < CARRIER.downwind_bore_x[0] + ON
    )
    on_web = ((np.abs(r - CARRIER.outer_radius) < ON) & between).all(axis=1)
    centre = x.mean(axis=1)
    third = np.floor(
        np.mod(np.arctan2(-centre[:, 1], centre[:, 2]), 2.0 * np.pi) / (2.0 * HALF_SECTOR_ANGLE)
    )
    inside = (x[..., 0] > -CARRIER.hub_length / 2.0) & (x[..., 0] < ON)
    surfaces = {
        "hub_bore": facets[
            ((np.abs(r - CARRIER.hub_inner_diameter / 2.0) < ON) & inside).all(axis=1)
        ]
    }
    surfaces |= {f"web_{k + 1}": facets[on_web & (third == k)] for k in range(3)}
    return replace(
        mesh,
        surfaces={
            **mesh.surfaces,
            **{name: found for name, found in surfaces.items() if len(found)},
        },
    )


def half_mesh(size):
    return with_more_surfaces(flexible_half_sector(CARRIER, size))


def whole_mesh(half):
    return with_more_surfaces(with_carrier_surfaces(completed(half), CARRIER))


def free_structure(mesh):
    """Finite elements of the whole carrier, its symmetry unused."""
    K, M = assemble_stiffness_and_mass(mesh, BODY_MATERIALS)
    pilots = tuple(distributing_pilot(mesh, name, point) for name, point in pilot_points().items())
    return StructuralModel("carrier", K, M, mesh.points, pilots)


def symmetric_structure(half):
    """Half sector and sensors for the reduction by blocks."""
    return half_sector("carrier", half, pilot_points()), half_sector_sensors(
        half, CARRIER.sensor_radius
    )
