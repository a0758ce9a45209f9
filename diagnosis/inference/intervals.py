"""95 % intervals of fitted parameters.

``h² = (t_{0.975, B-p} s)² + (1.96 theta gamma)² + (1.96 d)² + m²``: `s` is the sandwich over B
blocks, `gamma` the relative standard deviation by the declared gains of the signals, `d` the shift
beside a discrepancy of no known form, `m` what a hidden cause moves at most. Published is
``h / 1.96``. Of carriers and mountings `gamma` is the covariance of the declared errors of all
signals, and of the waves of a carrier's curves, in the fit (:func:`misread_moves`), of which the
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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from scipy.stats import t as student_t

from carrierflex.diagnosis.comparison.problem import BoolArray, FloatArray
from carrierflex.diagnosis.inference.effect_fit import EffectFit
from carrierflex.diagnosis.inference.results import NamedValue
from carrierflex.identification.estimation.scaled_least_squares import full_inverse, normal_inverse

#: Half width of a 95 % interval in standard deviations.
NORMAL_95 = float(norm.ppf(0.975))


@dataclass(frozen=True, eq=False)
class Systematics:
    """What moves the parameters of a fit beside noise and gains.

    Parameters
    ----------
    shift : ndarray, shape (p,)
        Of the parameters beside a discrepancy.
    hidden_square : float
        Sum of squares of a cause that the verdict "at the noise floor" passes.
    signal_square : float
        Sum of squares of the measured signal about its mean.
    """

    shift: FloatArray
    hidden_square: float
    signal_square: float


@dataclass(frozen=True, eq=False)
class KnownCombination:
    """What records know of two parameters that they do not know one by one.

    Parameters
    ----------
    names : tuple of str
        Names of both.
    factor : float
        The combination is the first less this times the second.
    value : NamedValue
        Its value.
    """

    names: tuple[str, str]
    factor: float
    value: NamedValue


def small_sample_factor(fit: EffectFit) -> float:
    """Factor on the sandwich's standard deviations for p parameters found from few blocks.

    ``t_{0.975, B-p} / 1.96 sqrt((B - 1) / (B - p))``: the fit takes p of the B degrees of freedom
    of the blocks' scores; the covariance of the fit counts one of them. A run's own parameter is
    not among the p where the run is a single block: its scatter is in no score of another one.

    Parameters
    ----------
    fit : EffectFit
        Parameters with the sums of every block.

    Returns
    -------
    float
        Not a number where there are no more blocks than free parameters.
    """
    of_one_block = np.array([own.run is not None for own in fit.parameters], dtype=bool)
    of_one_block &= fit.sums.n_segments_of_each() < 2
    n_free = int((_is_free(fit) & ~fit.at_bound & ~of_one_block).sum())
    n_blocks = len(fit.sums.square)
    degrees = n_blocks - max(n_free, 1)
    if degrees < 1:
        return float("nan")
    return float(student_t.ppf(0.975, degrees) / NORMAL_95 * np.sqrt((n_blocks - 1.0) / degrees))


def systematic_variance(fit: EffectFit, systematics: Systematics) -> FloatArray:
    """Variance of each parameter by what is neither noise nor gain, shape (p,).

    Parameters
    ----------
    fit : EffectFit
        Parameters with the sums of every block.
    systematics : Systematics
        What moves them.
    """
    moved = np.zeros(fit.theta.size)
    free = np.flatnonzero(_is_free(fit))
    if free.size:
        moved[free] = systematics.hidden_square * _largest_move(fit, free)
    return np.asarray(systematics.shift**2 + moved / NORMAL_95**2)


def misread_moves(fit: EffectFit, scores: FloatArray) -> FloatArray:
    """Moves of the parameters by declared errors of the signals, shape (E, p).

    ``d_e = (J.T J + W)^-1 J.T (r_e - r)``, see
    :mod:`~carrierflex.diagnosis.comparison.declared_errors`. The errors are independent: the
    covariance of the parameters by all of them is ``sum_e d_e d_e.T``.

    Parameters
    ----------
    fit : EffectFit
        Parameters with the sums of every block.
    scores : ndarray, shape (E, p)
        ``J.T (r_e - r)`` of E errors of one standard deviation each.

    Returns
    -------
    ndarray
        A parameter that is held or stands on a bound does not move.
    """
    free = np.flatnonzero(_is_free(fit) & ~fit.at_bound)
    matrix = fit.sums.total_matrix() + np.diag(fit.prior.weight)
    moves = np.zeros(scores.shape)
    moves[:, free] = scores[:, free] @ normal_inverse(matrix[np.ix_(free, free)])
    return moves


def prior_moves(fit: EffectFit) -> FloatArray:
    """Move of the parameters by their priors, ``(J.T J + W)^-1 W (mu - theta)``, shape (1, p).

    A prior and the records may contradict each other: a sensor whose gain is named reads by more
    than its calibration off, and the prior of the calibration draws the fitted gain to zero. How
    far it does is as little known as any other error. Where both agree, or either tells the
    parameter alone, the move is small.

    Parameters
    ----------
    fit : EffectFit
        Parameters with the sums of every block.
    """
    return misread_moves(fit, fit.prior.slope(fit.theta)[None])


def undetermined(fit: EffectFit, variance: FloatArray, systematics: Systematics) -> BoolArray:
    """Which parameters the records do not determine, shape (p,).

    They show neither that the parameter is there (its interval holds zero) nor that it is small (at
    the end of the interval it makes as much as all that was measured).

    Parameters
    ----------
    fit : EffectFit
        Parameters with the sums of every block.
    variance : ndarray, shape (p,)
        Of the parameters, but for the gains.
    systematics : Systematics
        Square of the measured signal.
    """
    half = NORMAL_95 * np.sqrt(variance)
    made = half**2 * np.diag(fit.sums.total_matrix())
    is_as_large = made >= systematics.signal_square
    return np.asarray(_is_free(fit) & (half >= np.abs(fit.theta)) & is_as_large)


def known_combination(
    fit: EffectFit, which: tuple[int, int], systematics: Systematics
) -> KnownCombination:
    """Combination of two parameters that the records know best.

    ``theta_0 - f theta_1`` with f the change of the first that makes up for a change of the second
    by one, the others fitted again: its error is that of the first beside a second that is known.

    Parameters
    ----------
    fit : EffectFit
        Parameters with the sums of every block.
    which : tuple of int
        Numbers of both.
    systematics : Systematics
        What moves the parameters beside noise and gains.
    """
    first, second = which
    others = np.flatnonzero(_is_free(fit))
    others = others[others != second]
    place = int(np.flatnonzero(others == first)[0])
    matrix = fit.sums.total_matrix()
    inverse = full_inverse((matrix + np.diag(fit.prior.weight))[np.ix_(others, others)])
    factor = -float((inverse @ matrix[others, second])[place])
    scores = fit.sums.full_right_side()
    scores = scores - scores.mean(axis=0)
    n_blocks = max(len(scores), 2)
    own = scores[:, others] @ inverse[place]
    noise = float(own @ own) * n_blocks / (n_blocks - 1.0) * small_sample_factor(fit) ** 2
    moved = systematics.hidden_square * _largest_move(fit, others)[place] / NORMAL_95**2
    shift = systematics.shift[first] - factor * systematics.shift[second]
    parts = (fit.parameters[first], fit.parameters[second])
    value = float(fit.theta[first] - factor * fit.theta[second])
    gain = max(part.gain_std for part in parts) * value
    std = float(np.sqrt(noise + moved + shift**2 + gain**2))
    half = NORMAL_95 * std
    named = NamedValue(value, std, parts[0].unit, (value - half, value + half))
    return KnownCombination((parts[0].name, parts[1].name), factor, named)


def _largest_move(fit: EffectFit, which: NDArray[np.int64]) -> FloatArray:
    """Square of the largest move of some parameters by a signal of unit square.

    ``[B J'J B]_kk`` with ``B = (J'J + W)^-1``, W the weights of the priors: ``[B - B W B]_kk``.
    """
    weight = fit.prior.weight[which]
    inverse = full_inverse(fit.sums.total_matrix()[np.ix_(which, which)] + np.diag(weight))
    return np.asarray(np.maximum(np.diag(inverse) - inverse**2 @ weight, 0.0))


def _is_free(fit: EffectFit) -> BoolArray:
    """Which parameters are fitted."""
    return np.array([own.lower < own.upper for own in fit.parameters], dtype=bool)
