"""Parameters of the physical effects that a simulation holds or lacks."""

from dataclasses import dataclass

from carrierflex.simulation.fit_parameter import FitParameter


@dataclass(frozen=True)
class PolarPair:
    """Names of a vector of which two parameters are the components.

    Parameters
    ----------
    size, angle : str
        Symbols of ``|(a, b)|`` and of ``atan2(b, a)`` [rad]; a is ``size cos angle``, b is
        ``size sin angle``.
    """

    size: str
    angle: str

    @property
    def components(self) -> tuple[str, str]:
        """Names of a and b."""
        return f"{self.size} cos {self.angle}", f"{self.size} sin {self.angle}"


@dataclass(frozen=True, eq=False)
class EffectParameter(FitParameter):
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
    pair : PolarPair, optional
        The vector of which this parameter is a component, as its name says; the report gives the
        size and angle of the vector. See :func:`vector_parameters`.
    absent_at : float, optional
        Value of a shape at which the effect adds nothing: that of the simulation without it.
    may_reach_lower : bool
        Whether a fit that ends at the lower bound has not left what is physical: it has found an
        upper limit, as signals no longer change below, or a state (no clearance, no stiffness).
    """

    powers: tuple[int, int, int] | None = None
    shape: bool = False
    pair: PolarPair | None = None
    may_reach_lower: bool = False
    absent_at: float | None = None


def published_names(parameter: EffectParameter) -> tuple[str, ...]:
    """Names under which a parameter is published: size and angle of a vector's component."""
    if parameter.pair is not None:
        return (parameter.pair.size, parameter.pair.angle)
    return (parameter.name,)


def vector_parameters(
    size: str, angle: str, unit: str, *, bound: float, scale: float
) -> tuple[EffectParameter, EffectParameter]:
    """Components of a vector (a tilt with its direction), published by size and angle.

    Parameters
    ----------
    size, angle, unit : str
        Symbols of the size and of the angle, and the unit of the components.
    bound, scale : float
        Largest size of a component, and the size worth noticing.
    """
    pair = PolarPair(size, angle)
    first, second = (
        EffectParameter(name, unit, -bound, bound, scale, pair=pair) for name in pair.components
    )
    return first, second


def unit_of_powers(powers: tuple[int, int, int], units: tuple[str, str]) -> str:
    """Unit text of a parameter: ``N s/m^3``.

    Parameters
    ----------
    powers : tuple of int
        Powers of force, length and time.
    units : tuple of str
        Units of force and length; time is in seconds.
    """
    symbols = (*units, "s")
    above = [_power(s, p) for s, p in zip(symbols, powers, strict=True) if p > 0]
    below = [_power(s, -p) for s, p in zip(symbols, powers, strict=True) if p < 0]
    top = " ".join(above) or "1"
    if not below:
        return top
    return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({' '.join(below)})"


def _power(symbol: str, power: int) -> str:
    return symbol if power == 1 else f"{symbol}^{power}"
