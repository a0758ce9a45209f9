"""Classes of a carrier: frame and pattern, each with the ways it may follow the loads."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from carrierflex.identification.campaign.order_analysis import highest_order
from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    BY_BOTH,
    BY_RADIAL_LOAD,
    BY_TORQUE,
    MODULATED,
    NONE,
    OFFSET,
    PLANET_PASS,
    SADDLE,
    TILT,
    TIME,
    TURNING_TILT,
    UNEVEN,
    WAVES,
    Columns,
    modulated_waves,
    offset,
    planet_pass,
    saddle,
    tilt,
    turning_tilt,
    turning_waves,
    uneven_waves,
)

_GAIN = "channel/gain"
_ZERO = "channel/zero"
_ANGLE = "channel/angle"
_DELAY = "clock/delay"
UNDETERMINED = "undetermined"

#: Frame and pattern of each law of the library, and what it follows.
LAWS = {
    "axial_offset": (OFFSET, (NONE,)),
    "thermal_drift": (OFFSET, (TIME,)),
    "housing_tilt": (TILT, (NONE,)),
    "torque_tilt": (TILT, (BY_TORQUE,)),
    "ntl_tilt": (TILT, (BY_RADIAL_LOAD,)),
    "bearing_clearance": (TILT, (BY_RADIAL_LOAD,)),
    "clearance_rocking": (TILT, (BY_RADIAL_LOAD,)),
    "flange_warp": (SADDLE, (NONE, BY_TORQUE, BY_RADIAL_LOAD)),
    "ring_pass": (PLANET_PASS, (BY_TORQUE,)),
    "load_sharing_ntl": (MODULATED, (BY_BOTH,)),
    "carrier_tilt": (TURNING_TILT, (NONE,)),
    "flexible_pins": (WAVES, (BY_TORQUE,)),
    "stiff_pins": (WAVES, (BY_TORQUE,)),
    "pin_clearance": (WAVES, (BY_TORQUE,)),
    "face_runout": (WAVES, (NONE,)),
    "unequal_load_sharing": (UNEVEN, (BY_TORQUE,)),
    "sensor_gain": (_GAIN, (NONE,)),
    "sensor_zero": (_ZERO, (NONE,)),
    "sensor_angle": (_ANGLE, (NONE,)),
    "sensor_delay": (_DELAY, (NONE,)),
}
CLASS_OF_LAW = {law: shape for law, (shape, _) in LAWS.items()}
#: Effects of the sensors, whose own signatures are the columns of their class.
SENSOR_EFFECTS = {
    "sensor_gain": _GAIN,
    "sensor_zero": _ZERO,
    "sensor_angle": _ANGLE,
    "sensor_delay": _DELAY,
}
_SETS_OF_HOUSING = (
    (NONE,),
    (BY_TORQUE,),
    (NONE, BY_TORQUE),
    (BY_RADIAL_LOAD,),
    (NONE, BY_RADIAL_LOAD),
    (BY_TORQUE, BY_RADIAL_LOAD),
    (NONE, BY_TORQUE, BY_RADIAL_LOAD),
)
_OF_TORQUE = ((NONE,), (BY_TORQUE,), (NONE, BY_TORQUE))


@dataclass(frozen=True, eq=False)
class Shape:
    """Frame and pattern of a class.

    Parameters
    ----------
    id : str
        ``frame/pattern``.
    columns : mapping of str to callable
        Columns by dependence: quantities of the sensors and planets to columns.
    sets : tuple of tuple of str
        Ways to follow the loads, as sets of dependences, the simplest first.
    """

    id: str
    columns: Mapping[str, Callable[[Sequence[str], int], Columns]]
    sets: tuple[tuple[str, ...], ...]


def _alone(
    pattern: Callable[[Sequence[str]], Columns],
) -> Callable[[Sequence[str], int], Columns]:
    """Pattern that does not depend on the number of planets."""
    return partial(_of_quantities, pattern)


def _of_quantities(
    pattern: Callable[[Sequence[str]], Columns], quantities: Sequence[str], n_planets: int
) -> Columns:
    return pattern(quantities)


def _face_waves(quantities: Sequence[str], n_planets: int) -> Columns:
    """Waves on the carrier's face, whatever their order."""
    return turning_waves(quantities, range(2, highest_order(n_planets) + 1))


def _planet_waves(quantities: Sequence[str], n_planets: int) -> Columns:
    """Waves that equal loads of all planets make: as many lobes as planets, and multiples."""
    return turning_waves(quantities, range(n_planets, highest_order(n_planets) + 1, n_planets))


def shapes() -> tuple[Shape, ...]:
    """Every frame and pattern whose columns are waves."""
    still = {OFFSET: offset, TILT: tilt, SADDLE: saddle}
    housing = tuple(
        Shape(
            name,
            {load: _alone(pattern) for load in (NONE, BY_TORQUE, BY_RADIAL_LOAD)},
            _SETS_OF_HOUSING,
        )
        for name, pattern in still.items()
    )

    turning = _alone(turning_tilt)
    return (
        *housing,
        Shape(PLANET_PASS, {NONE: planet_pass, BY_TORQUE: planet_pass}, _OF_TORQUE),
        Shape(MODULATED, {BY_BOTH: modulated_waves}, ((BY_BOTH,),)),
        Shape(TURNING_TILT, {NONE: turning, BY_TORQUE: turning}, _OF_TORQUE),
        Shape(WAVES, {NONE: _face_waves, BY_TORQUE: _planet_waves}, _OF_TORQUE),
        Shape(UNEVEN, {BY_TORQUE: uneven_waves}, ((BY_TORQUE,),)),
    )


def class_id(shape: str, dependences: Sequence[str], *, has_torques: bool) -> str:
    """Class of a shape that follows some loads.

    Parameters
    ----------
    shape : str
        ``frame/pattern``.
    dependences : sequence of str
        What it follows.
    has_torques : bool
        Whether the records have torques enough to determine what it follows.
    """
    if not has_torques:
        return f"{shape}/{UNDETERMINED}"
    words = [BY_TORQUE, BY_RADIAL_LOAD] if BY_BOTH in dependences else list(dependences)
    return f"{shape}/{'+'.join(words)}"


def classes_of_laws(
    classes_of_law: Mapping[str, Sequence[str]], *, has_torques: bool
) -> dict[str, tuple[str, ...]]:
    """Classes that hold each law, that of its own way to follow the loads first.

    Parameters
    ----------
    classes_of_law : mapping of str to sequence of str
        Classes of a table by law.
    has_torques : bool
        Whether the records have torques enough to determine what a class follows.
    """
    ordered = {}
    for law, classes in classes_of_law.items():
        first = ""
        if law in LAWS:
            shape, follows = LAWS[law]
            is_sensor = shape == OFFSET or law in SENSOR_EFFECTS
            first = class_id(shape, follows, has_torques=has_torques or is_sensor)
        ordered[law] = tuple(sorted(classes, key=lambda name: name != first))
    return ordered


def classes_holding(laws: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Class of laws that are in no table: theirs by what they follow; none of a user's law."""
    return {
        law: (class_id(LAWS[law][0], LAWS[law][1], has_torques=True),) if law in LAWS else ()
        for law in laws
    }
