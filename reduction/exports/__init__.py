"""Reduced bodies in the formats of multibody codes.

Conventions
-----------
Order
    Pilots first, in the order of the body's table, six rows each (Tx Ty Tz Rx Ry Rz in the body's
    frame at the pilot's point), then the modal coordinates. Matrices are symmetrised before
    writing.
Floating frame
    MBDyn and SID describe deformation in a frame that follows the body, so their basis may not hold
    rigid motion: one pilot is held, its six coordinates left out, and the frame follows that pilot.
Units
    SI: m, kg, s, N, rad; every file says so, or a text beside it where the format has no room for
    it.
"""
