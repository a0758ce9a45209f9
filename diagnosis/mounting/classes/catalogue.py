"""Classes of a mounting: where the cause sits and what it is, each in the ways it may act.

A class is ``place/kind/way``. A force of the bushings is the same in both or one each; the maps of
stiffness, loads and sensors have sparse ways, which are the effects of a rig, and a full one.
"""

from collections.abc import Container, Mapping, Sequence

#: Place of the forces that follow.
BUSHINGS = "bushings"
FORCE = "bushings/restoring_force"
DISSIPATION = "bushings/dissipation"
HYSTERESIS = "bushings/hysteresis"
MEMORY = "bushings/memory"
COUPLED = "bushings/coupled_damping"
CHANGE = "bushings/time_variation"
STIFFNESS = "housing/stiffness"
LOADS = "loads/map"
GAIN = "sensors/gain"
ZERO = "sensors/zero"
DELAY = "clock/delay"

SAME = "same"
EACH = "each"
FULL = "full"
#: One bushing stiffer than the other.
UNEQUAL = "unequal"
#: Groups of columns of each force, for both bushings alike; one each has them twice.
FORCE_GROUPS: Mapping[str, tuple[str, ...]] = {
    FORCE: ("f", "radial_f"),
    DISSIPATION: ("g", "radial_g"),
    HYSTERESIS: ("stops", "radial_stops", "smooth_stops"),
    MEMORY: ("prony",),
    COUPLED: ("h", "radial_h"),
    CHANGE: ("time",),
}
#: Ways of the maps, the sparse ones first.
STIFFNESS_WAYS = ("axial", "main_bearing", UNEQUAL, FULL)
LOAD_WAYS = ("torque_from_load", "direction", "gain", FULL)
DELAY_WAYS = ("all", "torque", "radial_load")
#: Maps from loads to signals: one class where slow loads act in one direction.
LINEAR_MAPS = (STIFFNESS, LOADS, GAIN)

#: Shape of each law of the library.
SHAPE_OF_LAW: Mapping[str, str] = {
    "cubic_stiffness": FORCE,
    "quintic_stiffness": FORCE,
    "deflection_dependent_damping": COUPLED,
    "fluid_branch": MEMORY,
    "elasto_plastic_friction": HYSTERESIS,
    "parasitic_torque": LOADS,
    "ntl_direction": LOADS,
    "axial_bushing_stiffness": STIFFNESS,
    "main_bearing_compliance": STIFFNESS,
    "unequal_bushings": STIFFNESS,
    "sensor_gain": GAIN,
    "sensor_zero": ZERO,
    "sensor_delay": DELAY,
}
#: Shapes that hold a user's law: a force of deflection and speed in both bushings.
SHAPES_OF_USER = (FORCE, DISSIPATION, COUPLED)


def class_groups(
    channels: Sequence[str], contained: Sequence[str], known: Container[str]
) -> dict[str, tuple[str, ...]]:
    """Groups of columns of every class, the simplest way of a shape first."""
    classes: dict[str, tuple[str, ...]] = {}
    for shape, groups in FORCE_GROUPS.items():
        classes[f"{shape}/{SAME}"] = groups
        classes[f"{shape}/{EACH}"] = tuple(
            f"{group}:{side}" for group in groups for side in ("starboard", "port")
        )
    for shape, ways in ((STIFFNESS, STIFFNESS_WAYS), (LOADS, LOAD_WAYS), (DELAY, DELAY_WAYS)):
        for way in ways:
            if f"{shape}:{way}" in known:
                classes[f"{shape}/{way}"] = (f"{shape}:{way}",)
    for shape in (GAIN, ZERO):
        measured = [channel for channel in channels if f"{shape}:{channel}" in known]
        for channel in measured:
            classes[f"{shape}/{channel}"] = (f"{shape}:{channel}",)
        if measured:
            classes[f"{shape}/{EACH}"] = tuple(f"{shape}:{channel}" for channel in measured)
    taken = {SHAPE_OF_LAW[law] for law in contained if SHAPE_OF_LAW.get(law) in (ZERO, DELAY)}
    return {name: of for name, of in classes.items() if name.rpartition("/")[0] not in taken}
