"""The parts of the measurement model that may be wrong (:mod:`carrierflex.simulation.sensing`).

Apart from the functions on signals: effects name them, and a case is checked without arrays.
"""

from enum import Enum


class Measurement(Enum):
    """What is wrong in the measurement model ``(1 + gain) y(t - delay; v + angle) + zero``.

    The radius is that of the point which a sensor looks at; no effect fits it.
    """

    GAIN = "gain"
    ANGLE = "angle"
    RADIUS = "radius"
    ZERO = "zero"
    DELAY = "delay"

    @property
    def is_of_one_channel(self) -> bool:
        """Whether each sensor has its own; all share the delay."""
        return self is not Measurement.DELAY
