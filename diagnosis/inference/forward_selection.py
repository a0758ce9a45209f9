"""S2 and S3: forward selection of effect sets.

Each refitted in full and scored on held-out segments.

Which of them are supported.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from itertools import combinations, permutations

import numpy as np
from threadpoolctl import threadpool_limits

from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.comparison.problem import ComparisonProblem, Effects, Signatures
from carrierflex.diagnosis.inference.effect_fit import EffectFit, NestedFitError, fit_effects
from carrierflex.diagnosis.inference.folds import Fold, held_out_folds
from carrierflex.diagnosis.inference.held_out import HeldOut, held_out_score, reduction_draws
from carrierflex.diagnosis.inference.results import Rejection
from carrierflex.diagnosis.inference.screening import Screen, screen
from carrierflex.diagnosis.inference.thresholds import Thresholds

#: Sets of one size that are extended by a further effect, and further effects tried on each.
_EXTENDED_SETS = 2
_FURTHER_EFFECTS = 4
_SEED = 7


@dataclass(eq=False)
class ForwardSelection:
    """Sets of effects tried so far; grows while the search runs.

    Parameters
    ----------
    problem : ComparisonProblem
        Records and simulator.
    folds : sequence of Fold
        Splits.
    thresholds : Thresholds
        Limits.
    note : callable
        Told what is tried, for progress.
    executor : Executor, optional
        Where sets that do not wait for each other are fitted and scored; None in this process.
    scores : dict
        Held-out scores by sorted set.
    fits : dict
        Fits by sorted set, also of those that were not worth a held-out score.
    failed_searches : dict
        Sets whose search ended above a set they contain, and how; none of them is supported.
    """

    problem: ComparisonProblem
    folds: Sequence[Fold]
    thresholds: Thresholds
    note: Callable[[str], None]
    executor: Executor | None = None
    scores: dict[Effects, HeldOut] = field(default_factory=dict)
    fits: dict[Effects, EffectFit] = field(default_factory=dict)
    failed_searches: dict[Effects, str] = field(default_factory=dict)

    def score(self, effects: Effects) -> HeldOut:
        """Score of a set, fitted now where it was not yet."""
        key = tuple(sorted(effects))
        if key not in self.scores:
            self.scores[key] = held_out_score(self.problem, self.fit(key), self.folds)
        return self.scores[key]

    def fit(self, effects: Effects) -> EffectFit:
        """Fit of a set to all segments, made now where it was not yet."""
        key = tuple(sorted(effects))
        if key not in self.fits:
            self.note(" + ".join(("baseline", *key)))
            fit, failure = _fitted_set(self.problem, key, self._contained(key))
            self._keep(key, fit, failure)
        return self.fits[key]

    def fit_all(self, sets: Sequence[Effects]) -> None:
        """Fit several sets, none of which contains another; where there is an executor, there."""
        keys = self._sorted(sets, self.fits)
        if self.executor is None or len(keys) < 2:
            for key in keys:
                self.fit(key)
            return
        futures = {}
        for key in keys:
            self.note(" + ".join(("baseline", *key)))
            contained = self._contained(key)
            futures[key] = self.executor.submit(_fitted_set, self.problem, key, contained)
        for key, future in futures.items():
            self._keep(key, *future.result())

    def score_all(self, sets: Sequence[Effects]) -> None:
        """Score several sets, none of which contains another; where there is an executor, there."""
        self.fit_all(sets)
        keys = self._sorted(sets, self.scores)
        if self.executor is None or len(keys) < 2:
            for key in keys:
                self.score(key)
            return
        futures = {
            key: self.executor.submit(_scored_set, self.problem, self.fits[key], self.folds)
            for key in keys
        }
        self.scores |= {key: future.result() for key, future in futures.items()}

    def _sorted(self, sets: Sequence[Effects], known: Mapping[Effects, object]) -> list[Effects]:
        """Sets that are not known yet, each once."""
        keys = dict.fromkeys(tuple(sorted(effects)) for effects in sets)
        return [key for key in keys if key not in known]

    def _contained(self, key: Effects) -> list[EffectFit]:
        """Fits of smaller sets, which a larger one cannot fit worse than."""
        return [fit for smaller, fit in self.fits.items() if set(smaller) < set(key)]

    def _keep(self, key: Effects, fit: EffectFit, failure: str) -> None:
        self.fits[key] = fit
        if failure:
            self.failed_searches[key] = failure

    def is_worth_scoring(self, effects: Effects) -> bool:
        """Whether a set fits its own data enough better than each fitted set it extends.

        Held-out gains are smaller still.
        """
        after = float(self.fit(effects).sums.square.sum())
        floor = float(self.problem.noise_square.sum())
        smaller_sets = combinations(sorted(effects), len(effects) - 1)
        squares = [
            float(self.fits[smaller].sums.square.sum())
            for smaller in smaller_sets
            if smaller in self.fits
        ]
        total_gap = float(self.fit(()).sums.square.sum()) - floor
        return all(
            explained_share(before, after, floor) >= self.thresholds.explained
            and self._is_material(before, after, floor, total_gap)
            for before in squares
        )

    def _is_material(self, before: float, after: float, floor: float, total_gap: float) -> bool:
        """Whether a step is a large enough part of the gap, or clears what exceeds the floor."""
        limits = self.thresholds
        clears = (
            explained_share(before, after, floor) >= limits.clears
            and before >= limits.stands_out**2 * floor
        )
        return clears or before - after >= limits.material * total_gap

    def mean_square(self, effects: Effects) -> float:
        """Held-out mean square of a set."""
        return float(self.score(effects).square.sum() / self.problem.cell_counts.sum())

    def leaves_nothing(self, effects: Effects) -> bool:
        """Whether what a set leaves above the floor is too little for a further effect."""
        limits = self.thresholds
        floor = self.floor
        remaining = self.mean_square(effects)
        material = limits.material * (self.mean_square(()) - floor)
        is_small = remaining - floor <= material and remaining < limits.stands_out**2 * floor
        return remaining <= limits.nothing_left * floor or is_small

    @property
    def floor(self) -> float:
        """Mean square of the noise."""
        return float(self.problem.noise_square.sum() / self.problem.cell_counts.sum())

    def rejection(self, effects: Effects) -> Rejection | None:
        """Why a set is not supported; None where every effect in it is.

        The search of a set must have converged; an effect must keep off its physical bounds,
        explain at least the share `explained` of what is left without it and, beside others, a
        material part of the whole gap, and reduce the held-out RMS in nearly all bootstrap draws,
        or leave it as it is where the drawn conditions do not call for it
        (:class:`carrierflex.diagnosis.inference.thresholds.Thresholds`).
        """
        score = self.score(effects)
        failure = self.failed_searches.get(tuple(sorted(effects)))
        if failure is not None:
            return Rejection("search", "", failure)
        for parameter, hit in zip(score.fit.parameters, score.fit.at_bound, strict=True):
            if hit and parameter.effect in effects:
                text = (
                    f"{parameter.name} of {plain_name(parameter.effect)} is at its physical bound"
                )
                return Rejection("bound", parameter.effect, text)
        if self._fits_any_curve(effects):
            text = (
                f"{set_name(effects)} are laws of one kind along one motion: "
                "together they fit any curve"
            )
            return Rejection("any_curve", "", text)
        others = {effect: tuple(e for e in effects if e != effect) for effect in effects}
        # Sets that are scored already come first: they may settle it without another fit.
        by_scored = sorted(effects, key=lambda effect: others[effect] not in self.scores)
        rejections = (self._member_rejection(score, effect, others[effect]) for effect in by_scored)
        return next((rejection for rejection in rejections if rejection), None)

    def _member_rejection(self, score: HeldOut, effect: str, others: Effects) -> Rejection | None:
        """Why an effect of a set does not belong to it beside the others."""
        limits = self.thresholds
        without = self.score(others)
        failure = self.failed_searches.get(tuple(sorted(others)))
        if failure is not None:
            return Rejection(
                "search", effect, f"nothing is known without {plain_name(effect)}: {failure}"
            )
        floor = float(self.problem.noise_square.sum())
        total_gap = float(self.score(()).square.sum()) - floor
        before = float(without.square.sum())
        after = float(score.square.sum())
        share = explained_share(before, after, floor)
        if share < limits.explained:
            explained = f"{max(share, 0.0):.0%}"
            text = f"{plain_name(effect)} explains {explained} of what is left without it"
            return Rejection("explained", effect, text)
        if others and not self._is_material(before, after, floor, total_gap):
            least = f"{limits.material:.0%}"
            text = f"{plain_name(effect)} explains less than {least} of the total gap"
            return Rejection("material", effect, text)
        draws = self.reduction_draws(without, score)
        if np.quantile(draws, limits.draws_that_reduce) >= limits.unchanged:
            part = 1.0 - limits.draws_that_reduce
            text = (
                f"{plain_name(effect)} grows the held-out gap in more than {part:.1%} of the "
                "bootstrap samples"
            )
            return Rejection("draws", effect, text)
        return None

    def _fits_any_curve(self, effects: Effects) -> bool:
        """Whether three mutual aliases or more act on one channel.

        Aliases by their cards, each of every other.
        """
        cards = self.problem.cards
        return (
            self.problem.n_channels == 1
            and len(effects) > 2
            and all(other in cards[effect].aliases for effect, other in permutations(effects, 2))
        )

    def supported_sets(self) -> list[Effects]:
        """Sets scored so far that no rule rejects."""
        return [effects for effects in list(self.scores) if effects and not self.rejection(effects)]

    def reduction_draws(self, before: HeldOut, after: HeldOut) -> np.ndarray:
        """Bootstrap draws of RMS after over before."""
        return reduction_draws(
            before.square,
            after.square,
            [segment.condition for segment in self.problem.segments],
            n_samples=self.thresholds.bootstrap_samples,
            rng=np.random.default_rng(_SEED + self.thresholds.seed),
        )


def _fitted_set(
    problem: ComparisonProblem, effects: Effects, contained: Sequence[EffectFit]
) -> tuple[EffectFit, str]:
    """Fit of a set, and how its search ended above a set that it contains; empty where it did not.

    A pure function, so that it can be called in another process.
    """
    with threadpool_limits(limits=1):
        try:
            return fit_effects(problem, effects, contained=contained), ""
        except NestedFitError as error:
            return error.fit, str(error)


def _scored_set(problem: ComparisonProblem, fit: EffectFit, folds: Sequence[Fold]) -> HeldOut:
    """Held-out score of a set, in another process."""
    with threadpool_limits(limits=1):
        return held_out_score(problem, fit, folds)


def explained_share(before: float, after: float, floor: float) -> float:
    """Share of a sum of squares above the floor that is explained.

    ``1 - (after - floor) / (before - floor)``.
    """
    above = before - floor
    return 1.0 - (after - floor) / above if above > 0.0 else 0.0


def forward_selection(
    problem: ComparisonProblem,
    thresholds: Thresholds,
    note: Callable[[str], None] = lambda text: None,
    executor: Executor | None = None,
) -> ForwardSelection:
    """Selection without a set yet, scored on the folds that segments and parameters allow."""
    runs_have_own = any(parameter.run is not None for parameter in problem.parameters(()))
    folds = held_out_folds(problem.segments, runs_have_own=runs_have_own)
    return ForwardSelection(problem, folds, thresholds, note, executor)


def select_forward(search: ForwardSelection, screened: Screen, signatures: Signatures) -> None:
    """Try single effects, pairs and larger sets until nothing is left or no set pays.

    Parameters
    ----------
    search : ForwardSelection
        Grows by the sets tried.
    screened : Screen
        Force-space screen of the baseline's residual.
    signatures : Signatures
        Columns of the screen, to screen again beside the best set.
    """
    search.score(())
    survivors = screened.survivors(search.thresholds)
    search.score_all([(effect,) for effect in survivors])
    level: list[Effects] = [(effect,) for effect in survivors]
    for size in range(2, search.thresholds.most_effects + 1):
        level.sort(key=search.mean_square)
        nothing_left = bool(level) and search.leaves_nothing(level[0])
        if not level or nothing_left or (size > 2 and not _last_level_pays(search, level)):
            return
        larger = []
        # Several laws along one motion are hardly ever right beyond two: there the best pair alone
        # is extended.
        extended = _EXTENDED_SETS if size == 2 or search.problem.n_channels > 1 else 1
        for effects in level[:extended]:
            if search.mean_square(effects) <= search.thresholds.far_behind * search.mean_square(
                level[0]
            ):
                further = _further_effects(effects, screened, signatures, survivors)
                larger += [tuple(sorted((*effects, effect))) for effect in further]
        if size == 2:
            larger += _beside_sensors(search.problem, survivors)
        larger = list(dict.fromkeys(larger))
        search.fit_all(larger)
        level = [effects for effects in larger if search.is_worth_scoring(effects)]
        search.score_all(level)


def _beside_sensors(problem: ComparisonProblem, survivors: Effects) -> list[Effects]:
    """Every survivor with every effect that acts on it.

    Neither need show alone what both do together.
    """
    acting = [card.id for card in problem.cards.values() if card.acts_on_others]
    return [
        tuple(sorted((effect, other)))
        for effect in survivors
        for other in acting
        if effect != other
    ]


def _last_level_pays(search: ForwardSelection, level: list[Effects]) -> bool:
    """Whether the best supported set so far is one of the largest sets tried."""
    supported = search.supported_sets()
    return bool(supported) and min(supported, key=search.mean_square) in level


def _further_effects(
    effects: Effects, screened: Screen, signatures: Signatures, survivors: Effects
) -> list[str]:
    """Effects to add: the best of a new screen beside the set, then survivors of the first."""
    chosen = best_beside(effects, screened, signatures)
    return [*chosen, *(effect for effect in survivors[:2] if effect not in (*chosen, *effects))]


def best_beside(effects: Effects, screened: Screen, signatures: Signatures) -> list[str]:
    """Effects that explain most of what a set leaves in the space of the screen, best first."""
    beside = screen(signatures, beside={effect: screened.of(effect).variant for effect in effects})
    visible = [
        entry.id for entry in beside.effects if entry.id not in effects and entry.surviving > 0.0
    ]
    return visible[:_FURTHER_EFFECTS]


def negative_control_scores(search: ForwardSelection, beside: Effects) -> list[HeldOut]:
    """Scores of every negative control added to a set."""
    sets = [(*beside, negative_control) for negative_control in search.problem.negative_controls]
    search.score_all(sets)
    return [search.score(effects) for effects in sets]
