"""The parts of the measurement model that may be wrong (:mod:`carrierflex.simulation.sensing`).

Apart from the functions on signals: effects name them, and a case is checked without arrays.
"""

from enum import Enum


class Measurement(Enum):
    """Wrong part of the measurement model ``(1 + gain) y(t - delay; v + angle) + zero``."""

    GAIN = "gain"
    ANGLE = "angle"
    ZERO = "zero"
    DELAY = "delay"

    @property
    def is_of_one_channel(self) -> bool:
        """Whether each sensor has its own; all share the delay."""
        return self is not Measurement.DELAY
