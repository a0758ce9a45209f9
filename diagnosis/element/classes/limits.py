"""Limits of the comparison of classes of an element."""

from carrierflex.diagnosis.classes.constants import ClassConstants

#: Weight of a penalty at which a curve is straight but for what all records show: where one block
#: goes further than the others, any less leaves there the square of a spline's swing.
STRAIGHT = 1.0


def element_limits() -> ClassConstants:
    """Limits of every kind, with one more weight of the penalties to choose from."""
    limits = ClassConstants()
    return ClassConstants(ridges=(*limits.ridges, STRAIGHT))
