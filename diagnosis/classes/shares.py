"""Shares of the gap on held-out blocks, their scatter, and when two results are equal."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.held_out import HeldOutSquares
from carrierflex.diagnosis.comparison.problem import FloatArray

_SEED = 7
#: Quantiles of draws that are a 95 % interval, or the band of a curve.
INTERVAL = (0.025, 0.975)

#: Rounding of a block's squares, as a share of what the baseline leaves there.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Shares:
    """Shares of the gap above the floor, ``1 - sum(e - s) / sum(e_0 - s)``."""

    before: FloatArray  # Squares that the baseline leaves, e_0, shape (n_blocks,)
    floor: FloatArray  # Squares of the noise, s, shape (n_blocks,)
    constants: ClassConstants  # Limits

    @cached_property
    def gap(self) -> float:
        """Squares of the baseline above the floor; a rounding at least."""
        total = float(self.before.sum())
        return max(total - float(self.floor.sum()), 1e-12 * total)

    @cached_property
    def _counts(self) -> FloatArray:
        """How often each block is drawn, shape (n_draws, n_blocks)."""
        n = self.before.size
        rng = np.random.default_rng(_SEED)
        draws = rng.multinomial(n, np.full(n, 1.0 / n), size=self.constants.bootstrap_samples)
        return np.asarray(draws, dtype=np.float64)

    def of(self, result: HeldOutSquares) -> float:
        """Share that a result explains; negative where it is worse than the baseline."""
        return 1.0 - (result.total - float(self.floor.sum())) / self.gap

    def is_at_floor(self, result: HeldOutSquares) -> bool:
        """Whether a result leaves nothing but noise."""
        return result.total <= (1.0 + self.constants.nothing_beyond) * float(self.floor.sum())

    def interval(self, result: HeldOutSquares) -> tuple[float, float]:
        """95 % interval of a share over the blocks, its ends at most one."""
        return self._interval_of(self.before - result.squares)

    def contribution(
        self,
        nothing: HeldOutSquares,
        other: HeldOutSquares,
        alone: HeldOutSquares,
        both: HeldOutSquares,
    ) -> tuple[float, tuple[float, float]]:
        """Part of one class in a pair, with its 95 % interval over the blocks.

        Mean of what it explains alone and of what it adds to the other: the parts of a pair add up
        to its share. A single class has nothing beside it: `other` is `nothing`.

        References
        ----------
        .. [1] L. S. Shapley, "A value for n-person games", Annals of Math. Studies 28 (1953) 307.
        """
        gains = 0.5 * (nothing.squares - alone.squares + other.squares - both.squares)
        return float(gains.sum()) / self.gap, self._interval_of(gains)

    def _interval_of(self, gains: FloatArray) -> tuple[float, float]:
        """95 % interval over the blocks of what is gained in each, as a share of the gap."""
        above = self._counts @ (self.before - self.floor)
        draws = (self._counts @ gains) / np.maximum(above, 0.05 * self.gap)
        low, high = np.quantile(draws, INTERVAL)
        return at_most_one(float(low)), at_most_one(float(high))

    def gain(self, better: HeldOutSquares, worse: HeldOutSquares) -> float:
        """Share of the gap by which one result is better than another."""
        return (worse.total - better.total) / self.gap

    def gain_error(self, better: HeldOutSquares, worse: HeldOutSquares) -> float:
        """Standard error of :meth:`gain` over the blocks."""
        return float((self._counts @ (worse.squares - better.squares)).std()) / self.gap

    def remaining(self, result: HeldOutSquares) -> float:
        """What a result leaves above the floor, never less than the floor is known to."""
        floor = float(self.floor.sum())
        least = self.constants.least_left * floor
        return max(result.total - floor, least) + self.constants.floor_error * floor

    def are_equal(self, first: HeldOutSquares, second: HeldOutSquares) -> bool:
        """Whether the blocks cannot tell two results apart.

        What is left is compared, not the shares: 0.999 against 0.991 is nine times.
        """
        low, high = sorted((self.remaining(first), self.remaining(second)))
        ratio = high / max(low, 1e-300)
        if ratio <= self.constants.equal_left:
            return True
        better, worse = sorted((first, second), key=lambda result: result.total)
        return ratio <= self.constants.most_equal_left and not self.is_beyond_scatter(
            self.gain(better, worse), better, worse
        )

    def leaves_far_less(self, first: HeldOutSquares, second: HeldOutSquares) -> bool:
        """Whether a result leaves less than any that is equal to another, whatever the scatter."""
        return self.remaining(first) * self.constants.most_equal_left < self.remaining(second)

    def is_beyond_scatter(self, gain: float, better: HeldOutSquares, worse: HeldOutSquares) -> bool:
        """Whether a gain is more than its scatter over the blocks."""
        return gain > self.constants.standard_errors * self.gain_error(better, worse)

    def is_gain(self, better: HeldOutSquares, worse: HeldOutSquares, least_gain: float) -> bool:
        """Whether a richer result gains more than a least share of the gap and than its scatter.

        What it learns of the noise itself is no gain: it counts down to the floor.
        """
        gain = self._gain_to_floor(better, worse)
        return gain > least_gain and self.is_beyond_scatter(gain, better, worse)

    def is_clear_gain(
        self, better: HeldOutSquares, worse: HeldOutSquares, least_gain: float
    ) -> bool:
        """Whether a richer result gains enough over a simpler one to take its place.

        It takes its part of what the simpler one leaves, too.
        """
        taken = self._gain_to_floor(better, worse) * self.gap
        of_remaining = self.constants.gain_of_left * self.remaining(worse)
        return self.is_gain(better, worse, least_gain) and taken >= of_remaining

    def takes_of_remaining(
        self, better: HeldOutSquares, worse: HeldOutSquares, share: float
    ) -> bool:
        """Whether a richer result takes a share of what a simpler one leaves, however little.

        In block after block: the ratio of what both leave there stands clear of its scatter.
        """
        limits = self.constants
        takes = self.remaining(better) <= (1.0 - share) * self.remaining(worse)
        is_significant = self._gain_to_floor(better, worse) > limits.small_cause_gain
        errors = self.errors_of_ratio(better, worse)
        return takes and is_significant and errors > limits.small_cause_errors

    def errors_of_ratio(self, better: HeldOutSquares, worse: HeldOutSquares) -> float:
        """Mean of ``log(e_worse / e_better)`` over the blocks, in its standard errors."""
        least = _ROUNDING * self.before
        ratios = np.log(np.maximum(worse.squares, least) / np.maximum(better.squares, least))
        error = float(ratios.std()) / np.sqrt(ratios.size)
        return float(ratios.mean()) / max(error, _ROUNDING)

    def _gain_to_floor(self, better: HeldOutSquares, worse: HeldOutSquares) -> float:
        """Share of the gap gained, as if no result left less than the floor."""
        return (worse.total - max(better.total, float(self.floor.sum()))) / self.gap


def at_most_one(share: float) -> float:
    """Share that leaves the comparison: noise below its declared floor is no part of the gap."""
    return min(share, 1.0)


@dataclass(frozen=True, eq=False)
class PairedShares(Shares):
    """Shares of the gap; a gain counts where the blocks agree on it.

    A class that has not been where one block goes leaves there more than in all others together.
    The difference to a class that holds there then scatters as much as it is, though every single
    block is in its favour. The ratio of both in each block does not:

    ``mean(log(e_worse / e_better)) > t s / sqrt(n_blocks)``, s the standard deviation over the
    blocks and t the standard errors of the limits.

    References
    ----------
    .. [1] J. M. Bland, D. G. Altman, "Transformations, means, and confidence intervals", BMJ 312
       (1996) 1079: paired data whose differences grow with their size are compared by their ratio.
    """

    def is_beyond_scatter(self, gain: float, better: HeldOutSquares, worse: HeldOutSquares) -> bool:
        """Whether the ratio of what both leave is more than its scatter over the blocks."""
        return self.errors_of_ratio(better, worse) > self.constants.standard_errors
