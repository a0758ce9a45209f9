"""References in closed form (or one-dimensional integrals), each with its source and limits."""

import math

import numpy as np
from scipy.integrate import quad


def covered_angle(r, radius, distance):
    """Angle [rad] of a circle r about the axis inside a circle `radius` at `distance` off it."""
    if r <= 0.0:
        return 2.0 * math.pi if radius > distance else 0.0
    cosine = (r**2 + distance**2 - radius**2) / (2.0 * r * distance)
    return 2.0 * math.acos(min(1.0, max(-1.0, cosine)))


def ring_section(inner, outer, hole, distance):
    """Area and polar second moment [m^2, m^4] of an annulus less three circular holes.

    Elementary geometry, exact.
    """

    def integral(power):
        breaks = [r for r in (distance - hole, distance + hole) if inner < r < outer]

        def density(r):
            covered = min(covered_angle(r, hole, distance), 2.0 * math.pi / 3.0)
            return r**power * (2.0 * math.pi - 3.0 * covered)

        return quad(density, inner, outer, points=breaks or None, epsabs=1e-14, epsrel=1e-12)[0]

    return integral(1), integral(3)


def carrier_slabs(p):
    """Axial extent and section of each slab of the carrier.

    Hub, plate A, webs, plate B, seat, straight from its drawing.
    """
    x1 = p.upwind_plate_thickness
    x2 = x1 + p.plate_gap
    x3 = x2 + p.downwind_plate_thickness
    hole, a = p.pin_hole_diameter / 2.0, p.centre_distance
    hub_bore, seat_bore = p.hub_inner_diameter / 2.0, p.seat_inner_diameter / 2.0
    return [
        (-p.hub_length, 0.0, ring_section(hub_bore, p.hub_outer_diameter / 2.0, hole, a)),
        (0.0, x1, ring_section(hub_bore, p.outer_radius, hole, a)),
        (x1, x2, ring_section(p.web_inner_radius, p.outer_radius, p.planet_clearance_radius, a)),
        (x2, x3, ring_section(seat_bore, p.outer_radius, hole, a)),
        (x3, x3 + p.seat_length, ring_section(seat_bore, p.seat_outer_diameter / 2.0, hole, a)),
    ]


def carrier_volume(p):
    return sum((end - start) * area for start, end, (area, _) in carrier_slabs(p))


def carrier_centre_x(p):
    first = sum((end**2 - start**2) / 2.0 * area for start, end, (area, _) in carrier_slabs(p))
    return first / carrier_volume(p)


def carrier_inertia(p, rho):
    """Inertia [kg m^2] about x and a transverse axis through the centre of mass (y as z)."""
    polar = sum((end - start) * second for start, end, (_, second) in carrier_slabs(p))
    axial = sum((end**3 - start**3) / 3.0 * area for start, end, (area, _) in carrier_slabs(p))
    return rho * polar, rho * (polar / 2.0 + axial - carrier_volume(p) * carrier_centre_x(p) ** 2)


def box_inertia(mass, lengths):
    """Inertia tensor of a box about its centre (any mechanics table)."""
    x, y, z = lengths
    return mass / 12.0 * np.diag([y**2 + z**2, x**2 + z**2, x**2 + y**2])


def pin_inertia(mass, radius, length):
    """Inertia of a solid cylinder along x about its centre (any mechanics table)."""
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    return np.diag([mass * radius**2 / 2.0, across, across])


def torsion_twist(torque, length, radius, shear_modulus):
    """Relative twist [rad] of a round bar, T L / (G J).

    Saint-Venant, exact where the end shear grows with the radius.
    """
    return torque * length / (shear_modulus * math.pi / 2.0 * radius**4)


def bending_rotation(moment, length, width, height, E):
    """Relative rotation [rad] of the ends of a bar bent by end moments, M L / (E I).

    Exact for linear end stress.
    """
    return moment * length / (E * width * height**3 / 12.0)


def cantilever_work(force, length, width, height, E):
    """Work F·u [J] of the end tractions of a bar under end shear, nu = 0.

    Saint-Venant's flexure: bending and parabolic shear stress (Timoshenko and Goodier, Theory of
    Elasticity, art. 21); exact in three dimensions for nu = 0 only. ``F² L³ / (3 E I) + 6/5 F² L /
    (G A)``, with G = E / 2.
    """
    area, second = width * height, width * height**3 / 12.0
    return force**2 * (length**3 / (3.0 * E * second) + 1.2 * length / (E / 2.0 * area))


def longitudinal_frequency(length, E, rho):
    """First free-free longitudinal angular frequency [rad/s], (pi / L) sqrt(E / rho).

    Exact in 3-D for nu = 0.
    """
    return math.pi / length * math.sqrt(E / rho)


def torsional_frequency(length, shear_modulus, rho):
    """First free-free torsional angular frequency [rad/s] of a round bar, (pi / L) sqrt(G / rho).

    Exact in three dimensions.
    """
    return math.pi / length * math.sqrt(shear_modulus / rho)


def pressed_ring(x, radii, pressure, material, middle):
    """Displacement [m] at x (3, ...) of a ring about x under pressure in its bore, ends free.

    Lamé's thick cylinder (Timoshenko and Goodier, Theory of Elasticity, art. 28): stresses ``A ± B
    / r²`` with ``A = p a² / (b² - a²)``, ``B = A b²``, no axial stress, so that it contracts evenly
    along x about `middle`. Exact.
    """
    inner, outer = radii
    A = pressure * inner**2 / (outer**2 - inner**2)
    nu, r_squared = material.nu, x[1] ** 2 + x[2] ** 2
    radial_over_r = A / material.E * (1.0 - nu + (1.0 + nu) * outer**2 / r_squared)
    return np.array(
        [-2.0 * nu * A / material.E * (x[0] - middle), radial_over_r * x[1], radial_over_r * x[2]]
    )
