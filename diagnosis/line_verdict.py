"""Verdict where motion between the shaft's orders was found and taken out before anything else.

The search for effects saw records without it, so that both parts of the gap are put together here:
what the effects explain on the orders, and the lines and bands beside them, which are classes.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from carrierflex.diagnosis.classes.constants import ClassConstants
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
)
from carrierflex.diagnosis.verdict import Verdict

#: RMS of all motion beside the orders over the noise floor from which it is more than noise.
_SMALLEST = 0.5
_LIMITS = ClassConstants()


def with_lines(judged: Verdict, motions: Sequence[OffOrderMotion]) -> Verdict:
    """Verdict of the records without the lines, with the lines and bands beside the orders.

    The same where there is no such motion, or none worth a name.
    """
    verdict, reason, reduction = judged.verdict, judged.reason, judged.reduction
    squares = [_mean_square(motion, reduction) for motion in motions]
    of_lines = sum(squares)
    floor = reduction.noise_floor**2
    on_orders = max(reduction.rms_before**2 - floor, 0.0) if verdict != AT_NOISE_FLOOR else 0.0
    gap = on_orders + of_lines
    smallest = _LIMITS.second_cause * gap
    if of_lines < _SMALLEST**2 * floor or of_lines < smallest or not gap > 0.0:
        return judged
    explained = sum(
        square * motion.explained for square, motion in zip(squares, motions, strict=True)
    )
    of_run: dict[str, float] = {}
    for motion in motions:
        for run, square in motion.mean_square.items():
            of_run[run] = of_run.get(run, 0.0) + square
    joint = _joint_reduction(reduction, of_run, of_lines, explained, on_orders)
    share = joint.phi
    is_named, is_leading = share >= 1.0 - _LIMITS.named_left, share >= _LIMITS.leading_share
    state = NAMED_CLASS if is_named else LEADING_CLASS if is_leading else NO_CLASS
    ordered = sorted(zip(squares, motions, strict=True), key=lambda pair: -pair[0])
    large = [(square / gap, motion) for square, motion in ordered if square >= smallest]
    findings = [
        ClassFinding(line.id, size * line.explained, (size * line.explained, size), "", 0.0, False)
        for size, line in large
    ]
    if judged.answer is not None:
        parts = [finding.part(on_orders / gap) for finding in judged.answer.classes]
        findings += [one for one in parts if one.share >= _LIMITS.second_cause]
    answer = ClassAnswer(
        state=state,
        classes=tuple(findings) if state != NO_CLASS else (),
        ties=(),
        rivals={},
        share=share,
        share_ci95=joint.phi_ci95,
        learnable=share,
        learnt_by=(),
        law_share=max(share - explained / gap, 0.0),
        classes_of_law={},
    )
    names = ", ".join(
        f"{one.label} ({one.channels[0]} alone)"
        if len(one.channels) == 1
        else f"{one.label} (several channels)"
        for _, one in large
    )
    orders = " and ".join(dict.fromkeys(motion.place for _, motion in large))
    text = f"motion {orders}, {names}, is {of_lines / gap:.0%} of the gap"
    if verdict in NAMING:
        text = f"{text}; of the rest: {reason}"
    elif verdict == CLASS_NAMED:
        text = f"{text}; on the orders {reason}"
    elif verdict == NONE_OF_THESE:
        text = f"{text}; no effect explains the rest: {reason}"
    if verdict != ALIASED:
        verdict = NONE_OF_THESE if state == NO_CLASS else CLASS_NAMED
    effects = judged.effects if verdict != NONE_OF_THESE else ()
    return Verdict(verdict, text, effects, answer, joint)


def _mean_square(motion: OffOrderMotion, reduction: GapReduction) -> float:
    """Mean square of a motion over all runs, each as long as it is."""
    samples: dict[str, int] = {}
    for block in reduction.blocks:
        samples[block.run] = samples.get(block.run, 0) + block.samples
    total = sum(samples.values())
    return sum(
        square * samples.get(run, 0) / max(total, 1) for run, square in motion.mean_square.items()
    )


def _joint_reduction(
    reduction: GapReduction,
    of_run: Mapping[str, float],
    of_lines: float,
    explained: float,
    on_orders: float,
) -> GapReduction:
    """How far effects and lines together shrink the gap.

    `of_run` is the mean square of the lines by run, `of_lines` that of all runs.
    """
    before = reduction.rms_before**2 + of_lines
    floor, gap = reduction.noise_floor, on_orders + of_lines

    def ratio(of_effects: float) -> float:
        """RMS after over before, given that of the effects alone."""
        after = (of_effects * reduction.rms_before) ** 2 + (of_lines - explained)
        return float(np.sqrt(after / before))

    def share(of_effects: float) -> float:
        """Share of the gap explained, given that of the effects alone."""
        inside = of_effects * on_orders if np.isfinite(of_effects) else 0.0
        return min((inside + explained) / gap, 1.0)

    rms_after = ratio(reduction.rho) * float(np.sqrt(before))
    cells = map_of(reduction.cells_after).on_orders()
    fraction = on_orders / gap
    # RMS and rho of the steps stay those on the orders.
    steps = [
        replace(
            step,
            share=fraction * step.share,
            share_ci95=(fraction * step.share_ci95[0], fraction * step.share_ci95[1]),
        )
        for step in reduction.steps
    ]
    validation = []
    for row in reduction.validation:
        square = max(row.error_after**2 - of_run.get(row.run, 0.0), 0.0)
        validation.append(replace(row, error_after=float(np.sqrt(square))))
    return replace(
        reduction,
        rms_before=float(np.sqrt(before)),
        rms_after=rms_after,
        rho=ratio(reduction.rho),
        rho_ci95=(ratio(reduction.rho_ci95[0]), ratio(reduction.rho_ci95[1])),
        phi=share(reduction.phi),
        phi_ci95=(share(reduction.phi_ci95[0]), share(reduction.phi_ci95[1])),
        floor_multiple=rms_after / floor if floor > 0.0 else float("inf"),
        steps=tuple(steps),
        cells_after=cells.of_gap(float(cells.coherent.sum())),
        validation=tuple(validation),
        blocks=tuple(
            replace(block, mean_square=block.mean_square + of_run.get(block.run, 0.0))
            for block in reduction.blocks
        ),
    )
