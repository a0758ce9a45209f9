"""Named surfaces of carrier, pin and main shaft.

Found from the node coordinates of their boundary facets.

Every surface is stated by its equation (a cylinder of given axis and radius, or a plane) and an
axial extent; a facet belongs to it when all six nodes satisfy the equation.
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters, PinParameters
from carrierflex.geometry.pins import pin_angles
from carrierflex.geometry.tet_mesh import TetMesh, boundary_facets

#: Distance [m] at which a node counts as lying on a surface: far above gmsh's rounding, far below
#: any dimension.
_ON = 1e-7

Surface = Callable[[NDArray[np.float64]], NDArray[np.bool_]]


def with_carrier_surfaces(
    mesh: TetMesh, carrier: CarrierParameters, pin: PinParameters | None = None
) -> TetMesh:
    """Copy of `mesh` with the carrier's named surfaces.

    Those of the bonded pins too, where it has them.

    ``shaft_face``, ``rim_face`` (outside the sensor circle), ``upwind_seat``, ``downwind_seat``,
    ``pin_i_upwind`` and ``pin_i_downwind`` (bores), ``pin_i_midspan`` (planet bearings' seat,
    bonded pins only), i = 1, 2, 3 ... A half sector keeps those that it holds a part of.

    Raises
    ------
    ValueError
        Where a surface of the whole carrier has no facet: the mesh does not belong to these
        parameters.
    """
    facets = boundary_facets(mesh.tets[mesh.bodies["carrier"]])
    surfaces = _matching(mesh, facets, carrier_surface_equations(carrier))
    if pin is not None:
        pin_facets = boundary_facets(mesh.tets[mesh.bodies["pins"]])
        equations = {
            name: eq
            for name, eq in pin_surface_equations(carrier, pin).items()
            if "midspan" in name
        }
        surfaces |= _matching(mesh, pin_facets, equations)
    is_full_circle = mesh.symmetry_order == carrier.n_planets
    return _checked(mesh, surfaces, complete=is_full_circle)


def with_pin_surfaces(mesh: TetMesh, carrier: CarrierParameters, pin: PinParameters) -> TetMesh:
    """Copy of the mesh of pin 1 alone with its named surfaces.

    ``pin_1_upwind``, ``pin_1_downwind`` (its ends in the bores) and ``pin_1_midspan``.
    """
    equations = {
        name: eq
        for name, eq in pin_surface_equations(carrier, pin).items()
        if name.startswith("pin_1")
    }
    return _checked(mesh, _matching(mesh, boundary_facets(mesh.tets), equations), complete=True)


def with_main_shaft_surfaces(
    mesh: TetMesh, carrier: CarrierParameters, shaft: MainShaftParameters
) -> TetMesh:
    """Copy of the main shaft's mesh with its named surfaces.

    Its ends ``coupling_flange`` and ``carrier_joint``, and ``main_bearing_seat``.
    """
    inner, outer = shaft.inner_diameter / 2.0, shaft.outer_diameter / 2.0
    equations = {
        "coupling_flange": _plane(shaft.flange_x(carrier), inner, outer),
        "main_bearing_seat": _cylinder(shaft.bearing_seat_x(carrier), outer),
        "carrier_joint": _plane(shaft.joint_x(carrier), inner, outer),
    }
    return _checked(mesh, _matching(mesh, boundary_facets(mesh.tets), equations), complete=True)


def carrier_surface_equations(p: CarrierParameters) -> dict[str, Surface]:
    """Equation of each named surface of the carrier.

    Takes points (..., 3), tells which lie on it.
    """
    surfaces: dict[str, Surface] = {
        "shaft_face": _plane(-p.hub_length, p.hub_inner_diameter / 2.0, p.hub_outer_diameter / 2.0),
        "rim_face": _plane(0.0, p.sensor_radius, p.outer_radius),
        "upwind_seat": _cylinder(p.upwind_bearing_x, p.hub_outer_diameter / 2.0),
        "downwind_seat": _cylinder(
            (p.length_between_faces, p.length_between_faces + p.seat_length),
            p.seat_outer_diameter / 2.0,
        ),
    }
    for number, angle in enumerate(pin_angles(p.n_planets), start=1):
        for side, x in (("upwind", p.upwind_bore_x), ("downwind", p.downwind_bore_x)):
            surfaces[f"pin_{number}_{side}"] = _cylinder(
                x, p.pin_hole_radius, (p.centre_distance, float(angle))
            )
    return surfaces


def pin_surface_equations(p: CarrierParameters, pin: PinParameters) -> dict[str, Surface]:
    """Equation of each named surface of the pins."""
    middle = p.upwind_plate_thickness + p.plate_gap / 2.0
    seat = (middle - pin.bearing_width / 2.0, middle + pin.bearing_width / 2.0)
    surfaces: dict[str, Surface] = {}
    for number, angle in enumerate(pin_angles(p.n_planets), start=1):
        for section, x in (
            ("upwind", p.upwind_bore_x),
            ("downwind", p.downwind_bore_x),
            ("midspan", seat),
        ):
            surfaces[f"pin_{number}_{section}"] = _cylinder(
                x, pin.diameter / 2.0, (p.centre_distance, float(angle))
            )
    return surfaces


def _plane(x: float, inner: float, outer: float) -> Surface:
    def lies_on(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points (..., 3) lie on the surface."""
        r = np.hypot(points[..., 1], points[..., 2])
        return (np.abs(points[..., 0] - x) < _ON) & (r > inner - _ON) & (r < outer + _ON)

    return lies_on


def _cylinder(
    x: tuple[float, float], radius: float, centre: tuple[float, float] = (0.0, 0.0)
) -> Surface:
    """Cylinder about the line at distance centre[0] from the axis, at angle centre[1] [rad]."""
    y0, z0 = -centre[0] * math.sin(centre[1]), centre[0] * math.cos(centre[1])

    def lies_on(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points (..., 3) lie on the surface."""
        r = np.hypot(points[..., 1] - y0, points[..., 2] - z0)
        between = (points[..., 0] > x[0] - _ON) & (points[..., 0] < x[1] + _ON)
        return (np.abs(r - radius) < _ON) & between

    return lies_on


def _matching(
    mesh: TetMesh, facets: NDArray[np.int64], equations: dict[str, Surface]
) -> dict[str, NDArray[np.int64]]:
    coordinates = mesh.points[facets]
    return {name: facets[lies_on(coordinates).all(axis=1)] for name, lies_on in equations.items()}


def _checked(mesh: TetMesh, surfaces: dict[str, NDArray[np.int64]], *, complete: bool) -> TetMesh:
    empty = [name for name, facets in surfaces.items() if not len(facets)]
    if empty and complete:
        raise ValueError(
            f"the mesh has no facet on {', '.join(empty)}: it does not belong to these parameters"
        )
    return replace(
        mesh, surfaces={name: facets for name, facets in surfaces.items() if len(facets)}
    )
