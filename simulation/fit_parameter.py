"""What every fit knows of an unknown: its name, unit, bounds and scale."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class FitParameter:
    """One quantity that a fit may change.

    Parameters
    ----------
    name, unit : str
        Symbol, as in the papers, and SI unit.
    lower, upper : float
        Physical bounds.
    scale : float
        Typical size: step of the search and of difference quotients.

    Raises
    ------
    ValueError
        Where the bounds are out of order or the scale is not positive.
    """

    name: str
    unit: str
    lower: float = -math.inf
    upper: float = math.inf
    scale: float = 1.0

    def __post_init__(self) -> None:
        if not self.lower < self.upper:
            raise ValueError(
                f"parameter {self.name}: bounds {self.lower} to {self.upper}; "
                "expected lower < upper"
            )
        if not (self.scale > 0.0 and math.isfinite(self.scale)):
            raise ValueError(
                f"parameter {self.name}: scale is {self.scale}; expected a positive number"
            )
