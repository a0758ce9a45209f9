"""What a campaign states beforehand: known physics, and errors that its sensors may have.

Both are priors of the fits. Known physics is published by size and angle where it is a vector; its
prior is that of the components, each with its own standard deviation to first order.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import Parameter
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel, InputSignal, KnownValue
from carrierflex.simulation.measurement import Measurement

#: Declared error of a channel that bounds each part of the measurement model.
ERROR_KEYS = {
    Measurement.GAIN: "gain_std",
    Measurement.ZERO: "zero_std",
    Measurement.DELAY: "delay_std",
    Measurement.ANGLE: "angle_std",
}


@dataclass(frozen=True, eq=False)
class KnownPhysics:
    """What is known before any fit.

    Parameters
    ----------
    fixed : mapping of str to KnownValue
        Known values by ``effect.parameter``, under their published names.
    channels : tuple of Channel
        Channels with the errors that they declare.
    inputs : tuple of InputSignal
        Inputs with theirs.
    """

    fixed: Mapping[str, KnownValue] = field(default_factory=dict)
    channels: tuple[Channel, ...] = ()
    inputs: tuple[InputSignal, ...] = ()

    def prior(self, parameter: Parameter, name: str) -> Parameter:
        """Parameter with what is known of it as its prior; held where that is exact.

        Parameters
        ----------
        parameter : Parameter
            Unknown of a fit.
        name : str
            Its name on the effect's card, without the channel.
        """
        known = self._of_component(parameter) if parameter.pair else self._of(parameter, name)
        if known is None:
            return parameter
        if known.std == 0.0:
            return replace(parameter, lower=known.value, upper=known.value, prior_std=np.inf)
        return replace(parameter, prior_mean=known.value, prior_std=known.std)

    def sensor_prior(
        self, parameter: Parameter, measurement: Measurement | None, channel: int | None = None
    ) -> Parameter:
        """Parameter of a sensor's error, no larger than what the channel declares.

        Parameters
        ----------
        parameter : Parameter
            Unknown of a fit.
        measurement : Measurement, optional
            Part of the measurement model that its effect is.
        channel : int, optional
            Number of the channel; where it is not known, the largest declared error of all.
        """
        if measurement is None:
            return parameter
        those = self.channels if channel is None else (self.channels[channel : channel + 1])
        declared = [getattr(own, ERROR_KEYS[measurement]) for own in those]
        if not declared or None in declared:
            return parameter
        return replace(parameter, prior_std=float(max(declared)))

    def _of(self, parameter: Parameter, name: str) -> KnownValue | None:
        return self.fixed.get(f"{parameter.effect}.{name}")

    def _of_component(self, parameter: Parameter) -> KnownValue | None:
        """What size and angle of a vector say of one component."""
        pair = parameter.pair
        size = self.fixed.get(f"{parameter.effect}.{pair.size}") if pair else None
        angle = self.fixed.get(f"{parameter.effect}.{pair.angle}") if pair else None
        if pair is None or size is None or angle is None:
            return None
        cos, sin = np.cos(angle.value), np.sin(angle.value)
        along, across = (cos, sin) if parameter.name == pair.components[0] else (sin, cos)
        std = float(np.hypot(along * size.std, size.value * across * angle.std))
        return KnownValue(float(size.value * along), std)


#: Nothing is known.
NOTHING_KNOWN = KnownPhysics()


def known_physics(campaign: Campaign) -> KnownPhysics:
    """What a campaign states beforehand."""
    return KnownPhysics(campaign.baseline.fixed, campaign.channels, campaign.inputs)
