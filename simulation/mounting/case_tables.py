"""What a case file of kind ``mounting`` holds: rig, truth and load histories."""

from typing import Annotated, Literal

from pydantic import Field

from carrierflex.files.toml_values import (
    Count,
    Expected,
    FieldsOf,
    Key,
    KeysOf,
    NotNegative,
    Number,
    Positive,
    Text,
    TomlTable,
    different,
    key,
)
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameters import PARAMETERS, Parameter
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.rig_keys import RIG_KEYS

_HISTORY = {
    "duration": Key(Number, "Length of the record", "s"),
    "sample_rate": Key(Number, "Samples a second", "1/s"),
    "radial_load_from": Key(Number, "Time at which the radial load begins to grow", "s"),
    "radial_load_to": Key(Number, "Time at which the radial load is reached", "s"),
    "ntl_y": Key(Number, "Radial load reached along y", "N"),
    "ntl_z": Key(Number, "Radial load reached along z", "N"),
    "start": Key(Number, "Time at which the shaft starts", "s"),
    "full_speed": Key(Number, "Time at which the shaft reaches its speed", "s"),
    "stop_from": Key(Number, "Time at which the speed drops in the unplanned stop", "s"),
    "stop_to": Key(Number, "Time at which the speed has risen again", "s"),
    "speed": Key(Number, "Speed reached", "rad/s"),
    "torque_from": Key(Number, "Time at which the torque begins to grow", "s"),
    "torque_rise": Key(Number, "Time that the torque takes to grow", "s"),
    "torque": Key(Number, "Torque reached", "N m"),
    "torque_ripple": Key(Number, "Once-per-revolution part of the torque over its present value"),
    "load_ripple": Key(
        Number,
        "Once-per-revolution part of the radial load over its present value",
    ),
}
_TRUTH_WORDS = {
    "K1": "Linear stiffness of each bushing",
    "C1": "Linear damping of each bushing",
    "K3": "Cubic stiffness of each bushing",
    "K5": "Quintic stiffness of each bushing",
    "C3": "Damping of each bushing that grows with the square of its deflection",
    "k": "Stiffness of the fluid's branch",
    "c": "Damping of the fluid's branch",
    "m": "Mass of the fluid's branch",
    "Kp": "Stiffness of the elasto-plastic friction element",
    "Fy": "Force at which the elasto-plastic friction element slips",
    "P_T": "Torque about x per vertical radial load",
    "k_x": "Axial stiffness of each bushing",
    "c_x": "Axial damping of each bushing",
    "main_bearing_compliance": "Radial compliance of the main bearing",
    "ntl_angle": "Angle by which the radial load is turned",
    "starboard_excess": "Share by which the starboard bushing is stiffer than the mean of both",
    "gravity": "Gravity that loads the bushings; 0 where the weight leaves with the zero",
    "delay": "Time of the displacements behind the carrier angle",
}


def _truth_key(parameter: Parameter) -> Key:
    unit = parameter.unit.removeprefix("-")
    limits = Field(ge=parameter.lower, le=parameter.upper)
    expected = Expected(f"a value from {parameter.lower:g} to {parameter.upper:g} {unit}".rstrip())
    words = _TRUTH_WORDS.get(parameter.name)
    if words is None:
        kind, _, sensor = parameter.name.partition("_")
        words = f"{kind.capitalize()} of the sensor {sensor}"
    return Key(Annotated[float, limits, expected], words, unit)


class TruthTable(TomlTable):
    """Parameters of the true mounting; what is left out has the rig's value or no effect."""


_TRUTH = KeysOf({parameter.name: _truth_key(parameter) for parameter in PARAMETERS}, required=False)


class RunTable(TomlTable):
    """One run."""

    name: Text = key("Name of the run, also of its file")
    condition: Text = key("Free text, equal for repeats")
    history: Annotated[LoadHistory, FieldsOf(_HISTORY)] = key(
        "Loads of the run, after figure 6 of the 2011 paper",
    )


class MountingCaseDocument(TomlTable):
    """Runs on the mounting rig with the true mounting; SI units."""

    format: Literal["carrierflex-case"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    kind: Annotated[Literal["mounting"], Expected("one of mounting")] = key("Kind of the case")
    name: Text = key("Title")
    seed: Count = key("Seed of the random generator for the noise")
    noise_std: NotNegative = key("Standard deviation of the noise of every sensor", "m")
    step: Positive | None = key("Largest step of nonlinear bushings", "s", default=None)
    rig: Annotated[MountingRig, FieldsOf(RIG_KEYS, without=("axial_motion",))] = key("Nominal rig")
    truth: Annotated[TruthTable, _TRUTH] = key("True mounting")
    runs: Annotated[list[RunTable], Field(min_length=1), different("run name")] = key("Runs")
