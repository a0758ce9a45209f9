"""How far the gap shrinks on held-out records by the accepted laws, with intervals."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from carrierflex.diagnosis.comparison.problem import (
    BoolArray,
    Effects,
    FloatArray,
    GapCell,
    Segment,
)
from carrierflex.diagnosis.inference.effect_fit import EffectFit
from carrierflex.diagnosis.inference.law_fits import (
    Fold,
    LawFits,
    explained_share,
    fold_thetas,
)
from carrierflex.diagnosis.inference.results import (
    NO_INTERVAL,
    BlockScore,
    GapReduction,
    Interval,
    RunValidation,
    SelectionStep,
)
from carrierflex.diagnosis.inference.thresholds import INTERVAL
from carrierflex.diagnosis.kind.comparison_problem import ComparisonProblem
from carrierflex.identification.estimation.resampling import two_level_counts

_SEED = 11


def gap_reduction(search: LawFits, accepted: Effects) -> GapReduction:
    """GapReduction of the accepted set; of the baseline against itself where none is accepted.

    ``rho = RMS after / before``, ``phi = 1 - (MSE after - s²) / (MSE before - s²)`` on held-out
    segments, intervals by the two-level bootstrap (conditions, then segments).
    """
    problem = search.problem
    before = _baseline_square(search)
    after = search.score(accepted) if accepted else before
    rho, rho_draws, phi, phi_draws = _ratios(search, before, after)
    floor = float(np.sqrt(search.floor))
    n_samples = problem.cell_counts.sum()
    rms = [float(np.sqrt(square.sum() / n_samples)) for square in (before, after)]
    baseline, fit = search.fit(()), search.fit(accepted)
    cells_before = problem.gap((), baseline.theta).cells
    # One map where nothing is accepted: of hundreds of runs it holds a million cells.
    cells_after = problem.gap(fit.effects, fit.theta).cells if accepted else cells_before
    return GapReduction(
        rms_before=rms[0],
        rms_after=rms[1],
        noise_floor=floor,
        rho=rho,
        rho_ci95=_interval(rho_draws),
        phi=phi,
        phi_ci95=_interval(phi_draws),
        floor_multiple=rms[1] / floor if floor > 0.0 else float("inf"),
        extrapolation_rho=_extrapolation(search, accepted),
        steps=_steps(search, accepted, before),
        cells_before=cells_before,
        cells_after=cells_after,
        validation=_validation(problem, cells_before, cells_after, fit),
        blocks=tuple(
            BlockScore(one.run, one.condition, one.block, one.n_samples, square)
            for one, square in zip(problem.segments, _by_sample(problem, before), strict=True)
        ),
    )


def _by_sample(problem: ComparisonProblem, square: FloatArray) -> list[float]:
    """Mean squares of the samples of every segment."""
    n_samples = np.array([segment.n_samples for segment in problem.segments])
    return (square / np.maximum(n_samples, 1)).tolist()


def _baseline_square(search: LawFits) -> FloatArray:
    """Squares of the baseline: held out, or where they exceed the signal, of the fit to all."""
    # A baseline that other records do not determine (mass and spring at one frequency) may predict
    # held-out ones worse than no motion would be; that is no gap which a cause could close.
    problem, square = search.problem, search.score(())
    if not square.sum() > problem.signal_square:
        return square
    everywhere = np.ones(len(problem.segments), dtype=bool)
    return problem.squares((), search.fit(()).theta, everywhere).sum(axis=1)


def _rho(before: FloatArray, after: FloatArray) -> float:
    return float(np.sqrt(after.sum() / before.sum()))


def _ratios(
    search: LawFits, before: FloatArray, after: FloatArray
) -> tuple[float, FloatArray, float, FloatArray]:
    """Values of rho and phi, and their draws."""
    counts = two_level_counts(
        [segment.condition for segment in search.problem.segments],
        n_samples=search.thresholds.bootstrap_samples,
        rng=np.random.default_rng(_SEED + search.thresholds.seed),
    )
    noise = search.problem.noise_square.sum(axis=1)
    sums = [counts @ values for values in (before, after, noise)]
    phi_draws = np.array([explained_share(b, a, n) for b, a, n in zip(*sums, strict=True)])
    phi = explained_share(before.sum(), after.sum(), noise.sum())
    return _rho(before, after), np.sqrt(sums[1] / sums[0]), phi, phi_draws


def _taken(problem: ComparisonProblem, square: FloatArray) -> Mapping[str, Any]:
    """RMS that an effect takes by run, and in the halves of the runs; negative where it harms.

    `square` is what the squares are less by with it, shape (n_segments,).
    """
    samples = np.array([segment.n_samples for segment in problem.segments])
    runs = np.array([segment.run for segment in problem.segments])
    block = np.array([segment.block for segment in problem.segments])
    is_late = np.zeros(runs.size, dtype=bool)
    for run in set(runs):
        of_run = runs == run
        is_late |= of_run & (block > 0.5 * (block[of_run].min() + block[of_run].max()))

    def rms(chosen: BoolArray) -> float:
        """Signed RMS over some segments."""
        mean = float(square[chosen].sum() / max(samples[chosen].sum(), 1))
        return float(np.copysign(np.sqrt(abs(mean)), mean))

    has_halves = is_late.any() and not is_late.all()
    return {
        "by_run": {str(run): rms(runs == run) for run in dict.fromkeys(runs)},
        "halves": (rms(~is_late), rms(is_late)) if has_halves else NO_INTERVAL,
    }


def _interval(draws: FloatArray) -> Interval:
    low, high = np.quantile(draws, INTERVAL)
    return float(low), float(high)


def _steps(search: LawFits, accepted: Effects, base: FloatArray) -> tuple[SelectionStep, ...]:
    """Baseline, then the accepted effects, each time the one that shrinks the gap most."""
    rms = float(np.sqrt(base.sum() / search.problem.cell_counts.sum()))
    steps = [SelectionStep("baseline", rms, 1.0, NO_INTERVAL)]
    inside: Effects = ()
    phi, phi_draws = 0.0, np.zeros(1)
    while len(inside) < len(accepted):
        options = [tuple(sorted((*inside, effect))) for effect in accepted if effect not in inside]
        larger = min(options, key=search.mean_square)
        added = next(effect for effect in larger if effect not in inside)
        score, without = search.score(larger), search.score(inside) if inside else base
        inside = larger
        _, _, new_phi, new_draws = _ratios(search, base, score)
        steps.append(
            SelectionStep(
                added,
                float(np.sqrt(search.mean_square(inside))),
                _rho(base, score),
                _interval(search.reduction_draws(base, score)),
                share=new_phi - phi,
                share_ci95=_interval(new_draws - phi_draws),
                **_taken(search.problem, without - score),
            )
        )
        phi, phi_draws = new_phi, new_draws
    return tuple(steps)


def _extrapolation(search: LawFits, accepted: Effects) -> float:
    """Ratio of RMS in the condition with the largest gap, predicted from all others."""
    problem = search.problem
    fold = _extrapolation_fold(problem.segments, _by_sample(problem, search.score(())))
    if fold is None or not accepted:
        return float("nan")
    squares = []
    for effects in ((), accepted):
        fit = search.fit(effects)
        (theta,) = fold_thetas(problem, fit, fold)
        # The fit may hold the same effects in another order.
        squares.append(problem.squares(fit.effects, theta, fold.held_out)[fold.held_out].sum())
    return float(np.sqrt(squares[1] / squares[0]))


def _extrapolation_fold(segments: Sequence[Segment], gap: Sequence[float]) -> Fold | None:
    """The condition with the largest gap, predicted from all others; None where there is one."""
    condition = np.array([segment.condition for segment in segments])
    names = sorted(set(condition))
    if len(names) < 2:
        return None
    sizes = {name: float(np.mean(np.asarray(gap)[condition == name])) for name in names}
    outside = condition == max(sizes, key=lambda name: sizes[name])
    return Fold(outside, (outside,))


def _validation(
    problem: ComparisonProblem, before: Sequence[GapCell], after: Sequence[GapCell], fit: EffectFit
) -> tuple[RunValidation, ...]:
    """Comparison error by run."""
    numerical = problem.numerical_error(fit.effects, fit.theta)
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0, 0.0])
    for cell in before:
        sums[cell.run][0] += cell.coherent
    for cell in after:
        sums[cell.run][1] += cell.coherent
        sums[cell.run][2] += max(cell.mean_square - cell.coherent, 0.0)
    rows = []
    for run in dict.fromkeys(segment.run for segment in problem.segments):
        *coherent, noise = sums[run]
        squares = np.maximum([*coherent, numerical**2 + noise], 0.0)
        rows.append(RunValidation(run, *np.sqrt(squares).tolist()))
    return tuple(rows)
