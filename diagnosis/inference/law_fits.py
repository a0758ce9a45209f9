"""Sets of laws fitted in the simulator and scored on held-out records, and which are supported.

Whole conditions are held out where there are enough, blocks otherwise.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name
from carrierflex.diagnosis.comparison.problem import BoolArray, Effects, FloatArray, Segment
from carrierflex.diagnosis.inference.effect_fit import (
    EffectFit,
    NestedFitError,
    SegmentCost,
    fit_effects,
)
from carrierflex.diagnosis.inference.results import RankedSet
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.identification.estimation.gauss_newton import StopRule
from carrierflex.identification.estimation.resampling import two_level_counts
from carrierflex.identification.estimation.scaled_least_squares import column_lengths, full_inverse
from carrierflex.identification.estimation.single_thread import single_threaded

_SEED = 7
#: Sets of laws that are fitted in the simulator at most.
_MOST_SETS = 12
_Made = TypeVar("_Made")
#: With fewer conditions, leaving one out takes away the range of amplitude that the others cannot
#: replace.
FEWEST_CONDITIONS = 3
#: Groups of blocks where there is one condition.
_BLOCK_GROUPS = 4
#: A fold's fit starts at the fit to all segments, next to its own minimum.
_FOLD_STOP = StopRule(most_steps=4)


@dataclass(frozen=True, eq=False)
class Fold:
    """One split of the segments: those held out, and all others, which fit what runs share."""

    held_out: BoolArray  # Segments that fit nothing that runs share, shape (n_segments,)
    #: Held-out segments that are scored together, in turn; the others fit the values of their runs
    scored: tuple[BoolArray, ...]


def held_out_folds(segments: Sequence[Segment], *, runs_have_own: bool) -> tuple[Fold, ...]:
    """Folds in which every segment is scored once.

    Three conditions or more: leave one condition out; where runs have parameters of their own,
    these are fitted on the even blocks of the held-out runs to score the odd ones, and the other
    way round. Two conditions: half of the blocks of one condition at a time. One condition: a
    quarter of the blocks at a time.
    """
    condition = np.array([segment.condition for segment in segments])
    block = np.array([segment.block for segment in segments])
    names = sorted(set(condition))
    folds = []
    for name in names:
        of_name = condition == name
        if len(names) >= FEWEST_CONDITIONS:
            halves = [of_name & (block % 2 == k) for k in (0, 1)] if runs_have_own else [of_name]
            folds.append(Fold(of_name, tuple(half for half in halves if half.any())))
        else:
            n_groups = _BLOCK_GROUPS if len(names) == 1 else 2
            # Number of each segment within its condition.
            group = (np.cumsum(of_name) - 1) % n_groups
            groups = [of_name & (group == k) for k in range(n_groups)]
            folds += [Fold(some, (some,)) for some in groups if some.any()]
    return tuple(folds)


def fold_thetas(problem: ComparisonProblem, fit: EffectFit, fold: Fold) -> Iterator[FloatArray]:
    """Parameters fitted without the segments that are scored in turn, shape (p,) each.

    Those that the training segments do not determine are fitted to the other segments of the
    held-out runs: the values of these runs, and of a law by itself what acts in no other run, as
    the compliance to a radial load that one run alone has.
    """
    in_training = {problem.segments[k].run for k in np.flatnonzero(~fold.held_out)}
    free = np.array(
        [parameter.run is None or parameter.run in in_training for parameter in fit.parameters],
        dtype=bool,
    )
    # A further law must pay in runs that it was not fitted to.
    if len(fold.scored) > 1 and len(fit.effects) == 1:
        free &= ~_acts_elsewhere(fit, ~fold.held_out)
    training = SegmentCost(
        problem, fit.effects, fit.prior, chosen=~fold.held_out, free=free, stop=_FOLD_STOP
    )
    theta, _ = training.least(fit.theta, fit.sums)
    for scored in fold.scored:
        others = replace(training, chosen=fold.held_out & ~scored, free=~free)
        yield others.least(theta)[0] if others.chosen.any() and not free.all() else theta


def _acts_elsewhere(fit: EffectFit, chosen: BoolArray) -> BoolArray:
    """Parameters that all segments determine and the chosen ones do not, shape (p,)."""
    every, some = fit.sums.total_matrix(), fit.sums.total_matrix(chosen)
    length = column_lengths(every)
    variance, of_chosen = (
        np.diag(full_inverse((matrix + np.diag(fit.prior.weight)) / np.outer(length, length)))
        for matrix in (every, some)
    )
    return np.asarray(variance < Thresholds().surviving_share ** 2 * of_chosen)


@dataclass(eq=False)
class LawFits:
    """Sets of laws fitted so far, each once."""

    problem: ComparisonProblem  # Records and simulator
    folds: Sequence[Fold]  # Splits
    thresholds: Thresholds  # Limits
    note: Callable[[str], None]  # Told what is tried, for progress
    #: Where sets that do not wait for each other are fitted and scored; None in this process
    executor: Executor | None = None
    #: Sums of squared held-out residuals by sorted set, shape (n_segments,)
    scores: dict[Effects, FloatArray] = field(default_factory=dict)
    #: Fits to all segments by sorted set, also of those that were not worth a held-out score
    fits: dict[Effects, EffectFit] = field(default_factory=dict)
    #: Sets whose search ended above a set they contain, and how; none of them is supported
    failed_searches: dict[Effects, str] = field(default_factory=dict)

    def score(self, effects: Effects) -> FloatArray:
        """Held-out squares of a set, which is fitted now where it was not yet."""
        self.score_all([effects])
        return self.scores[tuple(sorted(effects))]

    def fit(self, effects: Effects) -> EffectFit:
        """Fit of a set to all segments, made now where it was not yet."""
        self._fit_all([tuple(sorted(effects))])
        return self.fits[tuple(sorted(effects))]

    def score_all(self, sets: Sequence[Effects]) -> None:
        """Score several sets, none of which contains another; where there is an executor, there."""
        keys = [tuple(sorted(effects)) for effects in sets]
        keys = [key for key in dict.fromkeys(keys) if key not in self.scores]
        self._fit_all(keys)
        scores = self._made(
            _scored_set, keys, lambda key: (self.problem, self.fits[key], self.folds)
        )
        self.scores |= dict(zip(keys, scores, strict=True))

    def _fit_all(self, keys: Sequence[Effects]) -> None:
        """Fit the sorted sets that are not fitted yet."""

        def arguments(key: Effects) -> tuple[ComparisonProblem, Effects, list[EffectFit]]:
            self.note(" + ".join(("baseline", *key)))
            # A larger set cannot fit worse than a smaller one.
            contained = [fit for smaller, fit in self.fits.items() if set(smaller) < set(key)]
            return self.problem, key, contained

        keys = [key for key in keys if key not in self.fits]
        made = self._made(_fitted_set, keys, arguments)
        for key, (fit, failure) in zip(keys, made, strict=True):
            self.fits[key] = fit
            if failure:
                self.failed_searches[key] = failure

    def _made(
        self,
        task: Callable[..., _Made],
        keys: Sequence[Effects],
        arguments: Callable[[Effects], tuple[Any, ...]],
    ) -> Iterator[_Made]:
        """Results of a task, in other processes where there is an executor and more than one."""
        if self.executor is None or len(keys) < 2:
            return (task(*arguments(key)) for key in keys)
        futures = [self.executor.submit(task, *arguments(key)) for key in keys]
        return (future.result() for future in futures)

    def mean_square(self, effects: Effects) -> float:
        """Held-out mean square of a set."""
        return float(self.score(effects).sum() / self.problem.cell_counts.sum())

    @property
    def is_at_floor(self) -> bool:
        """Whether the baseline alone leaves no more than the noise."""
        return self.mean_square(()) <= self.thresholds.floor_ratio * self.floor

    @property
    def floor(self) -> float:
        """Mean square of the noise."""
        return self.problem.noise_floor_square

    def rejection(self, effects: Effects) -> str:
        """Why a set is not supported; empty where every effect in it is.

        The search of a set must have converged; an effect must keep off its physical bounds,
        explain at least the share `explained` of the gap left without it and, beside others, a
        material part of the whole gap, and reduce the held-out RMS in nearly all bootstrap draws,
        or leave it as it is where the drawn conditions do not call for it
        (:class:`carrierflex.diagnosis.inference.thresholds.Thresholds`).
        """
        square = self.score(effects)
        if failure := self.failed_searches.get(tuple(sorted(effects))):
            return failure
        fit = self.fit(effects)
        for parameter, hit in zip(fit.parameters, fit.at_bound, strict=True):
            if hit and parameter.effect in effects:
                return (
                    f"{parameter.name} of {plain_name(parameter.effect)} is at its physical bound "
                    "within the noise"
                )
        others = {effect: tuple(e for e in effects if e != effect) for effect in effects}
        # Sets that are scored already come first: they may settle it without another fit.
        by_scored = sorted(effects, key=lambda effect: others[effect] not in self.scores)
        rejections = (self._member_rejection(square, one, others[one]) for one in by_scored)
        return next((rejection for rejection in rejections if rejection), "")

    def _member_rejection(self, square: FloatArray, effect: str, others: Effects) -> str:
        """Why an effect of a set does not belong to it beside the others; empty where it does."""
        limits, name = self.thresholds, plain_name(effect)
        without = self.score(others)
        if failure := self.failed_searches.get(tuple(sorted(others))):
            return f"no result without {name}: {failure}"
        floor = float(self.problem.noise_square.sum())
        total_gap = float(self.score(()).sum()) - floor
        before, after = float(without.sum()), float(square.sum())
        share = explained_share(before, after, floor)
        if share < limits.explained:
            return f"{name} explains {max(share, 0.0):.0%} of the gap left without it"
        clears = share >= limits.clears and before >= limits.stands_out**2 * floor
        if others and not clears and before - after < limits.material * total_gap:
            return f"{name} explains less than {limits.material:.0%} of the total gap"
        draws = self.reduction_draws(without, square)
        if np.quantile(draws, limits.draws_that_reduce) >= limits.unchanged:
            level = 1.0 - limits.draws_that_reduce
            return (
                f"{name} grows the held-out gap in more than {level:.1%} of the bootstrap samples"
            )
        return ""

    def reduction_draws(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """Draws of RMS after over before: of conditions, then of segments within them."""
        counts = two_level_counts(
            [segment.condition for segment in self.problem.segments],
            n_samples=self.thresholds.bootstrap_samples,
            rng=np.random.default_rng(_SEED + self.thresholds.seed),
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt((counts @ after) / (counts @ before))


def _fitted_set(
    problem: ComparisonProblem, effects: Effects, contained: Sequence[EffectFit]
) -> tuple[EffectFit, str]:
    """Fit of a set; how its search ended above a set that it contains, empty where it did not."""
    with single_threaded():
        try:
            return fit_effects(problem, effects, contained=contained), ""
        except NestedFitError as error:
            return error.fit, str(error)


def _scored_set(problem: ComparisonProblem, fit: EffectFit, folds: Sequence[Fold]) -> FloatArray:
    """Held-out squares of a set on every fold."""
    square = np.full(len(problem.segments), np.nan)
    with single_threaded():
        for fold in folds:
            for scored, theta in zip(fold.scored, fold_thetas(problem, fit, fold), strict=True):
                squares = problem.squares(fit.effects, theta, scored)
                square[scored] = squares[scored].sum(axis=1)
    return square


def explained_share(before: float, after: float, floor: float) -> float:
    """Share of a sum of squares above the floor that is explained.

    ``1 - (after - floor) / (before - floor)``, at most one: what leaves less than the floor
    explains all of it, and no more.
    """
    above = before - floor
    return float(min(1.0 - (after - floor) / above, 1.0)) if above > 0.0 else 0.0


def law_fits(
    problem: ComparisonProblem,
    thresholds: Thresholds,
    note: Callable[[str], None] = lambda text: None,
    executor: Executor | None = None,
) -> LawFits:
    """No set yet, to be scored on the folds that segments and parameters allow."""
    varies_by_run = any(parameter.run is not None for parameter in problem.parameters(()))
    folds = held_out_folds(problem.segments, runs_have_own=varies_by_run)
    return LawFits(problem, folds, thresholds, note, executor)


@dataclass(frozen=True, eq=False)
class Selection:
    """What the fits of the laws say."""

    #: Smallest supported set that predicts as well as the best; empty where none is supported
    accepted: Effects
    #: Other supported sets that predict as well, of as many parameters or fewer, or of laws that
    #: the cards call its aliases and that leave less
    rivals: tuple[Effects, ...]
    ranking: tuple[RankedSet, ...]  # All sets that were fitted, smallest held-out RMS first


def candidate_sets(
    problem: ComparisonProblem, of_table: Sequence[Effects] | None
) -> tuple[Effects, ...]:
    """Sets of laws that the table of the classes proposes; without one every law by itself."""
    if of_table is None:
        return tuple((law,) for law in problem.cards)
    of_files = tuple(law for law in problem.brought if law in problem.cards)
    brought: list[Effects] = [(law,) for law in of_files]
    if len(of_files) > 1:
        brought.append(of_files)
    proposed = [laws for laws in of_table if set(laws) <= set(problem.cards)]
    return tuple(dict.fromkeys((*brought, *proposed[:_MOST_SETS])))


def selected(
    fits: LawFits,
    sets: Sequence[Effects],
    absent: frozenset[str] = frozenset(),
    alike: Sequence[Effects] = (),
) -> Selection:
    """Fit sets of laws and accept the smallest supported one that predicts as well as the best.

    No set with a law of `absent` is supported: declared errors and priors explain its values. Laws
    of one group of `alike` differ only in what they follow, which these records cannot say: one
    counts no more parameters than another.
    """
    fits.score(())
    for size in sorted({len(laws) for laws in sets}):
        fits.score_all([laws for laws in sets if len(laws) == size])
    rejections = {laws: fits.rejection(laws) or _absence(laws, absent) for laws in sets}
    supported = [laws for laws in sets if not rejections[laws]]
    supported = [laws for laws in supported if np.isfinite(fits.mean_square(laws))]
    accepted: Effects = ()
    rivals: list[Effects] = []
    if supported:
        best = min(supported, key=fits.mean_square)
        # The best is as good as itself, also where nothing is left and no ratio can be made.
        most = fits.thresholds.equal_rms
        equal = [
            laws
            for laws in supported
            if laws == best or np.sqrt(fits.mean_square(laws) / fits.mean_square(best)) <= most
        ]
        sizes = {laws: _size(fits, laws, alike) for laws in equal}
        accepted = min(equal, key=lambda laws: (*sizes[laws], fits.mean_square(laws)))
        rivals = [
            laws
            for laws in equal
            if laws != accepted
            and (sizes[laws] <= sizes[accepted] or _is_richer_alias(fits, laws, accepted))
        ]
    ranking = [
        RankedSet(laws, float(np.sqrt(fits.mean_square(laws))), rejection)
        for laws, rejection in rejections.items()
    ]
    ordered = sorted(ranking, key=lambda entry: entry.held_out_rms)
    return Selection(accepted, tuple(rivals), tuple(ordered))


def _absence(laws: Effects, absent: frozenset[str]) -> str:
    """Rejection of a set for a law that may be absent; empty where none may be."""
    names = (plain_name(law) for law in laws if law in absent)
    return next((f"{name} is zero within declared errors and priors" for name in names), "")


def _is_richer_alias(fits: LawFits, laws: Effects, accepted: Effects) -> bool:
    """Whether laws of more parameters than those accepted may be the cause instead.

    More parameters speak against laws, unless those accepted are known to pass for them and they
    leave less: pins with clearance look like stiffer pins at one load. Beside an error of a sensor,
    which the fit chose, they need not predict better, only hold it: the zero of any of four
    sensors is a saddle.
    """
    others = [law for law in laws if law not in accepted]
    replaced = [law for law in accepted if law not in laws]
    if set(replaced) <= fits.problem.of_chosen_channel:
        squares = [float(fits.fits[one].sums.square.sum()) for one in (laws, accepted)]
    else:
        squares = [fits.mean_square(one) for one in (laws, accepted)]
    if squares[0] >= squares[1]:
        return False
    return len(others) == len(replaced) and all(
        any(other in fits.problem.cards[law].aliases for other in others) for law in replaced
    )


def _size(fits: LawFits, laws: Effects, alike: Sequence[Effects]) -> tuple[int, int]:
    """Laws, and their parameters."""
    more = 0
    for group in alike:
        sizes = {law: len(fits.problem.cards[law].parameters) for law in group}
        more += sum(sizes[law] - min(sizes.values()) for law in group if law in laws)
    return len(laws), len(fits.fits[laws].parameters) - more
