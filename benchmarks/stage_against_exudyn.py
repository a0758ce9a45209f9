"""The stage behind the reference of table 5 against the same mounting built in Exudyn.

    python -m benchmarks.stage_against_exudyn [LOAD_CASE] [SIZE]

Bearings with their clearances, kink, main shaft, bushings, masses and loads are those of the
reference (docs/papers.md); the carrier is rigid in both. Ours is run as the simulations of the
table are, implicit midpoint rule in the carrier frame; Exudyn's in the fixed frame with large
rotations.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.ratio import DIFFERENCE, Quantity, Ratio, at_most
from benchmarks.run import run_alone
from benchmarks.stage_by_exudyn import (
    CarrierBearing,
    RigidMass,
    StageMounting,
    exudyn_stage,
)
from carrierflex.geometry.parameters import DEFAULT_SIZE
from carrierflex.reduction.reduced_model import MassProperties
from carrierflex.simulation.carrier.run_cases import AXIAL
from carrierflex.simulation.stage.stage_body import ShaftData, beam_shaft
from carrierflex.simulation.stage.stage_cases import StageCase
from carrierflex.simulation.stage.stage_data import RigidPart
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.stage_run import simulate_stage
from carrierflex.workflows.simulation.simulate_table_5 import (
    reference_model,
    table_5_bodies,
    table_5_case,
)

QUICK = {"size": 0.06}
#: Turns of each code, the last whole one of which is compared: ours starts in equilibrium,
#: Exudyn's falls onto its bearings, which is over after a turn.
_TURNS, _TURNS_OF_EXUDYN = 1.05, 2.05
#: Of Exudyn [s]; half of it changes the motion by less than a thousandth.
_EXUDYN_STEP = 2e-3
#: Samples of the compared turn.
_SAMPLES = 200

Array = NDArray[np.float64]
_MOTION = Quantity("RMS", "m")


@dataclass(frozen=True, eq=False)
class ComparedMotion:
    """Axial sensors over one turn, without the offset that all share [m].

    Parameters
    ----------
    ours, exudyn : ndarray, shape (n_sensors, n)
        Over equal carrier angles.
    """

    ours: Array
    exudyn: Array

    @property
    def size(self) -> float:
        """RMS of ours [m]."""
        return float(np.std(self.ours))

    @property
    def difference(self) -> float:
        """RMS of ours less Exudyn's [m]."""
        return float(np.std(self.ours - self.exudyn))


def ratios(load_case: str = "LC1", size: float = DEFAULT_SIZE) -> Iterator[Ratio]:
    """RMS of the motion at the axial sensors, and of what the two codes differ by.

    Parameters
    ----------
    load_case
        Load case of the 2012 paper.
    size
        Element edge length [m] of the carrier, which gives its mass.
    """
    case = table_5_case(load_case)
    compared = compared_motion(reference_model(table_5_bodies(size).rigid, case), case)
    name = f"{load_case}, axial sensors over a turn"
    yield Ratio(f"{name}, ours", _MOTION, compared.size)
    yield Ratio(f"{name}, ours less Exudyn's", _MOTION, compared.difference)
    yield Ratio(name, DIFFERENCE, compared.difference / compared.size, wanted=at_most(0.1))


def compared_motion(model: StageModel, case: StageCase) -> ComparedMotion:
    """A turn by both codes.

    Parameters
    ----------
    model : StageModel
        Stage whose carrier is rigid.
    case : StageCase
        Load, speed, step and sensors.
    """
    turn = 2.0 * np.pi / case.speed
    theirs = exudyn_stage(
        mounting_numbers(model, case), duration=_TURNS_OF_EXUDYN * turn, step=_EXUDYN_STEP
    )
    (run,) = case.runs
    pieces = list(
        simulate_stage(
            model,
            run.load,
            case.sensors,
            duration=_TURNS * turn,
            sample_rate=case.sample_rate,
            step=case.step,
        )
    )
    sensors = [sensor for sensor in case.sensors if sensor.quantity == AXIAL]
    angle = np.concatenate([piece.record.c[:, 0] for piece in pieces])
    ours = [np.concatenate([piece.signals[sensor.name] for piece in pieces]) for sensor in sensors]
    other = [theirs.axial_signal(sensor.angle, sensor.radius) for sensor in sensors]
    return ComparedMotion(_last_turn(angle, ours), _last_turn(theirs.carrier_angle, other))


def _last_turn(angle: Array, signals: list[Array]) -> Array:
    """Signals at equal carrier angles from 0 over the last whole turn, less their common mean."""
    n_before = np.floor(angle[-1] / (2.0 * np.pi)) - 1.0
    wanted = 2.0 * np.pi * (n_before + np.arange(_SAMPLES) / _SAMPLES)
    turned = np.array([np.interp(wanted, angle, signal) for signal in signals])
    return np.asarray(turned - turned.mean())


def mounting_numbers(model: StageModel, case: StageCase) -> StageMounting:
    """Numbers of a stage for the model in Exudyn.

    Half the shaft's mass stands a sixth of its length from either end: the weight's forces and
    moments on the ends of a beam. The sun hangs in its meshes: planets roll between it and the
    ring, so that it moves twice as the carrier less once as the ring, and its weight acts so.
    """
    data, body = model.data, model.layout.body.model
    seats = {name: float(point[0]) for name, point in body.pilots.items()}
    joint, main = seats["carrier_joint"], seats["main_bearing_seat"]
    shaft = beam_shaft(ShaftData(), np.array([joint, 0.0, 0.0]))
    half, sixth = 0.5 * shaft.mass_properties.mass, (joint - main) / 6.0
    polar = 0.5 * float(shaft.mass_properties.inertia[0, 0])
    carrier = _carrier_mass(body.mass_properties, shaft.mass_properties)
    planets, sun = [_rigid_mass(data.planet)] * 3, _rigid_mass(data.sun)
    mounting, bearings = data.mounting, data.bearings
    coupling = RigidMass(
        mounting.coupling_mass, main - mounting.coupling_arm, mounting.rotor_inertia, 0.0
    )
    (run,) = case.runs
    return StageMounting(
        shaft=(RigidMass(half, main + sixth, polar, 0.0), coupling),
        carrier=(RigidMass(half, joint - sixth, polar, 0.0), carrier, *planets, sun, sun),
        housing=(
            _rigid_mass(data.housing),
            _rigid_mass(data.ring),
            replace(sun, mass=-sun.mass, polar=0.0, transverse=0.0),
        ),
        main_bearing_x=main,
        joint_x=joint,
        shaft_stiffness=shaft.K[6:, 6:],
        kink=model.effects.misalignment,
        main_bearing=np.array([bearings.main_axial, bearings.main_radial, bearings.main_radial]),
        bearings=(
            CarrierBearing(
                seats["upwind_seat"],
                bearings.carrier_axial,
                bearings.upwind_radial,
                bearings.upwind_clearance,
            ),
            CarrierBearing(
                seats["downwind_seat"], 0.0, bearings.downwind_radial, bearings.downwind_clearance
            ),
        ),
        bushing=np.array([mounting.axial_stiffness, *2 * [mounting.radial_stiffness]]),
        bushing_damping=np.array([mounting.axial_damping, *2 * [mounting.radial_damping]]),
        bushing_x=mounting.x,
        bushing_arm=mounting.arm,
        torque=run.load.torque,
        reaction=run.load.torque * (1.0 - 1.0 / data.ratio),
        radial_load=run.load.ntl_z,
        radial_load_x=main - mounting.ntl_arm,
        speed=case.speed,
    )


def _rigid_mass(body: RigidPart) -> RigidMass:
    return RigidMass(body.mass, body.x, body.polar_inertia, body.transverse_inertia)


def _carrier_mass(joined: MassProperties, shaft: MassProperties) -> RigidMass:
    """Carrier and pins: the joined body less its shaft, inertia by Steiner's theorem."""
    mass = joined.mass - shaft.mass
    first = joined.mass * joined.centre[0] - shaft.mass * shaft.centre[0]
    centre = float(first) / mass
    across = (
        joined.inertia[1, 1]
        + joined.mass * (joined.centre[0] - centre) ** 2
        - shaft.inertia[1, 1]
        - shaft.mass * (shaft.centre[0] - centre) ** 2
    )
    polar = joined.inertia[0, 0] - shaft.inertia[0, 0]
    return RigidMass(mass, centre, float(polar), float(across))


if __name__ == "__main__":
    run_alone(ratios)
