"""Which effects records of the check can tell apart.

The alias classes of the score, and what is outside the library.

The classes follow from the equations of the truth and the loads of the check; they are not taken
from any diagnosis. Kind element is judged by class of cause and has its table in
:mod:`carrierflex.blind_check.truth.element.families`.
"""

from carrierflex.blind_check.truth.carrier.signals import SIGNALS
from carrierflex.blind_check.truth.mounting.state import EFFECTS

#: Classes of more than one effect; every other is alone. Beside each, what the truth's own signals
#: share over the loads of a check once the baseline is refitted: the cosine of their residuals, or
#: the share that the other's parameters reach.
_CLASSES: dict[str, dict[str, tuple[str, ...]]] = {
    "carrier": {
        # A clearance saturates, a compliance does not: much shared, told apart only by how the tilt
        # bends over six loads.
        "load tilt": ("ntl_tilt", "bearing_clearance"),
    },
    "mounting": {
        "hardening": ("cubic_stiffness", "quintic_stiffness"),  # 0.97
    },
}

#: Effects withheld one at a time.
SINGLES: dict[str, tuple[str, ...]] = {
    "carrier": (*SIGNALS, "sensor_gain", "sensor_angle", "sensor_zero", "sensor_delay"),
    "mounting": EFFECTS,
}  # fmt: skip

#: Effects that leave one and the same signal where torque and radial load, or the amplitude, never
#: change.
CONSTANT_LOAD: dict[str, tuple[str, ...]] = {
    "carrier": ("stiff_pins", "pin_clearance", "face_runout", "unequal_load_sharing"),
    "mounting": (),
}
#: Effects of the cases with a single condition.
ONE_CONDITION_EFFECTS: dict[str, tuple[str, ...]] = {
    "carrier": (
        "carrier_tilt",
        "flexible_pins",
        "face_runout",
        "unequal_load_sharing",
        "thermal_drift",
        "sensor_gain",
    ),
    "mounting": ("cubic_stiffness", "parasitic_torque", "axial_bushing_stiffness"),
}
#: At one constant load every signal of the carrier's order n is a wave on its face, whatever makes
#: it.
_ONE_LOAD: dict[str, tuple[str, ...]] = {
    "carrier": (
        "flexible_pins", "stiff_pins", "pin_clearance", "face_runout", "unequal_load_sharing",
        "load_sharing_ntl",
    ),
    "mounting": ("cubic_stiffness", "quintic_stiffness"),
}  # fmt: skip

#: Effects of the planetary stage itself, alone and in pairs: the truth "stage" holds its readings.
STAGE_EFFECTS: tuple[tuple[str, ...], ...] = (
    ("bearing_clearance",),
    ("carrier_tilt",),
    ("pin_clearance",),
    ("unequal_load_sharing",),
    ("ring_pass",),
    ("bearing_clearance", "carrier_tilt"),
    ("bearing_clearance", "pin_clearance"),
    ("bearing_clearance", "ring_pass"),
    ("carrier_tilt", "pin_clearance"),
    ("carrier_tilt", "ring_pass"),
    ("pin_clearance", "ring_pass"),
    ("pin_clearance", "unequal_load_sharing"),
    ("ring_pass", "unequal_load_sharing"),
)
#: A pin out of place beside a held sun presses the carrier to one side whatever the torque: order
#: 1 of the carrier, as a tilt of it.
#: Clearances that weight holds apart answer alike to both signs of the radial load.
_IN_THE_STAGE = {
    "unequal_load_sharing": ("unequal_load_sharing", "carrier_tilt"),
    "bearing_clearance": ("bearing_clearance", "clearance_rocking"),
}
#: What an effect of the stage brings along and may be named beside it. A kink, or a pin out of
#: place, bends the carrier in its own frame: waves that stay on its face. A carrier that has used
#: up its clearance gives way to more load elastically, on another path than in tight bearings.
BROUGHT_ALONG = {
    "carrier_tilt": ("face_runout",),
    "unequal_load_sharing": ("face_runout",),
    "bearing_clearance": ("ntl_tilt", "bearing_clearance", "clearance_rocking"),
}

#: Causes that no library of the contract holds.
OUTSIDE_NAMES: dict[str, tuple[str, ...]] = {
    "carrier": ("thermal_bow", "oil_whirl", "loose_probe_bracket"),
    "mounting": ("ground_motion", "loose_probe_bracket", "softening_in_time"),
}

#: Those of them that a class holds all the same, though no law of its library.
OUTSIDE_CLASSES = {"softening_in_time": "time_variation"}


def class_of(kind: str, effect: str) -> str:
    """Name of an effect's alias class: its own id where it is alone in it."""
    for name, members in _CLASSES[kind].items():
        if effect in members:
            return name
    return effect


def same_class(kind: str, effect: str, *, one_load: bool = False) -> tuple[str, ...]:
    """Effects that the records cannot tell from this one, itself included.

    Parameters
    ----------
    kind, effect : str
        Kind and effect id.
    one_load : bool
        Whether loads and amplitudes are the same in all runs.

    Returns
    -------
    tuple of str
        Ids; the effect itself comes first.
    """
    members = set(_CLASSES[kind].get(class_of(kind, effect), (effect,)))
    if one_load and effect in _ONE_LOAD[kind]:
        members |= set(_ONE_LOAD[kind])
    return (effect, *sorted(members - {effect}))


def stage_class(effect: str) -> tuple[str, ...]:
    """Effects that readings of the stage cannot tell from this one, itself first."""
    return _IN_THE_STAGE.get(effect, same_class("carrier", effect))
