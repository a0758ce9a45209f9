"""What a campaign states beforehand: known physics, and errors that its sensors may have.

Both are priors of the fits. Known physics is published by size and angle where it is a vector; its
prior is that of the components, each with its own standard deviation to first order.

A signal that is read with a constant error e moves the fit. To first order, with the residual r,
``J = d predicted / d theta`` and W the weights of the priors,

``d theta = (J.T J + W)^-1 J.T (r_e - r)``,

``r_e`` the residual of the same records where the signal is read one standard deviation of the
error off. Errors of different signals are independent: their squares add up. A gain of channel c
of C has ``r_e - r = sigma_c y_c``, the channel's signal in it and zero in the others, so that least
squares decides what it does: C channels that tell a parameter alike move it by
``sigma / sqrt(C)``, one that alone tells it by all of sigma. A gain that one parameter or several
make up for exactly moves them by their powers in the unit of the signal: :class:`DeclaredGains`.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, Parameter
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.campaign.declarations import Channel, InputSignal, KnownValue
from carrierflex.simulation.effect_parameters import PolarPair
from carrierflex.simulation.measurement import Measurement

#: Declared error of a channel that bounds each part of the measurement model, and the name of that
#: source of error.
_ERRORS = {
    Measurement.GAIN: ("gain_std", "probes"),
    Measurement.ZERO: ("zero_std", "probes"),
    Measurement.DELAY: ("delay_std", "delay"),
    Measurement.ANGLE: ("angle_std", "probe angles"),
    Measurement.RADIUS: ("radius_std", "probe radius"),
}


@dataclass(frozen=True, eq=False)
class KnownPhysics:
    """What is known before any fit."""

    #: Known values by ``effect.parameter``, under their published names
    fixed: Mapping[str, KnownValue] = field(default_factory=dict)
    channels: tuple[Channel, ...] = ()  # Channels with the errors that they declare
    inputs: tuple[InputSignal, ...] = ()  # Inputs with theirs

    def prior(self, parameter: Parameter, name: str) -> Parameter:
        """Parameter with what is known of it as its prior; held where that is exact.

        `name` is that on the effect's card, without the channel.
        """
        known = self.fixed.get(f"{parameter.effect}.{name}")
        if parameter.pair:
            known = self._of_component(parameter, parameter.pair)
        if known is None:
            return parameter
        if known.std == 0.0:
            return replace(parameter, lower=known.value, upper=known.value, prior_std=np.inf)
        return replace(parameter, prior_mean=known.value, prior_std=known.std)

    def sensor_prior(
        self, parameter: Parameter, measurement: Measurement | None, channel: int | None = None
    ) -> Parameter:
        """Parameter of a sensor's error, no larger than what its channel, or any, declares.

        `measurement` is the part of the measurement model that its effect is.
        """
        if measurement is None:
            return parameter
        those = self.channels if channel is None else (self.channels[channel : channel + 1])
        declared = [getattr(signal, _ERRORS[measurement][0]) for signal in those]
        if not declared or None in declared:
            return parameter
        return replace(parameter, prior_std=float(max(declared)))

    def _of_component(self, parameter: Parameter, pair: PolarPair) -> KnownValue | None:
        """What size and angle of a vector say of one component."""
        size = self.fixed.get(f"{parameter.effect}.{pair.size}")
        angle = self.fixed.get(f"{parameter.effect}.{pair.angle}")
        if size is None or angle is None:
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


#: A torque 5 % too large on a carrier or mounting is the torque itself on one 5 % softer: where no
#: other load acts, the records of the two are the same.
LOADS_AS_READ = "load-cell errors are not included: they scale stiffness and values per load"


@dataclass(frozen=True)
class DeclaredGains:
    """Relative standard deviations of the gains of an element's two signals."""

    #: force, deflection: relative standard deviation; None where none is declared: the gain is
    #: taken as exact
    force: float | None = None
    deflection: float | None = None
    #: Whether the force is the mass times the measured acceleration (free decay): its gain is then
    #: that of the deflection
    force_is_inertia: bool = False

    def of(self, powers: tuple[int, int, int]) -> float:
        """Relative standard deviation of a parameter by the gains alone.

        A parameter of the powers ``a`` of force, deflection and time is found ``g_F^a_F g_x^a_x``
        times too large where force and deflection are read ``g_F`` and ``g_x`` times too large:
        ``sqrt((a_F sigma_F)² + (a_x sigma_x)²)``. Time is taken as exact.
        """
        force, deflection, _ = powers
        if self.force_is_inertia:
            force, deflection = 0, force + deflection
        return float(np.hypot(force * (self.force or 0.0), deflection * (self.deflection or 0.0)))

    @property
    def words(self) -> str:
        """What is declared, as a sentence without its full stop."""
        signals = {"deflection": self.deflection}
        if not self.force_is_inertia:
            signals = {"force": self.force, **signals}
        known = [f"{name} {100.0 * std:.3g} %" for name, std in signals.items() if std]
        exact = [name for name, std in signals.items() if not std]
        if not known:
            return "gain errors are not included"
        text = f"intervals hold the declared standard deviations of gains: {', '.join(known)}"
        return text + (f"; that of the {exact[0]} taken as exact" if exact else "")


#: Nothing is declared.
EXACT_GAINS = DeclaredGains()

#: Errors of an input that intervals hold.
_OF_INPUTS = (Measurement.GAIN, Measurement.ZERO)


@dataclass(frozen=True)
class DeclaredError:
    """One constant error of a signal."""

    #: Channel or input; of a delay, which all channels share, the first that declares it
    signal: str
    quantity: Measurement  # Part of the measurement model that is off
    std: float  # Standard deviation: relative, or in the unit of the signal, [s], [rad] or [m]
    #: Number of the channel; None for an input and for the delay of all channels
    channel: int | None = None

    @property
    def is_of_input(self) -> bool:
        """Whether an input is misread."""
        return self.channel is None and self.quantity in _OF_INPUTS

    def misread(self, values: FloatArray) -> FloatArray:
        """Signal as it is read one standard deviation off in gain or zero, of the same shape."""
        if self.quantity is Measurement.GAIN:
            return np.asarray((1.0 + self.std) * values)
        return np.asarray(values + self.std)


@dataclass(frozen=True, eq=False)
class Misreading:
    """Declared errors and what each of them does to the gradient of a fit."""

    errors: tuple[DeclaredError, ...]
    #: ``J.T (r_e - r)`` of each, then of further errors that nobody declares: of zeros by the noise
    #: of a run, of the waves of a carrier's curves, shape (E, p)
    scores: FloatArray
    further: str  # What those are
    curves: str = ""  # What intervals hold of the size of a carrier's curves, in words

    @property
    def sources(self) -> list[str]:
        """Source of error of every row of the scores: ``load cell``, ``probes`` ..."""
        of_errors = [
            "load cell" if error.is_of_input else _ERRORS[error.quantity][1]
            for error in self.errors
        ]
        return of_errors + [self.further] * (len(self.scores) - len(of_errors))


def declared_errors(known: KnownPhysics) -> tuple[DeclaredError, ...]:
    """Errors that a campaign declares of its signals, inputs first."""
    errors = [
        DeclaredError(signal.name, measurement, std)
        for signal in known.inputs
        for measurement in _OF_INPUTS
        if (std := getattr(signal, _ERRORS[measurement][0]))
    ]
    for measurement, (key, _) in _ERRORS.items():
        declared = [
            (k, channel.name, std)
            for k, channel in enumerate(known.channels)
            if (std := getattr(channel, key))
        ]
        if measurement is Measurement.DELAY:
            # All channels share one; whoever declares several knows it to the largest.
            largest = max((std for _, _, std in declared), default=0.0)
            errors += [DeclaredError(name, measurement, largest) for _, name, _ in declared[:1]]
        else:
            errors += [DeclaredError(name, measurement, std, k) for k, name, std in declared]
    return tuple(errors)


_WORDS = {
    Measurement.GAIN: ("gains", 100.0, " %"),
    Measurement.ANGLE: ("angles", float(np.rad2deg(1.0)), " deg"),
    Measurement.RADIUS: ("radii", 1e3, " mm"),
    Measurement.ZERO: ("zeros", 1.0, ""),
    Measurement.DELAY: ("delay", 1e3, " ms"),
}


def errors_words(errors: Sequence[DeclaredError]) -> str:
    """What is declared, as a sentence without its full stop."""
    clauses = [
        f"{_WORDS[measurement][0]} ({', '.join(_declared_words(errors, measurement))})"
        for measurement in _WORDS
        if any(error.quantity is measurement for error in errors)
    ]
    listed = ", ".join(clauses)
    texts = [f"intervals hold the declared standard deviations of {listed}"] if clauses else []
    if not any(error.is_of_input and error.quantity is Measurement.GAIN for error in errors):
        texts.append(LOADS_AS_READ)
    return "; ".join(texts)


def _declared_words(errors: Sequence[DeclaredError], measurement: Measurement) -> Iterator[str]:
    """Inputs by name, then all channels together."""
    _, factor, unit = _WORDS[measurement]
    chosen = [error for error in errors if error.quantity is measurement]
    yield from (
        f"{error.signal} {factor * error.std:.3g}{unit}" for error in chosen if error.is_of_input
    )
    stds = [factor * error.std for error in chosen if not error.is_of_input]
    if stds:
        low, high = f"{min(stds):.3g}", f"{max(stds):.3g}"
        yield f"channels {low if low == high else f'{low} to {high}'}{unit}"
