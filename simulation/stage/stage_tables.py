"""What a stage case holds: runs of the planetary stage, its data, effects, sensors and bodies."""

from typing import Annotated, Literal

from pydantic import Field

from carrierflex.files.toml_values import (
    Count,
    Expected,
    FieldsOf,
    FileStem,
    FourNumbers,
    Harmonics,
    Key,
    NotNegative,
    Number,
    PlanetNumbers,
    PlanetPositive,
    Positive,
    PositiveCount,
    Text,
    ThreeNumbers,
    TomlTable,
    TwoNumbers,
    different,
    key,
)
from carrierflex.geometry.parameter_tables import GEAR_KEYS
from carrierflex.geometry.parameters import GearData
from carrierflex.simulation.carrier.case_tables import RigTable, SensorTable, Share
from carrierflex.simulation.stage.effects import StageEffects
from carrierflex.simulation.stage.stage_data import (
    GRAVITY,
    BearingData,
    ChainData,
    MeshData,
    MountingData,
    RollerBearingData,
    StageData,
)

_Order = Annotated[int, Field(ge=2), Expected("a whole number >= 2, order 1 is a tilt of the face")]


_MESH_KEYS = {
    "sun_stiffness": Key(Positive, "Mean stiffness of a sun mesh along the tooth normal", "N/m"),
    "ring_stiffness": Key(Positive, "Mean stiffness of a ring mesh along the tooth normal", "N/m"),
    "backlash": Key(NotNegative, "Play between the flanks along the normal", "m"),
    "n_harmonics": Key(Harmonics, "Harmonics of the mesh frequency kept in the stiffness"),
    "n_slices": Key(PositiveCount, "Slices of a mesh over its face width; 1: no stiffness to tilt"),
}
_BEARING_KEYS = {
    "planet_radial": Key(NotNegative, "Radial stiffness of a planet's bearings", "N/m"),
    "planet_axial": Key(NotNegative, "Axial stiffness of a planet's bearings", "N/m"),
    "planet_tilt": Key(NotNegative, "Tilting stiffness of a planet's bearings", "N m/rad"),
    "upwind_radial": Key(NotNegative, "Radial stiffness of the carrier's upwind bearing", "N/m"),
    "downwind_radial": Key(
        NotNegative,
        "Radial stiffness of the carrier's downwind bearing",
        "N/m",
    ),
    "upwind_tilt": Key(NotNegative, "Tilting stiffness of the carrier's upwind bearing", "N m/rad"),
    "downwind_tilt": Key(
        NotNegative, "Tilting stiffness of the carrier's downwind bearing", "N m/rad"
    ),
    "upwind_y_factor": Key(
        NotNegative, "Stiffness of the carrier's upwind bearing along y over the one along z"
    ),
    "downwind_y_factor": Key(
        NotNegative, "Stiffness of the carrier's downwind bearing along y over the one along z"
    ),
    "carrier_axial": Key(NotNegative, "Axial stiffness of the carrier's bearings", "N/m"),
    "main_radial": Key(NotNegative, "Radial stiffness of the main bearing", "N/m"),
    "main_axial": Key(NotNegative, "Axial stiffness of the main bearing", "N/m"),
    "sun_radial": Key(NotNegative, "Radial stiffness of the sun's support", "N/m"),
    "sun_friction": Key(
        NotNegative, "Friction coefficient of the sun's spline; 0 for a spline without friction"
    ),
    "spline_radius": Key(Positive, "Radius at which the sun's spline rubs", "m"),
    "sun_clearance": Key(NotNegative, "Radial clearance of the sun's spline", "m"),
    "sun_axial": Key(NotNegative, "Axial stiffness of the sun's support", "N/m"),
    "sun_tilt": Key(NotNegative, "Tilting stiffness of the sun's support", "N m/rad"),
    "ring_to_housing": Key(NotNegative, "Stiffness of the joint between ring and housing", "N/m"),
    "upwind_clearance": Key(NotNegative, "Radial clearance of the carrier's upwind bearing", "m"),
    "downwind_clearance": Key(
        NotNegative,
        "Radial clearance of the carrier's downwind bearing",
        "m",
    ),
    "planet_clearance": Key(NotNegative, "Radial clearance of each planet on its pin", "m"),
}
_CHAIN_KEYS = {
    "sun_shaft_torsion": Key(NotNegative, "Torsional stiffness of the sun shaft", "N m/rad"),
    "low_speed_inertia": Key(NotNegative, "Inertia of the low-speed shaft", "kg m^2"),
    "intermediate_inertia": Key(NotNegative, "Inertia of the intermediate shaft", "kg m^2"),
    "high_speed_inertia": Key(NotNegative, "Inertia of the high-speed shaft", "kg m^2"),
    "generator_inertia": Key(NotNegative, "Inertia of the generator", "kg m^2"),
    "low_base_radius": Key(
        NotNegative,
        "Base radius of the wheel of the first parallel stage",
        "m",
    ),
    "high_base_radius": Key(
        NotNegative,
        "Base radius of the wheel of the second parallel stage",
        "m",
    ),
    "low_stiffness": Key(NotNegative, "Mesh stiffness of the first parallel stage", "N/m"),
    "high_stiffness": Key(NotNegative, "Mesh stiffness of the second parallel stage", "N/m"),
    "coupling_torsion": Key(
        NotNegative,
        "Torsional stiffness of the generator's coupling",
        "N m/rad",
    ),
    "generator_constant": Key(NotNegative, "Torque of the generator per speed", "N m s"),
}
_MOUNTING_KEYS = {
    "arm": Key(NotNegative, "Distance of each bushing from the axis along y", "m"),
    "x": Key(Number, "Axial position of the bushings, downwind of the rim's face", "m"),
    "radial_stiffness": Key(NotNegative, "Stiffness of each bushing in y and z", "N/m"),
    "axial_stiffness": Key(NotNegative, "Stiffness of each bushing in x", "N/m"),
    "tilt_stiffness": Key(
        NotNegative, "Stiffness of each bushing against tilt about y and z", "N m/rad"
    ),
    "radial_damping": Key(NotNegative, "Damping of each bushing in y and z", "N s/m"),
    "axial_damping": Key(NotNegative, "Damping of each bushing in x", "N s/m"),
    "rotor_inertia": Key(NotNegative, "Inertia of the rotor", "kg m^2"),
    "coupling_mass": Key(NotNegative, "Equivalent mass of the dynamometer's coupling", "kg"),
    "coupling_arm": Key(NotNegative, "Distance of the coupling upwind of the main bearing", "m"),
    "ntl_arm": Key(NotNegative, "Distance of the radial load upwind of the main bearing", "m"),
}
_ROLLER_KEYS = {
    "n_rollers": Key(PositiveCount, "Rollers in a row"),
    "n_rows": Key(PositiveCount, "Rows of a planet's bearings"),
    "row_spacing": Key(Positive, "Distance of the rows", "m"),
    "roller_diameter": Key(Positive, "Diameter of the rollers", "m"),
    "roller_length": Key(Positive, "Effective length of the rollers", "m"),
    "pitch_diameter": Key(Positive, "Diameter of the rollers' pitch circle", "m"),
    "n_slices": Key(PositiveCount, "Slices of a roller along its length"),
    "profile": Key(NotNegative, "Factor of the logarithmic profile; 0 for straight rollers"),
    "reference_load": Key(
        Positive,
        "Load of a bearing at which the linear part takes its stiffness",
        "N",
    ),
}


class StageSensorTable(SensorTable):
    """One displacement sensor fixed to the housing, with its errors."""

    gain: Number = key("Relative gain error, positive: it reads too much", default=0.0)
    angle_error_deg: Number = key(
        "Deviation from its stated angle",
        "deg",
        default=0.0,
    )
    zero: Number = key("Zero error", "m", default=0.0)


class StageRunTable(TomlTable):
    """One run."""

    name: FileStem = key("Name of the run, also of its file")
    condition: Text = key("Free text, equal for repeats")
    torque: Number = key("Torque on the main shaft about +x", "N m")
    ntl_y: Number = key("Radial load along y, at `ntl_arm` upwind of the main bearing", "N")
    ntl_z: Number = key("Radial load along z, at `ntl_arm` upwind of the main bearing", "N")


class EffectsTable(TomlTable):
    """What departs from the symmetric, aligned stage; what is left out does not."""

    # Symbols of the paper.
    phi_PLC: Number = key("Tilt of the carrier on the main shaft", "rad", default=0.0)
    theta_PLC_deg: Number = key("Carrier angle of its axis", "deg", default=0.0)
    pin_offset: PlanetNumbers = key(
        "Tangential position error of each pin",
        "m",
        default=StageEffects.pin_offset,
    )
    sun_mesh_factor: PlanetPositive = key(
        "Stiffness of each sun mesh over the nominal one",
        default=StageEffects.sun_mesh_factor,
    )
    ring_mesh_factor: PlanetPositive = key(
        "Stiffness of each ring mesh over the nominal one",
        default=StageEffects.ring_mesh_factor,
    )
    planet_bearing_factor: PlanetPositive = key(
        "Stiffness of each planet bearing over the nominal one",
        default=StageEffects.planet_bearing_factor,
    )
    pin_fit_play: NotNegative = key(
        "Angle by which a pin bends in its bore before it bears on the bore's edges",
        "rad",
        default=0.0,
    )
    pin_fit_closed: Positive = key(
        "Stiffness of each pin interface beyond the play",
        "N m/rad",
        default=StageEffects.pin_fit_closed,
    )
    ring_pass_offset: TwoNumbers = key(
        "Axial motion of the flange per torque, cos and sin of so many times the carrier angle as "
        "there are planets",
        "m/N m",
        default=StageEffects.ring_pass_offset,
    )
    ring_pass_tilt: FourNumbers = key(
        "Tilt of the flange per torque about the housing angles 0 and 90 deg, cos and sin of each",
        "rad/N m",
        default=StageEffects.ring_pass_tilt,
    )


class RunoutTable(TomlTable):
    """One order of the measured face's waviness."""

    order: _Order = key("Waves around the face")
    amplitude: Number = key("Amplitude", "m")
    phase_deg: Number = key("Phase", "deg")


class ReadingTable(TomlTable):
    """Effects between the stage's motion and the record; what is left out is none."""

    reference: Literal["housing", "ground"] = key(
        "What the sensors are mounted on: the housing, which moves, or the ground",
        default="housing",
    )
    axial_offset: Number = key("Axial offset of all axial sensors", "m", default=0.0)
    phi_H: Number = key("Tilt of the housing", "rad", default=0.0)
    theta_H_deg: Number = key("Housing angle of the tilt's axis", "deg", default=0.0)
    phi_face: Number = key("Tilt of the measured face against the carrier", "rad", default=0.0)
    theta_face_deg: Number = key("Carrier-frame angle of that tilt's axis", "deg", default=0.0)
    saddle: ThreeNumbers = key(
        "Static saddle: at no load [m], per torque [m/N m], per vertical radial load [m/N]",
        default=(0.0, 0.0, 0.0),
    )
    runout: Annotated[list[RunoutTable], Field(min_length=1)] = key(
        "Waviness of the measured face",
        default_factory=list,
    )
    drift_rate: Number = key("Drift of the axial sensors", "m/s", default=0.0)
    delay: Number = key("Time of the displacements behind the carrier angle", "s", default=0.0)
    noise_std: NotNegative = key(
        "Standard deviation of the noise of every sensor",
        "m",
        default=0.0,
    )


class PartTable(TomlTable):
    """Mass and inertia of a rigid part; what is left out keeps its default."""

    mass: Positive | None = key("Mass", "kg", default=None)
    polar_inertia: Positive | None = key(
        "Inertia about x through its centre", "kg m^2", default=None
    )
    transverse_inertia: Positive | None = key("Inertia about y and z", "kg m^2", default=None)
    x: Number | None = key(
        "Axial position of its centre, downwind of the rim's face", "m", default=None
    )


class BodiesTable(TomlTable):
    """Files of ``carrierflex reduce`` in place of the default bodies, relative to the case."""

    carrier: Text | None = key("Carrier", default=None)
    pin: Text | None = key("Pin", default=None)
    shaft: Text | None = key("Main shaft", default=None)


class ZeroingTable(TomlTable):
    """Rest reading that the signals count from."""

    carrier_angle_deg: Number = key("Carrier angle at rest", "deg")


class StageCaseDocument(TomlTable):
    """Load cases of the whole planetary stage; SI units unless a key's name says otherwise."""

    format: Literal["carrierflex-stage-case"] = key("Kind of the file")
    version: Literal[1] = key("Version of the format")
    name: Text = key("Title")
    seed: Count = key("Seed of the random generator for the noise")
    speed_rpm: Positive = key("Mean speed of the carrier", "rev/min")
    duration: Positive = key("Length of every run", "s")
    sample_rate_hz: Positive = key("Samples a second", "1/s")
    step: Positive = key("Longest step of the integration", "s")
    pin_fit_stiffness: NotNegative = key("Bending stiffness of each pin interface", "N m/rad")
    gravity: NotNegative = key("Acceleration of gravity; 0 for none", "m/s^2", default=GRAVITY)
    damping_ratio: Share = key(
        "Structural damping of every elastic mode, share of critical",
        default=StageData.damping_ratio,
    )
    main_shaft: Literal["beam", "finite_elements"] = key(
        "Main shaft: one beam, or finite elements with their lowest modes",
        default="beam",
    )
    rig: RigTable = key("Nominal facts of the rig")
    sensors: Annotated[list[StageSensorTable], Field(min_length=1), different("sensor name")] = key(
        "Sensors",
    )
    runs: Annotated[list[StageRunTable], Field(min_length=1), different("run name")] = key("Runs")
    gear: Annotated[GearData, FieldsOf(GEAR_KEYS)] = key(
        "Planetary gears",
        default_factory=GearData,
    )
    mesh: Annotated[MeshData, FieldsOf(_MESH_KEYS)] = key(
        "Tooth meshes of the stage",
        default_factory=MeshData,
    )
    bearings: Annotated[BearingData, FieldsOf(_BEARING_KEYS)] = key(
        "Bearings as springs",
        default_factory=BearingData,
    )
    chain: Annotated[ChainData, FieldsOf(_CHAIN_KEYS, without=("low_teeth", "high_teeth"))] = key(
        "Parallel stages and generator",
        default_factory=ChainData,
    )
    mounting: Annotated[MountingData, FieldsOf(_MOUNTING_KEYS)] = key(
        "Bushings under the housing",
        default_factory=MountingData,
    )
    housing: PartTable = key("Housing with the parallel stages", default_factory=PartTable)
    planet: PartTable = key("Each planet with its bearings", default_factory=PartTable)
    sun: PartTable = key("Sun", default_factory=PartTable)
    ring: PartTable = key("Ring", default_factory=PartTable)
    planet_rollers: Annotated[RollerBearingData, FieldsOf(_ROLLER_KEYS)] | None = key(
        "Planet bearings roller by roller in place of springs; may be empty",
        default=None,
    )
    effects: EffectsTable = key("Effects inside the stage", default_factory=EffectsTable)
    reading: ReadingTable = key("Effects between motion and record", default_factory=ReadingTable)
    bodies: BodiesTable = key(
        "Body files in place of the default ones",
        default_factory=BodiesTable,
    )
    zeroing: ZeroingTable | None = key("Rest reading that the signals count from", default=None)
