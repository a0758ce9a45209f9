"""Ids of causes inside the planetary stage, and which of them are one class.

Their signals are computed by :mod:`carrierflex.simulation.stage.causes`; here is what needs no
stage.
"""

from collections.abc import Mapping

from carrierflex.geometry.parameters import MOST_PLANETS

#: What ids of these causes begin with.
STAGE = "stage"
#: Parameter of a cause that is solved at a few sizes, its standard deviation about one. Chosen: a
#: straight line between two sizes misses a tenth.
RESPONSE, RESPONSE_STD = "response", 0.1
JOINT_TILT, PIN_PLACES = "joint_tilt", "pin_places"
#: Group of each cause, its class, by the cause's name.
GROUPS: Mapping[str, str] = {
    "sun_radial": "sun_restraint",
    "upwind_clearance": "carrier_clearance",
    "downwind_clearance": "carrier_clearance",
    "upwind_radial": "carrier_bearings",
    "downwind_radial": "carrier_bearings",
    "sun_stiffness": "mesh_stiffness",
    "ring_stiffness": "mesh_stiffness",
    "axial_stiffness": "mounting",
    "tilt_stiffness": "mounting",
    "pin_fit_play": "pin_play",
    JOINT_TILT: JOINT_TILT,
    PIN_PLACES: PIN_PLACES,
}


def effect_of_stage(name: str) -> str:
    """Effect id of a cause inside the stage."""
    return f"{STAGE}/{name}"


#: Effect ids of all causes inside the stage.
STAGE_EFFECTS: tuple[str, ...] = tuple(effect_of_stage(name) for name in GROUPS)


def group_of_effect(effect: str) -> str:
    """Group of a cause inside the stage; empty of another effect."""
    frame, _, name = effect.partition("/")
    return GROUPS.get(name, "") if frame == STAGE else ""


#: Published names of the values of each cause, by effect id; pins up to the most planets.
STAGE_PARAMETERS: Mapping[str, tuple[str, ...]] = {
    effect_of_stage(name): (RESPONSE, name) for name in GROUPS
} | {
    effect_of_stage(JOINT_TILT): ("phi_PLC", "theta_PLC"),
    effect_of_stage(PIN_PLACES): tuple(f"pin_{k}" for k in range(2, MOST_PLANETS + 1)),
}
#: Other half of the vectors among them.
STAGE_PARTNERS: Mapping[tuple[str, str], str] = {
    (effect_of_stage(JOINT_TILT), "phi_PLC"): "theta_PLC",
    (effect_of_stage(JOINT_TILT), "theta_PLC"): "phi_PLC",
}
