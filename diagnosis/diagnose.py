"""Diagnosis of a comparison problem, of any kind.

Table of classes and laws, answer by class, one fit of each nearest set of laws, one verdict.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
from carrierflex.diagnosis.classes.results import MEASURED, ClassAnswer
from carrierflex.diagnosis.classes.shapes import SIZE
from carrierflex.diagnosis.comparison.effect_names import set_name
from carrierflex.diagnosis.comparison.overlay import SignalComparison
from carrierflex.diagnosis.comparison.problem import Effects, FloatArray
from carrierflex.diagnosis.gap.findings import GapDetail, cell_validations, scalar_gaps
from carrierflex.diagnosis.inference.effect_fit import EffectFit, fit_effects, mean_square_left
from carrierflex.diagnosis.inference.gap_reduction import gap_reduction
from carrierflex.diagnosis.inference.law_fits import (
    LawFits,
    Selection,
    candidate_sets,
    law_fits,
    selected,
)
from carrierflex.diagnosis.inference.named_values import (
    NOISE,
    UNKNOWN_FORM,
    PublishedValues,
    published_values,
)
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    FLOOR_UNKNOWN,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    Attribution,
    GapReduction,
    NamedValue,
)
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.kind.comparison_problem import CandidateExperiment, ComparisonProblem
from carrierflex.diagnosis.line_verdict import with_lines
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.diagnosis.verdict import Verdict, verdict_of
from carrierflex.identification.estimation.gauss_newton import StopRule
from carrierflex.identification.estimation.resampling import NORMAL_95

_EXPERIMENT_STOP = StopRule(most_steps=8)
#: A trial separates two sets that differ there by more than this many noise floors.
_SEPARATES = 1.0
#: It is as good as the best where it separates by this share of it; how many such are listed.
_AS_GOOD, _MOST_OTHERS = 0.8, 3

#: Share of the signal, mean square, that an estimated noise may be and be agreement.
_MOST_UNEXPLAINED = 0.1
#: Share that a scatter which is no noise may be.
_NOTABLE = 0.01


def diagnose(
    problem: ComparisonProblem,
    *,
    campaign: str,
    kind: str,
    floor_is_measured: bool = True,
    thresholds: Thresholds | None = None,
    note: Callable[[str], None] = lambda text: None,
    executor: Executor | None = None,
) -> Diagnosis:
    """Where the gap of a comparison problem lies, which effect is missing, how far it shrinks.

    Parameters
    ----------
    problem : ComparisonProblem
        Records, simulator and library.
    campaign, kind : str
        Name and kind of the campaign.
    floor_is_measured : bool
        Whether the noise floor was declared or comes from repeats.
    thresholds : Thresholds, optional
        Limits.
    note : callable
        Called with each step, for progress.
    executor : Executor, optional
        Where sets of laws that do not wait for each other are fitted; None in this process.
    """
    limits = thresholds or Thresholds()
    missing = _missing(problem, limits)
    if missing:
        attribution = Attribution((), discriminating_experiment=missing)
        return Diagnosis(campaign, kind, NOT_DIAGNOSABLE, missing, problem.unit, attribution)
    note("classes")
    answer = problem.class_answer()
    fits = law_fits(problem, limits, note, executor)
    is_at_floor = floor_is_measured and fits.is_at_floor
    of_table = answer.law_sets if answer else None
    sets = () if is_at_floor else candidate_sets(problem, of_table)
    if answer is not None and sets:
        sets = tuple(dict.fromkeys((*sets, *answer.causes)))
    floor_ratio = limits.floor_ratio if floor_is_measured else limits.floor_ratio_estimated
    alike = answer.alike if answer else ()
    selection, published = _established(problem, fits, sets, alike, floor_ratio)
    note("intervals")
    of_laws = gap_reduction(fits, selection.accepted)
    judged = verdict_of(
        selection,
        of_laws,
        answer,
        limits,
        floor_is_measured=floor_is_measured,
        by_shapes=lambda answer: _reduction_by_shapes(fits, answer),
        predictive=tuple(law for law, card in problem.cards.items() if len(card.parameters) == 1),
        measured=tuple(law for law, card in problem.cards.items() if card.parameters == (SIZE,)),
    )
    judged = with_lines(judged, problem.off_order_motions())
    judged = _with_unknown_floor(
        judged,
        problem,
        float(fits.score(()).sum()),
        most=limits.most_coloured,
        floor_is_measured=floor_is_measured,
    )
    if _are_of_other_classes(selection.accepted, judged):
        selection, of_laws = replace(selection, accepted=()), gap_reduction(fits, ())
        published = published_values(problem, fits.fit(()), floor_ratio=floor_ratio)
    before, after = fits.fit(()), fits.fit(selection.accepted)
    note("separating trials")
    trial = _separating_trial(fits, selection, judged)
    between = ""
    if judged.verdict == ALIASED and judged.answer is not None and judged.answer.ties:
        between = problem.experiment_between((judged.answer.ids, *judged.answer.ties))
    note("pictures")
    return Diagnosis(
        campaign=campaign,
        kind=kind,
        verdict=judged.verdict,
        reason=judged.reason,
        reason_id=judged.reason_id,
        unit=problem.unit,
        attribution=Attribution(
            effects=judged.effects,
            aliases=_aliases(judged, selection),
            parameters={
                **published.parameters,
                **_combinations(problem, after, published.covariance),
            },
            alternatives=_alternatives(fits, selection, judged, floor_ratio),
            ranking=selection.ranking,
            discriminating_experiment=trial or judged.experiment or between,
            gains=published.gains,
            undetermined=published.undetermined,
        ),
        reduction=judged.reduction,
        reduction_law=of_laws if judged.answer is not None else None,
        classes=judged.answer,
        baseline=before,
        pictures=problem.pictures(after.effects, after.theta),
        gap=_gap_detail(problem, before, after, of_laws),
        signals=_signals(problem, before, after),
    )


def _are_of_other_classes(laws: Effects, judged: Verdict) -> bool:
    """Whether the answer is classes in none of which a fitted law lies: no value is of theirs."""
    if judged.answer is None or judged.effects or not judged.answer.classes:
        return False
    holders = [set(judged.answer.classes_of_law.get(law, ())) for law in laws]
    named = {name for names in (judged.answer.ids, *judged.answer.ties) for name in names}
    return bool(laws) and not any(classes & named for classes in holders)


def _established(
    problem: ComparisonProblem,
    fits: LawFits,
    sets: Sequence[Effects],
    alike: Sequence[Effects],
    floor_ratio: float,
) -> tuple[Selection, PublishedValues]:
    """Selection among laws that are there, and the values of its fit.

    A law that noise alone does not explain, but declared errors and priors do, may be absent: it
    stands for parameters of the baseline, as a motion of the housing does for waves of the carrier
    at evenly spaced sensors. In a tie it stays: there it is not named alone.
    """
    absent: frozenset[str] = frozenset()
    while True:
        selection = selected(fits, sets, absent, alike)
        fit = fits.fit(selection.accepted)
        published = published_values(problem, fit, floor_ratio=floor_ratio)
        uncertain = {law for law in selection.accepted if _may_be_absent(published, law)}
        if selection.rivals or not uncertain:
            return selection, published
        absent |= uncertain


def _may_be_absent(published: PublishedValues, law: str) -> bool:
    """Whether declared errors and priors explain every parameter of a law, noise some of them not.

    That its form is not the true one is no doubt that it is there.
    """
    values = published.parameters.get(law, {}).values()

    def is_zero(value: NamedValue, sources: Iterable[str]) -> bool:
        error = np.linalg.norm([value.sources.get(source, 0.0) for source in sources])
        return bool(abs(value.value) <= NORMAL_95 * error)

    return any(not is_zero(value, (NOISE,)) for value in values) and all(
        is_zero(value, value.sources.keys() - {UNKNOWN_FORM}) for value in values
    )


def _reduction_by_shapes(fits: LawFits, answer: ClassAnswer) -> GapReduction | str | None:
    """How far the measured shapes of an answer shrink the gap in the simulator."""
    fits.note("measured shapes")
    effects = tuple(
        MEASURED + finding.id if finding.measured_law is not None else finding.law
        for finding in answer.classes
    )
    library = tuple(name for name in effects if name in fits.problem.cards)
    problem = fits.problem.with_laws(answer.shapes, library) if answer.shapes else None
    if problem is None or not set(effects) <= problem.cards.keys():
        return None
    scores: dict[Effects, FloatArray] = {(): fits.score(())}
    baseline: dict[Effects, EffectFit] = {(): fits.fit(())}
    of_shapes = replace(fits, problem=problem, scores=scores, fits=baseline, failed_searches={})
    return of_shapes.rejection(effects) or gap_reduction(of_shapes, effects)


def _with_unknown_floor(
    judged: Verdict,
    problem: ComparisonProblem,
    gap_square: float,
    *,
    most: float,
    floor_is_measured: bool,
) -> Verdict:
    """Verdict; neither agreement nor an unknown cause where noise of unknown size may be the gap.

    Agreement asks for a noise that is known, or a small part of the signal. A gap of which the
    classes explain less than half has an unknown cause only where it is larger than noise may be:
    `most` times the estimated mean square. `gap_square` is the sum of squares that the baseline
    leaves of held-out records.
    """
    unexplained = gap_square / problem.signal_square
    is_unknown = bool(problem.unknown_floor)
    if floor_is_measured:
        # What repeats bounds the floor, unless most of what does not is no noise.
        is_unknown = is_unknown and unexplained > _NOTABLE
    else:
        is_unknown = is_unknown or unexplained > _MOST_UNEXPLAINED
    if judged.verdict == NONE_OF_THESE:
        far, answer = judged.reduction, judged.answer
        is_learnt = answer is not None and answer.learnable >= ClassConstants().leading_share
        is_above = floor_is_measured or far.rms_before**2 > most * far.noise_floor**2
        is_unknown = not is_learnt and not is_above
    if judged.verdict not in (AT_NOISE_FLOOR, NONE_OF_THESE) or not is_unknown:
        return judged
    why = (
        problem.unknown_floor
        or "the noise is estimated from the spectrum, not from repeated revolutions or runs"
    )
    return replace(
        judged,
        verdict=NOT_DIAGNOSABLE,
        reason_id=FLOOR_UNKNOWN,
        reason=f"the baseline leaves {100.0 * unexplained:.2g} % of the signal (mean square), and "
        f"whether that is noise is not known: {why}",
        experiment="declare noise_std of the channel from a record at rest, or record equal runs "
        "or repeated periods: a repeated, unexplained signal is not noise",
    )


def _missing(problem: ComparisonProblem, limits: Thresholds) -> str:
    """What the records lack for a diagnosis; empty where nothing."""
    for run in dict.fromkeys(segment.run for segment in problem.segments):
        samples = sum(segment.n_samples for segment in problem.segments if segment.run == run)
        if samples < limits.fewest_samples:
            return (
                f"run {run} holds {samples} samples that count; "
                f"expected at least {limits.fewest_samples}"
            )
    if len(problem.segments) < limits.fewest_segments:
        return (
            f"the records hold {len(problem.segments)} blocks to fit and score; expected at least "
            f"{limits.fewest_segments}: a longer record or another run"
        )
    if not problem.cards:
        return "every effect of the library is in the baseline or excluded; there is no candidate"
    return ""


def _aliases(judged: Verdict, selection: Selection) -> tuple[Effects, ...]:
    """Named laws, each with those that take its place in a set that predicts as well."""
    if judged.verdict != ALIASED:
        return ()
    classes = judged.answer.classes_of_law if judged.answer else {}
    groups: dict[str, list[str]] = {}
    for rival in selection.rivals:
        replaced = [law for law in selection.accepted if law not in rival]
        others = [law for law in rival if law not in selection.accepted]
        for law in replaced:
            same = [other for other in others if classes.get(other, ()) == classes.get(law)]
            groups.setdefault(law, [law]).extend(same or others)
    return tuple(tuple(dict.fromkeys(members)) for members in groups.values())


def _combinations(
    problem: ComparisonProblem, fit: EffectFit, covariance: FloatArray
) -> Mapping[str, Mapping[str, NamedValue]]:
    """What the records see of causes together, with intervals."""

    def named(value: float, std: float) -> NamedValue:
        half = NORMAL_95 * std
        return NamedValue(value, std, "1", (value - half, value + half))

    combinations = problem.combinations(fit.effects, fit.theta, covariance)
    return {
        name: {quantity: named(*pair) for quantity, pair in of_class.items()}
        for name, of_class in combinations.items()
    }


def _alternatives(
    fits: LawFits, selection: Selection, judged: Verdict, floor_ratio: float
) -> dict[str, Mapping[str, NamedValue]]:
    """Values of laws that predict as well as the named ones, by law."""
    if judged.verdict != ALIASED:
        return {}
    values: dict[str, Mapping[str, NamedValue]] = {}
    for rival in selection.rivals:
        of_rival = published_values(fits.problem, fits.fit(rival), floor_ratio=floor_ratio)
        further = [law for law in rival if law not in (*selection.accepted, *values)]
        values |= {law: of_rival.parameters[law] for law in further}
    return values


def _separating_trial(fits: LawFits, selection: Selection, judged: Verdict) -> str:
    """What to record next where laws or classes cannot be told apart; empty otherwise."""
    if judged.verdict == NONE_OF_THESE and judged.answer is not None:
        return judged.answer.experiment
    if judged.verdict != ALIASED or not selection.rivals:
        return ""
    laws, rival = selection.accepted, selection.rivals[0]
    trial = separating_trial(fits.problem, fits.fit(laws), fits.fit(rival), fits.note)
    differing = [law for law in laws if law not in rival]
    card = fits.problem.cards[differing[0]].discriminating_experiment if differing else ""
    return "; ".join(text for text in (trial, card) if text)


def separating_trial(
    problem: ComparisonProblem,
    first: EffectFit,
    second: EffectFit,
    note: Callable[[str], None] = lambda text: None,
) -> str:
    """Trial in which the second set, refitted, stays farthest from the signals of the first.

    ``argmax_u min_theta2 |y_1(u) - y_2(u; theta2)|²`` over the feasible trials u (A. C. Atkinson,
    V. V. Fedorov, "The design of experiments for discriminating between two rival models", 1975),
    in words with the difference in noise floors; empty where none separates.
    """
    floor = float(np.sqrt(problem.noise_floor_square))
    ratios: dict[str, float] = {}
    for experiment in problem.for_laws((*first.effects, *second.effects)).candidate_experiments():
        note(f"trial: {experiment.text}")
        ratio = _separation(experiment, first, second) / floor
        if np.isfinite(ratio) and ratio > _SEPARATES:
            ratios[experiment.text] = ratio
    if not ratios:
        return ""
    best = max(ratios.values())
    # The first of those that are as good in the order of the trials, not the largest by a hair:
    # the noise of the records does not decide what is recommended.
    text, *others = [trial for trial, ratio in ratios.items() if ratio >= _AS_GOOD * best]
    # Effects in which the sets differ; the sets themselves where one holds the other.
    only = [tuple(e for e in first.effects if e not in second.effects)]
    only += [tuple(e for e in second.effects if e not in first.effects)]
    names = " from ".join(map(set_name, only if all(only) else (first.effects, second.effects)))
    equivalent = f". Equivalent: {', '.join(others[:_MOST_OTHERS])}" if others else ""
    return (
        f"to distinguish {names}, run {text}; predicted difference {ratios[text]:.1f} times the "
        f"noise{equivalent}"
    )


def _separation(experiment: CandidateExperiment, first: EffectFit, second: EffectFit) -> float:
    """RMS by which the second set, refitted, misses the signals of the first; NaN: no trial."""
    problem = experiment.problem(first.effects, first.theta)
    if problem is None:
        return float("nan")
    # A trial may hold another number of runs, and with them of parameters.
    of_second = problem.parameters(second.effects)
    starts = [second.theta] if len(of_second) == second.theta.size else []
    fit = fit_effects(problem, second.effects, starts=starts, stop=_EXPERIMENT_STOP)
    return float(np.sqrt(mean_square_left(problem, fit)))


def _gap_detail(
    problem: ComparisonProblem, before: EffectFit, after: EffectFit, reduction: GapReduction
) -> GapDetail:
    """The baseline's gap beyond its map, with its uncertainty before and after."""
    numerical = problem.numerical_error((), before.theta)
    cells = cell_validations(reduction.cells_before, reduction.cells_after, numerical)
    gap, remaining = (problem.gap(fit.effects, fit.theta) for fit in (before, after))
    return GapDetail(gap.findings(), cells, scalar_gaps(gap.scalars(), remaining.scalars()))


def _signals(
    problem: ComparisonProblem, before: EffectFit, after: EffectFit
) -> SignalComparison | None:
    """Signals with the baseline and with the accepted laws, where the problem has them."""
    overlays = tuple(problem.overlays((), before.theta))
    with_effects = problem.overlays(after.effects, after.theta) if after.effects else ()
    return SignalComparison(overlays, tuple(with_effects)) if overlays else None
