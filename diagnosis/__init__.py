"""Where the gap between measurement and simulation lies, and how far an effect added shrinks it.

Frame, angles and signs: :mod:`carrierflex.geometry`; sensor readings:
:mod:`carrierflex.simulation`. This package owns two more conventions.

Orders
    The complex amplitude Y(n) of order n of a signal belongs to ``Re(Y(n) exp(+j n theta))``, theta
    the carrier angle; order 0 is the mean.
Sensor patterns
    Of four axial sensors 90 deg apart at the angles alpha_i: ``A_m(n) = 1/4 sum_i Y_i(n) exp(+j m
    alpha_i)`` for m = 0, +1, -1, 2. A pattern fixed to the carrier, ``cos(k (v - theta) + psi)``,
    has order k and lands in the single ``m = k mod 4``: tilt of the carrier (k = 1) in m = +1, its
    deflection of order 3 in m = -1 and of order 6 in m = 2. A static tilt stands at order 0 in m =
    +1 and m = -1, in equal parts; a static saddle at order 0 in m = 2. The mean square over time
    and sensors is the sum over all cells of ``|A_m(0)|²`` and ``|A_m(n)|² / 2``.
"""
