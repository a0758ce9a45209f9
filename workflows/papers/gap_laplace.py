"""Posterior of a hypothesis by Laplace's approximation: normal about each most probable point.

In coordinates z whose prior is the standard normal distribution (an angle is uniform),

    ``log Z = log L(z*) - z* z* / 2 - log det(H) / 2``,   ``H = J^T J``

with J the derivatives of misfit and z; a uniform angle adds ``-log(2 pi) / 2`` and its normal is
bounded to the circle by ``1 / (2 pi)`` on the diagonal of H. Modes that do not overlap are summed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import logsumexp, ndtr

from carrierflex.workflows.papers.gap_posterior import (
    CHOICES,
    NAMES,
    PUBLISHED,
    SAMPLED_ERROR,
    Comparison,
    Hypothesis,
    Samples,
    log_likelihoods,
    standard_errors,
)

#: Prior points among which the starts are chosen, the best results of least squares from which it
#: starts again, and its evaluations.
_LOOKED_AT, _RESTARTS, _EVALUATIONS = 300, 6, 40
#: Starting points of the search for modes, and samples of which the best starts a search.
STARTS = 10
#: A point counts as a mode where Newton's step from it gains less than this [nat].
_MOST_TO_GAIN = 1.0
#: Modes nearer than this many standard deviations are one.
_ONE_MODE = 2.0
#: Draws of the posterior and steps of the random walk that corrects each of them.
_DRAWS, _WALK = 150, 40
#: Step of the derivatives, in standard deviations of the priors.
_STEP = 1e-3
#: Misfit where contact does not settle.
_FAR = 1e3


@dataclass(frozen=True, eq=False)
class Mode:
    """A most probable point.

    Parameters
    ----------
    z : ndarray, shape (n,)
        Its coordinates.
    covariance : ndarray, shape (n, n)
        Of the normal distribution about it.
    log_evidence : float
        What it adds to the evidence.
    """

    z: NDArray[np.float64]
    covariance: NDArray[np.float64]
    log_evidence: float


@dataclass(frozen=True, eq=False)
class _Posterior:
    """Posterior density of a hypothesis in z, with one choice of the data's errors."""

    hypothesis: Hypothesis
    compare: Comparison
    width: float
    choice: tuple[float, float]

    @property
    def is_angle(self) -> NDArray[np.bool_]:
        """Coordinates that are angles."""
        return np.array([p.kind == "angle" for p in self.hypothesis.priors.values()])

    @property
    def is_size(self) -> NDArray[np.bool_]:
        """Coordinates of which the sign says nothing."""
        return np.array([p.kind == "size" for p in self.hypothesis.priors.values()])

    def numbers(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Numbers of the stage at a point; NaN where contact does not settle."""
        return self.compare.numbers(self.hypothesis, self.hypothesis.values_at(z, self.width))

    def misfit(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap to the published numbers in standard errors, then z without angles."""
        gap = self.numbers(z)[: len(NAMES)] - PUBLISHED
        both = np.concatenate([gap / standard_errors(*self.choice), z[~self.is_angle]])
        return np.nan_to_num(both, nan=_FAR)

    def slopes(self, z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivatives of the misfit, by differences of a fixed step: z may be zero."""
        steps = _STEP * np.eye(len(z))
        at = self.misfit(z)
        return np.stack([self.misfit(z + step) - at for step in steps], axis=1) / _STEP

    def mode(self, start: NDArray[np.float64]) -> tuple[Mode, float]:
        """Most probable point by least squares, and what a further step would gain [nat]."""
        fit = least_squares(self.misfit, start, self.slopes, x_scale="jac", max_nfev=_EVALUATIONS)
        is_angle, is_size = self.is_angle, self.is_size
        sign = np.where(is_size & (fit.x < 0.0), -1.0, 1.0)
        z = np.where(is_angle, fit.x % (2.0 * np.pi), sign * fit.x)
        J = fit.jac * sign
        H = J.T @ J + np.diag(is_angle / (2.0 * np.pi))
        covariance = np.linalg.inv(H)
        slope = J.T @ fit.fun
        log_evidence = (
            -fit.cost
            - np.log(np.sqrt(2.0 * np.pi) * standard_errors(*self.choice)).sum()
            - 0.5 * np.linalg.slogdet(H)[1]
            - 0.5 * is_angle.sum() * np.log(2.0 * np.pi)
            # Both signs of a size are one point: twice the share of the normal above zero.
            + np.log(2.0 * ndtr(z / np.sqrt(np.diag(covariance)))[is_size]).sum()
        )
        return Mode(z, covariance, float(log_evidence)), float(0.5 * slope @ covariance @ slope)

    def reached(self, starts: Iterable[NDArray[np.float64]]) -> list[tuple[Mode, float]]:
        """What :meth:`mode` gives from these points, best first."""
        return sorted((self.mode(start) for start in starts), key=lambda one: -one[0].log_evidence)

    def modes(self, reached: list[tuple[Mode, float]]) -> list[Mode]:
        """Different modes among them; the best of all where none has converged."""
        modes: list[Mode] = []
        for mode, gain in reached:
            if gain < _MOST_TO_GAIN and not any(self._is_one(mode, other) for other in modes):
                modes.append(mode)
        return modes or [reached[0][0]]

    def _is_one(self, mode: Mode, other: Mode) -> bool:
        distance = mode.z - other.z
        turned = (distance + np.pi) % (2.0 * np.pi) - np.pi
        distance = np.where(self.is_angle, turned, distance)
        return bool(distance @ np.linalg.solve(other.covariance, distance) < _ONE_MODE**2)

    def log_density(self, z: NDArray[np.float64], numbers: NDArray[np.float64]) -> float:
        """Logarithm of the posterior density, without a constant."""
        if not np.isfinite(numbers).all():
            return -np.inf
        prior = -0.5 * float((z[~self.is_angle] ** 2).sum())
        return prior + float(log_likelihoods(numbers, *self.choice).sum())

    def draw(
        self, modes: list[Mode], rng: np.random.Generator
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """A point of the normals, corrected by a random walk (Metropolis), and its numbers."""
        shares = np.array([mode.log_evidence for mode in modes])
        shares = np.exp(shares - logsumexp(shares))
        mode = modes[rng.choice(len(modes), p=shares)]
        z = rng.multivariate_normal(mode.z, mode.covariance)
        numbers = self.numbers(z)
        log_density = self.log_density(z, numbers)
        if not np.isfinite(log_density):
            z, numbers = mode.z, self.numbers(mode.z)
            log_density = self.log_density(z, numbers)
        step = 2.4 / np.sqrt(len(z)) * np.linalg.cholesky(mode.covariance)
        for _ in range(_WALK):
            new = z + step @ rng.standard_normal(len(z))
            new_numbers = self.numbers(new)
            new_density = self.log_density(new, new_numbers)
            if np.log(rng.random()) < new_density - log_density:
                z, numbers, log_density = new, new_numbers, new_density
        return z, numbers


def laplace(
    hypothesis: Hypothesis,
    compare: Comparison,
    width: float,
    rng: np.random.Generator,
    *,
    draws: bool,
    starts: int = STARTS,
) -> Samples:
    """Evidence of a hypothesis at every choice of errors, and points of its posterior.

    Parameters
    ----------
    hypothesis : Hypothesis
        The hypothesis.
    compare : Comparison
        The stage.
    width : float
        Widths of the priors over those of the table.
    rng : numpy.random.Generator
        Of starting points and draws.
    draws : bool
        Draw the posterior with the middle error; otherwise the points are its modes.
    starts : int
        Starting points of the search for modes.
    """
    middle = _Posterior(hypothesis, compare, width, (SAMPLED_ERROR, 0.0))
    looked_at = [_prior_point(middle, rng) for _ in range(_LOOKED_AT)]
    costs = [float((middle.misfit(z) ** 2).sum()) for z in looked_at]
    first = middle.reached(looked_at[i] for i in np.argsort(costs)[:starts])[:_RESTARTS]
    modes = middle.modes(middle.reached(mode.z for mode, _ in first))
    log_evidence = {}
    for choice in CHOICES:
        of_choice = _Posterior(hypothesis, compare, width, choice)
        if choice == middle.choice:
            at = modes
        else:
            at = of_choice.modes(of_choice.reached(mode.z for mode in modes))
        log_evidence[choice] = float(logsumexp([mode.log_evidence for mode in at]))
    if draws:
        drawn = [middle.draw(modes, rng) for _ in range(_DRAWS)]
    else:
        drawn = [(mode.z, middle.numbers(mode.z)) for mode in modes]
    values = [hypothesis.values_at(z, width) for z, _ in drawn]
    points = np.array([[value[name] for name in hypothesis.priors] for value in values])
    numbers = np.array([of for _, of in drawn])
    # Draws weigh alike with the middle error; other errors and data left out weight them anew.
    log_volume = -log_likelihoods(numbers, SAMPLED_ERROR).sum(axis=1) - np.log(len(drawn))
    if not draws:
        log_volume = np.array([-0.5 * float((z[~middle.is_angle] ** 2).sum()) for z, _ in drawn])
    return Samples(hypothesis, points, numbers, log_volume, log_evidence)


def _prior_point(posterior: _Posterior, rng: np.random.Generator) -> NDArray[np.float64]:
    """A point of the prior."""
    n = len(posterior.is_angle)
    return np.where(posterior.is_angle, 2.0 * np.pi * rng.random(n), rng.standard_normal(n))


def most_probable(
    samples: Samples, compare: Comparison, amplitude_error: float
) -> dict[str, float]:
    """Values of the highest posterior density, priors of the table, by least squares.

    Parameters
    ----------
    samples : Samples
        Of the hypothesis, with the priors of the table; the search begins at the best of them.
    compare : Comparison
        The stage.
    amplitude_error : float
        Standard error of the amplitudes [m].
    """
    hypothesis = samples.hypothesis
    misfit = _Posterior(hypothesis, compare, 1.0, (amplitude_error, 0.0)).misfit
    starts = [
        np.array([p.deviations(v) for v, p in zip(point, hypothesis.priors.values(), strict=True)])
        for point in samples.points[np.argsort(samples.log_weights(amplitude_error))[-STARTS:]]
    ]
    start = min(starts, key=lambda z: float((misfit(z) ** 2).sum()))
    return hypothesis.values_at(least_squares(misfit, start, diff_step=1e-3, max_nfev=15).x, 1.0)
