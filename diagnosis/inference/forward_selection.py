"""S2 and S3: the ladder of effect sets, each refitted in full and scored on held-out pieces.

Which of them are supported.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from carrierflex.diagnosis.comparison.problem import ComparisonProblem, Effects, Signatures
from carrierflex.diagnosis.inference.bounded_fit import EffectFit, NestedCostError, fit_effects
from carrierflex.diagnosis.inference.folds import Fold, held_out_folds
from carrierflex.diagnosis.inference.held_out import HeldOut, held_out_score, reduction_draws
from carrierflex.diagnosis.inference.screening import Screen, screen
from carrierflex.diagnosis.inference.thresholds import Thresholds

#: Sets of one size that are extended by a further effect, and further effects tried on each.
_EXTENDED_SETS = 2
_FURTHER_EFFECTS = 4
#: A set whose held-out mean square is this many times that of the best of its size is not extended.
_FAR_BEHIND = 10.0
#: A set within this ratio of the noise's mean square leaves nothing for a further effect.
_NOTHING_LEFT = 1.03
#: RMS ratio of a draw that holds none of the conditions in which an effect acts: one, but for how
#: shared parameters shift.
_UNCHANGED = 1.001
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
    scores : dict
        Held-out scores by sorted set.
    fits : dict
        Fits by sorted set, also of those that were not worth a held-out score.
    stuck : dict
        Sets whose search ended above a set they contain, and how; none of them is supported.
    """

    problem: ComparisonProblem
    folds: Sequence[Fold]
    thresholds: Thresholds
    note: Callable[[str], None]
    scores: dict[Effects, HeldOut] = field(default_factory=dict)
    fits: dict[Effects, EffectFit] = field(default_factory=dict)
    stuck: dict[Effects, str] = field(default_factory=dict)

    def score(self, effects: Effects) -> HeldOut:
        """Score of a set, fitted now where it was not yet."""
        key = tuple(sorted(effects))
        if key not in self.scores:
            self.scores[key] = held_out_score(self.problem, self.fit(key), self.folds)
        return self.scores[key]

    def fit(self, effects: Effects) -> EffectFit:
        """Fit of a set to all pieces, made now where it was not yet."""
        key = tuple(sorted(effects))
        if key not in self.fits:
            self.note(" + ".join(("baseline", *key)))
            contained = [self.fits[smaller] for smaller in self.fits if set(smaller) < set(key)]
            try:
                self.fits[key] = fit_effects(self.problem, key, contained=contained)
            except NestedCostError as error:
                self.fits[key], self.stuck[key] = error.fit, str(error)
        return self.fits[key]

    def is_worth_scoring(self, effects: Effects) -> bool:
        """Whether a set fits its own data enough better than each fitted set it extends.

        Held-out gains are smaller still.
        """
        square = self.fit(effects).sums.square.sum()
        floor = float(self.problem.noise_square.sum())
        smaller = [
            own for own in combinations(sorted(effects), len(effects) - 1) if own in self.fits
        ]
        left = [float(self.fits[own].sums.square.sum()) for own in smaller]
        whole = float(self.fit(()).sums.square.sum()) - floor
        return all(
            explained_share(own, square, floor) >= self.thresholds.explained
            and self._is_material(own, square, floor, whole)
            for own in left
        )

    def _is_material(self, before: float, after: float, floor: float, whole: float) -> bool:
        """Whether a step is a large enough part of the whole gap, or clears what stands out of the floor."""
        limits = self.thresholds
        clears = (
            explained_share(before, after, floor) >= limits.clears
            and before >= limits.stands_out**2 * floor
        )
        return clears or before - after >= limits.material * whole

    def mean_square(self, effects: Effects) -> float:
        """Held-out mean square of a set."""
        return float(self.score(effects).square.sum() / self.problem.cell_counts.sum())

    def leaves_nothing(self, effects: Effects) -> bool:
        """Whether what a set leaves above the floor is too little for a further effect."""
        left, floor = self.mean_square(effects), self.floor
        material = self.thresholds.material * (self.mean_square(()) - floor)
        small = left - floor <= material and left < self.thresholds.stands_out**2 * floor
        return left <= _NOTHING_LEFT * floor or small

    @property
    def floor(self) -> float:
        """Mean square of the noise."""
        return float(self.problem.noise_square.sum() / self.problem.cell_counts.sum())

    def rejection(self, effects: Effects) -> str:
        """Why a set is not supported; empty where every effect in it is.

        An effect must stand off its physical bounds, explain at least the share `explained` of what
        is left without it and, beside others, a material part of the whole gap
        (:class:`carrierflex.diagnosis.inference.thresholds.Thresholds`), and shrink the held-out
        RMS in 97.5 % of the bootstrap draws, or leave it as it is where the drawn conditions do not
        call for it.
        """
        score = self.score(effects)
        if tuple(sorted(effects)) in self.stuck:
            return self.stuck[tuple(sorted(effects))]
        for parameter, hit in zip(score.fit.parameters, score.fit.at_bound, strict=True):
            if hit and parameter.effect in effects:
                return f"{parameter.name} of {parameter.effect} stands on its physical bound"
        if self._fits_any_curve(effects):
            return f"{', '.join(effects)} are laws of one kind along one motion: together they fit any curve"
        smaller = [tuple(own for own in effects if own != effect) for effect in effects]
        floor = float(self.problem.noise_square.sum())
        whole = float(self.score(()).square.sum()) - floor
        # Sets that are scored already come first: they may settle it without another fit.
        for effect, rest in sorted(
            zip(effects, smaller, strict=True), key=lambda pair: pair[1] not in self.scores
        ):
            without = self.score(rest)
            if tuple(sorted(rest)) in self.stuck:
                return f"nothing is known without {effect}: {self.stuck[tuple(sorted(rest))]}"
            share = explained_share(without.square.sum(), score.square.sum(), floor)
            if share < self.thresholds.explained:
                return f"{effect} explains {max(share, 0.0):.0%} of what is left without it"
            if rest and not self._is_material(
                float(without.square.sum()), float(score.square.sum()), floor, whole
            ):
                return (
                    f"{effect} explains less than {self.thresholds.material:.0%} of the whole gap"
                )
            draws = self.shrink_draws(without, score)
            if np.quantile(draws, 0.975) >= _UNCHANGED:
                return f"{effect} grows the held-out gap in some draws of the conditions"
        return ""

    def _fits_any_curve(self, effects: Effects) -> bool:
        """Whether three effects or more, each an alias of every other by its card, act on one channel."""
        cards = self.problem.cards
        return (
            self.problem.n_channels == 1
            and len(effects) > 2
            and all(two in cards[one].aliases for one in effects for two in effects if one != two)
        )

    def supported_sets(self) -> list[Effects]:
        """Sets scored so far that no rule refuses."""
        return [effects for effects in list(self.scores) if effects and not self.rejection(effects)]

    def shrink_draws(self, before: HeldOut, after: HeldOut) -> np.ndarray:
        """Bootstrap draws of RMS after over before."""
        return reduction_draws(
            before.square,
            after.square,
            [segment.condition for segment in self.problem.segments],
            n_samples=self.thresholds.bootstrap_samples,
            rng=np.random.default_rng(_SEED),
        )


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
) -> ForwardSelection:
    """Empty ladder of a plant, scored on the folds that its pieces and parameters allow."""
    own = any(parameter.run is not None for parameter in problem.parameters(()))
    return ForwardSelection(
        problem, held_out_folds(problem.segments, runs_have_own=own), thresholds, note
    )


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
    level: list[Effects] = [search.score((effect,)).fit.effects for effect in survivors]
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
            if search.mean_square(effects) <= _FAR_BEHIND * search.mean_square(level[0]):
                further = _further_effects(effects, screened, signatures, survivors)
                larger += [tuple(sorted((*effects, effect))) for effect in further]
        if size == 2:
            larger += _beside_sensors(search.problem, survivors)
        level = [effects for effects in dict.fromkeys(larger) if search.is_worth_scoring(effects)]
        for effects in level:
            search.score(effects)


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
    return [own.id for own in beside.effects if own.id not in effects and own.surviving > 0.0][
        :_FURTHER_EFFECTS
    ]


def negative_control_scores(search: ForwardSelection, beside: Effects) -> list[HeldOut]:
    """Scores of every placebo added to a set."""
    return [
        search.score((*beside, negative_control))
        for negative_control in search.problem.negative_controls
    ]
