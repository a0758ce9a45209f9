"""Stages that could stand behind a record: what no sensor reads is drawn within its range.

Pin fit, supports, clearances, positions of the pins, meshes, mounting, weight. Each drawn stage is
solved in static equilibrium over a turn, under a known and under a drawn load, so that readings
and loads of its pins belong together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from carrierflex.reduction.pin_joints import TABLE_4_STIFFNESS, carrier_with_pins
from carrierflex.reduction.reduced_model import ReducedModel
from carrierflex.simulation.carrier.run_cases import Sensor
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.part_loads import part_loads
from carrierflex.simulation.stage.quasi_static import quasi_static_turn
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader, sensor_signals
from carrierflex.simulation.stage.stage_body import (
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
#: What the loads of a stage begin with.
HEAD = ("torque", "moment_y", "moment_z", "load_sharing_factor", "logarithm_of_pin_fit")


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
#: Ranges by quantity.
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

    @property
    def n_hidden(self) -> int:
        """Hidden quantities of a stage: those of :data:`HIDDEN`, and every pin's place."""
        return len(HIDDEN) + self.n_planets

    def body(self, pin_fit: float, elasticity: float) -> StageBody:
        """Carrier with pins on its main shaft.

        Parameters
        ----------
        pin_fit : float
            Bending stiffness of each pin interface [N m/rad].
        elasticity : float
            Stiffness of the carrier over that of the reduced body.
        """
        # Stiffness and load are linear in both: three bodies give all.
        body, elastic, fitted = self._corners
        more, fit = elasticity - 1.0, pin_fit / TABLE_4_STIFFNESS - 1.0

        def at(first: Array, second: Array, third: Array) -> Array:
            return first + more * (second - first) + fit * (third - first)

        K = at(body.model.K, elastic.model.K, fitted.model.K)
        load = at(body.misalignment_load, elastic.misalignment_load, fitted.misalignment_load)
        return replace(body, model=replace(body.model, K=K), misalignment_load=load)

    @cached_property
    def _corners(self) -> tuple[StageBody, StageBody, StageBody]:
        """Body of one elasticity and pin fit, of twice the elasticity, of twice the fit."""
        fit = TABLE_4_STIFFNESS
        return self._joined(fit, 1.0), self._joined(fit, 2.0), self._joined(2.0 * fit, 1.0)

    def _joined(self, pin_fit: float, elasticity: float) -> StageBody:
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
    """

    readings: Array
    pins: Array


def loaded_turn(
    model: StageModel,
    load: SteadyLoad,
    sensors: Sequence[Sensor],
    *,
    effects: ReadingEffects | None = None,
    n_angles: int = TURN_ANGLES,
) -> LoadedTurn:
    """Readings and pin loads over one turn at equal carrier angles, in equilibrium.

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
    return LoadedTurn(
        np.array([signals[sensor.name] for sensor in sensors]), pins.transpose(1, 2, 0)
    )


@dataclass(frozen=True, eq=False)
class StagePair:
    """A stage under the known load and under a hidden one, as function of standard normal numbers.

    Parameters
    ----------
    bodies : Bodies
        What is known of the stage.
    known : ndarray, shape (3,)
        Known torque, rotor moment about y and z [N m].
    sensors : sequence of Sensor
        Sensors.
    nominal_torque : float
        [N m].
    of_known : bool
        The known load alone.
    """

    bodies: Bodies
    known: Array
    sensors: Sequence[Sensor]
    nominal_torque: float
    of_known: bool = False

    @property
    def n_unknowns(self) -> int:
        """Numbers of a stage: its hidden quantities, then torque and moments."""
        return self.bodies.n_hidden + (0 if self.of_known else 3)

    def load(self, z: Array) -> Array:
        """Torque and rotor moment [N m]: even over its range; normal, as wide as drawn ones."""
        if self.of_known:
            return self.known
        torque, moment_y, moment_z = z[self.bodies.n_hidden :]
        lower, upper = TORQUE_SHARES
        share = lower + (upper - lower) * ndtr(torque)
        half = 0.5 * LARGEST_MOMENT
        return np.array([share * self.nominal_torque, half * moment_y, half * moment_z])

    def __call__(self, z: Array) -> tuple[Array, Array] | None:
        """Readings of the turns (n_readings,) [m], and loads (n_loads,): HEAD, then of the pins.

        None where the stage reaches no equilibrium.
        """
        stage, load = stage_at(ndtr(z[: self.bodies.n_hidden])), self.load(z)
        model, arm = stage.model(self.bodies), self.bodies.data.mounting.ntl_arm
        loads = [load] if self.of_known else [self.known, load]
        try:
            turns = [loaded_turn(model, load_of(of, arm), self.sensors) for of in loads]
        except NotConvergedError:
            return None
        pins = turns[-1].pins
        share = (pins[:, 0] / pins[:, 0].sum(axis=0)).max() * len(pins)
        head = [*load, share, np.log(stage.values["pin_fit"])]
        return np.concatenate([turn.readings.ravel() for turn in turns]), np.append(head, pins)

    def each(self, Z: Array) -> list[tuple[Array, Array] | None]:
        """Answers to the rows of Z."""
        return [self(z) for z in Z]
