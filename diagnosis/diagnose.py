"""Diagnosis of a comparison problem, of any kind.

Screening, forward selection, choice, alias classes, shrinkage, verdict.
"""

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace

from carrierflex.diagnosis.class_verdict import joint_verdict
from carrierflex.diagnosis.classes.answer import WithClasses
from carrierflex.diagnosis.comparison.overlay import Overlaid, SignalComparison
from carrierflex.diagnosis.comparison.pictures import Picture
from carrierflex.diagnosis.comparison.problem import ComparisonProblem, Effects, Signatures
from carrierflex.diagnosis.gap.findings import Detailed, GapDetail
from carrierflex.diagnosis.gap.off_order_motion import WithLines
from carrierflex.diagnosis.gap.validation import cell_validations, scalar_gaps
from carrierflex.diagnosis.inference.alias_classes import (
    alias_class,
    discriminating_experiment_between,
)
from carrierflex.diagnosis.inference.evidence.candidates import evidence_of
from carrierflex.diagnosis.inference.forward_selection import (
    ForwardSelection,
    forward_selection,
    select_forward,
)
from carrierflex.diagnosis.inference.gap_reduction import gap_reduction
from carrierflex.diagnosis.inference.joint_selection import select_jointly
from carrierflex.diagnosis.inference.named_values import published_values
from carrierflex.diagnosis.inference.results import (
    NAMING,
    NONE_OF_THESE,
    NOT_DIAGNOSABLE,
    Attribution,
    GapReduction,
)
from carrierflex.diagnosis.inference.screening import Screen, explainable_fraction, screen
from carrierflex.diagnosis.inference.selection import Selection, selected
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.inference.verdict import verdict
from carrierflex.diagnosis.line_verdict import line_verdict
from carrierflex.diagnosis.results import Diagnosis


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
    """Tell where the gap of a comparison problem lies and which effect is missing.

    The gap reduction by the named effects is part of the answer.

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
        Told each step, for progress.
    executor : Executor, optional
        Where sets of effects that do not wait for each other are fitted; None in this process.

    Returns
    -------
    Diagnosis
        Verdict with everything behind it.
    """
    limits = thresholds or Thresholds()
    missing = _missing(problem, limits)
    if missing:
        return _not_diagnosable(campaign, kind, problem.unit, missing)
    search = forward_selection(problem, limits, note, executor)
    judged = _judged(search, campaign, kind, floor_is_measured=floor_is_measured)
    selection, classes = judged.selection, judged.classes
    diagnosis = judged.diagnosis
    which = replace(
        diagnosis.attribution,
        discriminating_experiment=_separating_test(search, selection, classes)
        or _experiment_by_class(diagnosis),
    )
    note("pictures")
    pictures = _pictures(search, selection)
    note("parts of the gap")
    gap = _gap_detail(search, selection, judged.reduction)
    note("signals")
    signals = _signals(search, selection)
    note("evidence")
    evidence = evidence_of(search, selection, classes, floor_is_measured=floor_is_measured)
    return replace(
        diagnosis,
        attribution=which,
        pictures=pictures,
        gap=gap,
        signals=signals,
        evidence=evidence,
    )


def verdict_alone(
    problem: ComparisonProblem,
    *,
    campaign: str,
    kind: str,
    floor_is_measured: bool = True,
    thresholds: Thresholds | None = None,
) -> Diagnosis:
    """Verdict of :func:`diagnose`, by the same steps, without what explains it.

    No evidence, discriminating experiment, pictures, signals or findings beyond the gap map.

    Parameters
    ----------
    problem, campaign, kind, floor_is_measured, thresholds
        As of :func:`diagnose`.

    Returns
    -------
    Diagnosis
        Verdict, attribution, classes and how far.
    """
    limits = thresholds or Thresholds()
    missing = _missing(problem, limits)
    if missing:
        return _not_diagnosable(campaign, kind, problem.unit, missing)
    search = forward_selection(problem, limits)
    return _judged(search, campaign, kind, floor_is_measured=floor_is_measured).diagnosis


@dataclass(frozen=True, eq=False)
class _Judged:
    """A verdict, and what it was found by; `reduction` is that of the laws."""

    diagnosis: Diagnosis
    selection: Selection
    classes: tuple[Effects, ...]
    reduction: GapReduction


def _judged(
    search: ForwardSelection, campaign: str, kind: str, *, floor_is_measured: bool
) -> _Judged:
    """Screen, search, verdict, classes."""
    problem, note = search.problem, search.note
    note("screen")
    screened, explainable, selection = _screened_and_searched(search)
    classes = tuple(
        alias_class(search, screened, selection.accepted, effect) for effect in selection.accepted
    )
    note("intervals")
    far = gap_reduction(search, selection.accepted, explainable)
    kind_of_verdict, reason = verdict(
        search,
        screened,
        selection,
        classes,
        far,
        floor_is_measured=floor_is_measured,
        explainable=explainable,
    )
    attribution = _attribution(
        search,
        screened,
        selection,
        classes,
        kind_of_verdict,
        explainable,
        far,
        floor_is_measured=floor_is_measured,
    )
    diagnosis = Diagnosis(
        campaign=campaign,
        kind=kind,
        verdict=kind_of_verdict,
        reason=reason,
        unit=problem.unit,
        attribution=attribution,
        reduction=far,
        baseline=search.fit(()),
    )
    note("classes")
    return _Judged(_with_lines(_with_classes(diagnosis, problem), problem), selection, classes, far)


def _with_lines(diagnosis: Diagnosis, problem: ComparisonProblem) -> Diagnosis:
    """Diagnosis with what was found beside the shaft's orders, where the kind looks there."""
    far = diagnosis.reduction
    if far is None or not isinstance(problem, WithLines):
        return diagnosis
    classes = diagnosis.classes.classes if diagnosis.classes is not None else ()
    motions = problem.off_order_motions()
    joint = line_verdict(diagnosis.verdict, diagnosis.reason, far, motions, classes)
    if joint is None:
        return diagnosis
    effects = diagnosis.attribution.effects if joint.verdict != NONE_OF_THESE else ()
    return replace(
        diagnosis,
        verdict=joint.verdict,
        reason=joint.reason,
        attribution=replace(diagnosis.attribution, effects=effects),
        reduction=joint.reduction,
        reduction_law=diagnosis.reduction_law or far,
        classes=joint.answer,
    )


def _with_classes(diagnosis: Diagnosis, problem: ComparisonProblem) -> Diagnosis:
    """Diagnosis with the class of the missing effect, where the kind has classes."""
    answer = problem.class_answer() if isinstance(problem, WithClasses) else None
    far = diagnosis.reduction
    if answer is None or far is None:
        return diagnosis
    laws = tuple(step.added for step in far.steps[1:])
    joint = joint_verdict(diagnosis.verdict, diagnosis.reason, laws, far, answer)
    return replace(
        diagnosis,
        verdict=joint.verdict,
        reason=joint.reason,
        attribution=replace(diagnosis.attribution, effects=joint.effects),
        reduction=joint.reduction,
        reduction_law=far,
        classes=joint.answer,
    )


def _screened_and_searched(search: ForwardSelection) -> tuple[Screen, float, Selection]:
    """Screen, share of the gap that a flexible model explains, and the search.

    Signatures of hundreds of runs take 0.4 GB, more than half of it for the flexible model: they
    live here alone.
    """
    signatures = search.problem.signatures()
    screened, explainable = screen(signatures), explainable_fraction(signatures)
    selection = _searched(search, screened, replace(signatures, features=None))
    return screened, explainable, selection


def _searched(search: ForwardSelection, screened: Screen, signatures: Signatures) -> Selection:
    """Singles, pairs and triples that pay.

    Where they explain too little, larger sets; then the one that predicts best.
    """
    select_forward(search, screened, signatures)
    select_jointly(search, screened, signatures)
    return selected(search)


def _missing(problem: ComparisonProblem, limits: Thresholds) -> str:
    """What the records lack for a diagnosis; empty where nothing."""
    runs = dict.fromkeys(segment.run for segment in problem.segments)
    for run in runs:
        samples = sum(segment.n_samples for segment in problem.segments if segment.run == run)
        if samples < limits.fewest_samples:
            return (
                f"run {run} holds {samples} samples that count; "
                f"expected at least {limits.fewest_samples}"
            )
    if len(problem.segments) < limits.fewest_segments:
        return (
            f"the records hold {len(problem.segments)} blocks to fit and score; expected at least "
            f"{limits.fewest_segments}: "
            "a longer record or another run"
        )
    if not problem.cards:
        return (
            "the baseline contains, or rules out, every effect of the library; nothing is left to "
            "look for"
        )
    return ""


def _attribution(
    search: ForwardSelection,
    screened: Screen,
    selection: Selection,
    classes: tuple[Effects, ...],
    kind_of_verdict: str,
    explainable: float,
    far: GapReduction,
    *,
    floor_is_measured: bool,
) -> Attribution:
    limits = search.thresholds
    published = published_values(
        search.problem,
        search.score(selection.accepted).fit,
        floor_ratio=limits.floor_ratio if floor_is_measured else limits.floor_ratio_estimated,
    )
    return Attribution(
        effects=tuple(step.added for step in far.steps[1:]) if kind_of_verdict in NAMING else (),
        aliases=tuple(members for members in classes if len(members) > 1),
        parameters=published.parameters,
        ranking=selection.ranking,
        screen=screened,
        explainable=explainable,
        discriminating_experiment="",
        gains=published.gains,
        undetermined=published.undetermined,
    )


def _gap_detail(
    search: ForwardSelection, selection: Selection, far: GapReduction
) -> GapDetail | None:
    """The baseline's gap beyond its map, with its uncertainty before and after.

    Where the problem looks at it.
    """
    problem = search.problem
    before = search.score(()).fit
    after = search.score(selection.accepted).fit
    if not isinstance(problem, Detailed):
        return None
    return GapDetail(
        problem.gap_findings((), before.theta),
        cell_validations(
            far.cells_before, far.cells_after, problem.numerical_error((), before.theta)
        ),
        scalar_gaps(problem.scalars((), before.theta), problem.scalars(after.effects, after.theta)),
    )


def _pictures(search: ForwardSelection, selection: Selection) -> tuple[Picture, ...]:
    """Gap along the motion with the accepted effects."""
    fit = search.score(selection.accepted).fit
    return search.problem.pictures(fit.effects, fit.theta)


def _signals(search: ForwardSelection, selection: Selection) -> SignalComparison | None:
    """Signals with the baseline and with the accepted effects, where the problem has them."""
    problem = search.problem
    if not isinstance(problem, Overlaid):
        return None
    before = search.score(()).fit
    after = search.score(selection.accepted).fit
    overlays = tuple(problem.overlays((), before.theta))
    if not overlays:
        return None
    with_effects = problem.overlays(after.effects, after.theta) if after.effects else ()
    return SignalComparison(overlays, tuple(with_effects))


def _separating_test(
    search: ForwardSelection, selection: Selection, classes: tuple[Effects, ...]
) -> str:
    """Text for the first class with more than one member.

    The computed trial, and what the card says.
    """
    for members in classes:
        if len(members) < 2:
            continue
        other = tuple(
            sorted((*(own for own in selection.accepted if own != members[0]), members[1]))
        )
        computed = discriminating_experiment_between(
            search, search.score(selection.accepted).fit, search.score(other).fit
        )
        return "; ".join(
            text
            for text in (computed, search.problem.cards[members[0]].discriminating_experiment)
            if text
        )
    return ""


def _experiment_by_class(diagnosis: Diagnosis) -> str:
    """What to record so that the class of the cause shows; empty where a cause is named."""
    answer = diagnosis.classes if diagnosis.verdict == NONE_OF_THESE else None
    return answer.experiment if answer is not None else ""


def _not_diagnosable(campaign: str, kind: str, unit: str, missing: str) -> Diagnosis:
    return Diagnosis(
        campaign=campaign,
        kind=kind,
        verdict=NOT_DIAGNOSABLE,
        reason=missing,
        unit=unit,
        attribution=Attribution(
            effects=(),
            aliases=(),
            parameters={},
            ranking=(),
            screen=None,
            explainable=float("nan"),
            discriminating_experiment=missing,
        ),
    )
