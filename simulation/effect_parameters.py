"""Parameters of the physical effects that a simulation holds or lacks."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class EffectParameter:
    """One parameter of an effect.

    Parameters
    ----------
    name : str
        Symbol, as in the papers.
    unit : str
        SI unit.
    lower, upper : float
        Physical bounds; a lower bound of zero is the physical sign (friction never drives).
    scale : float
        Size at which the effect is worth noticing, in `unit`, or in the record's own scale where
        `powers` is given: step of the search and standard deviation of the prior.
    powers : tuple of int, optional
        Powers of force, length and time in the parameter. It is then scaled and bounded by the
        force, deflection and time of the record, which also give its unit (a voltage analogue has
        volts in place of newton and metre).
    shape : bool
        Whether the effect is absent only where another parameter is zero (a yield force, a time
        constant): such a parameter has no prior and is searched from several starts.
    """

    name: str
    unit: str
    lower: float = -math.inf
    upper: float = math.inf
    scale: float = 1.0
    powers: tuple[int, int, int] | None = None
    shape: bool = False

    def __post_init__(self) -> None:
        if not self.lower < self.upper:
            raise ValueError(
                f"parameter {self.name}: bounds {self.lower} to {self.upper}; expected lower < "
                "upper"
            )
        if not (self.scale > 0.0 and math.isfinite(self.scale)):
            raise ValueError(
                f"parameter {self.name}: scale is {self.scale}; expected a positive number"
            )
