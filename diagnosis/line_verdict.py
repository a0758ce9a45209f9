"""Verdict where motion between the shaft's orders was found and taken out before anything else.

The search for effects saw records without it, so that both parts of the gap are put together here:
what the effects explain on the orders, and the lines and bands beside them, which are classes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from carrierflex.diagnosis.classes.results import (
    LEADING_CLASS,
    NAMED_CLASS,
    NO_CLASS,
    ClassAnswer,
    ClassFinding,
)
from carrierflex.diagnosis.gap.findings import OffOrderMotion
from carrierflex.diagnosis.gap.gap_map import map_of
from carrierflex.diagnosis.inference.results import (
    ALIASED,
    AT_NOISE_FLOOR,
    CLASS_NAMED,
    NAMING,
    NONE_OF_THESE,
    GapReduction,
    SelectionStep,
)

#: RMS of all motion beside the orders over the noise floor from which it is more than noise, and
#: its share of the gap from which it is part of the answer.
_SMALLEST = 0.5
_SMALLEST_SHARE = 0.025
#: Share of the gap from which classes are named, and from which they lead.
_NAMED, _LEADING = 0.8, 0.5


@dataclass(frozen=True, eq=False)
class LineVerdict:
    """Verdict, its reason, the classes, and how far the gap shrinks with both parts together."""

    verdict: str
    reason: str
    answer: ClassAnswer
    reduction: GapReduction


def line_verdict(
    verdict: str,
    reason: str,
    reduction: GapReduction,
    motions: Sequence[OffOrderMotion],
    classes: Sequence[ClassFinding] = (),
) -> LineVerdict | None:
    """Verdict of a search without the lines, and of the lines.

    Parameters
    ----------
    verdict, reason : str
        What the search says of the records without them.
    reduction : GapReduction
        How far its effects shrink that gap.
    motions : sequence of OffOrderMotion
        Lines and bands beside the orders.
    classes : sequence of ClassFinding
        Classes of the gap on the orders.

    Returns
    -------
    LineVerdict or None
        None where there is no such motion, or none worth a name.
    """
    sizes = [_mean_square(motion, reduction) for motion in motions]
    beside = sum(sizes)
    floor = reduction.noise_floor**2
    on_orders = max(reduction.rms_before**2 - floor, 0.0) if verdict != AT_NOISE_FLOOR else 0.0
    gap = on_orders + beside
    if beside < _SMALLEST**2 * floor or beside < _SMALLEST_SHARE * gap or not gap > 0.0:
        return None
    explained = sum(size * own.explained for size, own in zip(sizes, motions, strict=True))
    of_run = {run: sum(own.mean_square.get(run, 0.0) for own in motions) for run in _runs(motions)}
    whole = _whole(reduction, of_run, beside, explained, on_orders)
    share = whole.phi
    state = NAMED_CLASS if share >= _NAMED else LEADING_CLASS if share >= _LEADING else NO_CLASS
    ordered = sorted(zip(sizes, motions, strict=True), key=lambda pair: -pair[0])
    large = [(size / gap, own) for size, own in ordered if size >= _SMALLEST_SHARE * gap]
    findings = [
        ClassFinding(own.id, part * own.explained, (part * own.explained, part), "", 0.0, False)
        for part, own in large
    ]
    findings += _of_whole(classes, on_orders / gap)
    answer = ClassAnswer(
        state=state,
        classes=tuple(findings) if state != NO_CLASS else (),
        ties=(),
        rivals={},
        share=share,
        share_ci95=whole.phi_ci95,
        learnable=share,
        learnt_by=(),
        law_share=max(share - explained / gap, 0.0),
        classes_of_law={},
    )
    names = ", ".join(f"{own.label} ({_where(own)})" for _, own in large)
    text = f"motion between the shaft's orders, {names}, is {beside / gap:.0%} of the gap"
    if verdict in NAMING:
        text = f"{text}; of the rest: {reason}"
    elif verdict == CLASS_NAMED:
        text = f"{text}; on the orders {reason}"
    elif verdict == NONE_OF_THESE:
        text = f"{text}; no effect explains the rest: {reason}"
    joint = NONE_OF_THESE if state == NO_CLASS else CLASS_NAMED
    return LineVerdict(verdict if verdict == ALIASED else joint, text, answer, whole)


def _of_whole(classes: Sequence[ClassFinding], part: float) -> list[ClassFinding]:
    """Classes of a part of the gap as shares of the whole."""
    return [
        replace(
            own,
            share=part * own.share,
            share_ci95=(part * own.share_ci95[0], part * own.share_ci95[1]),
            law_share=part * own.law_share,
        )
        for own in classes
        if part * own.share >= _SMALLEST_SHARE
    ]


def _where(motion: OffOrderMotion) -> str:
    return f"{motion.channels[0]} alone" if len(motion.channels) == 1 else "several channels"


def _mean_square(motion: OffOrderMotion, reduction: GapReduction) -> float:
    """Mean square of a motion over all runs, each as long as it is."""
    samples: dict[str, int] = {}
    for block in reduction.blocks:
        samples[block.run] = samples.get(block.run, 0) + block.samples
    total = sum(samples.values())
    return sum(
        square * samples.get(run, 0) / max(total, 1) for run, square in motion.mean_square.items()
    )


def _runs(motions: Sequence[OffOrderMotion]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(run for motion in motions for run in motion.mean_square))


def _whole(
    reduction: GapReduction,
    of_run: Mapping[str, float],
    beside: float,
    explained: float,
    on_orders: float,
) -> GapReduction:
    """How far effects and lines together shrink the whole gap.

    `of_run` is the mean square of the lines by run, `beside` that of all runs.
    """
    before = reduction.rms_before**2 + beside
    left = beside - explained
    floor = reduction.noise_floor

    def ratio(of_effects: float) -> float:
        """RMS after over before, given that of the effects alone."""
        return float(np.sqrt(((of_effects * reduction.rms_before) ** 2 + left) / before))

    def share(of_effects: float) -> float:
        """Share of the gap explained, given that of the effects alone."""
        inside = of_effects * on_orders if np.isfinite(of_effects) else 0.0
        return min((inside + explained) / (on_orders + beside), 1.0)

    rms_after = ratio(reduction.rho) * float(np.sqrt(before))
    kept = map_of(reduction.cells_after).on_orders()
    return replace(
        reduction,
        rms_before=float(np.sqrt(before)),
        rms_after=rms_after,
        rho=ratio(reduction.rho),
        rho_ci95=(ratio(reduction.rho_ci95[0]), ratio(reduction.rho_ci95[1])),
        phi=share(reduction.phi),
        phi_ci95=(share(reduction.phi_ci95[0]), share(reduction.phi_ci95[1])),
        floor_multiple=rms_after / floor if floor > 0.0 else float("inf"),
        steps=tuple(
            _step_of_whole(step, on_orders / (on_orders + beside)) for step in reduction.steps
        ),
        cells_after=kept.of_gap(float(kept.coherent.sum())),
        validation=tuple(
            replace(row, error_after=_less(row.error_after, of_run.get(row.run, 0.0)))
            for row in reduction.validation
        ),
        blocks=tuple(
            replace(block, mean_square=block.mean_square + of_run.get(block.run, 0.0))
            for block in reduction.blocks
        ),
    )


def _step_of_whole(step: SelectionStep, part: float) -> SelectionStep:
    """Step whose share is that of the whole gap; RMS and rho stay those on the orders."""
    low, high = step.share_ci95
    return replace(step, share=part * step.share, share_ci95=(part * low, part * high))


def _less(error: float, square: float) -> float:
    return float(np.sqrt(max(error**2 - square, 0.0)))
