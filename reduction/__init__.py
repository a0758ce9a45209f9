"""Craig-Bampton reduction.

Pilot nodes kept as physical coordinates, fixed-interface modes beside them.

Conventions
-----------
Coordinates
    Every reduced body keeps six coordinates a pilot first (translations x y z [m], rotations x y z
    [rad], in the body's frame at the pilot's point), pilots in the order of its table, then the
    modal coordinates, mass-normalised, by ascending frequency.
Modes
    Constraint modes Ψ answer a unit motion of one pilot with the others held; fixed-interface modes
    Φ vibrate with every pilot held, ``G Φ = 0`` and ``Φᵀ M Φ = I``. The Craig-Bampton basis is ``T
    = [Ψ Φ]``.
Frames and units
    Those of :mod:`carrierflex.geometry`.
"""
