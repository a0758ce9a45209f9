"""Fitted parameters as they are published: by effect and name, tilts by size and direction."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.declared_errors import errors_words
from carrierflex.diagnosis.comparison.declared_gains import LOADS_AS_READ
from carrierflex.diagnosis.comparison.problem import BASELINE, FloatArray, Parameter
from carrierflex.diagnosis.inference.effect_fit import EffectFit, parameter_key
from carrierflex.diagnosis.inference.intervals import (
    NORMAL_95,
    KnownCombination,
    Systematics,
    known_combination,
    misread_moves,
    prior_moves,
    small_sample_factor,
    systematic_variance,
    undetermined,
)
from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.identification.estimation.polar_pair import polar_values


@dataclass(frozen=True, eq=False)
class PublishedValues:
    """Parameters of a fit and what is said of them.

    Parameters
    ----------
    parameters : mapping of str to mapping of str to NamedValue
        Values by effect and name.
    gains : str
        What the intervals hold of the gains and delays of the signals.
    undetermined : tuple of str
        What the records do not determine.
    """

    parameters: Mapping[str, Mapping[str, NamedValue]]
    gains: str
    undetermined: tuple[str, ...]


def published_values(
    problem: ComparisonProblem, fit: EffectFit, *, floor_ratio: float
) -> PublishedValues:
    """Parameters of a fit with everything that is known of their errors.

    Parameters
    ----------
    problem : ComparisonProblem
        Records and simulator.
    fit : EffectFit
        Fitted set.
    floor_ratio : float
        Mean square over the floor up to which the verdict is "at the noise floor".
    """
    gains = problem.gains
    words = gains.words if gains else LOADS_AS_READ
    misreading = problem.misreading(fit.effects, fit.theta)
    if misreading is not None:
        moves = np.concatenate([misread_moves(fit, misreading.scores), prior_moves(fit)])
        values = named_values(fit, few_blocks=True, moves=moves)
        return PublishedValues(values, errors_words(misreading.errors), ())
    shift = problem.discrepancy_shift(fit.effects, fit.theta)
    if shift is None:
        return PublishedValues(named_values(fit, few_blocks=gains is not None), words, ())
    systematics = Systematics(
        shift=shift,
        hidden_square=(floor_ratio - 1.0) * float(problem.noise_square.sum()),
        signal_square=problem.signal_square,
    )
    values = named_values(fit, few_blocks=gains is not None, systematics=systematics)
    delay = problem.delay_words(fit.theta)
    return PublishedValues(
        values,
        "; ".join(text for text in (words, delay) if text),
        tuple(_undetermined_words(fit, values, systematics, problem.has_one_frequency)),
    )


def _undetermined_words(
    fit: EffectFit,
    values: Mapping[str, Mapping[str, NamedValue]],
    systematics: Systematics,
    has_one_frequency: bool,
) -> Iterator[str]:
    """What the records do not tell of the parameters, and the combination that they do."""
    keys = [parameter_key(parameter) for parameter in fit.parameters]
    free = {
        key: k
        for k, (key, parameter) in enumerate(zip(keys, fit.parameters, strict=True))
        if parameter.lower < parameter.upper
    }
    unknown = [key for key in free if np.isnan(values.get(key[0], {}).get(key[1], _SOME).std)]
    stiffness, mass = (BASELINE, "K1"), (BASELINE, "m")
    both = stiffness in free and mass in free
    if both and (has_one_frequency or {stiffness, mass} <= set(unknown)):
        known = known_combination(fit, (free[stiffness], free[mass]), systematics)
        if known.factor > 0.0:
            yield _at_one_frequency(known, is_all={stiffness, mass} <= set(unknown))
            unknown = [key for key in unknown if key not in (stiffness, mass)]
    numbers = [free[key] for key in unknown]
    # Two springs in parallel are known as their sum; what has different units makes no sum.
    if len(numbers) == 2 and len({fit.parameters[k].unit for k in numbers}) == 1:
        known = known_combination(fit, (numbers[0], numbers[1]), systematics)
        first, second = known.names
        sign = "-" if known.factor > 0.0 else "+"
        yield (
            f"{first} and {second} are not determined one by one: these records know "
            f"{first} {sign} {abs(known.factor):.4g} {second} = {_with_half(known)}"
        )
    else:
        yield from (f"{name} is not determined by these records" for _, name in unknown)


#: Stands for a value that is not published.
_SOME = NamedValue(0.0, 0.0, "1", (0.0, 0.0))


def _at_one_frequency(known: KnownCombination, *, is_all: bool) -> str:
    """Words on stiffness less inertia."""
    frequency = np.sqrt(known.factor) / (2.0 * np.pi)
    text = f"K1 - m w² = {_with_half(known)} at {frequency:.4g} Hz"
    if is_all:
        return (
            f"m and K1 are not determined one by one: these records know {text}; give the mass or "
            "drive a second frequency"
        )
    return f"of m and K1 these records know best {text}"


def _with_half(known: KnownCombination) -> str:
    half = NORMAL_95 * known.value.std
    if not (np.isfinite(half) and half > 0.0):
        return f"{known.value.value:.5g} {known.value.unit}"
    decimals = max(0, 1 - int(np.floor(np.log10(half))))
    return f"{known.value.value:.{decimals}f} ± {half:.{decimals}f} {known.value.unit} (95 %)"


def named_values(
    fit: EffectFit,
    *,
    few_blocks: bool = False,
    systematics: Systematics | None = None,
    moves: FloatArray | None = None,
) -> dict[str, dict[str, NamedValue]]:
    """Values of a fit by effect and name, each with its 95 % interval.

    Parameters
    ----------
    fit : EffectFit
        Parameters with their covariance.
    few_blocks : bool
        Whether the blocks are few beside the parameters: Student's t in place of the normal
        quantile (see :func:`~carrierflex.diagnosis.inference.intervals.small_sample_factor`).
    systematics : Systematics, optional
        What moves the parameters beside noise and gains; without, nothing.
    moves : ndarray, shape (E, p), optional
        Moves by independent errors of the signals and by priors; without, none is declared or the
        parameters hold theirs by their powers.

    Returns
    -------
    dict
        Two components ``(a, b)`` of a vector appear as its size ``|(a, b)|`` and its angle
        ``atan2(b, a)`` [rad], errors by the delta method. Amplitudes that move no sample of these
        records (a radial shift where every sensor reads along the axis) are left out: their
        intervals would be rounding. The interval is not a number where the records do not determine
        the parameter.
    """
    factor = small_sample_factor(fit) if few_blocks else 1.0
    covariance = factor**2 * fit.covariance
    if moves is not None:
        covariance = covariance + moves.T @ moves
    if systematics is not None:
        # The sandwich is zero along a direction that the records do not determine.
        covariance = covariance + np.diag(systematic_variance(fit, systematics))
        unknown = undetermined(fit, np.diag(covariance), systematics)
        covariance[unknown], covariance[:, unknown] = np.nan, np.nan
    numbers = {parameter_key(parameter): k for k, parameter in enumerate(fit.parameters)}
    values: dict[str, dict[str, NamedValue]] = {}
    for k, parameter in enumerate(fit.parameters):
        named = values.setdefault(parameter.effect, {})
        pair = parameter.pair
        gain = _gain_std(parameter)
        if pair is None:
            if not (fit.moves_records[k] or parameter.shape):
                continue
            value = _named(float(fit.theta[k]), covariance[k, k], parameter.unit, gain)
            named[_of_run(parameter.name, parameter)] = value
        elif parameter.name == pair.components[0]:
            both = [k, numbers[parameter.effect, _of_run(pair.components[1], parameter)]]
            ends, slopes = polar_values(fit.theta[both], covariance[np.ix_(both, both)])
            variances = np.diag(slopes @ covariance[np.ix_(both, both)] @ slopes.T)
            size, angle = float(ends[0]), float(ends[1])
            named[_of_run(pair.size, parameter)] = _named(size, variances[0], parameter.unit, gain)
            # One gain for both components: it leaves the angle as it is.
            named[_of_run(pair.angle, parameter)] = _named(angle, variances[1], "rad", 0.0)
    return values


def _gain_std(parameter: Parameter) -> float:
    """Relative error by the gains; none where the value is held."""
    return parameter.gain_std if parameter.lower < parameter.upper else 0.0


def _named(value: float, variance: float, unit: str, gain_std: float) -> NamedValue:
    """Value with the interval of its covariance and of the gains together."""
    std = float(np.hypot(np.sqrt(np.maximum(variance, 0.0)), gain_std * value))
    half = NORMAL_95 * std
    return NamedValue(value, std, unit, (value - half, value + half))


def _of_run(name: str, parameter: Parameter) -> str:
    """Name with the run that the parameter belongs to, where it has one."""
    return name if parameter.run is None else f"{name} of {parameter.run}"
