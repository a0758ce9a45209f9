"""What a CAD solid of a planet carrier consists of, recognised from its faces.

Unit, axis, origin, pins, seats, faces of rim and shaft: candidates are ranked and the reason for
each rank is told; what two candidates fit alike is left to the user.
"""
