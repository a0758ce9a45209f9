"""The planetary stage in time.

Carrier, main shaft and pins elastic, planets, sun, ring, housing and chain rigid.

Conventions
-----------
Carrier frame
    Every displacement is small and resolved in the frame that turns with the carrier by the carrier
    angle ``theta``, also those of the housing and of the ground's loads. ``theta`` itself is free
    and large. In this frame all lines of action keep their direction; weight, radial load and
    mounting turn, against the carrier, once a revolution.
Coordinates
    The elastic body's reduced coordinates first, then six a rigid part (translations x y z [m] at
    its centre, rotations x y z [rad]), then one rotation a shaft of the chain. The carrier angle
    takes the place of the rotation of the pilot ``upwind_seat`` about x: it moves every part by the
    rigid drive motion ``r_0`` (carrier as a whole, planets, sun and chain by their gear ratios),
    and the remaining coordinates count from there.
Meshes
    A mesh's approach is positive when its flanks press; the force on the planet is along the mesh's
    normal.
Frames, angles and the sign of the torque are those of :mod:`carrierflex.geometry`; what a sensor
reads is said in :mod:`carrierflex.simulation`. The equations and every neglected term with its
size: ``docs/stage_model.md``.
"""
