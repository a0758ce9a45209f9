"""Units of REXS 1.7, and the unit that the standard gives each attribute that is read or written.

The standard allows one unit an attribute; another one of the same dimension is converted too.
"""

import math
import re

#: Factor to SI and SI unit of each unit of the database's table in which something of a stage is
#: stated. `°` is that of files before REXS 1.4.
UNITS = {
    "none": (1.0, ""),
    "%": (1e-2, ""),
    "mm": (1e-3, "m"),
    "mum": (1e-6, "m"),
    "deg": (math.pi / 180.0, "rad"),
    "°": (math.pi / 180.0, "rad"),
    "rad": (1.0, "rad"),
    "N": (1.0, "N"),
    "kN": (1e3, "N"),
    "N m": (1.0, "N m"),
    "N / m": (1.0, "N/m"),
    "N / mm": (1e3, "N/m"),
    "N mm / rad": (1e-3, "N m/rad"),
    "N / (mm mum)": (1e9, "Pa"),
    "N / mm^2": (1e6, "Pa"),
    "MPa": (1e6, "Pa"),
    "Pa": (1.0, "Pa"),
    "kg": (1.0, "kg"),
    "kg / dm^3": (1e3, "kg/m^3"),
    "1 / min": (math.pi / 30.0, "rad/s"),
    "rad / s": (1.0, "rad/s"),
    "W": (1.0, "W"),
    "kW": (1e3, "W"),
    "m / s^2": (1.0, "m/s^2"),
    "h": (3600.0, "s"),
    "s": (1.0, "s"),
    "MRev": (2e6 * math.pi, "rad"),
}

#: Unit of each attribute in the database.
STANDARD_UNITS = {
    "axial_stiffness": "N / m",
    "bending_stiffness": "N mm / rad",
    "center_distance": "mm",
    "common_face_width": "mm",
    "density": "kg / dm^3",
    "diameter_of_rolling_element": "mm",
    "direction_vector_gravity_u": "none",
    "direction_vector_gravity_v": "none",
    "direction_vector_gravity_w": "none",
    "elastic_modulus": "N / mm^2",
    "face_width": "mm",
    "force_acting_on_inner_component_u": "N",
    "force_acting_on_inner_component_v": "N",
    "force_acting_on_inner_component_w": "N",
    "force_u_direction": "N",
    "force_v_direction": "N",
    "force_w_direction": "N",
    "gravitational_acceleration": "m / s^2",
    "helix_angle_reference_diameter": "deg",
    "inner_diameter": "mm",
    "inner_diameter_begin": "mm",
    "inner_diameter_end": "mm",
    "length": "mm",
    "length_of_rolling_element": "mm",
    "mass_of_component": "kg",
    "maximum_normal_backlash": "mm",
    "mean_mesh_stiffness_for_transverse_load_iso_6336_2006": "N / (mm mum)",
    "mean_mesh_stiffness_for_transverse_load_iso_6336_2019": "N / (mm mum)",
    "mesh_load_factor_iso_6336_2019": "none",
    "mesh_stiffness_for_load_distribution_along_face_width": "N / (mm mum)",
    "minimum_normal_backlash": "mm",
    "nominal_rating_life_rotations_iso_281_2007": "MRev",
    "nominal_rating_life_time_iso_281_2007": "h",
    "nominal_tangential_force_at_reference_circle": "N",
    "normal_module": "mm",
    "normal_pressure_angle": "deg",
    "number_of_rolling_elements": "none",
    "number_of_teeth": "none",
    "operating_radial_bearing_clearance": "mum",
    "outer_diameter": "mm",
    "outer_diameter_begin": "mm",
    "outer_diameter_end": "mm",
    "poisson_ratio": "none",
    "power": "kW",
    "radial_bearing_clearance": "mum",
    "radial_clearance": "mum",
    "radial_dynamic_load_rating": "kN",
    "radial_stiffness": "N / m",
    "reference_diameter": "mm",
    "rotational_speed": "1 / min",
    "strut_inner_diameter": "mm",
    "strut_radius_planet_recess": "mm",
    "support_vector": "mm",
    "tip_diameter": "mm",
    "torque_around_u_axis": "N m",
    "u_axis_vector": "mm",
    "u_coordinate_on_shaft": "mm",
    "w_axis_vector": "mm",
    "width": "mm",
}


def factor_to_si(attribute: str, unit: str | None) -> float:
    """Factor from the unit that a file states to SI.

    Parameters
    ----------
    attribute : str
        Id of the attribute; its dimension follows.
    unit : str or None
        Unit in the file; None or empty where there is none: the standard's.

    Raises
    ------
    ValueError
        Where the unit is not in the standard's table, or of another dimension.
    """
    standard = STANDARD_UNITS[attribute]
    stated = _spelled(unit) if unit and unit.strip() else standard
    dimension = UNITS[standard][1]
    factor, other = UNITS.get(stated, (0.0, None))
    if other != dimension:
        alike = ", ".join(name for name, entry in UNITS.items() if entry[1] == dimension)
        raise ValueError(f"{attribute} has the unit '{stated[:40]}'; expected one of {alike}")
    return factor


def in_standard_unit(attribute: str, value: float) -> float:
    """A value in SI, in the standard's unit of an attribute; 15 digits, as the standard allows."""
    return float(f"{value / UNITS[STANDARD_UNITS[attribute]][0]:.15g}")


def _spelled(unit: str) -> str:
    """A unit with the standard's blanks: `N/mm` as `N / mm`."""
    return re.sub(r"\s*/\s*", " / ", " ".join(unit.split()))
