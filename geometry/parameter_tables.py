"""What a parameter file holds: [carrier], [pin], [gear], [main_shaft], keys as in their classes."""

from typing import Annotated

from carrierflex.files.toml_values import (
    FieldsOf,
    Key,
    NotNegative,
    Planets,
    Positive,
    Teeth,
    TomlTable,
    key,
)
from carrierflex.geometry.main_shaft_parameters import MainShaftParameters
from carrierflex.geometry.parameters import CarrierParameters, GearData, PinParameters

_CARRIER = {
    "outer_radius": "Outer radius of both plates",
    "upwind_plate_thickness": "Thickness of the upwind plate",
    "downwind_plate_thickness": "Thickness of the downwind plate",
    "plate_gap": "Axial distance between the plates, where the planets run",
    "centre_distance": "Distance of the pins' axes from the carrier's axis",
    "pin_hole_diameter": "Diameter of the pin bores in both plates",
    "web_inner_radius": "Inner radius of the webs between the plates",
    "planet_clearance_radius": "Radius about each pin's axis that the webs leave free",
    "hub_outer_diameter": "Outer diameter of the upwind hub",
    "hub_inner_diameter": "Bore of the upwind hub",
    "hub_length": "Length of the upwind hub",
    "upwind_bearing_width": "Width of the upwind carrier bearing, centred on the hub",
    "seat_outer_diameter": "Outer diameter of the downwind bearing's seat",
    "seat_inner_diameter": "Bore of the downwind bearing's seat",
    "seat_length": "Length of the downwind bearing's seat",
    "sensor_radius": "Radius of the circle on the rim that the axial sensors face",
}
_PIN = {
    "diameter": "Diameter of the planet pins, equal to the pin bores'",
    "bearing_width": "Width of the planet bearings' seat on each pin",
}
GEAR_KEYS = {
    "ring_teeth": Key(Teeth, "Number of teeth of the ring gear"),
    "planet_teeth": Key(Teeth, "Number of teeth of a planet"),
    "sun_teeth": Key(Teeth, "Number of teeth of the sun"),
    "centre_distance": Key(
        Positive,
        "Distance of the planets' axes from the sun's, the carrier's centre distance",
        "m",
    ),
    "pressure_angle": Key(Positive, "Normal pressure angle", "rad"),
    "helix_angle": Key(
        NotNegative, "Helix angle; the sun is right-handed; 0 for spur gears", "rad"
    ),
    "module": Key(Positive, "Normal module", "m"),
    "sun_tip_diameter": Key(Positive, "Tip diameter of the sun", "m"),
    "planet_tip_diameter": Key(Positive, "Tip diameter of a planet", "m"),
    "ring_tip_diameter": Key(Positive, "Tip diameter of the ring, its smallest", "m"),
    "sun_width": Key(Positive, "Face width of the sun", "m"),
    "planet_width": Key(Positive, "Face width of planets and ring", "m"),
}
_MAIN_SHAFT = {
    "outer_diameter": "Outer diameter of the main shaft",
    "inner_diameter": "Bore of the main shaft",
    "bearing_to_joint": "Distance from the main bearing's centre to the carrier's hub",
    "bearing_width": "Width of the main bearing",
    "bearing_to_flange": "Distance from the main bearing's centre upwind to the coupling's flange",
    "hub_to_bearing": "Distance from the point of the rotor's loads to the main bearing",
}


def _lengths(words: dict[str, str]) -> FieldsOf:
    return FieldsOf({name: Key(Positive, text, "m") for name, text in words.items()})


_CARRIER_KEYS = FieldsOf(
    {
        **{name: Key(Positive, text, "m") for name, text in _CARRIER.items()},
        "n_planets": Key(Planets, "Number of planets, 3 to 8, and of pins and webs"),
    }
)


class ParameterTables(TomlTable):
    """Dimensions of the carrier, pins, gears and main shaft; what is left out keeps its default."""

    carrier: Annotated[CarrierParameters, _CARRIER_KEYS] = key(
        "Planet carrier",
        default_factory=CarrierParameters,
    )
    pin: Annotated[PinParameters, _lengths(_PIN)] = key(
        "Planet pins",
        default_factory=PinParameters,
    )
    gear: Annotated[GearData, FieldsOf(GEAR_KEYS)] = key(
        "Planetary gears", default_factory=GearData
    )
    main_shaft: Annotated[MainShaftParameters, _lengths(_MAIN_SHAFT)] = key(
        "Main shaft",
        default_factory=MainShaftParameters,
    )
