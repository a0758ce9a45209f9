"""The carrier as a solid of OpenCASCADE: union of plates, webs, hub and seat, minus the bores."""

import math
from collections.abc import Sequence
from typing import Any

from carrierflex.geometry.parameters import CarrierParameters


def carrier_solid(geometry: Any, p: CarrierParameters, pin_angles: Sequence[float]) -> list[Any]:
    """Build the carrier with the pin holes and planet pockets of the pins at `pin_angles`.

    Parameters
    ----------
    geometry : pygmsh.occ.Geometry
        Open session.
    p : CarrierParameters
        Dimensions [m].
    pin_angles : sequence of float
        Carrier-frame angles [rad]: all three for the whole carrier, the first alone where only its
        sector is used.

    Returns
    -------
    list
        The solid, as pygmsh's operations give it.
    """
    end_a, start_b, end_b = p.upwind_bore_x[1], *p.downwind_bore_x
    seat_end = end_b + p.seat_length
    middle = (end_a + start_b) / 2.0
    pockets = [
        solid_cylinder(geometry, (end_a, start_b), p.planet_clearance_radius, _off(p, v))
        for v in pin_angles
    ]
    webs = geometry.boolean_difference(
        solid_cylinder(geometry, (end_a, start_b), p.outer_radius),
        [solid_cylinder(geometry, (end_a, start_b), p.web_inner_radius), *pockets],
    )
    solids = [
        solid_cylinder(geometry, (-p.hub_length, 0.0), p.hub_outer_diameter / 2.0),
        solid_cylinder(geometry, (0.0, end_a), p.outer_radius),
        solid_cylinder(geometry, (start_b, end_b), p.outer_radius),
        solid_cylinder(geometry, (end_b, seat_end), p.seat_outer_diameter / 2.0),
    ]
    whole = geometry.boolean_union([*solids, *webs])
    bores = [
        solid_cylinder(geometry, (-p.hub_length, middle), p.hub_inner_diameter / 2.0),
        solid_cylinder(geometry, (middle, seat_end), p.seat_inner_diameter / 2.0),
    ]
    for x in ((-p.hub_length, end_a), (start_b, seat_end)):
        bores += [solid_cylinder(geometry, x, p.pin_hole_radius, _off(p, v)) for v in pin_angles]
    return list(geometry.boolean_difference(whole, bores))


def solid_cylinder(
    geometry: Any, x: tuple[float, float], radius: float, centre: tuple[float, float] = (0.0, 0.0)
) -> Any:
    """Cylinder along x from x[0] to x[1], its axis at (y, z) = `centre`."""
    return geometry.add_cylinder([x[0], *centre], [x[1] - x[0], 0.0, 0.0], radius)


def _off(p: CarrierParameters, angle: float) -> tuple[float, float]:
    """Where the pin at `angle` [rad] pierces a plane of constant x, (y, z) [m]."""
    return -p.centre_distance * math.sin(angle), p.centre_distance * math.cos(angle)
