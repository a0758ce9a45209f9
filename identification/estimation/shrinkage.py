"""Values of many machines, each with its error: their common prior, and trends over time.

Hierarchical model of one value x_i of machine i with known standard deviation s_i::

    x_i ~ N(theta_i, s_i^2),    theta_i ~ N(mu, tau^2)

mu and tau come from all machines (empirical Bayes), so a value with a large error is drawn to mu
and one with a small error stays where it is.

References
----------
.. [1] R. C. Paule, J. Mandel, "Consensus values and weighting factors", Journal of Research of the
   National Bureau of Standards 87 (1982): tau, eq. 4.
.. [2] C. N. Morris, "Parametric empirical Bayes inference: theory and applications", Journal of the
   American Statistical Association 78 (1983), section 5: means and their errors.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, stats

from carrierflex.identification.estimation.resampling import NORMAL_95

Array = NDArray[np.float64]

#: Fewest machines with which a prior can be estimated and an error of its spread be allowed for.
FEWEST_MACHINES = 4
#: Fewest dates of a trend.
FEWEST_DATES = 3


@dataclass(frozen=True, eq=False)
class ShrunkValues:
    """Values of n machines under their common normal prior.

    Parameters
    ----------
    mean, mean_std : float
        mu of the prior and its standard deviation.
    spread : float
        tau: standard deviation of the machines' true values; zero where their errors explain all.
    values, stds : ndarray, shape (n,)
        Posterior mean and standard deviation of every machine.
    p_values : ndarray, shape (n,)
        Two-sided probability of a machine as far from the others as this one, under the prior that
        the others alone give.
    """

    mean: float
    mean_std: float
    spread: float
    values: Array
    stds: Array
    p_values: Array


def shrunk_values(values: Array, stds: Array) -> ShrunkValues:
    """Values of machines drawn to their common mean.

    ``B_i = (n - 3)/(n - 1) s_i^2/(s_i^2 + tau^2)``, ``theta_i = x_i - B_i (x_i - mu)``, variance
    ``s_i^2 (1 - (1 - w_i) B_i) + v_i (x_i - mu)^2`` with the weight w_i of x_i in mu and
    ``v_i = 2/(n - 3) B_i^2 (s^2 + tau^2)/(s_i^2 + tau^2)``, which holds the error of tau.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Measured values.
    stds : ndarray, shape (n,)
        Their standard deviations.

    Returns
    -------
    ShrunkValues
        Prior, posterior of every machine, and how far each is from the others.

    Raises
    ------
    ValueError
        Where there are fewer than four machines, or a value or a standard deviation is not finite
        and positive.
    """
    n = values.size
    if n < FEWEST_MACHINES:
        raise ValueError(f"{n} machines; expected at least {FEWEST_MACHINES} for a common prior")
    if not (np.isfinite(values).all() and np.isfinite(stds).all() and (stds > 0.0).all()):
        raise ValueError(
            "values or standard deviations are not finite and positive; leave them out"
        )
    mean, mean_variance, tau_square = _prior(values, stds)
    variances = stds**2
    weights = 1.0 / (variances + tau_square)
    share = weights / weights.sum()
    mean_of_variances = float(share @ variances)
    drawn = (n - 3) / (n - 1) * variances * weights
    error_of_spread = 2.0 / (n - 3) * drawn**2 * (mean_of_variances + tau_square) * weights
    of_mean = variances * (1.0 - (1.0 - share) * drawn)
    return ShrunkValues(
        mean=mean,
        mean_std=float(np.sqrt(mean_variance)),
        spread=float(np.sqrt(tau_square)),
        values=values - drawn * (values - mean),
        stds=np.sqrt(of_mean + error_of_spread * (values - mean) ** 2),
        p_values=np.array([_p_value(values, stds, i) for i in range(n)]),
    )


def _prior(values: Array, stds: Array) -> tuple[float, float, float]:
    """Mean of the prior, its variance, and tau^2."""
    tau_square = _spread_square(values, stds, np.ones((values.size, 1)))
    weights = 1.0 / (stds**2 + tau_square)
    return float(weights @ values / weights.sum()), float(1.0 / weights.sum()), tau_square


def _spread_square(values: Array, stds: Array, columns: Array) -> float:
    """tau^2 with which the weighted scatter about a fit of `columns`, shape (n, p), is n - p."""
    n_free = columns.shape[0] - columns.shape[1]

    def excess(tau_square: float) -> float:
        root = 1.0 / np.sqrt(stds**2 + tau_square)
        scaled = columns * root[:, None]
        residual = values * root - scaled @ np.linalg.lstsq(scaled, values * root)[0]
        return float(residual @ residual) - n_free

    # At this tau^2 the scatter is at most one.
    most = float(((values - values.mean()) ** 2).sum())
    if excess(0.0) <= 0.0:
        return 0.0
    # A share of it: squares of micrometres are below the solver's absolute tolerance.
    share = optimize.brentq(lambda share: excess(most * share), 0.0, 1.0, xtol=1e-15, rtol=1e-12)
    return float(most * share)


def _p_value(values: Array, stds: Array, machine: int) -> float:
    """Probability of a value as far from the others, by Student's t of the others' number."""
    mean, mean_variance, tau_square = _prior(np.delete(values, machine), np.delete(stds, machine))
    scale = np.sqrt(stds[machine] ** 2 + tau_square + mean_variance)
    return float(2.0 * stats.t.sf(abs(values[machine] - mean) / scale, values.size - 2))


@dataclass(frozen=True)
class Trend:
    """Straight line through values over time.

    Parameters
    ----------
    slope, slope_ci95 : float, tuple of float
        Change in a unit of time, and its 95 % interval.
    p_value : float
        Two-sided probability of such a slope, step or drift that speeds up of a value that stays.
    step_time : float
        First time after a step, where one value before and another after it leave less than the
        line; NaN where the line leaves less.
    """

    slope: float
    slope_ci95: tuple[float, float]
    p_value: float
    step_time: float


def trend(time: Array, values: Array, stds: Array) -> Trend:
    """Weighted straight line, and step, through values with known errors.

    Beside its error a value has a scatter from day to day, as large as the line leaves beyond the
    errors. The interval is the wider of two: of errors and scatter as stated, and of what the line
    leaves with Student's t.

    Parameters
    ----------
    time, values, stds : ndarray, shape (n,)
        Times, values and their standard deviations.

    Raises
    ------
    ValueError
        Where there are fewer than three different times.
    """
    if np.unique(time).size < FEWEST_DATES:
        raise ValueError(f"{np.unique(time).size} dates; expected at least {FEWEST_DATES}")
    line = _slope(time, values, stds)
    firsts = np.unique(time)[1:]
    steps = [_slope((time >= first).astype(np.float64), values, stds) for first in firsts]
    best = int(np.argmin([step.residual_square for step in steps]))
    quicker = _slope((time - time.min()) ** 2, values, stds)
    # The smallest of several probabilities, as many times as it was looked for (Bonferroni): half
    # for the line, a quarter each for a drift that speeds up and for the steps.
    of_steps = len(steps) * min(step.p_value for step in steps)
    p_value = min(2.0 * line.p_value, 4.0 * quicker.p_value, 4.0 * of_steps, 1.0)
    return Trend(
        line.slope,
        (line.slope - line.half, line.slope + line.half),
        p_value,
        float(firsts[best]) if steps[best].residual_square < line.residual_square else float("nan"),
    )


@dataclass(frozen=True)
class _Slope:
    """Slope over one column, half its interval, its probability, and what errors leave unmet."""

    slope: float
    half: float
    p_value: float
    residual_square: float


def _slope(x: Array, values: Array, stds: Array) -> _Slope:
    """Weighted fit of a constant and a slope over x."""
    columns = np.stack([np.ones_like(x), x], axis=1)
    weights = 1.0 / (stds**2 + _spread_square(values, stds, columns))
    about = x - weights @ x / weights.sum()
    information = float(weights @ about**2)
    slope = float((weights * about) @ values / information)
    residual = values - weights @ values / weights.sum() - slope * about
    scatter = float(weights @ residual**2) / (x.size - 2)
    student = float(stats.t.ppf(0.975, x.size - 2))
    half = max(NORMAL_95, student * np.sqrt(scatter)) / np.sqrt(information)
    z = abs(slope) * np.sqrt(information)
    by_line = 2.0 * stats.t.sf(z / np.sqrt(scatter), x.size - 2) if scatter > 0.0 else 0.0
    p_value = max(2.0 * float(stats.norm.sf(z)), float(by_line))
    return _Slope(slope, float(half), p_value, float(residual**2 @ (1.0 / stds**2)))
