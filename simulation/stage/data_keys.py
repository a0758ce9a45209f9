"""Keys of a stage case for the data of meshes, bearings, parallel stages, mounting and rollers."""

from carrierflex.files.toml_values import (
    Harmonics,
    Key,
    NotNegative,
    Number,
    Positive,
    PositiveCount,
)

MESH_KEYS = {
    "sun_stiffness": Key(Positive, "Mean stiffness of a sun mesh along the tooth normal", "N/m"),
    "ring_stiffness": Key(Positive, "Mean stiffness of a ring mesh along the tooth normal", "N/m"),
    "backlash": Key(NotNegative, "Play between the flanks along the normal", "m"),
    "n_harmonics": Key(Harmonics, "Harmonics of the mesh frequency kept in the stiffness"),
}
BEARING_KEYS = {
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
CHAIN_KEYS = {
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
MOUNTING_KEYS = {
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
ROLLER_KEYS = {
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
