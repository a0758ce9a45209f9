"""Measured laws: one description of every kind, from which files, schema and simulators are made.

A law is a sum of parts. Their fields are the keys of a law file: beside its type stand the kind of
value that each may hold and its words, of which :mod:`carrierflex.simulation.law_tables` makes the
tables of the file. Forces and deflections are in the law's units. What a part does is described
where a simulator takes it: :mod:`carrierflex.simulation.element.law_forces`,
:mod:`carrierflex.simulation.mounting.measured_laws.bushing_laws` and
:mod:`carrierflex.simulation.carrier.measured_laws.carrier_laws`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, TypeVar

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.measured_laws.rim_patterns import (
    ALONG_LOAD,
    NONE,
    RIM_PATTERNS,
    TIME,
    has_wave,
)

Array = NDArray[np.float64]

ELEMENT, MOUNTING, CARRIER = "element", "mounting", "carrier"
RESTORING_FORCE = "restoring_force"
DISSIPATION = "dissipation"
COUPLED_DAMPING = "coupled_damping"
#: What a table holds: force over deflection, force over speed, damping over deflection.
TABULATED = (RESTORING_FORCE, DISSIPATION, COUPLED_DAMPING)
HYSTERESIS, MEMORY = "hysteresis", "memory"
#: Classes whose force depends on the past.
WITH_MEMORY = (HYSTERESIS, MEMORY)
FORCE_SURFACE = "force_surface"

BOTH, STARBOARD, PORT = "both", "starboard", "port"
#: What parts of a law of a kind act on.
ACTS_ON: Mapping[str, tuple[str, ...]] = {
    ELEMENT: (ELEMENT,),
    MOUNTING: (BOTH, STARBOARD, PORT),
    CARRIER: ("axial_displacement", "radial_displacement"),
}
#: In y and in z apart, along deflection or speed in the plane, or giving way along the path.
APART, RADIAL, SMOOTH = "apart", "radial", "smooth"
#: Values of the stiffness of a smooth loop.
N_STIFFNESS = 9
#: Types of parts of a law by kind and class, each with its least and largest number.
_ONE, _SEVERAL = (1, 1), (0, 100)
_TYPES: Mapping[str, Mapping[str, Mapping[str, tuple[int, int]]]] = {
    ELEMENT: {
        RESTORING_FORCE: {"table": _ONE},
        DISSIPATION: {"table": _ONE, "friction": (0, 1), "stop": _SEVERAL},
        COUPLED_DAMPING: {"table": _ONE},
        HYSTERESIS: {"stop": _SEVERAL, "loop": _SEVERAL},
        MEMORY: {"branch": _SEVERAL},
        FORCE_SURFACE: {"surface": _ONE, "friction": (0, 1), "stop": _SEVERAL},
    },
    MOUNTING: {
        **{name: {"table": (1, 4)} for name in TABULATED},
        HYSTERESIS: {"stop": _SEVERAL},
        MEMORY: {"branch": _SEVERAL},
    },
    CARRIER: {name: {"wave": (1, 1600)} for name in RIM_PATTERNS},
}
#: Classes of every kind, in the order of the kinds.
EFFECT_CLASSES = tuple(dict.fromkeys(name for classes in _TYPES.values() for name in classes))
#: Share of the range whose chord is the slope beyond a table.
_END_SHARE = 0.05


def _points() -> Array:
    return np.empty(0)


@dataclass(frozen=True, eq=False)
class LawTerm:
    """Term of a law, a table ``[[part]]`` of its file."""

    acts_on: Annotated[str, "acts_on", "The element, both bushings or one, sensors of one quantity"]

    @property
    def type(self) -> str:
        """Type as in the file."""
        return type(self).__name__.lower()

    def problems(self, law: "Law") -> list[str]:
        """What contradicts another key of it, or the law's kind or class."""
        return []


@dataclass(frozen=True, eq=False)
class Table(LawTerm):
    """Function as points, linear between them: f(x) or g(v), or h(x) of a damping h(x) v."""

    x: Annotated[
        Array, "points", "Visited deflections (dissipation: speeds), increasing; radial: from 0"
    ]
    y: Annotated[Array, "points", "Force (coupled_damping: damping) at x; radial force: 0 at 0"]
    plane: Annotated[str, "plane", "Of bushings: y and z apart, or along the motion"] = ""

    def problems(self, law: "Law") -> list[str]:
        """What keeps the points from being a function."""
        messages = [
            *_differing({"x": self.x, "y": self.y}),
            *_unordered(self.x),
            *_wrong_plane(self.plane, (APART, RADIAL), law.kind),
        ]
        if self.plane == RADIAL and self.x[0] != 0.0:
            messages.append(f"x begins at {self.x[0]:g}; expected 0 where plane is radial")
        if self.plane == RADIAL and law.effect_class != COUPLED_DAMPING and self.y[0] != 0.0:
            messages.append(f"y begins at {self.y[0]:g}; expected 0 of a radial force")
        return messages


@dataclass(frozen=True)
class Stop(LawTerm):
    """A spring in series with dry friction; z in -1 to 1 is its deflection over where it slips."""

    yield_deflection: Annotated[float, "positive", "Deflection at which it slips"]
    slip: Annotated[float, "not_negative", "Force at slip, anywhere"] = 0.0
    plane: Annotated[
        str, "plane", "Of bushings: y and z apart, radial, or smooth along the path"
    ] = ""
    middle: Annotated[float, "number", "Deflection where the place s is zero"] = 0.0
    half_range: Annotated[float, "positive", "Deflection from the middle at which s is 1"] = 1.0
    slip_middle: Annotated[float, "not_negative", "Force at slip in addition, times 1 - |s|"] = 0.0
    slip_upper: Annotated[float, "not_negative", "The same times s where s > 0"] = 0.0
    slip_lower: Annotated[float, "not_negative", "The same times -s where s < 0"] = 0.0
    slip_outside: Annotated[float, "not_negative", "The same times min(4 |s|, 1)"] = 0.0
    inner: Annotated[float, "not_negative", "Force per z within -1/2 and 1/2"] = 0.0
    outer_upper: Annotated[float, "not_negative", "Force per z above 1/2"] = 0.0
    outer_lower: Annotated[float, "not_negative", "Force per z below -1/2"] = 0.0

    def problems(self, law: "Law") -> list[str]:
        """What a bushing or an element does not have."""
        messages = _wrong_plane(self.plane, (APART, RADIAL, SMOOTH), law.kind)
        if law.kind == MOUNTING:
            simple = Stop(self.acts_on, self.yield_deflection, self.slip, self.plane)
            messages += [
                f"key '{name}' of a bushing; expected none: its stops are equal everywhere"
                for name, value in vars(self).items()
                if value != getattr(simple, name)
            ]
        return messages


@dataclass(frozen=True)
class Branch(LawTerm):
    """A spring in series with a damper; of bushings the same in y and in z."""

    tau: Annotated[float, "positive", "Relaxation time [s]"]
    stiffness: Annotated[float, "not_negative", "Stiffness of the spring"]


@dataclass(frozen=True, eq=False)
class Loop(LawTerm):
    """A smooth loop: force times z, with dz = c(z) / half_range times the deflection's change."""

    half_range: Annotated[float, "positive", "Deflection over which c = 1 changes z by 1"]
    force: Annotated[float, "not_negative", "Force at z = 1"]
    stiffness: Annotated[Array, "stiffness", "c at z = -1, -0.75, ... 1 in the direction of motion"]


@dataclass(frozen=True, eq=False)
class Friction(LawTerm):
    """Dry friction, in which the motion sticks: by the sense of the motion, or by deflection."""

    plus: Annotated[float, "not_negative", "Of dissipation: at positive speed"] = 0.0
    minus: Annotated[float, "not_negative", "Of dissipation: at negative speed"] = 0.0
    x: Annotated[Array, "points", "Of force_surface: deflection, increasing"] = field(
        default_factory=_points
    )
    level: Annotated[Array, "levels", "Of force_surface: friction at x, constant beyond"] = field(
        default_factory=_points
    )

    def problems(self, law: "Law") -> list[str]:
        """Keys of the other class, and levels that are no function."""
        if law.effect_class == DISSIPATION:
            message = "x and level in the class dissipation; expected plus and minus"
            return [message] * bool(self.x.size or self.level.size)
        messages = [*_differing({"x": self.x, "level": self.level}), *_unordered(self.x)]
        if self.plus or self.minus or not self.x.size:
            messages.append(f"no x and level in the class {law.effect_class}; expected these alone")
        return messages


@dataclass(frozen=True, eq=False)
class Surface(LawTerm):
    """Force over deflection and speed, bilinear between the points, without dry friction."""

    x: Annotated[Array, "points", "Deflection over the visited range, increasing"]
    v: Annotated[Array, "points", "Speed over the visited range, increasing"]
    y: Annotated[Array, "rows", "Force: a row over v for each value of x"]

    def problems(self, law: "Law") -> list[str]:
        """What keeps the points from being a function of both."""
        messages = [*_unordered(self.x), *_unordered(self.v, "v")]
        n_x, n_v = self.x.size, self.v.size
        if len(self.y) != n_x:
            messages.append(
                f"y has {len(self.y)} rows; expected one for each of the {n_x} values of x"
            )
        wrong = next((k for k, row in enumerate(self.y) if len(row) != n_v), None)
        if wrong is not None:
            messages.append(
                f"row {wrong} of y has {len(self.y[wrong])} values; expected one for each of the "
                f"{n_v} values of v"
            )
        return messages


@dataclass(frozen=True, eq=False)
class Wave(LawTerm):
    """``cosine cos(m v - n theta) + sine sin(m v - n theta)`` at the sensors of one quantity."""

    order: Annotated[int, "order", "Order n of the carrier angle theta"]
    lobes: Annotated[int, "lobes", "Lobes m around the housing, v the angle of a sensor"]
    follows: Annotated[str, "follows", "What it follows; load_sharing: torque times load"]
    cosine: Annotated[Array, "amplitudes", "Amplitudes at x [m]; of load_sharing [m/(N m)]"]
    sine: Annotated[Array, "amplitudes", "Amplitudes of the sine, as those of the cosine"]
    x: Annotated[Array, "points", "Torque [N m], radial load [N] from 0, share of the run"] = field(
        default_factory=_points
    )
    along: Annotated[str, "along", "Factor: components of the radial load's direction"] = ""

    def problems(self, law: "Law") -> list[str]:
        """What is no wave of the pattern, and what keeps its amplitudes from being functions."""
        messages = self._wrong_abscissa()
        n_points = max(self.x.size, 1)
        for name, amplitudes in (("cosine", self.cosine), ("sine", self.sine)):
            if amplitudes.size != n_points:
                messages.append(
                    f"{name} has {amplitudes.size} points; expected {n_points}, those of x"
                )
            if self.follows in ALONG_LOAD and amplitudes[0] != 0.0:
                messages.append(
                    f"{name} begins at {amplitudes[0]:g}; expected 0 without radial load"
                )
        n_planets = int(law.rig.get("n_planets", 0))
        if n_planets and not has_wave(law.effect_class, self.order, self.lobes, n_planets):
            messages.append(
                f"order {self.order} with {self.lobes} lobes is no wave of {law.effect_class} "
                f"with {n_planets} planets"
            )
        return messages

    def _wrong_abscissa(self) -> list[str]:
        """What is wrong with the abscissa and the direction."""
        messages = []
        if bool(self.along) != (self.follows in ALONG_LOAD):
            expected = "expected no key along" if self.along else "expected a direction"
            messages.append(f"along is {self.along or None} and follows {self.follows}; {expected}")
        if self.follows == NONE:
            return messages + (["x where nothing is followed; expected none"] * bool(self.x.size))
        if not self.x.size:
            return [*messages, f"no x; expected that of follows {self.follows}"]
        messages += _unordered(self.x)
        if self.follows in ALONG_LOAD and self.x[0] != 0.0:
            messages.append(f"x begins at {self.x[0]:g}; expected 0, the size of a load")
        low, high = self.x[[0, -1]]
        if self.follows == TIME and (low, high) != (0.0, 1.0):
            messages.append(f"x is {low:g} to {high:g}; expected 0 to 1, the run")
        return messages


#: Types of parts, in the order of the manual.
TERM_TYPES: tuple[type[LawTerm], ...] = (Table, Stop, Branch, Loop, Friction, Surface, Wave)
_P = TypeVar("_P", bound=LawTerm)


@dataclass(frozen=True, eq=False)
class Law:
    """A measured law: the shape of one class of effect, of size one.

    Parameters
    ----------
    name : str
        Id of the effect.
    kind : str
        Kind of the campaigns that it is for: element, mounting or carrier.
    effect_class : str
        Class of the effect; of a carrier frame and pattern.
    units : tuple of str
        Units of force and deflection; time is in seconds.
    terms : tuple of LawTerm
        Terms that add up, the tables ``[[part]]`` of its file.
    visited : mapping of str to (float, float)
        Least and largest value of what the parts follow, where no table states them: deflection
        (of bushings its size in the plane, from zero), or torque, ntl_y and ntl_z.
    rig : mapping of str to float
        Of a carrier n_planets and sensor_radius [m].
    measured_on : str
        Campaign whose records gave it; empty where unknown.
    """

    name: str
    kind: str
    effect_class: str
    units: tuple[str, str]
    terms: tuple[LawTerm, ...]
    visited: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    rig: Mapping[str, float] = field(default_factory=dict)
    measured_on: str = ""

    def of(self, term_type: type[_P]) -> tuple[_P, ...]:
        """Parts of one type."""
        return tuple(one for one in self.terms if isinstance(one, term_type))

    def problems(self) -> list[str]:
        """What keys of its file contradict each other in, by the names in the file."""
        classes = _TYPES[self.kind]
        if self.effect_class not in classes:
            return [
                f"key 'effect_class' is '{self.effect_class}'; expected one of "
                f"{', '.join(classes)} of kind {self.kind}"
            ]
        messages = self._wrong_head()
        types = classes[self.effect_class]
        for name, (least, most) in types.items():
            number = sum(term.type == name for term in self.terms)
            if not least <= number <= most:
                messages.append(
                    f"{number} tables [[part]] of type {name}; expected {least} to {most}"
                )
        for k, term in enumerate(self.terms, start=1):
            if term.type not in types:
                expected = f"{' or '.join(types)}, of {self.effect_class}"
                problems = [f"key 'type' is '{term.type}'; expected {expected}"]
            elif term.acts_on not in ACTS_ON[self.kind]:
                expected = f"one of {', '.join(ACTS_ON[self.kind])} of kind {self.kind}"
                problems = [f"key 'acts_on' is '{term.acts_on}'; expected {expected}"]
            else:
                problems = term.problems(self)
            messages += [f"[[part]] {k}: {message}" for message in problems]
        return messages

    def _wrong_head(self) -> list[str]:
        """What is wrong beside the parts."""
        messages = []
        if self.kind != ELEMENT and self.units != ("N", "m"):
            messages.append(f"[units]: {' and '.join(self.units)}; expected N and m of this kind")
        if self.kind == CARRIER and not self.rig:
            messages.append("missing table [rig]; expected n_planets and sensor_radius")
        elif self.kind != CARRIER and self.rig:
            messages.append(f"unknown table [rig] of kind {self.kind}; expected none")
        is_tabulated = any(isinstance(term, Table | Surface) for term in self.terms)
        loads = ("torque", "ntl_y", "ntl_z")
        stated = loads if self.kind == CARRIER else ("deflection",)
        expected = () if is_tabulated else stated
        if set(self.visited) != set(expected):
            messages.append(
                f"[visited] has {', '.join(self.visited) or 'no key'}; expected "
                f"{', '.join(expected) or 'none: the tables have their ends'}"
            )
        for name, (low, high) in self.visited.items():
            if low > high or (low == high and self.kind != CARRIER):
                ends = f"{low:g} to {high:g}"
                messages.append(f"[visited]: {name} is {ends}; expected the least first")
        if self.kind == MOUNTING and self.visited.get("deflection", (0.0, 0.0))[0] != 0.0:
            messages.append("[visited]: deflection does not begin at 0; expected its size")
        return messages


def end_slopes(x: Array, y: Array) -> tuple[float, float]:
    """Slopes of the outermost twentieth of a table at its lower and its upper end."""
    step = _END_SHARE * (x[-1] - x[0])
    low = min(max(int(np.searchsorted(x, x[0] + step)), 1), x.size - 1)
    high = max(min(int(np.searchsorted(x, x[-1] - step, side="right")) - 1, x.size - 2), 0)
    return (
        float((y[low] - y[0]) / (x[low] - x[0])),
        float((y[-1] - y[high]) / (x[-1] - x[high])),
    )


def _differing(lists: Mapping[str, Array]) -> list[str]:
    """Message where lists that belong together differ in length."""
    (first, n), (second, m) = ((name, values.size) for name, values in lists.items())
    return [] if n == m else [f"{first} has {n} and {second} {m} points; expected as many"]


def _unordered(x: Array, name: str = "x") -> list[str]:
    """Message where an abscissa does not increase."""
    at = next((k for k in range(x.size - 1) if not x[k] < x[k + 1]), None)
    if at is None:
        return []
    return [f"{name}[{at + 1}] is {x[at + 1]:g} after {x[at]:g}; expected increasing values"]


def _wrong_plane(plane: str, allowed: Sequence[str], kind: str) -> list[str]:
    """Message where a part of a bushing has no way in the plane, or one of an element has one."""
    if kind == MOUNTING and plane not in allowed:
        return [f"key 'plane' is '{plane}'; expected one of {', '.join(allowed)}"]
    if kind != MOUNTING and plane:
        return [f"key 'plane' of kind {kind}; expected none"]
    return []
