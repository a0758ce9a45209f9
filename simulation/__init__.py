"""The carrier's motion and deflection turned into sensor signals, run by run.

Frame, angles, carrier angle and the sign of the torque are those of :mod:`carrierflex.geometry`.
This package owns two more conventions.

Reading of a sensor
    A sensor fixed to the housing at angle ``v`` reads the material point of the carrier that stands
    at ``v``: the point at the carrier-frame angle ``v - theta``. Axial signals are positive for
    motion in +x, radial ones for motion along ``e(v)``.
Conversion of equations (1)-(8) of the 2012 paper
    The tilt terms are kept as printed, ``R phi_H sin(theta_H - v)`` and ``R phi_PLC sin(theta_PLC +
    theta - v)``. A right-handed rotation by a small angle ``phi`` about the axis ``e(theta_H)``
    moves the point ``R e(v)`` by ``phi e(theta_H) × R e(v) = -R phi sin(theta_H - v)`` along +x, so
    ``phi_H`` and ``phi_PLC`` of the paper count negative rotation about their axes. Equation (8)
    evaluates the deflection curves at ``theta + theta_rho - v``; the material point under the
    sensor is at ``v - theta``. The curves are odd about the pin, ``delta(-x) = -delta(x)``, so the
    paper's argument would turn their sign over. This project uses ``delta(v - theta - theta_rho)``
    throughout, with curves that belong to a positive torque: then ``rho_s, rho_f >= 0``.
    ``theta_rho`` is the carrier-frame angle of pin 1, zero by the definition of the carrier angle.

References
----------
.. [1] "Modeling and Parameter Identification of Deflections in Planetary Stage of Wind Turbine
Gearbox",
   2012, equations (1)-(3), (7), (8).
"""
