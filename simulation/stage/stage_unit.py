"""The planetary stage with its reduced bodies as a co-simulation unit.

The unit's C code (``stage_unit.c``) takes the steps of :mod:`carrierflex.simulation.stage.response`
in the modes of :mod:`carrierflex.simulation.stage.modal_form`, all with inertia: flexible
bodies, meshes that vary with the angle and part from each other, clearances, roller bearings, the
sun's spline, mount and weight are inside.
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.run_cases import AXIAL, Sensor
from carrierflex.simulation.fmi.functional_mockup import (
    MODAL_UNIT,
    UnitModel,
    Variable,
    coordinate_states,
)
from carrierflex.simulation.sensing import SensorError
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.modal_form import modal_stage, step_matrices
from carrierflex.simulation.stage.quasi_static import rest_readings
from carrierflex.simulation.stage.readings import ReadingEffects, rim_reader
from carrierflex.simulation.stage.response import (
    quasi_static_start,
    steady_drive,
    steps_per_sample,
)
from carrierflex.simulation.stage.stage_model import StageModel
from carrierflex.simulation.stage.statics import SteadyLoad

Array = NDArray[np.float64]

#: What the unit's sensors know of the effects between motion and record, beside the noise.
_READ = ("sensors", "reference", "noise_std", "theta_H", "theta_face")
_SHAFTS = (
    Variable("carrier_angle", "rad", "Angle of the carrier from pin 1 up, about x"),
    Variable("carrier_speed", "rad/s", "Speed of the carrier about x"),
    Variable("generator_speed", "rad/s", "Speed of the generator about x"),
    Variable("generator_torque", "N.m", "Torque on the generator about x"),
)


def refuse_effects(inside: StageEffects, reading: ReadingEffects) -> None:
    """Refuse effects between motion and record that the unit does not hold.

    Raises
    ------
    ValueError
        Where there is one; the message names it.
    """
    nominal = ReadingEffects()
    changed = [
        f"[reading] {field.name}"
        for field in fields(reading)
        if field.name not in _READ
        and (getattr(reading, field.name) or None) != (getattr(nominal, field.name) or None)
    ]
    changed += [
        f"[effects] {name}"
        for name in ("ring_pass_offset", "ring_pass_tilt")
        if any(getattr(inside, name))
    ]
    if changed:
        raise ValueError(
            f"{', '.join(changed)}: not inside a unit, whose sensors read the motion with gain, "
            "angle and zero; leave out in a copy of the case and add in the importing tool"
        )


def stage_unit(
    model: StageModel,
    load: SteadyLoad,
    sensors: Sequence[Sensor],
    *,
    step: float,
    effects: ReadingEffects | None = None,
    rest_angle: float | None = None,
) -> UnitModel:
    """The stage that begins in the quasi-static answer to a load, ready to be written as a unit.

    Parameters
    ----------
    model : StageModel
        The stage.
    load : SteadyLoad
        Load that it begins under; its inputs' values at the start.
    sensors : sequence of Sensor
        Sensors to read.
    step : float
        Largest step that the unit takes [s].
    effects : ReadingEffects, optional
        Gains, angles and zeros of the sensors and what they are mounted on; noise is left out.
    rest_angle : float, optional
        Count every signal from its reading at rest at this carrier angle [rad].

    Returns
    -------
    UnitModel
        Inputs torque, the generator's set speed, ntl_y, ntl_z; outputs angle, speeds and torque of
        the shafts and the sensors.

    Raises
    ------
    ValueError
        Where the step does not resolve the mesh frequency, or an effect between motion and record
        is not inside the unit.
    """
    effects = effects or ReadingEffects()
    refuse_effects(model.effects, effects)
    steps_per_sample(model.speed, model.channels.mesh_teeth, sample_rate=1.0 / step, step=step)
    stage = modal_stage(model)
    c, c_rate = quasi_static_start(model, load)
    to_modes = stage.Phi.T @ model.M
    torque, wanted, ntl_y, ntl_z = steady_drive(model, load)(np.zeros(1))[0].tolist()
    constant = model.data.chain.generator_constant
    k = step_matrices(stage, step, load.gravity)
    data: dict[str, int | float | Array] = {
        "N_M": len(stage.omega),
        "N_CH": len(k.B),
        "N_FLANKS": len(k.gaps),
        "N_MESHES": len(k.real),
        "N_HARMONICS": k.real.shape[1],
        "N_TURNING": len(model.channels.K_fixed),
        "N_LOOSE": len(k.clearance),
        "N_ROLLING": len(k.rollers.directions),
        "N_ROLLERS": k.rollers.directions.shape[1],
        "N_SLICES": len(k.rollers.x),
        "N_SPLINES": len(k.splines),
        "N_SENSORS": len(sensors),
        "LARGEST_STEP": float(step),
        "SPEED": float(model.speed),
        "MESH_TEETH": float(k.mesh_teeth),
        "GRAVITY": float(k.gravity),
        "GENERATOR": float(constant),
        "CAGE": float(k.rollers.cage),
        "OMEGA_2": k.stiffness,
        "D": stage.D,
        "B": k.B,
        "FREE": model.channels.free,
        "P": k.P,
        "REFERENCE": k.reference,
        "REAL": k.real,
        "IMAG": k.imag,
        "GAPS": k.gaps,
        "SHARES": k.shares,
        "CLEARANCE": k.clearance,
        "DIRECTIONS": k.rollers.directions,
        "SLICE_X": k.rollers.x,
        "SLICE_STIFFNESS": k.rollers.stiffness,
        "SLICE_GAP": k.rollers.gap,
        "SPLINES": k.splines,
        "K_FIXED": model.channels.K_fixed,
        "C_FIXED": model.channels.C_fixed,
        "K_MEAN": model.channels.K_mean,
        "C_MEAN": k.C_mean,
        "Q_0": to_modes @ c,
        "V_0": to_modes @ c_rate,
        "ANGLE": stage.Phi[0],
        **_readings(model, sensors, effects, stage.Phi, rest_angle, load.gravity),
    }
    motions = [coordinate_states(_mode(i, omega)) for i, omega in enumerate(stage.omega)]
    positions, velocities = zip(*motions, strict=True)
    moves, turns = (tuple(s.variable.name for s in group) for group in (positions, velocities))
    return UnitModel(
        identifier="carrierflex_stage",
        title="carrierflex planetary stage",
        description="Planetary gear stage with flexible carrier, pins and main shaft, in the "
        f"quasi-static answer to {load.torque:g} N m at the start",
        inputs=(
            Variable("torque", "N.m", "Torque on the main shaft about x", torque),
            Variable(
                "generator_speed_set",
                "rad/s",
                "Set speed of the generator: its torque about x is "
                f"{constant:g} N m s times set speed less speed",
                wanted,
            ),
            Variable("ntl_y", "N", "Non-torque load on the main shaft along y", ntl_y),
            Variable("ntl_z", "N", "Non-torque load on the main shaft along z", ntl_z),
        ),
        outputs=(*_SHAFTS, *map(_signal, sensors)),
        states=positions + velocities,
        dependencies={
            "carrier_angle": moves,
            "carrier_speed": turns,
            "generator_speed": turns,
            "generator_torque": ("generator_speed_set", *turns),
            **dict.fromkeys((sensor.name for sensor in sensors), moves),
        },
        source=Path(__file__).with_suffix(".c"),
        data=data,
        memory=2 * len(k.B) + 2,
        step=float(step),
    )


def _mode(i: int, omega: float) -> Variable:
    """Coordinate of normal mode `i` of the linear stage."""
    mode = f"mode of {omega / (2.0 * np.pi):.4g} Hz" if i else "free motion of the drive"
    return Variable(f"mode[{i + 1}]", MODAL_UNIT, f"Coordinate of the {mode}, mass-normalised")


def _signal(sensor: Sensor) -> Variable:
    angle = np.rad2deg(sensor.angle)
    kind = "Axial" if sensor.quantity == AXIAL else "Radial"
    return Variable(
        sensor.name, "m", f"{kind} displacement of the rim at the housing angle {angle:g} deg"
    )


def _readings(
    model: StageModel,
    sensors: Sequence[Sensor],
    effects: ReadingEffects,
    Phi: Array,
    rest_angle: float | None,
    gravity: float,
) -> dict[str, int | float | Array]:
    """Series of the rim, motion of the housing and errors of the sensors, over the modes."""
    reader = rim_reader(model)
    rim = np.stack([reader.radial @ Phi, reader.axial @ Phi])
    tilt = np.stack([reader.misaligned_radial, reader.misaligned_axial])
    errors: Mapping[str, SensorError] = effects.sensors or {}
    sensor_errors = [errors.get(sensor.name, SensorError()) for sensor in sensors]
    at_rest = dict.fromkeys((sensor.name for sensor in sensors), 0.0)
    if rest_angle is not None:
        at_rest |= rest_readings(model, sensors, rest_angle, effects=effects, gravity=gravity)
    return {
        "N_ORDERS": len(reader.orders),
        "ORDERS": reader.orders.astype(np.float64),
        "RIM_RE": rim.real,
        "RIM_IM": rim.imag,
        "TILT_RE": tilt.real,
        "TILT_IM": tilt.imag,
        "HOUSING": model.channels.B[:, model.channels.housing].T @ Phi,
        "HOUSING_X": float(model.data.housing.x),
        "ON_HOUSING": 1.0 if effects.reference == "housing" else 0.0,
        "SENSOR_ANGLE": np.array(
            [s.angle + e.angle for s, e in zip(sensors, sensor_errors, strict=True)]
        ),
        "SENSOR_RADIUS": np.array([sensor.radius for sensor in sensors]),
        "SENSOR_AXIAL": np.array([sensor.quantity == AXIAL for sensor in sensors]).astype(np.intp),
        "SENSOR_GAIN": np.array([1.0 + error.gain for error in sensor_errors]),
        "SENSOR_ZERO": np.array(
            [e.zero - at_rest[s.name] for s, e in zip(sensors, sensor_errors, strict=True)]
        ),
    }
