"""Effects in words: ids of the contract as an engineer would say them."""

from carrierflex.diagnosis.comparison.problem import Effects

_PROPER_NAMES = {
    "coulomb": "Coulomb",
    "stribeck": "Stribeck",
    "maxwell": "Maxwell",
    "dahl": "Dahl",
    "ntl": "non-torque-load",
}


#: Words of what stands behind the first part of an id: a line between the shaft's orders by its
#: frame, an error of the measurement.
_FRAMES = {
    "nonsynchronous": "motion at {}, between the shaft's orders",
    "aliased": "motion at {}, above half the sampling rate",
    "channel": "motion at {} in one sensor alone",
    "geometry": "{} of the carrier",
    "wiring": "a wrong {}",
}

#: Words of a class of frame, pattern and loads, by its first two parts.
_SHAPES = {
    "housing/offset": "offset of the housing",
    "housing/tilt": "tilt of the housing",
    "housing/saddle": "saddle of the housing",
    "housing/planet_pass": "motion of the housing as planets pass",
    "housing/load_sharing": "planet loads that change once a turn",
    "carrier/tilt": "tilt of the carrier",
    "carrier/waves": "waves fixed to the carrier",
    "carrier/load_sharing": "unequal planet loads fixed to the carrier",
    "channel/gain": "gain of a sensor",
    "channel/zero": "zero of a sensor",
    "channel/angle": "angle of a sensor",
    "clock/delay": "delay of all sensors",
    "stage/sun_restraint": "restraint of the sun",
    "stage/carrier_clearance": "clearance of a carrier bearing",
    "stage/carrier_bearings": "stiffness of a carrier bearing",
    "stage/mesh_stiffness": "stiffness of the tooth meshes",
    "stage/mounting": "support of the housing",
    "stage/pin_play": "play of the pins in their bores",
    "stage/joint_tilt": "tilt of the carrier in its joint",
    "stage/pin_places": "positions of the pins",
}
#: Words of what such a class follows.
_FOLLOWS = {
    "none": "whatever the load",
    "time": "slow in time",
    "torque": "following torque",
    "radial_load": "following radial load",
    "undetermined": "",
}
#: Ids whose words say less than a name: forces in both bushings, maps between loads and signals.
_NAMES = {
    "ring_pass": "planet pass",
    "model/carrier": "a carrier off its drawing",
    "model/pins": "pins off their drawing",
    "material/E": "modulus of the carrier",
    "material/nu": "Poisson's ratio of the carrier",
    "material/pin_E": "modulus of the pins",
    "stage/sun_radial": "restraint of the sun",
    "stage/upwind_radial": "stiffness of the upwind carrier bearing",
    "stage/downwind_radial": "stiffness of the downwind carrier bearing",
    "stage/upwind_clearance": "clearance of the upwind carrier bearing",
    "stage/downwind_clearance": "clearance of the downwind carrier bearing",
    "stage/sun_stiffness": "stiffness of the sun's meshes",
    "stage/ring_stiffness": "stiffness of the ring's meshes",
    "stage/axial_stiffness": "axial stiffness of the bushings",
    "stage/tilt_stiffness": "tilting stiffness of the bushings",
    "stage/pin_fit_play": "play of the pins in their bores",
    "stage/joint_tilt": "tilt of the carrier in its joint",
    "stage/pin_places": "positions of the pins",
    "bushings/restoring_force": "restoring force of the bushings",
    "bushings/dissipation": "dissipation of the bushings",
    "bushings/hysteresis": "hysteresis of the bushings",
    "bushings/memory": "memory of the bushings",
    "bushings/coupled_damping": "damping of the bushings that follows their deflection",
    "stiffness_map": "linear stiffness beyond the bushings",
    "input_map": "map of the loads",
    "sensor_map": "gain, zero or delay of the sensors",
}


def plain_name(effect: str) -> str:
    """Effect id, or id of a class, in words: ``cubic stiffness``, ``tilt of the housing``.

    Of the measured shape of a class, ``measured housing/tilt/none``, both parts.
    """
    measured, _, name = effect.partition(" ")
    if name:
        return f"{measured} {plain_name(name)}"
    if effect in _NAMES:
        return _NAMES[effect]
    shape, _, follows = effect.rpartition("/")
    if shape in _SHAPES:
        return ", ".join(filter(None, (_SHAPES[shape], _follows_words(follows))))
    frame, _, line = effect.partition("/")
    if line and "/" not in line and frame in _FRAMES:
        return _FRAMES[frame].format(line.replace("_", " "))
    words = effect.replace("elasto_plastic", "elasto-plastic").split("_")
    return " ".join(_PROPER_NAMES.get(word, word) for word in words)


def _follows_words(follows: str) -> str:
    """What a class follows: ``following torque and radial load, part of it whatever the load``."""
    if follows in _FOLLOWS:
        return _FOLLOWS[follows]
    loads = [word for word in follows.split("+") if word != "none"]
    words = "following " + " and ".join(word.replace("_", " ") for word in loads)
    return f"{words}, part of it whatever the load" if "none" in follows.split("+") else words


def set_name(effects: Effects) -> str:
    """Set of effects in words; the empty one is the baseline."""
    return " + ".join(plain_name(effect) for effect in effects) or "baseline alone"
