"""The planetary stage in a REXS model: which component is which, and where it stands.

Frame: x along the axis, from the side on which the carrier is loaded to the other, z against the
weight and y = z × x, so that a stage of a wind turbine has the frame of this program.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.rexs.rexs_model import Component, RexsModel

_BEARINGS = (
    "concept_bearing",
    "rolling_bearing_with_catalog_geometry",
    "rolling_bearing_with_detailed_geometry",
    "slide_bearing",
    "hydrodynamic_radial_plain_bearing",
)
_GEARS = ("cylindrical_gear", "ring_gear")
#: Planets that stand farther than this from equal steps [rad] are told.
_UNEVEN = 1e-3
#: A shaft farther than this from the axis [m] is a pin.
_OFF_AXIS = 1e-3


@dataclass(frozen=True, eq=False)
class Planet:
    """One planet: its gear and shaft, its pin, its bearings from upwind, its meshes."""

    gear: Component
    shaft: Component | None
    pin: Component | None
    bearings: tuple[Component, ...]
    sun_mesh: Component
    ring_mesh: Component
    radial: NDArray[np.float64]
    """Unit vector from the axis to the planet, in the model's frame, shape (3,)."""
    radius: float
    """Distance from the axis [m]; 0 where the file states no place."""


@dataclass(frozen=True, eq=False)
class PlanetaryStage:
    """Components of a planetary stage.

    Parameters
    ----------
    model : RexsModel
        The file.
    stage, sun, ring : Component
        The stage and its central gears.
    sun_shaft, ring_shaft : Component or None
        Shafts that carry them.
    planets : tuple of Planet
        In the order of their angle about x, from the first of the file.
    carrier : Component or None
        Planet carrier.
    plates : tuple of Component
        Its side plates from upwind.
    carrier_shafts : tuple of Component
        Shafts on its axis from upwind.
    upwind_bearings, downwind_bearings, sun_bearings : tuple of Component
        Bearings between carrier or sun shaft and casing.
    carrier_loads, sun_loads : tuple of Component
        External loads on their shafts.
    axes : ndarray, shape (3, 3)
        Rows x, y, z of this program's frame in the model's frame.
    notes : tuple of str
        What was chosen on the way.
    """

    model: RexsModel
    stage: Component
    sun: Component
    ring: Component
    sun_shaft: Component | None
    ring_shaft: Component | None
    planets: tuple[Planet, ...]
    carrier: Component | None
    plates: tuple[Component, ...]
    carrier_shafts: tuple[Component, ...]
    upwind_bearings: tuple[Component, ...]
    downwind_bearings: tuple[Component, ...]
    sun_bearings: tuple[Component, ...]
    carrier_loads: tuple[Component, ...]
    sun_loads: tuple[Component, ...]
    axes: NDArray[np.float64]
    notes: tuple[str, ...]

    def x(self, component: Component | None) -> float | None:
        """Place along the axis [m]; None where the file states none."""
        centre = None if component is None else position(self.model, component)
        return None if centre is None else float(self.axes[0] @ centre)

    def along_x(self, component: Component) -> float:
        """+1 where a component's u axis points along x, -1 where against it."""
        return _along_x(self.model, component, self.axes[0])

    def axes_of(self, component: Component) -> NDArray[np.float64]:
        """Axes u, v, w of a component as rows in the model's frame."""
        placed = placement(self.model, component)
        return np.eye(3) if placed is None else placed[0]

    @property
    def teeth(self) -> tuple[int, int, int]:
        """Teeth of ring, planet and sun.

        Raises
        ------
        ValueError
            Where the file states none of a gear.
        """
        gears = (self.ring, self.planets[0].gear, self.sun)
        numbers = [self.model.number(gear, "number_of_teeth") for gear in gears]
        for gear, number in zip(gears, numbers, strict=True):
            if number is None or number != round(number) or number == 0:
                raise ValueError(
                    f"{self.model.path}: {gear}: number_of_teeth is {number}; expected a whole "
                    "number"
                )
        # Some programs give an internal gear a negative number.
        ring, planet, sun = (abs(round(number or 0.0)) for number in numbers)
        return ring, planet, sun


def planetary_stages(model: RexsModel) -> list[Component]:
    """Planetary stages of a model.

    Raises
    ------
    ValueError
        Where it has none.
    """
    stages = model.of_type("planetary_stage")
    if not stages:
        types = sorted({each.type for each in model.components.values()})
        raise ValueError(
            f"{model.path}: no component planetary_stage; expected one beside "
            f"{', '.join(types[:8]) or 'other components'}"
        )
    return stages


def chosen_stage(model: RexsModel, stage: int | None) -> Component:
    """The planetary stage of a model, or the one that is asked for.

    Raises
    ------
    ValueError
        Where there is none, several and none is asked for, or not that one.
    """
    stages = planetary_stages(model)
    names = ", ".join(f"{each.id} ({each.name})" if each.name else str(each.id) for each in stages)
    if stage is None and len(stages) > 1:
        raise ValueError(
            f"{model.path}: {len(stages)} planetary stages: {names}; choose one by --stage ID"
        )
    for each in stages:
        if stage is None or each.id == stage:
            return each
    raise ValueError(f"--stage is {stage}; {model.path} has the planetary stage {names}")


def planetary_stage(model: RexsModel, stage: Component) -> PlanetaryStage:
    """Components of a simple planetary stage: one sun, one ring, planets that mesh with both.

    Raises
    ------
    ValueError
        Where the stage is another, or has fewer than three or more than eight planets.
    """
    sun, ring, meshes = _gears(model, stage)
    sun_shaft, ring_shaft = (model.assembly_of(gear, "shaft") for gear in (sun, ring))
    carriers = model.parts_of(stage, "planet_carrier")
    if len(carriers) > 1:
        raise ValueError(
            f"{model.path}: {stage} has {len(carriers)} planet carriers: "
            f"{', '.join(str(each.id) for each in carriers)}; expected one"
        )
    carrier = carriers[0] if carriers else None
    members = model.parts_of(carrier, "shaft") if carrier is not None else []
    related = list(model.related("planet_carrier_shaft", "planetary_stage", stage, "shaft"))
    axis = _axis(model, sun_shaft or sun)
    pins = list(model.related("planet_pin", "planetary_stage", stage, "shaft")) or [
        each for each in members if _off_axis(model, each, axis) > _OFF_AXIS
    ]
    known = {pin.id for pin in pins}
    shafts = list({each.id: each for each in [*related, *members] if each.id not in known}.values())
    carrier_loads = [load for shaft in shafts for load in model.parts_of(shaft, "external_load")]
    notes: list[str] = []
    x_axis, z_axis = _frame(model, axis[1], (shafts, sun), notes)
    axes = np.array([x_axis, np.cross(z_axis, x_axis), z_axis])

    def from_upwind(components: Iterable[Component]) -> tuple[Component, ...]:
        return _along(model, components, x_axis)

    plates = from_upwind(model.parts_of(carrier, "side_plate") if carrier is not None else [])
    planets = tuple(
        _planet(model, gear, pair, (pins, plates, axis, x_axis)) for gear, pair in meshes
    )
    on_carrier = {each.id for each in (*shafts, *plates)}
    bearings = from_upwind(_between(model, on_carrier, _casings(model)))
    middle = _middle(model, [*plates] or [planet.gear for planet in planets], x_axis)
    upwind = tuple(each for each in bearings if _x(model, each, x_axis) < middle)
    on_sun, on_ring = (
        {each.id for each in pair if each is not None}
        for pair in ((sun, sun_shaft), (ring, ring_shaft))
    )
    if not _between(model, on_ring, _casings(model), None):
        notes.append(f"no connection of {ring_shaft or ring} to the casing: the ring is fixed here")
    return PlanetaryStage(
        model=model,
        stage=stage,
        sun=sun,
        ring=ring,
        sun_shaft=sun_shaft,
        ring_shaft=ring_shaft,
        planets=_in_order(model, stage, planets, axes, notes),
        carrier=carrier,
        plates=plates,
        carrier_shafts=from_upwind(shafts),
        upwind_bearings=upwind,
        downwind_bearings=tuple(each for each in bearings if each not in upwind),
        sun_bearings=from_upwind(_between(model, on_sun, _casings(model))),
        carrier_loads=tuple(carrier_loads),
        sun_loads=tuple(
            model.parts_of(sun_shaft, "external_load") if sun_shaft is not None else ()
        ),
        axes=axes,
        notes=tuple(notes),
    )


def placement(
    model: RexsModel, component: Component
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Axes u, v, w (rows) and origin [m] of a component in the outermost frame; None without one.

    ``v = w × u``; the frame that a component refers to is placed first.
    """
    steps, visited = [], set()
    current: Component | None = component
    while current is not None and current.id not in visited:
        visited.add(current.id)
        support = model.vector(current, "support_vector")
        if support is None:
            break
        u = _unit(model.vector(current, "u_axis_vector"), (1.0, 0.0, 0.0))
        w = _unit(model.vector(current, "w_axis_vector"), (0.0, 0.0, 1.0))
        steps.append((np.array([u, np.cross(w, u), w]), np.array(support)))
        # Programs write the id as 12 or 12.0.
        reference = model.text(current, "reference_component_for_position").removesuffix(".0")
        current = next((c for c in model.components.values() if str(c.id) == reference), None)
    if not steps:
        return None
    axes, origin = np.eye(3), np.zeros(3)
    for local, support in reversed(steps):
        origin = origin + support @ axes
        axes = local @ axes
    return axes, origin


def position(model: RexsModel, component: Component) -> NDArray[np.float64] | None:
    """Origin of a component [m]; None where the file states none."""
    placed = placement(model, component)
    return None if placed is None else placed[1]


def _unit(
    vector: tuple[float, float, float] | None, default: tuple[float, float, float]
) -> NDArray[np.float64]:
    direction = np.array(default if vector is None or not any(vector) else vector)
    return np.asarray(direction / np.linalg.norm(direction))


def _gears(
    model: RexsModel, stage: Component
) -> tuple[Component, Component, list[tuple[Component, tuple[Component, Component]]]]:
    """Sun, ring, and each planet with its meshes with sun and ring."""
    partners: dict[int, dict[int, Component]] = {}
    for mesh in model.parts_of(stage, "cylindrical_stage"):
        pair = [
            gear
            for role in ("gear_1", "gear_2")
            for gear in model.related("stage", "stage", mesh, role)
            if gear.type in _GEARS
        ]
        if len(pair) != 2:
            raise ValueError(
                f"{model.path}: {mesh} joins {len(pair)} gears; expected a relation 'stage' with "
                "gear_1 and gear_2"
            )
        for gear, other in (pair, reversed(pair)):
            partners.setdefault(gear.id, {})[other.id] = mesh
    rings = [number for number in partners if model.components[number].type == "ring_gear"]
    planets = [] if len(rings) != 1 else list(partners[rings[0]])
    suns = {number for planet in planets for number in partners[planet]} - set(rings)
    if len(rings) != 1 or len(suns) != 1 or set(partners) != {*rings, *suns, *planets}:
        raise ValueError(
            f"{model.path}: {stage} has {len(rings)} rings and {len(suns)} suns among "
            f"{len(partners)} gears that mesh; expected one sun, one ring, and planets that mesh "
            "with both"
        )
    (sun,) = suns
    alone = [planet for planet in planets if sun not in partners[planet]]
    if alone or not 3 <= len(planets) <= 8:
        raise ValueError(
            f"{model.path}: {stage} has {len(planets)} planets, {len(alone)} of them without a "
            "mesh with the sun; expected three to eight"
        )
    return (
        model.components[sun],
        model.components[rings[0]],
        [
            (model.components[each], (partners[each][sun], partners[each][rings[0]]))
            for each in planets
        ],
    )


_Axis = tuple[NDArray[np.float64], NDArray[np.float64]]


def _axis(model: RexsModel, central: Component) -> _Axis:
    """A point of the axis and its direction, the u axis of a central component."""
    placed = placement(model, central)
    return (np.zeros(3), np.array([1.0, 0.0, 0.0])) if placed is None else (placed[1], placed[0][0])


def _off_axis(model: RexsModel, component: Component, axis: _Axis) -> float:
    centre = position(model, component)
    return 0.0 if centre is None else float(np.linalg.norm(_across(centre, axis)))


def _across(point: NDArray[np.float64], axis: _Axis) -> NDArray[np.float64]:
    """Part of a place's vector from the axis that is perpendicular to it."""
    arm = point - axis[0]
    return np.asarray(arm - axis[1] * (axis[1] @ arm))


def _frame(
    model: RexsModel,
    u: NDArray[np.float64],
    around: tuple[Sequence[Component], Component],
    notes: list[str],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Directions x and z: x leads away from the carrier's load, z points against the weight."""
    shafts, sun = around
    middle = position(model, sun)
    loaded = [
        float(u @ (placed[1] + (model.number(load, "u_coordinate_on_shaft") or 0.0) * placed[0][0]))
        for shaft in shafts
        for load in model.parts_of(shaft, "external_load")
        if (placed := placement(model, shaft)) is not None
    ]
    x = -u if loaded and middle is not None and loaded[0] > u @ middle else u
    if x is not u:
        notes.append("x leads against the axis u: the carrier's load is on its positive side")
    unit = next(iter(model.of_type("gear_unit")), None)
    weight = [model.number(unit, f"direction_vector_gravity_{axis}") or 0.0 for axis in "uvw"]
    placed = None if unit is None else placement(model, unit)
    down = np.array(weight) @ (np.eye(3) if placed is None else placed[0])
    z = -(down - x * (x @ down))
    if np.linalg.norm(z) < 1e-6:
        notes.append("no direction of the weight across the axis: z is taken along w")
        z = np.array([0.0, 0.0, 1.0]) - x * x[2]
    if np.linalg.norm(z) < 1e-6:
        z = np.array([0.0, 1.0, 0.0]) - x * x[1]
    return x, z / np.linalg.norm(z)


def _x(model: RexsModel, component: Component, x: NDArray[np.float64]) -> float:
    centre = position(model, component)
    return 0.0 if centre is None else float(x @ centre)


def _along(
    model: RexsModel, components: Iterable[Component], x: NDArray[np.float64]
) -> tuple[Component, ...]:
    return tuple(sorted(components, key=lambda each: _x(model, each, x)))


def _middle(model: RexsModel, components: Sequence[Component], x: NDArray[np.float64]) -> float:
    """Middle of the plates, or of what stands between them [m]."""
    ends = []
    for each in components:
        first = _x(model, each, x)
        ends += [first, first + (model.number(each, "length") or 0.0) * _along_x(model, each, x)]
    return 0.5 * (min(ends) + max(ends))


def _along_x(model: RexsModel, component: Component, x: NDArray[np.float64]) -> float:
    """+1 where a component's u axis points along x, -1 where against it."""
    placed = placement(model, component)
    return 1.0 if placed is None else float(np.sign(placed[0][0] @ x) or 1.0)


def _casings(model: RexsModel) -> set[int]:
    return {each.id for each in model.of_type("gear_casing")}


def _between(
    model: RexsModel,
    first: set[int],
    second: set[int],
    types: tuple[str, ...] | None = _BEARINGS,
) -> list[Component]:
    """Bearings, or connections of any type, with one side on each of two sets of components."""
    between = []
    for relation in model.relations:
        roles = relation.roles
        if relation.type != "side" or not {"inner_part", "outer_part", "assembly"} <= roles.keys():
            continue
        inner, outer = roles["inner_part"], roles["outer_part"]
        connection = model.components[roles["assembly"]]
        sides = (inner in first and outer in second) or (inner in second and outer in first)
        if sides and (types is None or connection.type in types):
            between.append(connection)
    return between


def _planet(
    model: RexsModel,
    gear: Component,
    meshes: tuple[Component, Component],
    around: tuple[list[Component], tuple[Component, ...], _Axis, NDArray[np.float64]],
) -> Planet:
    pins, plates, axis, x = around
    shaft = model.assembly_of(gear, "shaft")
    on_planet = {each.id for each in (gear, shaft) if each is not None}
    on_carrier = {each.id for each in (*pins, *plates)}
    bearings = _along(model, _between(model, on_planet, on_carrier), x)
    on_pins = [
        pin
        for pin in pins
        if _between(model, on_planet, {pin.id}) or _same_axis(model, pin, gear, axis)
    ]
    centre = position(model, gear)
    arm = np.zeros(3) if centre is None else _across(centre, axis)
    length = float(np.linalg.norm(arm))
    return Planet(
        gear,
        shaft,
        on_pins[0] if on_pins else None,
        bearings,
        *meshes,
        radial=arm / length if length > 0.0 else arm,
        radius=length,
    )


def _same_axis(model: RexsModel, pin: Component, gear: Component, axis: _Axis) -> bool:
    first, second = position(model, pin), position(model, gear)
    if first is None or second is None:
        return False
    return bool(np.linalg.norm(_across(first, axis) - _across(second, axis)) < _OFF_AXIS)


def _in_order(
    model: RexsModel,
    stage: Component,
    planets: tuple[Planet, ...],
    axes: NDArray[np.float64],
    notes: list[str],
) -> tuple[Planet, ...]:
    """Planets by their angle about x from the first; without places in the file's order."""
    if not all(planet.radial.any() for planet in planets):
        notes.append("planets without places: they are taken in the file's order, in equal steps")
        return planets
    # Angles count from z to -y.
    angles = np.array(
        [np.arctan2(-axes[1] @ planet.radial, axes[2] @ planet.radial) for planet in planets]
    )
    angles = (angles - angles[0] + 1e-6) % (2.0 * np.pi)
    order = np.argsort(angles)
    steps = 2.0 * np.pi / len(planets) * np.arange(len(planets))
    if np.abs(angles[order] - steps).max() > _UNEVEN:
        notes.append(f"{stage}: planets not at equal steps; the model has them so")
    return tuple(planets[k] for k in order)
