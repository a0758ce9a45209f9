"""Stages that could stand behind a record: what no sensor reads is drawn within its range.

Pin fit, supports, clearances, positions of the pins, meshes, mounting, weight. Each drawn stage is
solved in static equilibrium over a turn, under a known and under a drawn load, so that readings,
forces on the rotating body and loads of its pins belong together.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.reduction.pin_joints import carrier_with_pins
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader, sensor_signals
from carrierflex.simulation.stage.stage_body import (
    RIM_AXIAL,
    RIM_RADIAL,
    ShaftData,
    StageBody,
    beam_shaft,
    joined_to_shaft,
)
from carrierflex.simulation.stage.stage_data import StageData
from carrierflex.simulation.stage.stage_model import StageModel, stage_model
from carrierflex.simulation.stage.statics import NotConvergedError, SteadyLoad

Array = NDArray[np.float64]

#: Carrier angles of a turn: orders 0 to 5, and half of order 6.
TURN_ANGLES = 12
#: Loads of a pin, in this order: forces of the planet on it [N], against the rotation and away from
#: the axis; moments about the directions of growing angle and away from the axis [N m].
PIN_LOADS = ("tangential", "radial", "moment_tangential", "moment_radial")
#: Shares of the nominal torque, and the largest rotor moment [N m], that loads are drawn from: the
#: range of the rig (NREL/TP-5000-66594), a little widened.
TORQUE_SHARES, LARGEST_MOMENT = (0.15, 1.2), 320e3
#: Pilot whose motion is the rigid one: the carrier's seat at its joint with the main shaft.
_HELD = "upwind_seat"


@dataclass(frozen=True)
class HiddenRange:
    """Range of a quantity that no sensor reads.

    Parameters
    ----------
    lower, upper : float
        Range.
    logarithmic : bool
        Whether draws are even in its logarithm.
    words : str
        Unit, and source of the range.

    Raises
    ------
    ValueError
        Where the range is empty, or a logarithmic one is not positive.
    """

    lower: float
    upper: float
    logarithmic: bool
    words: str

    def __post_init__(self) -> None:
        if not self.lower < self.upper or (self.logarithmic and not self.lower > 0.0):
            raise ValueError(
                f"range {self.lower} to {self.upper}; expected lower < upper, both positive where "
                "the logarithm is even"
            )

    def at(self, share: float) -> float:
        """Value at a share of the range, 0 to 1."""
        if self.logarithmic:
            return float(self.lower * (self.upper / self.lower) ** share)
        return self.lower + (self.upper - self.lower) * share


_DERIVED = "over the derived value; chosen"
#: Ranges by quantity. The first two decide what the sensors read per load.
HIDDEN: Mapping[str, HiddenRange] = {
    "pin_fit": HiddenRange(
        3e6, 1e8, True, "N m/rad each interface: nearly free pins to six peaks (reduction.md)"
    ),
    "elasticity": HiddenRange(
        0.9, 1.1, True, "stiffness of the carrier over the body's: grade of iron, mesh"
    ),
    "planet_bearings": HiddenRange(0.5, 2.0, True, f"stiffness {_DERIVED}"),
    "upwind_bearing": HiddenRange(0.5, 2.0, True, f"stiffness {_DERIVED}"),
    "downwind_bearing": HiddenRange(0.5, 2.0, True, f"stiffness {_DERIVED}"),
    "main_bearing": HiddenRange(0.5, 2.0, True, f"stiffness {_DERIVED}"),
    "sun_radial": HiddenRange(1e6, 3e9, True, "N/m, slender to shortest quill (stage_model.md)"),
    "sun_friction": HiddenRange(0.0, 0.15, False, "of the spline: none to lubricated steel"),
    "sun_clearance": HiddenRange(0.0, 0.3e-3, False, "m, radial, of the spline; chosen"),
    "upwind_clearance": HiddenRange(
        0.0, 0.25e-3, False, "m, radial: 0 to 0.5 mm of diameter, published 0.275 mm"
    ),
    "downwind_clearance": HiddenRange(
        0.0, 0.25e-3, False, "m, radial: 0 to 0.5 mm of diameter, published 0.245 mm"
    ),
    "planet_clearance": HiddenRange(0.0, 60e-6, False, "m, radial: usual of the size"),
    "sun_meshes": HiddenRange(0.7, 1.4, True, f"stiffness {_DERIVED}"),
    "ring_meshes": HiddenRange(0.7, 1.4, True, f"stiffness {_DERIVED}"),
    "mounting_radial": HiddenRange(14e6, 40e6, True, "N/m each bushing: 2011 paper, table 3"),
    "mounting_axial": HiddenRange(0.5e6, 20.2e6, True, "N/m each bushing (papers.md)"),
    "mounting_tilt": HiddenRange(1e4, 8e5, True, "N m/rad each bushing (papers.md)"),
    "mounting_x": HiddenRange(-0.05, 0.5, False, "m, place of the bushings; chosen"),
    "coupling_mass": HiddenRange(3700.0, 4500.0, False, "kg: 2011 paper's 4100, 10 %"),
    "kink_y": HiddenRange(-1e-3, 1e-3, False, "rad, carrier on shaft: 2012 paper, table 5"),
    "kink_z": HiddenRange(-1e-3, 1e-3, False, "rad, carrier on shaft: 2012 paper, table 5"),
}
#: Place of each pin along growing angle.
PIN_OFFSET = HiddenRange(-30e-6, 30e-6, False, "m: three times the drawing's tolerance")


@dataclass(frozen=True, eq=False)
class HiddenStage:
    """One drawn stage.

    Parameters
    ----------
    values : mapping of str to float
        Values of :data:`HIDDEN`.
    pin_offset : tuple of float
        Places of the pins [m].
    """

    values: Mapping[str, float]
    pin_offset: tuple[float, ...]

    def model(self, bodies: "Bodies") -> StageModel:
        """Equations of the stage."""
        of, data = self.values, bodies.data
        bearings, mesh = data.bearings, data.mesh
        same: tuple[str, ...] = ("sun_radial", "sun_friction", "sun_clearance")
        same += ("upwind_clearance", "downwind_clearance", "planet_clearance")
        data = replace(
            data,
            bearings=replace(
                bearings,
                planet_radial=bearings.planet_radial * of["planet_bearings"],
                planet_tilt=bearings.planet_tilt * of["planet_bearings"],
                upwind_radial=bearings.upwind_radial * of["upwind_bearing"],
                downwind_radial=bearings.downwind_radial * of["downwind_bearing"],
                main_radial=bearings.main_radial * of["main_bearing"],
                **{name: of[name] for name in same},
            ),
            mesh=replace(
                mesh,
                sun_stiffness=mesh.sun_stiffness * of["sun_meshes"],
                ring_stiffness=mesh.ring_stiffness * of["ring_meshes"],
                n_slices=2,  # teeth resist tilt
            ),
            mounting=replace(
                data.mounting,
                radial_stiffness=of["mounting_radial"],
                axial_stiffness=of["mounting_axial"],
                tilt_stiffness=of["mounting_tilt"],
                x=of["mounting_x"],
                coupling_mass=of["coupling_mass"],
            ),
            planet_rollers=None,
        )
        effects = StageEffects(
            phi_PLC=float(np.hypot(of["kink_y"], of["kink_z"])),
            theta_PLC=float(np.arctan2(of["kink_z"], of["kink_y"])),
            pin_offset=self.pin_offset,
        )
        body = bodies.body(of["pin_fit"], of["elasticity"])
        return stage_model(body, data, effects=effects, speed=0.0)


@dataclass(frozen=True, eq=False)
class Bodies:
    """What is known of a stage: its reduced bodies and the data that no range changes.

    Parameters
    ----------
    carrier, pin : ReducedModel
        Carrier without pins, and pin 1.
    data : StageData
        Bearings, gears, mounting.
    n_planets : int
        Planets.
    """

    carrier: ReducedModel
    pin: ReducedModel
    data: StageData
    n_planets: int = 3

    def body(self, pin_fit: float, elasticity: float) -> StageBody:
        """Carrier with pins on its main shaft.

        Parameters
        ----------
        pin_fit : float
            Bending stiffness of each pin interface [N m/rad].
        elasticity : float
            Stiffness of the carrier over that of the reduced body.
        """
        stiff = replace(self.carrier, K=elasticity * self.carrier.K)
        pinned = carrier_with_pins(stiff, self.pin, pin_fit)
        return joined_to_shaft(pinned, beam_shaft(ShaftData(), pinned.pilots["shaft_face"]))


def stage_at(shares: Array) -> HiddenStage:
    """Stage at shares of the ranges, 0 to 1: those of :data:`HIDDEN`, then of every pin's place."""
    values = {
        name: hidden.at(float(share))
        for share, (name, hidden) in zip(shares, HIDDEN.items(), strict=False)
    }
    return HiddenStage(values, tuple(PIN_OFFSET.at(float(u)) for u in shares[len(HIDDEN) :]))


def drawn_stage(rng: np.random.Generator, n_planets: int) -> HiddenStage:
    """Draw a stage, every quantity within its range."""
    return stage_at(rng.random(len(HIDDEN) + n_planets))


def load_of(load: Array, arm: float) -> SteadyLoad:
    """Steady load of a torque and a rotor moment, made by a radial force upwind.

    ``(-arm, 0, 0) x (0, F_y, F_z) = (0, arm F_z, -arm F_y)``.

    Parameters
    ----------
    load : ndarray, shape (3,)
        Torque, rotor moment about y and z [N m].
    arm : float
        Distance of the force upwind of the main bearing [m].
    """
    torque, moment_y, moment_z = (float(value) for value in load)
    return SteadyLoad(torque, ntl_y=-moment_z / arm, ntl_z=moment_y / arm)


def drawn_load(rng: np.random.Generator, nominal_torque: float) -> Array:
    """Torque and rotor moment about y and z [N m], shape (3,), even over their ranges."""
    torque = nominal_torque * rng.uniform(*TORQUE_SHARES)
    size = LARGEST_MOMENT * np.sqrt(rng.random())
    angle = rng.uniform(0.0, 2.0 * np.pi)
    return np.array([torque, size * np.cos(angle), size * np.sin(angle)])


@dataclass(frozen=True, eq=False)
class LoadedTurn:
    """A turn of a stage under one load.

    Parameters
    ----------
    readings : ndarray, shape (n_sensors, n_angles)
        What the sensors read [m].
    pins : ndarray, shape (n_planets, 4, n_angles)
        Loads of the pins, as `PIN_LOADS`.
    forces : ndarray, shape (n_angles, n_forces)
        Forces on the pilots of the rotating body but the held one [N, N m].
    """

    readings: Array
    pins: Array
    forces: Array


def loaded_turn(
    model: StageModel,
    load: SteadyLoad,
    sensors: Sequence[Sensor],
    *,
    effects: ReadingEffects | None = None,
    n_angles: int = TURN_ANGLES,
) -> LoadedTurn:
    """Readings, pin loads and forces over one turn at equal carrier angles, in equilibrium.

    Raises
    ------
    NotConvergedError
        Where the contact iteration does not settle.
    """
    record = quasi_static_turn(model, load, n_angles)
    signals = sensor_signals(model, record, sensors, effects=effects, reader=rim_reader(model))
    loads = part_loads(model, record.c)
    force, moment = loads.pin_force, loads.pin_moment
    pins = np.stack([-force[:, :, 2], force[:, :, 1], moment[:, :, 2], moment[:, :, 1]], axis=2)
    body = model.layout.body
    q = record.c[:, 1:] @ model.L[: body.model.n_coordinates, 1:].T
    forces = q @ body.model.K - body.misalignment_load @ model.effects.misalignment
    return LoadedTurn(
        np.array([signals[sensor.name] for sensor in sensors]),
        pins.transpose(1, 2, 0),
        forces[:, _loaded_coordinates(body)],
    )


def _loaded_coordinates(body: StageBody) -> NDArray[np.int64]:
    pilots = (*body.planet_pilots, "downwind_seat", "main_bearing_seat")
    return np.concatenate([body.model.coordinates_of(pilot) for pilot in pilots])


def reading_per_force(body: StageBody, sensors: Sequence[Sensor], n_angles: int) -> Array:
    """What sensors read per unit force on the body's pilots, the held one at rest.

    From the recovery rows: ``A = S K^-1`` at the rim's material point ``phi = v - theta`` under
    each sensor.

    Returns
    -------
    ndarray, shape (n_sensors, n_angles, n_forces)
        [m/N, m/N m].
    """
    model, loaded = body.model, _loaded_coordinates(body)
    free = np.setdiff1d(np.arange(model.n_coordinates), model.coordinates_of(_HELD))
    unit = (free[:, None] == loaded[None, :]).astype(np.float64)
    motion = np.zeros((model.n_coordinates, len(loaded)))
    motion[free] = np.linalg.solve(model.K[np.ix_(free, free)], unit)
    theta, A = 2.0 * np.pi * np.arange(n_angles) / n_angles, []
    for sensor in sensors:
        prefix = RIM_AXIAL if sensor.quantity == AXIAL else RIM_RADIAL
        rows = [i for i, name in enumerate(model.sensor_names) if name.startswith(prefix)]
        rim = model.sensor_rows[rows] @ motion
        place = (sensor.angle - theta) % (2.0 * np.pi) / (2.0 * np.pi) * len(rim)
        before = np.floor(place).astype(np.int64)
        share = (place - before)[:, None]
        A.append((1.0 - share) * rim[before % len(rim)] + share * rim[(before + 1) % len(rim)])
    return np.array(A)


@dataclass(frozen=True, eq=False)
class StageEnsemble:
    """N drawn stages, each under the known load and under a drawn one.

    Parameters
    ----------
    loads : ndarray, shape (N, 2, 3)
        Torque, rotor moment about y and z [N m]: the known load, then the drawn one.
    rest : ndarray, shape (N, 2, n_sensors, n_angles)
        Readings less what the recovery rows make of the forces: rigid motion, weight, kink [m].
    forces : ndarray, shape (N, 2, n_angles, n_forces)
        Forces on the rotating body [N, N m].
    pins : ndarray, shape (N, 2, n_planets, 4, n_angles)
        Loads of the pins, as `PIN_LOADS`.
    n_failed : int
        Draws whose equilibrium was not reached; they are left out.
    n_copies : int
        Copies of every stage, :meth:`with_turned_copies`; they stand copy after copy.
    """

    loads: Array
    rest: Array
    forces: Array
    pins: Array
    n_failed: int
    n_copies: int = 1

    def readings(self, A: Array) -> Array:
        """Readings of bodies of one pin fit, shape (N, 2, n_sensors, n_angles) [m].

        Parameters
        ----------
        A : ndarray
            :func:`reading_per_force` of that body.
        """
        return self.rest + np.einsum("saf,nraf->nrsa", A, self.forces, optimize=True)

    def with_turned_copies(self) -> "StageEnsemble":
        """The same stages with their pins counted from each in turn, copy after copy.

        The body is alike from pin to pin and draws know no pin 1, so that a stage counted from its
        next pin is another draw: its carrier angle is larger by ``2 pi / n``. Where the angles of a
        turn do not meet that step there is the first copy alone.
        """
        n = self.pins.shape[2]
        if TURN_ANGLES % n:
            return self
        step, angle = TURN_ANGLES // n, 2.0 * np.pi / n
        c, s = np.cos(angle), np.sin(angle)
        copies = [self]
        for _ in range(n - 1):
            last = copies[-1]
            forces = np.roll(last.forces, step, axis=2)
            forces = forces.reshape(*forces.shape[:-1], -1, 2, 3)
            forces = np.concatenate(
                [np.roll(forces[..., :n, :, :], -1, axis=-3), forces[..., n:, :, :]], axis=-3
            )
            x, y, z = (forces[..., i] for i in range(3))
            forces = np.stack([x, c * y + s * z, c * z - s * y], axis=-1)
            copies.append(
                StageEnsemble(
                    self.loads,
                    np.roll(last.rest, step, axis=3),
                    forces.reshape(self.forces.shape),
                    np.roll(np.roll(last.pins, -1, axis=2), step, axis=4),
                    self.n_failed,
                )
            )
        return StageEnsemble(
            np.concatenate([copy.loads for copy in copies]),
            np.concatenate([copy.rest for copy in copies]),
            np.concatenate([copy.forces for copy in copies]),
            np.concatenate([copy.pins for copy in copies]),
            self.n_failed,
            n,
        )


def drawn_ensemble(
    bodies: Bodies,
    known: Array,
    sensors: Sequence[Sensor],
    n_draws: int,
    *,
    nominal_torque: float,
    rng: np.random.Generator,
    note: Callable[[str, float], None] = lambda text, share: None,
) -> StageEnsemble:
    """Draw stages and loads, and solve both turns of each.

    Parameters
    ----------
    bodies : Bodies
        What is known of the stage.
    known : ndarray, shape (3,)
        Known torque, rotor moment about y and z [N m].
    sensors : sequence of Sensor
        Sensors.
    n_draws : int
        Number of stages.
    nominal_torque : float
        [N m].
    rng : numpy.random.Generator
        Source of the draws.
    note : callable
        Told the number of stages that are done, and their share.

    Raises
    ------
    ValueError
        Where half of the draws or more reach no equilibrium.
    """
    loads, rest, forces, pins, failed = [], [], [], [], 0
    arm = bodies.data.mounting.ntl_arm
    for number in range(n_draws):
        stage, load = drawn_stage(rng, bodies.n_planets), drawn_load(rng, nominal_torque)
        model = stage.model(bodies)
        try:
            turns = [loaded_turn(model, load_of(of, arm), sensors) for of in (known, load)]
        except NotConvergedError:
            failed += 1
            continue
        A = reading_per_force(model.layout.body, sensors, TURN_ANGLES)
        loads.append([known, load])
        rest.append([t.readings - np.einsum("saf,af->sa", A, t.forces) for t in turns])
        forces.append([turn.forces for turn in turns])
        pins.append([turn.pins for turn in turns])
        note(f"{number + 1} of {n_draws} stages", (number + 1) / n_draws)
    if 2 * failed >= n_draws:
        raise ValueError(
            f"{failed} of {n_draws} drawn stages reach no static equilibrium; expected fewer than "
            "half: check the body with carrierflex certificate, or draw more"
        )
    return StageEnsemble(np.array(loads), np.array(rest), np.array(forces), np.array(pins), failed)
