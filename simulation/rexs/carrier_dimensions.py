"""Dimensions of carrier, pins, gears and main shaft from a planetary stage in REXS.

The carrier of this program has two plates with webs between them, a hub upwind and a seat downwind:
what of a REXS carrier is another shape is left to its dimensions.
"""

import math
from collections.abc import Callable

from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters
from carrierflex.simulation.rexs.planetary_stage import PlanetaryStage
from carrierflex.simulation.rexs.rexs_model import Component
from carrierflex.simulation.rexs.sourced_numbers import Numbers

#: Tables of a parameter file.
TABLES = ("carrier", "pin", "gear", "main_shaft")
#: Air between a planet's tips and the webs of the shipped carrier [m].
_AIR = 0.008


def carrier_dimensions(stage: PlanetaryStage, unit_of: Callable[[str, str], str]) -> Numbers:
    """Numbers of a parameter file.

    Parameters
    ----------
    stage : PlanetaryStage
        Components of the stage.
    unit_of : callable
        SI unit of a key by its table and name.

    Raises
    ------
    ValueError
        Where the file states no centre distance and no places of the gears, no module or teeth, or
        a unit or a number is wrong.
    """
    distance, source = _centre_distance(stage)
    numbers = Numbers(stage, distance / GearData.centre_distance, unit_of)
    numbers.notes += stage.notes
    _gear(numbers, distance, source)
    _plates(numbers)
    _pin(numbers)
    _carrier_ends(numbers)
    _room_of_the_planets(numbers)
    _main_shaft(numbers)
    for table in TABLES:
        numbers.rest(table)
    return numbers


def _centre_distance(stage: PlanetaryStage) -> tuple[float, str]:
    """Centre distance [m], stated or that of the planets' places, and its source."""
    for planet in stage.planets:
        for mesh in (planet.sun_mesh, planet.ring_mesh):
            distance = stage.model.number(mesh, "center_distance")
            if distance is not None:
                if not distance > 0.0:
                    raise ValueError(
                        f"{stage.model.path}: {mesh}: center_distance is {distance} m; expected a "
                        "positive one"
                    )
                return distance, f"{mesh} center_distance"
    for planet in stage.planets:
        if planet.radius > 0.0:
            return planet.radius, f"{planet.gear} support_vector, from the axis"
    raise ValueError(
        f"{stage.model.path}: {stage.stage}: no cylindrical_stage of it has a center_distance, no "
        "planet a support_vector off the axis; expected one"
    )


def _gear(numbers: Numbers, distance: float, source: str) -> None:
    """Teeth, module, angles, widths and tip diameters."""
    stage = numbers.stage
    planet = stage.planets[0]
    for key, gear, teeth in zip(
        ("ring_teeth", "planet_teeth", "sun_teeth"),
        (stage.ring, planet.gear, stage.sun),
        stage.teeth,
        strict=True,
    ):
        numbers.put("gear", key, teeth, "file", f"{gear} number_of_teeth")
    numbers.put("gear", "centre_distance", distance, "file", source)
    numbers.put("carrier", "centre_distance", distance, "file", source)
    numbers.take("gear", "module", stage.sun, "normal_module")
    numbers.take("gear", "module", planet.gear, "normal_module")
    if ("gear", "module") not in numbers:
        raise ValueError(f"{stage.model.path}: {stage.sun} has no normal_module; expected one")
    helix = stage.model.number(stage.sun, "helix_angle_reference_diameter")
    if helix is not None:
        source = f"{stage.sun} helix_angle_reference_diameter"
        numbers.put("gear", "helix_angle", abs(helix), "file", source)
        if helix < 0.0:
            numbers.notes.append(f"{stage.sun} is left-handed; the model's sun is right-handed")
    numbers.take("gear", "pressure_angle", _flank(stage, stage.sun), "normal_pressure_angle")
    numbers.take("gear", "pressure_angle", stage.sun, "normal_pressure_angle")
    module = numbers["gear", "module"]
    # Reference diameter and two modules of a gear without profile shift.
    helix = abs(helix or 0.0)
    for key, gear, teeth, sign in (
        ("sun_tip_diameter", stage.sun, stage.teeth[2], 1.0),
        ("planet_tip_diameter", planet.gear, stage.teeth[1], 1.0),
        ("ring_tip_diameter", stage.ring, stage.teeth[0], -1.0),
    ):
        numbers.take("gear", key, gear, "tip_diameter")
        rule = "module (teeth / cos(helix) + 2), no profile shift"
        tip = module * (teeth / math.cos(helix) + 2.0 * sign)
        numbers.put("gear", key, tip, "default", rule.replace("+", "-") if sign < 0.0 else rule)
    numbers.take("gear", "sun_width", stage.sun, "face_width")
    numbers.take("gear", "planet_width", planet.gear, "face_width")


def _flank(stage: PlanetaryStage, gear: Component) -> Component | None:
    """A flank of a gear."""
    for side in ("left", "right"):
        for flank in stage.model.related("flank", "gear", gear, side):
            return flank
    return None


def _plates(numbers: Numbers) -> None:
    """Both side plates."""
    stage, model = numbers.stage, numbers.model
    numbers.put("carrier", "n_planets", len(stage.planets), "file", f"planets of {stage.stage}")
    if len(stage.plates) != 2:
        numbers.notes.append(
            f"{stage.carrier or 'no planet carrier'} with {len(stage.plates)} side plates: the "
            "model's carrier has two"
        )
    if stage.plates:
        numbers.take("carrier", "upwind_plate_thickness", stage.plates[0], "length")
        numbers.take("carrier", "outer_radius", stage.plates[0], "outer_diameter", times=0.5)
    if len(stage.plates) != 2:
        return
    upwind, downwind = stage.plates
    numbers.take("carrier", "downwind_plate_thickness", downwind, "length")
    ends = [_ends(stage, plate) for plate in stage.plates]
    if ends[0] is not None and ends[1] is not None and ends[1][0] > ends[0][1]:
        gap = ends[1][0] - ends[0][1]
        source = f"{upwind} and {downwind} support_vector, length"
        numbers.put("carrier", "plate_gap", gap, "file", source)
    radii = [model.number(plate, "outer_diameter") for plate in stage.plates]
    if None not in radii and radii[0] != radii[1]:
        numbers.notes.append(f"{downwind} has another outer_diameter than {upwind}, whose counts")


def _ends(stage: PlanetaryStage, component: Component) -> tuple[float, float] | None:
    """First and last place of a component of stated length along x [m]."""
    first, length = stage.x(component), stage.model.number(component, "length")
    if first is None or length is None:
        return None
    last = first + length * stage.along_x(component)
    return min(first, last), max(first, last)


def _sections(stage: PlanetaryStage, shaft: Component) -> list[tuple[float, float, Component]]:
    """Sections of a shaft from upwind, with their ends along x [m]."""
    origin = stage.x(shaft)
    sections = []
    for section in stage.model.parts_of(shaft, "shaft_section"):
        length = stage.model.number(section, "length")
        if origin is None or length is None:
            continue
        begin = stage.model.number(section, "u_coordinate_on_shaft") or 0.0
        ends = [origin + u * stage.along_x(shaft) for u in (begin, begin + length)]
        sections.append((min(ends), max(ends), section))
    return sorted(sections, key=lambda each: each[:2])


def _pin(numbers: Numbers) -> None:
    """Pins as thick as their middle section."""
    stage = numbers.stage
    planet = stage.planets[0]
    sections = [] if planet.pin is None else stage.model.parts_of(planet.pin, "shaft_section")
    for section in sections[len(sections) // 2 :]:
        numbers.take("pin", "diameter", section, "outer_diameter_begin")
    numbers.default("pin", "diameter")
    diameter = numbers.values["pin", "diameter"]
    numbers.put("carrier", "pin_hole_diameter", diameter.number, diameter.how, diameter.source)
    numbers.default("carrier", "plate_gap")
    widths = [stage.model.number(bearing, "width") for bearing in planet.bearings]
    gap = numbers["carrier", "plate_gap"]
    known = [width for width in widths if width is not None]
    if known and len(known) == len(widths) and sum(known) < gap:
        source = " and ".join(f"{bearing} width" for bearing in planet.bearings)
        numbers.put("pin", "bearing_width", sum(known), "file", source)
    share = PinParameters.bearing_width / CarrierParameters.plate_gap
    numbers.put("pin", "bearing_width", share * gap, "default", f"{share:.4g} of plate_gap")


def _carrier_ends(numbers: Numbers) -> None:
    """Hub and seat: what stands out of the plates of the shafts on the carrier's axis."""
    stage = numbers.stage
    if len(stage.plates) != 2:
        return
    upwind, downwind = (_ends(stage, plate) for plate in stage.plates)
    if upwind is None or downwind is None:
        return
    sections = [each for shaft in stage.carrier_shafts for each in _sections(stage, shaft)]
    outside = [each for each in sections if each[0] < upwind[0] - 1e-6]
    if outside:
        section = outside[-1][2]
        length = upwind[0] - min(each[0] for each in outside)
        source = "shaft sections upwind of the plates"
        numbers.put("carrier", "hub_length", length, "file", source)
        numbers.take("carrier", "hub_outer_diameter", section, "outer_diameter_end")
        numbers.take("carrier", "hub_inner_diameter", section, "inner_diameter_end")
    beyond = [each for each in sections if each[1] > downwind[0] + 1e-6]
    if beyond:
        length = max(each[1] for each in beyond) - downwind[1]
        if length > 1e-6:
            source = "shaft sections downwind of the plates"
            numbers.put("carrier", "seat_length", length, "file", source)
        section = beyond[0][2]
        numbers.take("carrier", "seat_outer_diameter", section, "outer_diameter_begin")
        numbers.take("carrier", "seat_inner_diameter", section, "inner_diameter_begin")
    widths = [stage.model.number(bearing, "width") for bearing in stage.upwind_bearings]
    if len(widths) == 1 and widths[0] is not None:
        numbers.take("carrier", "upwind_bearing_width", stage.upwind_bearings[0], "width")
    if ("carrier", "hub_length") in numbers:
        key, half = "upwind_bearing_width", 0.5 * numbers["carrier", "hub_length"]
        width, rule = numbers.scaled("carrier", key, CarrierParameters.upwind_bearing_width)
        rule += ", at most half the hub_length" if width > half else ""
        numbers.put("carrier", key, min(width, half), "default", rule)


def _room_of_the_planets(numbers: Numbers) -> None:
    """Webs, the planets' room between them, and the sensors' circle."""
    stage, scale = numbers.stage, numbers.scale
    carrier = stage.carrier
    for key, attribute, times in (
        ("planet_clearance_radius", "strut_radius_planet_recess", 1.0),
        ("web_inner_radius", "strut_inner_diameter", 0.5),
    ):
        # Programs write 0 where there are no struts.
        if numbers.model.number(carrier, attribute):
            numbers.take("carrier", key, carrier, attribute, times=times)
    room = 0.5 * numbers["gear", "planet_tip_diameter"] + _AIR * scale
    rule = f"planet_tip_diameter / 2 + {_AIR:g} x {scale:.4g}"
    numbers.put("carrier", "planet_clearance_radius", room, "default", rule)
    numbers.default("carrier", "outer_radius")
    holes = numbers["carrier", "centre_distance"] + 0.5 * numbers["carrier", "pin_hole_diameter"]
    circle = 0.5 * (holes + numbers["carrier", "outer_radius"])
    rule = "middle between pin holes and outer_radius"
    numbers.put("carrier", "sensor_radius", circle, "default", rule)


def _main_shaft(numbers: Numbers) -> None:
    """A main shaft that fits the hub."""
    for key in ("hub_outer_diameter", "hub_inner_diameter"):
        numbers.default("carrier", key)
    inner, outer = (numbers["carrier", f"hub_{side}_diameter"] for side in ("inner", "outer"))
    key = "outer_diameter"
    shipped, rule = numbers.scaled("main_shaft", key, MainShaftParameters.outer_diameter)
    fits = inner < shipped <= outer
    rule = rule if fits else "middle between hub_inner_diameter and hub_outer_diameter"
    diameter = shipped if fits else 0.5 * (inner + outer)
    numbers.put("main_shaft", key, diameter, "default", rule)
