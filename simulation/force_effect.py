"""One physical effect on a measured motion as one object: parameters, values simulated, texts.

Kinds element and mounting: the simulator takes the values by name, the campaign contract lists the
id, the diagnosis fits the parameters and the report prints the texts.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from carrierflex.simulation.effect_parameters import EffectParameter
from carrierflex.simulation.measurement import Measurement


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceEffect:
    """One physical effect.

    Parameters
    ----------
    id : str
        Effect id of the campaign contract.
    equation : str
        The law in text.
    parameters : tuple of EffectParameter
        What is fitted; the effect is absent where those that are no shape are zero.
    signature : str
        What it looks like in the gap map.
    simulated : mapping of str to tuple of str
        Names of the simulator's values that a parameter is added to; where it is left out, the one
        of the parameter's own name.
    law : callable, optional
        ``(deflection, speed, parameters) -> force``, which numba can compile, for a force that the
        simulator's compiled laws lack; see :mod:`carrierflex.simulation.force_laws`.
    measurement : Measurement, optional
        The part of the measurement model that the effect is.
    shape_starts : tuple of float
        Values of the shape, over its scale, that start the search.
    alike : tuple of str
        Ids of effects that look alike; its own may be among them.
    discriminating_experiment : str
        The measurement that tells it from them.
    """

    id: str
    equation: str
    parameters: tuple[EffectParameter, ...]
    signature: str
    simulated: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    law: Callable[..., float] | None = None
    measurement: Measurement | None = None
    shape_starts: tuple[float, ...] = (1.0,)
    alike: tuple[str, ...] = ()
    discriminating_experiment: str = ""

    @property
    def aliases(self) -> tuple[str, ...]:
        """Ids it is commonly confused with."""
        return tuple(name for name in self.alike if name != self.id)

    def values_of(self, parameter: str) -> tuple[str, ...]:
        """Names of the simulator's values that a parameter is added to."""
        return self.simulated.get(parameter, (parameter,))


def scaled_parameter(
    name: str,
    unit: str,
    powers: tuple[int, int, int],
    *,
    lower: float = 0.0,
    upper: float = 20.0,
    shape: bool = False,
) -> EffectParameter:
    """Parameter bounded in powers of the force, deflection and time of the record.

    Parameters
    ----------
    name, unit : str
        Symbol and SI unit.
    powers : tuple of int
        Powers of force, length and time.
    lower, upper : float
        Bounds in the record's own scale; none is negative unless they say otherwise.
    shape : bool
        Whether it is a shape.
    """
    return EffectParameter(name, unit, lower, upper, powers=powers, shape=shape)
