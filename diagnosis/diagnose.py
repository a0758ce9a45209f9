"""Diagnosis of a plant, of any kind.

Screen, ladder, selection, alias classes, shrinkage, verdict.
"""

from collections.abc import Callable

from carrierflex.diagnosis.comparison.pictures import Picture, Pictured
from carrierflex.diagnosis.comparison.problem import Effects, Plant, Signatures
from carrierflex.diagnosis.gap.findings import Detailed, GapDetail, cell_validations, scalar_gaps
from carrierflex.diagnosis.inference.alias_classes import alias_class, separating_measurement
from carrierflex.diagnosis.inference.forward_selection import Ladder, climb, ladder_of
from carrierflex.diagnosis.inference.gap_reduction import shrinkage_of
from carrierflex.diagnosis.inference.joint_selection import climb_together
from carrierflex.diagnosis.inference.named_values import named_values
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    NAMED,
    NAMED_WITH_REMAINDER,
    NOT_DIAGNOSABLE,
    Attribution,
    Shrinkage,
)
from carrierflex.diagnosis.inference.screening import Screen, learnable_share, screen
from carrierflex.diagnosis.inference.selection import Selection, selected
from carrierflex.diagnosis.inference.thresholds import Thresholds
from carrierflex.diagnosis.inference.verdict import verdict
from carrierflex.diagnosis.results import Diagnosis

#: Verdicts that name effects.
_NAMING = (NAMED, NAMED_WITH_REMAINDER, ALIASED)


def diagnose(
    plant: Plant,
    *,
    campaign: str,
    kind: str,
    floor_is_measured: bool = True,
    thresholds: Thresholds | None = None,
    note: Callable[[str], None] = lambda text: None,
) -> Diagnosis:
    """Tell where the gap of a plant lies, which effect is missing, and how far it shrinks.

    Parameters
    ----------
    plant : Plant
        Records, simulator and library.
    campaign, kind : str
        Name and kind of the campaign.
    floor_is_measured : bool
        Whether the noise floor was declared or comes from repeats.
    thresholds : Thresholds, optional
        Limits.
    note : callable
        Told each step, for progress.

    Returns
    -------
    Diagnosis
        Verdict with everything behind it.
    """
    limits = thresholds or Thresholds()
    missing = _missing(plant, limits)
    if missing:
        return _not_diagnosable(campaign, kind, plant.unit, missing)
    note("screen")
    signatures = plant.signatures()
    screened, learnable = screen(signatures), learnable_share(signatures)
    ladder = ladder_of(plant, limits, note)
    selection = _searched(ladder, screened, signatures)
    classes = tuple(
        alias_class(ladder, screened, selection.accepted, effect) for effect in selection.accepted
    )
    note("intervals")
    far = shrinkage_of(ladder, selection.accepted, learnable)
    kind_of_verdict, reason = verdict(
        ladder,
        screened,
        selection,
        classes,
        far,
        floor_is_measured=floor_is_measured,
        learnable=learnable,
    )
    gap = _gap_detail(ladder, selection, far)
    where_text = plant.where_text((), ladder.score(()).fit.theta)
    return Diagnosis(
        campaign=campaign,
        kind=kind,
        verdict=kind_of_verdict,
        reason=reason,
        unit=plant.unit,
        where_text="; ".join(
            text for text in (where_text, gap.findings.text if gap else "") if text
        ),
        attribution=_attribution(
            ladder, screened, selection, classes, kind_of_verdict, learnable, far
        ),
        shrinkage=far,
        pictures=_pictures(ladder, selection),
        gap=gap,
    )


def _searched(ladder: Ladder, screened: Screen, signatures: Signatures) -> Selection:
    """Singles, pairs and triples that pay.

    Where they explain too little, larger sets; then the one that predicts best.
    """
    climb(ladder, screened, signatures)
    climb_together(ladder, screened, signatures)
    return selected(ladder)


def _missing(plant: Plant, limits: Thresholds) -> str:
    """What the records lack for a diagnosis; empty where nothing."""
    runs = dict.fromkeys(piece.run for piece in plant.pieces)
    for run in runs:
        samples = sum(piece.n_samples for piece in plant.pieces if piece.run == run)
        if samples < limits.fewest_samples:
            return f"run {run} holds {samples} samples that count; expected at least {limits.fewest_samples}"
    if len(plant.pieces) < limits.fewest_pieces:
        return (
            f"the records hold {len(plant.pieces)} blocks to fit and score; expected at least {limits.fewest_pieces}: "
            "a longer record or another run"
        )
    if not plant.cards:
        return "the baseline contains every effect of the library; nothing is left to look for"
    return ""


def _attribution(
    ladder: Ladder,
    screened: Screen,
    selection: Selection,
    classes: tuple[Effects, ...],
    kind_of_verdict: str,
    learnable: float,
    far: Shrinkage,
) -> Attribution:
    fit = ladder.score(selection.accepted).fit
    return Attribution(
        effects=tuple(step.added for step in far.ladder[1:]) if kind_of_verdict in _NAMING else (),
        aliases=tuple(members for members in classes if len(members) > 1),
        parameters=named_values(fit),
        ranking=selection.ranking,
        screen=screened,
        learnable=learnable,
        separating_test=_separating_test(ladder, selection, classes),
    )


def _gap_detail(ladder: Ladder, selection: Selection, far: Shrinkage) -> GapDetail | None:
    """The baseline's gap beyond its map, with its uncertainty before and after, where the plant looks at it."""
    plant, before, after = ladder.plant, ladder.score(()).fit, ladder.score(selection.accepted).fit
    if not isinstance(plant, Detailed):
        return None
    return GapDetail(
        plant.gap_findings((), before.theta),
        cell_validations(
            far.cells_before, far.cells_after, plant.numerical_error((), before.theta)
        ),
        scalar_gaps(plant.scalars((), before.theta), plant.scalars(after.effects, after.theta)),
    )


def _pictures(ladder: Ladder, selection: Selection) -> tuple[Picture, ...]:
    """Gap along the motion with the accepted effects, where the plant draws it."""
    fit = ladder.score(selection.accepted).fit
    return (
        ladder.plant.pictures(fit.effects, fit.theta) if isinstance(ladder.plant, Pictured) else ()
    )


def _separating_test(ladder: Ladder, selection: Selection, classes: tuple[Effects, ...]) -> str:
    """Text for the first class with more than one member.

    The computed trial, and what the card says.
    """
    for members in classes:
        if len(members) < 2:
            continue
        other = tuple(
            sorted((*(own for own in selection.accepted if own != members[0]), members[1]))
        )
        computed = separating_measurement(
            ladder, ladder.score(selection.accepted).fit, ladder.score(other).fit
        )
        return "; ".join(
            text for text in (computed, ladder.plant.cards[members[0]].separating_test) if text
        )
    return ""


def _not_diagnosable(campaign: str, kind: str, unit: str, missing: str) -> Diagnosis:
    nan, none = float("nan"), (float("nan"), float("nan"))
    return Diagnosis(
        campaign=campaign,
        kind=kind,
        verdict=NOT_DIAGNOSABLE,
        reason=missing,
        unit=unit,
        where_text="not diagnosed",
        attribution=Attribution((), (), {}, (), None, nan, missing),
        shrinkage=Shrinkage(
            nan, nan, nan, nan, none, nan, none, nan, nan, nan, nan, (), (), (), ()
        ),
    )
