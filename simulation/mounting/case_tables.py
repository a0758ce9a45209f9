"""What a case file of kind ``mounting`` holds: rig, truth and load histories."""

from typing import Annotated, Literal

from pydantic import Field

from carrierflex.files.toml_values import (
    Count,
    Expected,
    FieldsOf,
    FileStem,
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
from carrierflex.simulation.mounting.effects import MountingParameter
from carrierflex.simulation.mounting.load_history import LoadHistory
from carrierflex.simulation.mounting.parameters import PARAMETERS
from carrierflex.simulation.mounting.rig import MountingRig
from carrierflex.simulation.mounting.rig_keys import RIG_KEYS
from carrierflex.simulation.mounting.table_3 import TABLE_3
from carrierflex.simulation.plan_tables import PlanTable

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


def _truth_key(parameter: MountingParameter) -> Key:
    unit = parameter.unit.removeprefix("-")
    limits = Field(ge=parameter.lower, le=parameter.upper)
    expected = Expected(f"a value from {parameter.lower:g} to {parameter.upper:g} {unit}".rstrip())
    return Key(Annotated[float, limits, expected], parameter.words, unit)


class TruthTable(TomlTable):
    """Parameters of the true mounting; what is left out has the rig's value or no effect."""


_TABLE_3 = Key(
    Annotated[Literal[tuple(TABLE_3)], Expected(f"one of {', '.join(TABLE_3)}")],
    "Column of table 3 of the 2011 paper; constants given here replace its own",
)
_TRUTH = KeysOf(
    {parameter.name: _truth_key(parameter) for parameter in PARAMETERS} | {"table_3": _TABLE_3},
    required=False,
)


class BendingTable(TomlTable):
    """Strain gauges of one section of the main shaft: channels M_y and M_z."""

    section: NotNegative = key("Distance upwind of the main bearing", "m")
    noise_std: NotNegative = key("Standard deviation of the noise of both moments", "N m")


class RunTable(TomlTable):
    """One run."""

    name: FileStem = key("Name of the run, also of its file")
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
    bending: list[BendingTable] = key(
        "Bending moments of the main shaft, from the rig's coupling_mass, coupling_arm and the "
        "radial load",
        default_factory=list,
    )
    plan: PlanTable | None = key("Costs and limits of additions to the campaign", default=None)
