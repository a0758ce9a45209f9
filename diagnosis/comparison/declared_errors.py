"""Constant errors of the signals that a campaign declares, and what they do to a fit.

A signal that is read with a constant error e moves the fit. To first order, with the residual r,
``J = d predicted / d theta`` and W the weights of the priors,

``d theta = (J.T J + W)^-1 J.T (r_e - r)``,

``r_e`` the residual of the same records where the signal is read one standard deviation of the
error off. Errors of different signals are independent: their squares add up. A gain of channel c
of C has ``r_e - r = sigma_c y_c``, the channel's signal in it and zero in the others, so that least
squares decides what it does: C channels that tell a parameter alike move it by
``sigma / sqrt(C)``, one that alone tells it by all of sigma. A gain that one parameter or several
make up for exactly moves them by their powers in the unit of the signal:
:class:`~carrierflex.diagnosis.comparison.declared_gains.DeclaredGains` is this with a single
channel.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.declared_gains import LOADS_AS_READ
from carrierflex.diagnosis.comparison.known_physics import ERROR_KEYS, KnownPhysics
from carrierflex.diagnosis.comparison.problem import FloatArray
from carrierflex.simulation.measurement import Measurement

#: Errors of an input that intervals hold.
_OF_INPUTS = (Measurement.GAIN, Measurement.ZERO)


@dataclass(frozen=True)
class DeclaredError:
    """One constant error of a signal.

    Parameters
    ----------
    signal : str
        Channel or input; of a delay, which all channels share, the first that declares it.
    part : Measurement
        Part of the measurement model that is off.
    std : float
        Standard deviation: relative, or in the unit of the signal, [s] or [rad].
    channel : int, optional
        Number of the channel; None for an input and for the delay of all channels.
    """

    signal: str
    part: Measurement
    std: float
    channel: int | None = None

    @property
    def is_of_input(self) -> bool:
        """Whether an input is misread."""
        return self.channel is None and self.part in _OF_INPUTS

    def misread(self, values: FloatArray) -> FloatArray:
        """Signal as it is read one standard deviation off in gain or zero, of the same shape."""
        if self.part is Measurement.GAIN:
            return np.asarray((1.0 + self.std) * values)
        return np.asarray(values + self.std)


@dataclass(frozen=True, eq=False)
class Misreading:
    """Declared errors and what each of them does to the gradient of a fit.

    Parameters
    ----------
    errors : tuple of DeclaredError
        Declared errors.
    scores : ndarray, shape (E, p)
        ``J.T (r_e - r)`` of each, then of further errors that nobody declares: of zeros by the
        noise of a run, of the waves of a carrier's curves.
    """

    errors: tuple[DeclaredError, ...]
    scores: FloatArray


def declared_errors(known: KnownPhysics) -> tuple[DeclaredError, ...]:
    """Errors that a campaign declares of its signals, inputs first.

    Parameters
    ----------
    known : KnownPhysics
        Channels and inputs with their declarations.
    """
    errors = [
        DeclaredError(signal.name, part, std)
        for signal in known.inputs
        for part in _OF_INPUTS
        if (std := getattr(signal, ERROR_KEYS[part]))
    ]
    for part, key in ERROR_KEYS.items():
        declared = [(k, own.name, getattr(own, key)) for k, own in enumerate(known.channels)]
        declared = [one for one in declared if one[2]]
        if part is Measurement.DELAY:
            # All channels share one; whoever declares several knows it to the largest.
            largest = max((std for _, _, std in declared), default=0.0)
            errors += [DeclaredError(name, part, largest) for _, name, _ in declared[:1]]
        else:
            errors += [DeclaredError(name, part, std, k) for k, name, std in declared]
    return tuple(errors)


_WORDS = {
    Measurement.GAIN: ("gains", 100.0, " %"),
    Measurement.ANGLE: ("angles", float(np.rad2deg(1.0)), " deg"),
    Measurement.ZERO: ("zeros", 1.0, ""),
    Measurement.DELAY: ("delay", 1e3, " ms"),
}


def errors_words(errors: Sequence[DeclaredError]) -> str:
    """What is declared, as a sentence without its full stop.

    Parameters
    ----------
    errors : sequence of DeclaredError
        Declared errors; where no gain of an input is among them, loads are taken as read.
    """
    parts = [
        f"{_WORDS[part][0]} ({', '.join(_of_part(errors, part))})"
        for part in _WORDS
        if any(error.part is part for error in errors)
    ]
    text = f"intervals hold the declared standard deviations of {', '.join(parts)}" if parts else ""
    has_load = any(error.is_of_input and error.part is Measurement.GAIN for error in errors)
    return "; ".join(own for own in (text, "" if has_load else LOADS_AS_READ) if own)


def _of_part(errors: Sequence[DeclaredError], part: Measurement) -> Iterator[str]:
    """Inputs by name, then all channels together."""
    _, factor, unit = _WORDS[part]
    own = [error for error in errors if error.part is part]
    yield from (
        f"{error.signal} {factor * error.std:.3g}{unit}" for error in own if error.is_of_input
    )
    stds = [factor * error.std for error in own if not error.is_of_input]
    if stds:
        low, high = f"{min(stds):.3g}", f"{max(stds):.3g}"
        yield f"channels {low if low == high else f'{low} to {high}'}{unit}"
