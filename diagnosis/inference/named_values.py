"""Fitted parameters by effect and name, with 95 % intervals.

``h² = (t_{0.975, B-p} s)² + (1.96 theta gamma)² + (1.96 d)² + m²``: `s` is the sandwich over B
blocks, `gamma` the relative standard deviation by the declared gains of the signals, `d` the shift
beside a discrepancy of no known form, `m` what a hidden cause moves at most. Published is
``h / 1.96``. Of carriers and mountings `gamma` is the covariance of the declared errors of all
signals, and of the waves of a carrier's curves, in the fit (:func:`_misread_moves`), of which the
powers of an element are a case.

A cause is hidden where the verdict "at the noise floor" would pass it: its square is the share of
the floor that this verdict allows. Of all causes of that size the one along the parameter's own
signature moves it most, by ``m² = S [A^-1 J'J A^-1]_kk``. Where the records determine a parameter
this is a share of the floor over the signal; where they do not, it is beyond all bounds.

References
----------
.. [1] H. White, "A heteroskedasticity-consistent covariance matrix estimator and a direct test for
   heteroskedasticity", Econometrica 48 (1980) 817-838.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student_t

from carrierflex.diagnosis.comparison.known_physics import LOADS_AS_READ, errors_words
from carrierflex.diagnosis.comparison.problem import (
    BASELINE,
    FloatArray,
    IntArray,
    Parameter,
)
from carrierflex.diagnosis.inference.effect_fit import EffectFit, parameter_key
from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.identification.estimation.polar_pair import polar_values
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.identification.estimation.scaled_least_squares import (
    full_inverse,
    is_undetermined,
    normal_inverse,
)

#: Sources of error: scatter of the records; what a law may differ by from the true one.
NOISE, UNKNOWN_FORM = "noise", "unknown form"


@dataclass(frozen=True, eq=False)
class _Systematics:
    """What moves the parameters of a fit beside noise and gains."""

    shift: FloatArray
    hidden_square: float


def _small_sample_factor(fit: EffectFit) -> float:
    """Factor ``t_{0.975, B-p} / 1.96 sqrt((B - 1) / (B - p))`` for p parameters from few blocks B.

    Not counted in p: a run's parameter where the run is a single block, whose scatter is in no
    score of another one. Not a number where there are no more blocks than free parameters.
    """
    of_one_block = np.array([parameter.run is not None for parameter in fit.parameters], dtype=bool)
    of_one_block &= fit.sums.n_segments_of_each() < 2
    n_free = int((fit.is_free & ~fit.at_bound & ~of_one_block).sum())
    n_blocks = len(fit.sums.square)
    degrees = n_blocks - max(n_free, 1)
    if degrees < 1:
        return float("nan")
    return float(student_t.ppf(0.975, degrees) / NORMAL_95 * np.sqrt((n_blocks - 1.0) / degrees))


def _misread_moves(fit: EffectFit, scores: FloatArray) -> FloatArray:
    """Moves ``d_e = (J.T J + W)^-1 J.T (r_e - r)`` by E declared errors, shape (E, p).

    The errors are independent: the covariance of the parameters is ``sum_e d_e d_e.T``. A fixed
    parameter, or one on a bound that is not the end of its prior's range, does not move.
    """
    free = np.flatnonzero(fit.is_free & (~fit.at_bound | (fit.prior.weight > 0.0)))
    moves = np.zeros(scores.shape)
    moves[:, free] = scores[:, free] @ normal_inverse(fit.matrix[np.ix_(free, free)])
    return moves


def _prior_moves(fit: EffectFit) -> FloatArray:
    """Moves ``(J.T J + W)^-1 W e_k`` by K priors, each as far off as it may be, shape (K, p)."""
    # That is its standard deviation, or how far the records draw from it where that is more.
    std = np.array([parameter.prior_std for parameter in fit.parameters])
    std[np.isinf(std)] = 0.0
    known = np.flatnonzero(fit.prior.weight > 0.0)
    drawn = fit.prior.mean - fit.theta
    off = np.where(np.abs(drawn) > std, drawn, std)
    return _misread_moves(fit, np.diag(fit.prior.weight * off)[known])


def _known_combination(
    fit: EffectFit, which: tuple[int, int], systematics: _Systematics
) -> tuple[float, str]:
    """Factor of the combination of two parameters known best, ``theta_0 - f theta_1``; its value.

    The value is in words: records may not know the two one by one.
    """
    # f is the change of the first that makes up for a change of the second by one, the others
    # fitted again: its error is that of the first beside a second that is known.
    first, second = which
    others = np.flatnonzero(fit.is_free)
    others = others[others != second]
    row = int(np.flatnonzero(others == first)[0])
    matrix = fit.sums.total_matrix()
    inverse = full_inverse((matrix + np.diag(fit.prior.weight))[np.ix_(others, others)])
    factor = -float((inverse @ matrix[others, second])[row])
    scores = fit.sums.full_right_side()
    scores = scores - scores.mean(axis=0)
    n_blocks = max(len(scores), 2)
    score = scores[:, others] @ inverse[row]
    noise = float(score @ score) * n_blocks / (n_blocks - 1.0) * _small_sample_factor(fit) ** 2
    moved = systematics.hidden_square * _largest_move(fit, others)[row] / NORMAL_95**2
    shift = systematics.shift[first] - factor * systematics.shift[second]
    both = (fit.parameters[first], fit.parameters[second])
    value = float(fit.theta[first] - factor * fit.theta[second])
    gain = max(parameter.gain_std for parameter in both) * value
    half = NORMAL_95 * float(np.sqrt(noise + moved + shift**2 + gain**2))
    if not (np.isfinite(half) and half > 0.0):
        return factor, f"{value:.5g} {both[0].unit}"
    decimals = max(0, 1 - int(np.floor(np.log10(half))))
    return factor, f"{value:.{decimals}f} ± {half:.{decimals}f} {both[0].unit} (95 %)"


def _largest_move(fit: EffectFit, which: IntArray) -> FloatArray:
    """Largest move ``[B J'J B]_kk``, squared, by a signal of unit square; ``B = (J'J + W)^-1``."""
    weight = fit.prior.weight[which]
    inverse = full_inverse(fit.sums.total_matrix()[np.ix_(which, which)] + np.diag(weight))
    return np.asarray(np.maximum(np.diag(inverse) - inverse**2 @ weight, 0.0))


@dataclass(frozen=True, eq=False)
class PublishedValues:
    """Parameters of a fit and what is said of them."""

    parameters: Mapping[str, Mapping[str, NamedValue]]  # Values by effect and name
    covariance: FloatArray  # Of the parameters by all sources but gains of the loads, shape (p, p)
    gains: str  # What the intervals hold of the gains and delays of the signals
    undetermined: tuple[str, ...]  # What the records do not determine


def published_values(
    problem: ComparisonProblem, fit: EffectFit, *, floor_ratio: float
) -> PublishedValues:
    """Parameters of a fit with everything that is known of their errors."""
    gains = problem.gains
    words = [gains.words if gains else LOADS_AS_READ]
    misreading = problem.misreading(fit.effects, fit.theta)
    shift = problem.discrepancy_shift(fit.effects, fit.theta) if misreading is None else None
    by_source = _scatter(fit, few_blocks=misreading is not None or gains is not None)
    unknown = np.zeros(fit.theta.size, dtype=bool)
    systematics = None
    if misreading is not None:
        words = [errors_words(misreading.errors), misreading.curves]
        of_errors = _misread_moves(fit, misreading.scores)
        sources = np.array(misreading.sources)
        moves = {name: of_errors[sources == name] for name in dict.fromkeys(misreading.sources)}
        moves |= {"prior": _prior_moves(fit), "model": problem.model_moves(fit.effects, fit.theta)}
        by_source |= {name: rows.T @ rows for name, rows in moves.items()}
        # What can be changed together so that no prediction changes.
        unknown = fit.is_free & fit.moves_records
        unknown[unknown] = is_undetermined(fit.matrix[np.ix_(unknown, unknown)])
    elif shift is not None:
        words.append(problem.delay_words(fit.theta))
        systematics = _Systematics(
            shift=shift, hidden_square=(floor_ratio - 1.0) * float(problem.noise_square.sum())
        )
        # The sandwich is zero along a direction that the records do not determine.
        moved, free = np.zeros(fit.theta.size), np.flatnonzero(fit.is_free)
        if free.size:
            moved[free] = systematics.hidden_square * _largest_move(fit, free)
        by_source[UNKNOWN_FORM] = np.diag(shift**2 + moved / NORMAL_95**2)
        half = NORMAL_95 * np.sqrt(sum(np.diag(one) for one in by_source.values()))
        is_as_large = half**2 * np.diag(fit.sums.total_matrix()) >= problem.signal_square
        unknown = fit.is_free & (half >= np.abs(fit.theta)) & is_as_large
    for covariance in by_source.values():
        covariance[unknown], covariance[:, unknown] = np.nan, np.nan
    values = _named_values(fit, by_source)
    undetermined: Iterable[str] = ()
    if systematics is not None:
        undetermined = _undetermined_words(fit, values, systematics, problem.has_one_frequency)
    elif misreading is not None:
        undetermined = (
            f"{name} is not determined by these records"
            for of_effect in values.values()
            for name, value in of_effect.items()
            if np.isnan(value.std)
        )
    total = np.asarray(sum(by_source.values()))
    return PublishedValues(values, total, "; ".join(filter(None, words)), tuple(undetermined))


def _scatter(fit: EffectFit, *, few_blocks: bool) -> dict[str, FloatArray]:
    """Covariance of the parameters by the scatter of the records."""
    factor = _small_sample_factor(fit) if few_blocks else 1.0
    return {NOISE: factor**2 * fit.covariance}


def _undetermined_words(
    fit: EffectFit,
    values: Mapping[str, Mapping[str, NamedValue]],
    systematics: _Systematics,
    has_one_frequency: bool,
) -> Iterator[str]:
    """What the records do not tell of the parameters, and the combination that they do."""
    free = {parameter_key(p): k for k, p in enumerate(fit.parameters) if p.is_free}
    published = {key: values.get(key[0], {}).get(key[1]) for key in free}
    unknown = [key for key, value in published.items() if value and np.isnan(value.std)]
    stiffness, mass = (BASELINE, "K1"), (BASELINE, "m")
    are_both = {stiffness, mass} <= set(unknown)
    if {stiffness, mass} <= set(free) and (has_one_frequency or are_both):
        factor, value = _known_combination(fit, (free[stiffness], free[mass]), systematics)
        if factor > 0.0:
            text = f"K1 - m w² = {value} at {np.sqrt(factor) / (2.0 * np.pi):.4g} Hz"
            if are_both:
                yield (
                    f"m and K1 are not determined one by one: these records know {text}; give the "
                    "mass or drive a second frequency"
                )
            else:
                yield f"of m and K1 these records know best {text}"
            unknown = [key for key in unknown if key not in (stiffness, mass)]
    numbers = [free[key] for key in unknown]
    # Two springs in parallel are known as their sum; what has different units makes no sum.
    if len(numbers) == 2 and len({fit.parameters[k].unit for k in numbers}) == 1:
        factor, value = _known_combination(fit, (numbers[0], numbers[1]), systematics)
        first, second = (fit.parameters[k].name for k in numbers)
        yield (
            f"{first} and {second} are not determined one by one: these records know "
            f"{first} {'-' if factor > 0.0 else '+'} {abs(factor):.4g} {second} = {value}"
        )
    else:
        yield from (f"{name} is not determined by these records" for _, name in unknown)


def _named_values(
    fit: EffectFit, by_source: Mapping[str, FloatArray]
) -> dict[str, dict[str, NamedValue]]:
    """Values of a fit by effect and name, each with the 95 % interval of covariances by source.

    Two components ``(a, b)`` of a vector appear as its size and its angle ``atan2(b, a)`` [rad],
    errors by the delta method. Amplitudes that move no sample are left out: their intervals would
    be rounding. The interval is not a number where the records do not determine the parameter.
    """
    numbers = {parameter_key(parameter): k for k, parameter in enumerate(fit.parameters)}
    values: dict[str, dict[str, NamedValue]] = {}
    for k, parameter in enumerate(fit.parameters):
        named = values.setdefault(parameter.effect, {})
        pair = parameter.pair
        gain = parameter.gain_std if parameter.is_free else 0.0
        if pair is None:
            if not (fit.moves_records[k] or parameter.shape):
                continue
            variances = {name: one[k, k] for name, one in by_source.items()}
            value = _named(float(fit.theta[k]), variances, parameter.unit, gain)
            named[_of_run(parameter.name, parameter)] = value
        elif parameter.name == pair.components[0]:
            both = [k, numbers[parameter.effect, _of_run(pair.components[1], parameter)]]
            of_both = {name: one[np.ix_(both, both)] for name, one in by_source.items()}
            total = np.asarray(sum(of_both.values()))
            ends, slopes = polar_values(fit.theta[both], total)
            size, angle = (
                {name: slope @ one @ slope for name, one in of_both.items()} for slope in slopes
            )
            named[_of_run(pair.size, parameter)] = _named(
                float(ends[0]), size, parameter.unit, gain
            )
            # One gain for both components: it leaves the angle as it is.
            named[_of_run(pair.angle, parameter)] = _named(float(ends[1]), angle, "rad", 0.0)
    return values


def _named(value: float, variances: Mapping[str, float], unit: str, gain_std: float) -> NamedValue:
    """Value with the interval of its variances by source and of the gains together."""
    sources = {name: float(np.sqrt(np.maximum(one, 0.0))) for name, one in variances.items()}
    if gain_std:
        sources["gains"] = abs(gain_std * value)
    std = float(np.sqrt(sum(one**2 for one in sources.values())))
    half = NORMAL_95 * std
    sources = {name: one for name, one in sources.items() if one > 0.0}
    return NamedValue(value, std, unit, (value - half, value + half), sources)


def _of_run(name: str, parameter: Parameter) -> str:
    """Name with the run that the parameter belongs to, where it has one."""
    return name if parameter.run is None else f"{name} of {parameter.run}"
