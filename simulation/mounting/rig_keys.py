"""Keys of the mounting rig in a file: cases may leave them out, campaigns state all of them."""

from carrierflex.files.toml_values import (
    Key,
    NotNegative,
    Number,
    Positive,
    PositiveCount,
    ThreePositive,
)

RIG_KEYS = {
    "R_x": Key(
        Positive,
        "Distance of each bushing from the axis along y, and lever of the sensors ssz, spz",
        "m",
    ),
    "R_y": Key(Number, "Lever of the sensors ssx, spx about y", "m"),
    "R_z": Key(Number, "Lever of the sensors ssx, spx about z", "m"),
    "R_b": Key(Number, "Lever of the sensor sbx about y", "m"),
    "R_yz": Key(Number, "Lever of the sensor spy about z", "m"),
    "bushing_radial_stiffness": Key(Positive, "Stiffness of each bushing in y and z", "N/m"),
    "bushing_radial_damping": Key(NotNegative, "Damping of each bushing in y and z", "N s/m"),
    "bushing_axial_stiffness": Key(NotNegative, "Stiffness of each bushing in x", "N/m"),
    "bushing_axial_damping": Key(NotNegative, "Damping of each bushing in x", "N s/m"),
    "housing_mass": Key(Positive, "Mass of the housing", "kg"),
    "housing_inertia": Key(
        ThreePositive,
        "Inertia of the housing about x, y, z through its centre",
        "kg m^2",
    ),
    "housing_cg_x": Key(Number, "Axial position of the housing's centre", "m"),
    "shaft_mass": Key(NotNegative, "Mass of the main shaft with carrier and planets", "kg"),
    "shaft_cg_x": Key(Number, "Axial position of the main shaft's centre", "m"),
    "coupling_mass": Key(NotNegative, "Equivalent mass of the dynamometer's coupling", "kg"),
    "coupling_arm": Key(Number, "Distance of the coupling upwind of the main bearing", "m"),
    "main_bearing_x": Key(Positive, "Distance of the main bearing upwind of the bushings", "m"),
    "gear_ratio": Key(Positive, "Speed of the generator over that of the main shaft"),
    "zeroing_samples": Key(PositiveCount, "Samples at rest whose mean is the zero of every sensor"),
}
