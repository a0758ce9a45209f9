"""One physical effect at the rim sensors as one object: parameters, signal, and how it shows.

The simulator adds its signal, the papers' models M1 and M2 and the diagnosis take the same signal
as regressor, the campaign contract lists its id and the report prints its texts.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from carrierflex.simulation.carrier.rim import CarrierInputs, CarrierRig, RimSensor
from carrierflex.simulation.effect_parameters import EffectParameter, PolarPair, vector_parameters
from carrierflex.simulation.measurement import Measurement

FloatArray = NDArray[np.float64]
#: Signal per unit of each parameter [m per unit], shape (n_parameters, n), of a RimSensor,
#: CarrierInputs and a CarrierRig. The pattern of an effect whose last parameters are shapes takes
#: their values as further arguments and gives no rows for them.
Pattern = Callable[..., FloatArray]
#: Values of a shape between which signals are interpolated, of rig and largest radial load [N].
ShapeNodes = Callable[[CarrierRig, float], FloatArray]


@dataclass(frozen=True, eq=False)
class Effect:
    """One physical effect.

    Parameters
    ----------
    id : str
        Effect id of the campaign contract.
    equation : str
        The law in text.
    parameters : tuple of EffectParameter
        Coefficients of the signal, then its shapes where there are any.
    signature : str
        What it looks like in the gap map.
    pattern : callable, optional
        Signal of unit parameters; none where the effect is a sensor's.
    measurement : Measurement, optional
        The part of the measurement model that the effect is.
    per_run : bool
        Whether every run has values of its own.
    follows_sensor, follows_delay : bool
        Whether the diagnosis moves its signal with a misplaced sensor and with a delay.
    shape_nodes : callable, optional
        Where a shape is interpolated; eleven values between its bounds without it.
    shape_parts : tuple of callable
        Of an effect with several shapes: patterns of one shape each, in the order of the shapes,
        that sum up to `pattern`.
    weighed_by : str
        Effect whose only parameter multiplies a second row of signals per unit of the only
        parameter of this one; empty of an effect with a row for each parameter.
    curves : tuple of str
        Deflection curves it needs beyond those under torque.
    aliases : tuple of str
        Ids it is commonly confused with.
    discriminating_experiment : str
        The measurement that tells it from them.
    """

    id: str
    equation: str
    parameters: tuple[EffectParameter, ...]
    signature: str
    pattern: Pattern | None = None
    measurement: Measurement | None = None
    per_run: bool = False
    follows_sensor: bool = False
    follows_delay: bool = False
    shape_nodes: ShapeNodes | None = None
    shape_parts: tuple[Pattern, ...] = ()
    weighed_by: str = ""
    curves: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    discriminating_experiment: str = ""

    @property
    def pair(self) -> PolarPair | None:
        """The vector of which its two parameters are the components."""
        return self.parameters[0].pair

    @property
    def published(self) -> tuple[tuple[str, str], ...]:
        """Names and units under which its values are published: size and angle of a pair."""
        if self.pair:
            return (self.pair.size, self.parameters[0].unit), (self.pair.angle, "rad")
        return tuple((parameter.name, parameter.unit) for parameter in self.parameters)

    def each_run(self) -> "Effect":
        """Copy with values of its own in every run."""
        return replace(self, per_run=True)

    def signals(
        self, sensor: RimSensor, inputs: CarrierInputs, rig: CarrierRig, *shape: float
    ) -> FloatArray:
        """Signal per unit of each parameter that is no shape.

        Parameters
        ----------
        sensor, inputs, rig
            Where, under which loads and on which rig it is read.
        *shape : float
            Values of the shapes, where the effect has any.

        Returns
        -------
        ndarray, shape (n_parameters, n)
            Signals [m per unit].

        Raises
        ------
        ValueError
            Where the effect is a sensor's, which adds no signal.
        """
        if self.pattern is None:
            raise ValueError(
                f"effect {self.id} is an error of the sensors; expected one that adds a signal"
            )
        return self.pattern(sensor, inputs, rig, *shape)

    def signal(
        self,
        coefficients: Sequence[float],
        sensor: RimSensor,
        inputs: CarrierInputs,
        rig: CarrierRig,
    ) -> FloatArray:
        """Signal of some coefficients [m], shape (n,); what a zero would multiply is left out."""
        total = np.zeros_like(inputs.carrier_angle)
        rows = self.signals(sensor, inputs, rig)
        for value, row in zip(coefficients, rows, strict=True):
            if value != 0.0:
                total += value * row
        return total

    @property
    def n_shapes(self) -> int:
        """Number of shapes among the parameters; they come last."""
        return sum(parameter.shape for parameter in self.parameters)

    @property
    def is_of_one_channel(self) -> bool:
        """Whether it is the error of one sensor, which is found with it."""
        return self.measurement is not None and self.measurement.is_of_one_channel


def lengths(*names: str, scale: float = 1e-5, bound: float = 1e-2) -> tuple[EffectParameter, ...]:
    """Displacements [m]."""
    return tuple(EffectParameter(name, "m", -bound, bound, scale) for name in names)


def angles(*names: str, scale: float = 1e-3) -> tuple[EffectParameter, ...]:
    """Small tilts [rad]."""
    return tuple(EffectParameter(name, "rad", -0.05, 0.05, scale) for name in names)


def tilt_pair(size: str, angle: str) -> tuple[EffectParameter, ...]:
    """Components of a tilt along the axes at angle 0 and at a quarter turn [rad]."""
    return vector_parameters(size, angle, "rad", bound=0.05, scale=1e-3)


def per_newton(unit: str, scale: float, *names: str) -> tuple[EffectParameter, ...]:
    """Compliances to the radial load."""
    bound = 200.0 * scale
    return tuple(EffectParameter(name, unit, -bound, bound, scale) for name in names)


def others(effect: str, group: tuple[str, ...]) -> tuple[str, ...]:
    """Members of a group of effects that look alike, but for one of them."""
    return tuple(name for name in group if name != effect)
