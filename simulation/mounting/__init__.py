"""The gearbox on its mounting.

Housing and main shaft on a spherical main bearing and two bushings (2011 paper).

Frame of :mod:`carrierflex.geometry`: x downwind along the rotation axis, z up; the origin lies
midway between the bushings. This package owns these conventions:

Bodies
    Housing, main shaft and the dynamometer coupling pitch and yaw together about the main bearing
    at ``x = -main_bearing_x``; the housing alone rolls about x. The shaft's spin is the measured
    ``carrier_angle``.
Coordinates
    ``theta_x, theta_y, b_z | theta_z, b_y, d_x``: roll, pitch, vertical motion of the main bearing;
    yaw, sideways motion of the main bearing, axial motion of the housing. ``b_y, b_z`` exist where
    the main bearing has a compliance, ``d_x`` where the rig lets the housing move axially. To first
    order the three before the bar and the three after it do not influence one another, for any
    bushing whose directions are uncoupled: two blocks.
Bushings
    At ``(0, +R_x, 0)`` starboard and ``(0, -R_x, 0)`` port. Their deflections in y are equal
    (``b_y + L theta_z``), so one element of double weight stands for both.
Loads
    ``(1 - 1/gear_ratio) (T + P_T F_z)`` rolls the housing about +x (equation 16); the radial load
    acts at ``x = -main_bearing_x - coupling_arm``.
Sensors
    ``s = T d``, equation (8), with ``d = (d_x, d_y, d_z, theta_x, theta_y, theta_z)`` of the
    origin; starboard is +y.

References
----------
.. [1] "Modeling of Wind Turbine Gearbox Mounting", Modeling, Identification and Control 32(4),
2011.
"""
