"""Groups of effects that look alike, and the measurements that tell their members apart."""

#: Constant in the housing, or growing with a load only.
STATIC = (
    "housing_tilt",
    "torque_tilt",
    "ntl_tilt",
    "bearing_clearance",
    "clearance_rocking",
    "flange_warp",
    "sensor_zero",
)
#: At the order of the planets and its multiples.
AT_PLANET_ORDERS = ("flexible_pins", "stiff_pins", "pin_clearance", "ring_pass", "face_runout")
#: At the first order and its neighbours.
ONCE_PER_TURN = ("carrier_tilt", "unequal_load_sharing", "load_sharing_ntl")
#: Following the radial load, or torque times radial load.
WITH_RADIAL_LOAD = ("ntl_tilt", "bearing_clearance", "unequal_load_sharing")

STEPS_OF_LOAD = (
    "torque in four steps without radial load, and radial loads of five sizes along y and z at "
    "full torque"
)
STEPS_OF_TORQUE = (
    "the same speed at a quarter, half and full torque: waves on the face stay, deflection follows "
    "the torque"
)
