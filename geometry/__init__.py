"""Parametric planet carrier, pins and main shaft, meshed with quadratic tetrahedra.

Conventions of the whole project (stated here once, linked from elsewhere)
--------------------------------------------------------------------------
Frame
    x points downwind along the rotation axis, z up, right-handed. The carrier's own frame has the
    same x axis, its origin on the upwind face of the upwind plate (plate A), and turns with the
    carrier.
Angle
    Angles turn about +x and start at the z axis: the unit vector at angle v is ``e(v) = (0, -sin v,
    cos v)`` and the tangential one, along increasing angle, is ``t(v) = x × e(v) = (0, -cos v, -sin
    v)``.
Carrier angle
    ``theta``, the rotation of the carrier frame about x, is zero when pin 1 points along z. Pins
    stand at equal angles from 0 in the carrier frame, three of them at 0, 120 and 240 deg; a
    sensor at the housing angle v reads the
    material point at the carrier-frame angle ``v - theta``.
Torque
    Positive about +x: it drives the carrier towards increasing angle. The planets then load the
    pins against the rotation: the tangential force on each pin is ``-T / (N a) t`` of N planets.
Units
    SI (m, kg, s, N, Pa, rad). A value in another unit carries the unit in its name.
"""
