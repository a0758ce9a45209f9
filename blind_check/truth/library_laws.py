"""Effects whose equation in the truth is the library's own, in the campaign's constants.

Their parameters have true values that an answer can be held against. The others have another form
(a tanh for a root, a stack of leaves for a cubic spring, two Maxwell branches for one), or are in
units of the deflection curves of another carrier.
"""

LIBRARY_LAWS: dict[str, tuple[str, ...]] = {
    "carrier": (
        "axial_offset", "housing_tilt", "torque_tilt", "carrier_tilt", "ntl_tilt", "flange_warp",
        "face_runout", "ring_pass", "sensor_gain", "sensor_angle", "sensor_zero", "sensor_delay",
    ),
    "mounting": (
        "parasitic_torque", "axial_bushing_stiffness", "main_bearing_compliance", "ntl_direction",
        "unequal_bushings", "sensor_gain", "sensor_zero", "sensor_delay",
    ),
}  # fmt: skip
