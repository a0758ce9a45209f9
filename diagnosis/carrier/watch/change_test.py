"""Sequential test of whether the mean of a vector has left a ball, with a known mean run length.

A revolution gives a vector x of p rows (orders) by C channels: what is measured less what is
predicted, less its mean m over the learning period. The noise has a memory from one revolution to
the next,

    x_n - mu_n = phi (x_(n-1) - mu_(n-1)) + eps_n,    eps_n ~ N(0, Sigma),

phi by row, Sigma between the channels of a row. Null hypothesis: ``|mu_n| <= delta`` (the dead
band), and mu moves little from one revolution to the next. Let d be any estimate of mu from the
past and ``v = d / |d| / (1 - phi)``. Then

    y_n = <v, x_n - phi x_(n-1)>    has the mean    <d / |d|, mu> <= delta

and the variance ``q = <v, Sigma v>``, so that for every ``s >= 0`` that the past decides

    e_n = exp(s (y_n - delta) - s² q / 2),    E[e_n | past] <= 1        (an e-value, [1])
    S_n = max(S_(n-1), 0) + ln e_n                                     (CUSUM)

``exp(S_n)`` is at most the Shiryaev-Roberts sum ``M_n = (M_(n-1) + 1) e_n``, whose mean under the
null is at most n: an alarm at the first ``mean_w exp(S_n) >= exp(h)`` over W windows has a mean run
length of at least ``exp(h)`` revolutions [1]. d is an exponentially weighted mean over each of W
windows, less what noise makes of it, ``s = (|d| - delta) / q`` its best growth [2]; a smaller s,
and an ln e_n that is cut off, keep ``E[e_n] <= 1``.

Where mu leaves the ball, ln e_n grows by ``I = (|mu| - delta)² / (2 q)`` a revolution at most. No
test with this run length has a mean delay much below ``h / I`` [3].

References
----------
.. [1] Shin, Ramdas, Rinaldo, "E-detectors: a nonparametric framework for sequential change
   detection", New England Journal of Statistics in Data Science 2 (2024) 229-260.
.. [2] Lorden, Pollak, "Nonanticipating estimation applied to sequential analysis and changepoint
   detection", Annals of Statistics 33 (2005) 1422-1454.
.. [3] Lorden, "Procedures for reacting to a change in distribution", Annals of Mathematical
   Statistics 42 (1971) 1897-1908.
.. [4] Davidson, Szarek, "Local operator theory, random matrices and Banach spaces", Handbook of
   the Geometry of Banach Spaces 1 (2001), theorem II.13.
.. [5] Kendall, "Note on bias in the estimation of autocorrelation", Biometrika 41 (1954) 403-404.
"""

from dataclasses import dataclass

import numpy as np

from carrierflex.diagnosis.comparison.problem import FloatArray, IntArray

#: Revolutions over which d is averaged, chosen: a large change shows in the first window, a small
#: one in the last.
WINDOWS = (3.0, 12.0, 48.0)
#: Fewest revolutions of a learning period: the bound of [4] needs them.
LEAST_LEARNED = 100


@dataclass(frozen=True, eq=False)
class RevolutionNoise:
    """Mean and noise of the vectors of a learning period."""

    mean: FloatArray  # m, shape (p, C)
    memory: FloatArray  # Upper bound of phi, shape (p,)
    covariance: FloatArray  # Upper bound of Sigma, shape (p, C, C)

    def variance_along(self, direction: FloatArray, n: int) -> float:
        """Variance ``<v, Sigma v> / n`` of a mean, ``v = direction / (1 - phi)``."""
        v = direction / (1.0 - self.memory[:, None])
        return float(np.einsum("kc,kcd,kd", v, self.covariance, v)) / n


def learned_noise(vectors: FloatArray) -> RevolutionNoise:
    """Mean of a learning period, and bounds of the noise, of vectors of shape (n, p, C) in a row.

    phi is the correlation of neighbours over all channels of a row, corrected for its bias [5], and
    two standard deviations more. Sigma is the mean square of ``x_n - phi x_(n-1)``, divided by ``(1
    - sqrt(C / n) - t / sqrt(n))²``: with a probability of one in 1000 the true one is larger along
    any direction of any row [4]. ValueError where there are fewer than 100 revolutions.
    """
    n, p, C = vectors.shape
    if n < LEAST_LEARNED:
        raise ValueError(
            f"{n} revolutions to learn from; expected at least {LEAST_LEARNED}, from which the "
            "noise can be bounded"
        )
    mean = vectors.mean(axis=0)
    x = vectors - mean
    products = (x[1:] * x[:-1]).sum(axis=(0, 2))
    squares = np.maximum((x[:-1] ** 2).sum(axis=(0, 2)), np.finfo(float).tiny)
    r = products / squares
    r = np.clip(r + (1.0 + 3.0 * r) / n, -1.0, 1.0)
    phi = np.clip(r + 2.0 * np.sqrt((1.0 - r**2) / n), 0.0, 0.98)
    eps = x[1:] - phi[:, None] * x[:-1]
    Sigma = np.einsum("nkc,nkd->kcd", eps, eps) / (n - 1)
    t = np.sqrt(2.0 * np.log(p / 1e-3))
    shrinks = max(1.0 - np.sqrt(C / n) - t / np.sqrt(n), 0.1)
    return RevolutionNoise(mean, phi, Sigma / shrinks**2)


@dataclass(frozen=True, eq=False)
class DetectorState:
    """What the test of B streams carries from one revolution to the next."""

    last: FloatArray  # x of the revolution before; not a number after a gap, shape (B, p, C)
    estimate: FloatArray  # d of every window, shape (B, W, p, C)
    sums: FloatArray  # S, shape (B, W)
    offset: FloatArray  # Offset of the nuisance that is followed, shape (B,)

    @property
    def evidence(self) -> FloatArray:
        """``ln mean_w exp(S)``, shape (B,): an alarm from h on."""
        largest = self.sums.max(axis=1)
        return np.asarray(largest + np.log(np.exp(self.sums - largest[:, None]).mean(axis=1)))


@dataclass(frozen=True, eq=False)
class ChangeTest:
    """The test of B streams, alike but for their noise."""

    memory: FloatArray  # phi, shape (B, p)
    covariance: FloatArray  # Sigma, shape (B, p, C, C)
    dead_band: FloatArray  # delta, in the unit of the vectors, shape (B,)
    threshold: float  # h
    #: Unit vector along which a slow drift is followed and no change (daily temperature); zero
    #: where there is none, shape (p, C)
    nuisance: FloatArray
    drift: FloatArray  # Largest drift that is followed, per revolution, shape (B,)

    def begin(self) -> DetectorState:
        """State before the first revolution."""
        B, p = self.memory.shape
        C = self.covariance.shape[-1]
        return DetectorState(
            last=np.full((B, p, C), np.nan),
            estimate=np.zeros((B, len(WINDOWS), p, C)),
            sums=np.zeros((B, len(WINDOWS))),
            offset=np.zeros(B),
        )

    def advanced(self, state: DetectorState, x: FloatArray) -> DetectorState:
        """State after the next revolution, of vectors `x` less their means, shape (B, p, C)."""
        x = x - state.offset[:, None, None] * self.nuisance
        sums = np.maximum(state.sums, 0.0)
        size = np.sqrt(np.einsum("bwkc,bwkc->bw", state.estimate, state.estimate))
        beyond = size > self.dead_band[:, None]
        # Inside the dead band s is zero, and e_n is one. After a gap there is no x_(n-1).
        b, w = np.nonzero(beyond & np.isfinite(state.last[:, :1, 0]))
        if b.size:
            d = self._without_noise(state.estimate[b, w], b, w)
            sums[b, w] += self._growth(state.last[b], x[b], d, b)
        weight = 1.0 / np.array(WINDOWS)[:, None, None]
        estimate = state.estimate + weight * (x[:, None] - state.estimate)
        # The offset follows the second window; its lag behind a drift is 64 revolutions of it.
        along = np.einsum("bkc,kc->b", estimate[:, 1], self.nuisance)
        step = np.clip(along / 64.0, -2.0 * self.drift, 2.0 * self.drift)
        return DetectorState(x, estimate, sums, state.offset + step)

    def _without_noise(self, d: FloatArray, b: IntArray, w: IntArray) -> FloatArray:
        """Estimates d less what noise makes of them, by component: ``d max(1 - 2 var / d², 0)``.

        ``var = Sigma_cc / (1 - phi)² / (2 w - 1)`` is the variance of a mean over a window w.
        """
        variance = np.einsum("mkcc->mkc", self.covariance[b]) / (
            (1.0 - self.memory[b][..., None]) ** 2
            * (2.0 * np.array(WINDOWS)[w] - 1.0)[:, None, None]
        )
        share = np.maximum(d**2 - 2.0 * variance, 0.0) / np.maximum(d**2, np.finfo(float).tiny)
        return np.asarray(share * d)

    def _growth(self, last: FloatArray, x: FloatArray, d: FloatArray, b: IntArray) -> FloatArray:
        """``ln e_n``, shape (m,), of m streams and windows whose estimate is beyond delta."""
        phi, Sigma, delta = self.memory[b][..., None], self.covariance[b], self.dead_band[b]
        size = np.sqrt(np.einsum("mkc,mkc->m", d, d))
        v = d / np.maximum(size, np.finfo(float).tiny)[:, None, None] / (1.0 - phi)
        y = np.einsum("mkc,mkc->m", v, x - phi * last)
        q = np.einsum("mkc,mkcd,mkd->m", v, Sigma, v)
        q = np.maximum(q, np.finfo(float).tiny)
        # Tails heavier than normal ones weigh less.
        s = np.minimum(np.maximum(size - delta, 0.0) / q, 3.0 / np.sqrt(q))
        growth = s * (y - delta) - 0.5 * s**2 * q
        # An alarm needs five revolutions: no single one, whatever disturbs it, raises one.
        return np.asarray(np.minimum(growth, self.threshold / 5))


def threshold_of(revolutions_a_day: float, false_alarms_a_day: float) -> float:
    """H at which the mean run length is that of a rate: ``exp(h) = revolutions / false alarms``."""
    return float(np.log(revolutions_a_day / false_alarms_a_day))


def change_point(vectors: FloatArray, direction: FloatArray, size: float) -> int:
    """Number of the first revolution after a step of a known size along a unit vector.

    The arg max over k of the likelihood of a step at k: ``sum_(i >= k) (<direction, x_i> - size /
    2)``; `vectors`, shape (n, p, C), are the last revolutions, the latest one after the step.
    """
    along = np.einsum("nkc,kc->n", vectors, direction) - 0.5 * size
    return int(vectors.shape[0] - 1 - np.argmax(np.cumsum(along[::-1])))
