"""Numbers of a stage case from a planetary stage in REXS, beside the dimensions of its carrier."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from carrierflex.simulation.rexs.carrier_dimensions import TABLES, carrier_dimensions
from carrierflex.simulation.rexs.planetary_stage import PlanetaryStage
from carrierflex.simulation.rexs.rexs_model import Component, LoadCase
from carrierflex.simulation.rexs.sourced_numbers import RIGID, How, Numbers, Value
from carrierflex.simulation.stage.stage_cases import StageRun
from carrierflex.simulation.stage.stage_data import GRAVITY, BearingData, StageData
from carrierflex.simulation.stage.statics import SteadyLoad

#: Shipped cases: steps a mesh period, samples a revolution, revolutions.
_STEPS_PER_MESH, _SAMPLES_PER_TURN, _TURNS = 27.0, 271.0, 7.0
#: Mesh stiffness over face width, ISO 6336 [N/m^2], where the file has none: as the shipped one.
_SUN_MESH, _RING_MESH = 15e9, 18e9
#: Steel [kg/m^3].
_STEEL = 7850.0
#: Bending stiffness of a pin in its bore in the shipped cases [N m/rad].
_PIN_FIT = 1e6
#: Speed [1/min] and torque [N m] of the shipped cases.
_SPEED, _TORQUE = 22.1, 360e3
#: Tables that come from the shipped gearbox where the file has nothing of them.
_DEFAULTED = ("mesh", "bearings", "chain", "mounting", "housing")
_CASE_TABLES = ("", "rig", "gear", *_DEFAULTED, "planet", "sun", "ring")


@dataclass(frozen=True)
class StageValues:
    """What a REXS file gives for a stage, complete with defaults."""

    scale: float
    """Centre distance over that of the shipped gearbox."""
    dimensions: tuple[Value, ...]
    """Tables of a parameter file."""
    case: tuple[Value, ...]
    """Keys and tables of a stage case."""
    runs: tuple[StageRun, ...]
    """Load cases."""
    run_sources: tuple[str, ...]
    """Where the torque of each run comes from."""
    notes: tuple[str, ...]
    """What else a user should know."""


def stage_values(stage: PlanetaryStage, unit_of: Callable[[str, str], str]) -> StageValues:
    """Numbers of a parameter file and a stage case.

    Parameters
    ----------
    stage : PlanetaryStage
        Components of the stage.
    unit_of : callable
        SI unit of a key by its table and name; empty for pure numbers.

    Returns
    -------
    StageValues
        Every number with its source.

    Raises
    ------
    ValueError
        Where the file states no centre distance, module or teeth, or a unit or a number is wrong.
    """
    dimensions = carrier_dimensions(stage, unit_of)
    case = Numbers(stage, dimensions.scale, unit_of)
    for value in dimensions.of_tables(("gear",)):
        case.put("gear", value.key, value.number, value.how, value.source)
    _meshes(case)
    _bearings(case)
    _rigid_parts(case, dimensions)
    _pin_fit(case)
    for table in _DEFAULTED:
        case.rest(table)
    runs, sources = _runs(case)
    _times(case, dimensions)
    return StageValues(
        dimensions.scale,
        dimensions.of_tables(TABLES),
        case.of_tables(_CASE_TABLES),
        runs,
        sources,
        (*dimensions.notes, *case.notes),
    )


def _meshes(numbers: Numbers) -> None:
    """Mean stiffness of both meshes, and backlash."""
    planet, model = numbers.stage.planets[0], numbers.model
    for mate, mesh, stiffness in (
        ("sun", planet.sun_mesh, _SUN_MESH),
        ("ring", planet.ring_mesh, _RING_MESH),
    ):
        width = model.number(mesh, "common_face_width")
        where = f"{mesh} common_face_width"
        if width is None:
            gear = numbers.stage.sun if mate == "sun" else planet.gear
            width = model.number(gear, "face_width")
            where = f"{gear} face_width"
        if width is None:
            continue
        key = f"{mate}_stiffness"
        for attribute in (
            "mean_mesh_stiffness_for_transverse_load_iso_6336_2019",
            "mean_mesh_stiffness_for_transverse_load_iso_6336_2006",
            "mesh_stiffness_for_load_distribution_along_face_width",
        ):
            numbers.take("mesh", key, mesh, attribute, times=width)
        rule = f"{stiffness / 1e9:g} N/(mm um) (ISO 6336) x {where}"
        numbers.put("mesh", key, stiffness * width, "default", rule)
    limits = [
        model.number(planet.sun_mesh, f"{end}_normal_backlash") for end in ("minimum", "maximum")
    ]
    if limits[0] is not None and limits[1] is not None:
        source = f"{planet.sun_mesh} minimum_ and maximum_normal_backlash, mean"
        numbers.put("mesh", "backlash", 0.5 * sum(limits), "file", source)  # type: ignore[arg-type]


def _bearings(numbers: Numbers) -> None:
    """Bearings of planets, carrier and sun as springs."""
    stage = numbers.stage
    _group(numbers, stage.planets[0].bearings, "planet")
    for planet in stage.planets[1:]:
        stiff = [
            _stiffness(numbers, each.bearings, "radial_stiffness")
            for each in (stage.planets[0], planet)
        ]
        if stiff[0] != stiff[1]:
            first = stage.planets[0].gear
            numbers.notes.append(f"bearings of {planet.gear} are not those of {first}, which count")
    for side in ("upwind", "downwind"):
        _group(numbers, getattr(stage, f"{side}_bearings"), side)
    axial = _stiffness(
        numbers, (*stage.upwind_bearings, *stage.downwind_bearings), "axial_stiffness"
    )
    if axial is not None:
        _keep(numbers, "carrier_axial", axial, "bearings of the carrier axial_stiffness")
    if stage.upwind_bearings and not stage.downwind_bearings:
        source = "no bearing downwind of the plates"
        for key in ("downwind_radial", "downwind_tilt", "downwind_clearance"):
            numbers.put("bearings", key, 0.0, "file", source)
    if stage.downwind_bearings and not stage.upwind_bearings:
        source = "no bearing upwind of the plates"
        for key in ("upwind_radial", "upwind_tilt", "upwind_clearance"):
            numbers.put("bearings", key, 0.0, "file", source)
    _group(numbers, stage.sun_bearings, "sun")
    if not stage.sun_bearings:
        numbers.notes.append(f"no bearing of {stage.sun_shaft or stage.sun}: the sun floats")


def _group(numbers: Numbers, bearings: tuple[Component, ...], name: str) -> None:
    """Springs of bearings that stand beside each other, joined to one.

    ``k = Σ k_i``, tilt ``Σ k_i (x_i - x)^2 + Σ k_φ,i`` about the mean place of the stiffness.
    """
    if not bearings:
        return
    names = " and ".join(str(bearing) for bearing in bearings)
    is_gear = name in ("planet", "sun")
    axial = _stiffness(numbers, bearings, "axial_stiffness")
    if axial is not None and is_gear:
        _hold(numbers, f"{name}_axial", axial, f"{names} axial_stiffness")
    radial = _stiffness(numbers, bearings, "radial_stiffness")
    if radial is not None:
        _keep(numbers, f"{name}_radial", radial, f"{names} radial_stiffness")
        tilt, source = _tilt(numbers, bearings, names)
        (_hold if is_gear else _keep)(numbers, f"{name}_tilt", tilt, source)
    clearances = [_clearance(numbers, bearing) for bearing in bearings]
    known = [clearance for clearance in clearances if clearance is not None]
    if known:
        # Clearances count across the diameter.
        if min(known) < 0.0:
            numbers.notes.append(f"{names}: preload, a negative clearance, is taken as 0")
        mean = 0.5 * max(0.0, sum(known) / len(known))
        numbers.put("bearings", f"{name}_clearance", mean, "file", f"{names} clearance / 2")


def _stiffness(numbers: Numbers, bearings: Iterable[Component], attribute: str) -> float | None:
    """Sum of a stiffness over bearings [N/m]; None where one of them states none."""
    total = 0.0
    for bearing in bearings:
        if not _carries(numbers, bearing, attribute):
            continue
        stiffness = numbers.model.number(bearing, attribute)
        if stiffness is None:
            return None
        total += stiffness
    return total


def _carries(numbers: Numbers, bearing: Component, attribute: str) -> bool:
    """Whether a bearing takes forces in a direction."""
    if attribute == "axial_stiffness":
        return numbers.model.text(bearing, "axial_force_absorption") != "no_direction"
    return numbers.model.flag(bearing, "radial_force_absorption") is not False


def _tilt(numbers: Numbers, bearings: tuple[Component, ...], names: str) -> tuple[float, str]:
    model, stage = numbers.model, numbers.stage
    tilt = sum(model.number(bearing, "bending_stiffness") or 0.0 for bearing in bearings)
    positions = [stage.x(bearing) for bearing in bearings]
    stiffness = [_stiffness(numbers, (bearing,), "radial_stiffness") or 0.0 for bearing in bearings]
    source = f"{names} bending_stiffness"
    if None not in positions and sum(stiffness) > 0.0:
        pairs = [(k, x) for k, x in zip(stiffness, positions, strict=True) if x is not None]
        # Rigid bearings: what counts of them as rigid, so that a tilt is as stiff as they are.
        most = RIGID * BearingData.planet_radial * numbers.scale
        pairs = [(min(k, most), x) for k, x in pairs]
        total = sum(k for k, _ in pairs)
        middle = sum(k * x for k, x in pairs) / total
        tilt += sum(k * (x - middle) ** 2 for k, x in pairs)
        source += ", radial_stiffness and places"
    return tilt, source


def _keep(numbers: Numbers, key: str, stiffness: float, source: str) -> None:
    """Keep a stiffness of [bearings]."""
    shipped = BearingData.planet_tilt if key.endswith("_tilt") else BearingData.planet_radial
    numbers.take_stiffness("bearings", key, stiffness, shipped, source)


def _hold(numbers: Numbers, key: str, stiffness: float, source: str) -> None:
    """Keep a stiffness without which a gear is free: where there is none, the default holds it."""
    if stiffness > 0.0:
        _keep(numbers, key, stiffness, source)
    else:
        numbers.notes.append(f"{source}: none, the gear would be free; the default of {key} holds")


def _clearance(numbers: Numbers, bearing: Component) -> float | None:
    for attribute in (
        "operating_radial_bearing_clearance",
        "radial_clearance",
        "radial_bearing_clearance",
    ):
        clearance = numbers.model.number(bearing, attribute)
        if clearance is not None:
            return clearance
    return None


def _rigid_parts(numbers: Numbers, dimensions: Numbers) -> None:
    """Masses of planets, sun and ring: rings of the reference diameter and the face width.

    ``m = ρ π/4 (D^2 - d^2) b``, ``J_x = m/8 (D^2 + d^2)``, ``J_y = J_x/2 + m b^2/12``.
    """
    stage, model = numbers.stage, numbers.model
    ring_teeth, planet_teeth, sun_teeth = stage.teeth
    module = dimensions["gear", "module"]
    transverse = module / math.cos(numbers.values["gear", "helix_angle"].number)
    middle = (
        dimensions["carrier", "upwind_plate_thickness"] + 0.5 * dimensions["carrier", "plate_gap"]
    )
    planet = stage.planets[0]
    pin = dimensions["pin", "diameter"]
    sun_width, width = dimensions["gear", "sun_width"], dimensions["gear", "planet_width"]
    bodies = (
        ("planet", planet.gear, planet.shaft, (pin, transverse * planet_teeth), width),
        ("sun", stage.sun, None, (0.0, transverse * sun_teeth), sun_width),
        (
            "ring",
            stage.ring,
            None,
            (transverse * ring_teeth, _ring_outside(stage) or transverse * (ring_teeth + 10)),
            width,
        ),
    )
    for name, gear, shaft, (bore, outside), b in bodies:
        rho = _density(stage, gear) or _STEEL
        masses = [model.number(each, "mass_of_component") for each in (gear, shaft)]
        if masses[0] is not None:
            mass = masses[0] + (masses[1] or 0.0)
            numbers.put(name, "mass", mass, "file", f"{gear} mass_of_component")
        rule = f"ring of {bore:.4g} to {outside:.4g} m, {b:.4g} m wide, {rho:.4g} kg/m^3"
        mass = rho * math.pi / 4.0 * (outside**2 - bore**2) * b
        numbers.put(name, "mass", mass, "derived", rule)
        mass = numbers[name, "mass"]
        polar = mass / 8.0 * (outside**2 + bore**2)
        numbers.put(name, "polar_inertia", polar, "derived", rule)
        across = polar / 2.0 + mass * b**2 / 12.0
        numbers.put(name, "transverse_inertia", across, "derived", rule)
        numbers.put(name, "x", middle, "derived", "middle of the plate gap")


def _ring_outside(stage: PlanetaryStage) -> float | None:
    """Outer diameter of the ring: that of its shaft's widest section [m]."""
    sections = (
        [] if stage.ring_shaft is None else stage.model.parts_of(stage.ring_shaft, "shaft_section")
    )
    diameters = [stage.model.number(section, "outer_diameter_begin") for section in sections]
    return max((diameter for diameter in diameters if diameter is not None), default=None)


def _density(stage: PlanetaryStage, component: Component) -> float | None:
    for material in stage.model.related("reference", "origin", component, "referenced"):
        if material.type == "material":
            return stage.model.number(material, "density")
    return None


def _pin_fit(numbers: Numbers) -> None:
    """Bending stiffness of a pin in its bore: of the coupling between pin and side plate."""
    stage, key = numbers.stage, "pin_fit_stiffness"
    pin = stage.planets[0].pin
    for plate in stage.plates if pin is not None else ():
        for relation in stage.model.relations:
            roles = relation.roles
            pair = {roles.get("inner_part"), roles.get("outer_part")}
            if relation.type != "side" or pair != {plate.id, pin.id if pin else None}:
                continue
            coupling = stage.model.components[roles.get("assembly", plate.id)]
            stiffness = stage.model.number(coupling, "bending_stiffness")
            if stiffness is not None:
                source = f"{coupling} bending_stiffness"
                numbers.take_stiffness("", key, stiffness, BearingData.planet_tilt, source)
    fit, rule = numbers.scaled("", key, _PIN_FIT)
    numbers.put("", key, fit, "default", rule)


def _runs(numbers: Numbers) -> tuple[tuple[StageRun, ...], tuple[str, ...]]:
    """One run for every load case, or for the loads of the components."""
    stage = numbers.stage
    cases: list[tuple[str, LoadCase | None]] = [
        (f"load_case_{case.id}", case) for case in stage.model.load_cases
    ] or [("nominal", None)]
    gravity = _gravity(numbers)
    first_speed, runs, sources = None, [], []
    for name, case in cases:
        speed, speed_source = _speed(numbers, case)
        torque, source = _torque(numbers, case, speed)
        if first_speed is None:
            first_speed = speed
            how: How = "default" if speed_source.startswith("default") else "file"
            numbers.put("", "speed_rpm", abs(speed) * 30.0 / math.pi, how, speed_source)
        elif not math.isclose(speed, first_speed, rel_tol=1e-6):
            rpm = abs(speed) * 30.0 / math.pi
            numbers.notes.append(f"{name} left out: {rpm:.4g} 1/min is not the first one's speed")
            continue
        forces = _forces(numbers, case)
        # Positive torque drives the carrier in the sense of its speed.
        signed = torque * (1.0 if speed >= 0.0 else -1.0)
        runs.append(StageRun(name, name, SteadyLoad(signed, *forces, gravity)))
        sources.append(source)
    largest = max(abs(run.load.torque) for run in runs)
    if largest > 0.0:
        numbers.put("rig", "nominal_torque", largest, "file", "largest torque of the runs")
    else:
        torque, source = numbers.scaled("rig", "nominal_torque", _TORQUE)
        numbers.put("rig", "nominal_torque", torque, "default", source)
        runs = [replace(run, load=replace(run.load, torque=torque)) for run in runs]
        sources = [source] * len(runs)
    return tuple(runs), tuple(sources)


def _gravity(numbers: Numbers) -> float:
    unit = next(iter(numbers.model.of_type("gear_unit")), None)
    if numbers.model.flag(unit, "account_for_gravity") is False:
        numbers.put("", "gravity", 0.0, "file", f"{unit} account_for_gravity")
    numbers.take("", "gravity", unit, "gravitational_acceleration")
    numbers.put("", "gravity", GRAVITY, "default", f"default {GRAVITY:g}")
    return numbers["", "gravity"]


def _speed(numbers: Numbers, case: LoadCase | None) -> tuple[float, str]:
    """Speed of the carrier about x [rad/s]."""
    stage, model = numbers.stage, numbers.model
    for shaft in stage.carrier_shafts:
        speed = model.number(shaft, "rotational_speed", case)
        if speed:
            return speed * stage.along_x(shaft), f"{shaft} rotational_speed"
    if stage.sun_shaft is not None:
        speed = model.number(stage.sun_shaft, "rotational_speed", case)
        if speed:
            ring, _, sun = stage.teeth
            carrier = speed * stage.along_x(stage.sun_shaft) / (1.0 + ring / sun)
            return carrier, f"{stage.sun_shaft} rotational_speed / (1 + z_ring / z_sun)"
    return _SPEED * math.pi / 30.0, f"default {_SPEED:g}"


def _torque(numbers: Numbers, case: LoadCase | None, speed: float) -> tuple[float, str]:
    """Torque on the carrier about x [N m]: stated, or against that of the sun times the ratio."""
    stage, model = numbers.stage, numbers.model
    ring, _, sun = stage.teeth
    ratio = 1.0 + ring / sun
    for loads, shafts, factor in (
        (stage.carrier_loads, stage.carrier_shafts, 1.0),
        (stage.sun_loads, (stage.sun_shaft,), -ratio),
    ):
        shaft = shafts[0] if shafts else None
        sense = 1.0 if shaft is None else stage.along_x(shaft)
        rule = "" if factor == 1.0 else " x -(1 + z_ring / z_sun)"
        for load in loads:
            torque = model.number(load, "torque_around_u_axis", case)
            if torque:
                return torque * sense * factor, f"{load} torque_around_u_axis{rule}"
        for load in loads:
            power = model.number(load, "power", case)
            if power and speed:
                # Power into the shaft that turns at the carrier's speed times its ratio.
                turning = speed if factor == 1.0 else speed * ratio
                return power / turning * factor, f"{load} power / speed{rule}"
    return 0.0, "no torque"


def _forces(numbers: Numbers, case: LoadCase | None) -> tuple[float, float]:
    """Radial force on the carrier's shafts along y and z [N]."""
    stage, model = numbers.stage, numbers.model
    total = [0.0, 0.0]
    for shaft in stage.carrier_shafts:
        axes = stage.axes_of(shaft)
        for load in model.parts_of(shaft, "external_load"):
            force = [model.number(load, f"force_{axis}_direction", case) or 0.0 for axis in "uvw"]
            total = [total[k] + float(stage.axes[k + 1] @ (force @ axes)) for k in (0, 1)]
    return total[0], total[1]


def _times(numbers: Numbers, dimensions: Numbers) -> None:
    """Length, samples and steps of the runs, as many as the shipped cases have."""
    turn = 60.0 / numbers["", "speed_rpm"]
    ring_teeth = numbers.stage.teeth[0]
    put = numbers.put
    put("", "duration", float(f"{_TURNS * turn:.4g}"), "derived", f"{_TURNS:g} revolutions")
    rate = float(f"{_SAMPLES_PER_TURN / turn:.4g}")
    put("", "sample_rate_hz", rate, "derived", f"{_SAMPLES_PER_TURN:g} samples a revolution")
    step = float(f"{turn / (ring_teeth * _STEPS_PER_MESH):.3g}")
    put("", "step", step, "derived", f"{_STEPS_PER_MESH:g} steps a mesh period")
    damping = StageData().damping_ratio
    put("", "damping_ratio", damping, "default", f"default {damping:g}")
    radius = dimensions.values["carrier", "sensor_radius"]
    put("rig", "sensor_radius", radius.number, radius.how, radius.source)
    planets = dimensions.values["carrier", "n_planets"]
    put("rig", "n_planets", planets.number, planets.how, planets.source)
