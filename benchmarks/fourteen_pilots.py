"""The carrier with fourteen pilots that the benchmarks reduce.

A pilot for every surface on which a load or a neighbour acts.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.fe.assembly import assemble_stiffness_and_mass
from carrierflex.fe.couplings import distributing_pilot
from carrierflex.fe.half_sector_sensors import HalfSectorSensors, half_sector_sensors
from carrierflex.fe.materials import BODY_MATERIALS
from carrierflex.fe.structural_model import (
    StructuralModel,
    carrier_pilot_points,
    flexible_carrier_pilots,
)
from carrierflex.fe.symmetry_blocks import HalfSector, half_sector
from carrierflex.geometry.carrier_mesh import flexible_half_sector
from carrierflex.geometry.dihedral import completed, rotation_about_x
from carrierflex.geometry.dihedral_group import dihedral_group
from carrierflex.geometry.named_surfaces import with_carrier_surfaces
from carrierflex.geometry.parameters import CarrierParameters, half_sector_angle
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets
from carrierflex.reduction.craig_bampton import craig_bampton

CARRIER = CarrierParameters()
#: Fixed-interface modes that every benchmark keeps.
N_MODES = 40
#: Distance [m] at which a node counts as lying on a surface.
ON = 1e-7


def half_mesh(size: float) -> TetMesh:
    """Half sector of the carrier with all fourteen surfaces that it holds; edge length [m]."""
    return _with_more_surfaces(flexible_half_sector(CARRIER, size))


def completed_mesh(half: TetMesh) -> TetMesh:
    """The whole carrier from its half sector."""
    return _with_more_surfaces(with_carrier_surfaces(completed(half, CARRIER.n_planets), CARRIER))


def free_structure(mesh: TetMesh) -> StructuralModel:
    """Finite elements of the whole carrier, its symmetry unused."""
    K, M = assemble_stiffness_and_mass(mesh, BODY_MATERIALS)
    points = pilot_points()
    pilots = tuple(distributing_pilot(mesh, name, point) for name, point in points.items())
    return StructuralModel("carrier", K, M, mesh.points, pilots)


def symmetric_structure(half: TetMesh) -> tuple[HalfSector, HalfSectorSensors]:
    """Half sector and sensors for the reduction by blocks."""
    sensors = half_sector_sensors(half, CARRIER.sensor_radius, CARRIER.n_planets)
    return half_sector("carrier", half, pilot_points(), dihedral_group(CARRIER.n_planets)), sensors


def compile_kernels() -> None:
    """Reduce a coarse carrier, so that nothing is compiled or loaded while a clock runs."""
    craig_bampton(free_structure(completed_mesh(half_mesh(0.06))), 1)


def pilot_points() -> dict[str, NDArray[np.float64]]:
    """Points of the pilots by name.

    Shaft flange, bearing seats and six bores as in a reduction; rim face, hub bore and the outer
    faces of the three webs beside them.
    """
    points = carrier_pilot_points(CARRIER)
    pilots = {name: points[name] for name in flexible_carrier_pilots(CARRIER.n_planets)}
    pilots["rim_face"] = np.zeros(3)
    pilots["hub_bore"] = np.array([-CARRIER.hub_length / 4.0, 0.0, 0.0])
    middle = (CARRIER.upwind_bore_x[1] + CARRIER.downwind_bore_x[0]) / 2.0
    for number in range(CARRIER.n_planets):
        rotation = rotation_about_x((2 * number + 1) * half_sector_angle(CARRIER.n_planets))
        pilots[f"web_{number + 1}"] = rotation @ [middle, 0.0, CARRIER.outer_radius]
    return pilots


def _with_more_surfaces(mesh: TetMesh) -> TetMesh:
    """Copy with the surfaces ``hub_bore`` and ``web_i``, none sharing nodes with another."""
    facets = boundary_facets(mesh.tets)
    x = mesh.points[facets]
    r = np.hypot(x[..., 1], x[..., 2])
    behind_upwind = x[..., 0] > CARRIER.upwind_bore_x[1] - ON
    before_downwind = x[..., 0] < CARRIER.downwind_bore_x[0] + ON
    at_outer_radius = np.abs(r - CARRIER.outer_radius) < ON
    on_web = (at_outer_radius & behind_upwind & before_downwind).all(axis=1)
    centre = x.mean(axis=1)
    angle = np.mod(np.arctan2(-centre[:, 1], centre[:, 2]), 2.0 * np.pi)
    third = np.floor(angle / (2.0 * half_sector_angle(CARRIER.n_planets)))
    inside = (x[..., 0] > -CARRIER.hub_length / 2.0) & (x[..., 0] < ON)
    at_hub_radius = np.abs(r - CARRIER.hub_inner_diameter / 2.0) < ON
    surfaces = {"hub_bore": facets[(at_hub_radius & inside).all(axis=1)]}
    surfaces |= {f"web_{k + 1}": facets[on_web & (third == k)] for k in range(CARRIER.n_planets)}
    present = {name: surface for name, surface in surfaces.items() if len(surface)}
    return replace(mesh, surfaces={**mesh.surfaces, **present})
