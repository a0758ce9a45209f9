"""All figures of a report as inline SVG with captions."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.comparison.overlay import Picture
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import GapMoment
from carrierflex.diagnosis.inference.results import GapReduction
from carrierflex.diagnosis.report.figures import (
    MOST_RUNS,
    gap_in_time_figure,
    inline_svg,
    panel_figure,
    shape_figure,
    signal_figure,
)
from carrierflex.diagnosis.report.gap_map_figure import (
    GapGrid,
    colour_limits,
    gap_grids,
    gap_map_figure,
    selection_figure,
)
from carrierflex.diagnosis.report.machine_drawing import machine_figure
from carrierflex.diagnosis.report.words import added_effects, position_of, sized
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.carrier.sensor_patterns import PATTERN_NAMES


@dataclass(frozen=True, eq=False)
class Drawing:
    """One figure: its SVG element and what stands below it."""

    svg: str
    caption: str


@dataclass(frozen=True, eq=False)
class Drawings:
    """Figures of a report; None or empty where there is nothing to draw.

    Parameters
    ----------
    gap_maps : tuple of Drawing
        Before and after, one colour scale.
    remaining : Drawing, optional
        The remaining gap, on its own scale.
    selection : Drawing, optional
        Held-out ratios in turn.
    in_time : Drawing, optional
        Gap over time.
    motion : tuple of (Picture, tuple of Drawing)
        Loops or polar plots.
    shapes : tuple of Drawing
        Measured shape of each class of the answer.
    machine, signals : Drawing, optional
        The machine with its sensors; measured against simulated, before and after.
    """

    gap_maps: tuple[Drawing, ...]
    remaining: Drawing | None
    selection: Drawing | None
    in_time: Drawing | None
    motion: tuple[tuple[Picture, tuple[Drawing, ...]], ...]
    shapes: tuple[Drawing, ...]
    machine: Drawing | None
    signals: Drawing | None


def drawings(diagnosis: Diagnosis, campaign: Campaign) -> Drawings:
    """Draw everything a diagnosis holds.

    Parameters
    ----------
    diagnosis : Diagnosis
        Result of the diagnosis.
    campaign : Campaign
        Channels and rig, for the drawing of the machine.

    Returns
    -------
    Drawings
        Inline SVG elements.
    """
    reduction = diagnosis.reduction
    grids = gap_grids(reduction.cells_before, reduction.cells_after) if reduction else ()
    motion = tuple(
        (picture, tuple(_panel(picture, number, k) for number in range(len(picture.panels))))
        for k, picture in enumerate(diagnosis.pictures)
    )
    return Drawings(
        gap_maps=_gap_maps(grids, diagnosis),
        remaining=_remaining(grids, diagnosis),
        selection=_selection(reduction) if reduction and reduction.steps else None,
        in_time=_in_time(diagnosis.gap.findings.in_time, diagnosis.unit) if diagnosis.gap else None,
        motion=motion,
        shapes=_shapes(diagnosis.classes),
        machine=_machine(diagnosis, campaign),
        signals=_signals(diagnosis),
    )


def _machine(diagnosis: Diagnosis, campaign: Campaign) -> Drawing | None:
    if diagnosis.signals is None:
        return None
    waves = _waves(diagnosis)
    draw = partial(machine_figure, campaign, diagnosis.signals, diagnosis.unit, waves)
    sizes = ", ".join(
        f"{name} {sized(before, diagnosis.unit)}"
        for name, (before, _) in diagnosis.signals.by_channel().items()
    )
    after = ", blue with the effects added" if diagnosis.signals.after else ""
    pattern = (
        "; dashed: its largest part around the rim at one instant" if waves is not None else ""
    )
    view = "" if campaign.kind == "element" else "Seen downwind. "
    discs = "" if campaign.kind == "element" else f"Discs: gap, orange with the baseline{after}"
    return Drawing(
        inline_svg(draw, "machine", f"Machine with its sensors; RMS of the gap: {sizes}"),
        f"{view}{discs}{pattern}{'. ' if discs else ''}Numbers: its RMS over all runs.",
    )


def _waves(diagnosis: Diagnosis) -> int | None:
    """Circumferential waves of the largest part of the gap at the rim; None for other patterns."""
    findings = diagnosis.gap.findings.where if diagnosis.gap is not None else ()
    names = {name: abs(m) for m, name in PATTERN_NAMES.items()}
    patterns = [finding.patterns[0] for finding in findings if finding.patterns]
    return names.get(patterns[0]) if patterns else None


def _signals(diagnosis: Diagnosis) -> Drawing | None:
    compared = diagnosis.signals
    if compared is None:
        return None
    before = compared.before[compared.largest]
    after = compared.after[compared.largest] if compared.after else None
    draw = partial(signal_figure, before, after, diagnosis.unit)
    size = sized(before.rms, diagnosis.unit)
    left = f", with the effects {sized(after.rms, diagnosis.unit)}" if after else ""
    is_turn = before.x_unit == "deg"
    span = "the mean of the revolutions" if is_turn else "the stretch of time where it is largest"
    title = f"Measured and simulated, {before.channel} in run {before.run}: gap {size}{left}"
    return Drawing(
        inline_svg(draw, "signals", title),
        f"The largest gap: {before.channel} in run {before.run}, RMS {size}{left}. Drawn: {span}.",
    )


def _shapes(answer: ClassAnswer | None) -> tuple[Drawing, ...]:
    drawn: list[Drawing] = []
    for finding in answer.classes if answer is not None else ():
        if finding.shape is None:
            continue
        law = plain_name(finding.law)
        name = plain_name(finding.id)
        draw = partial(shape_figure, finding.shape, law)
        svg = inline_svg(draw, f"shape-{len(drawn)}", f"Measured {name}: {finding.shape.words}")
        over = f" Dashed: {law}, the nearest law." if finding.shape.law.size else ""
        drawn.append(Drawing(svg, f"Measured {name} over the visited range.{over}"))
    return tuple(drawn)


def _in_time(moments: Sequence[GapMoment], unit: str) -> Drawing | None:
    if not moments:
        return None
    largest = max(moments, key=lambda moment: moment.rms)
    title = (
        f"Gap over time; largest in run {largest.run} at {largest.time:.4g} s, "
        f"{sized(largest.rms, unit)}"
    )
    more = len({moment.run for moment in moments}) - MOST_RUNS
    rest = f" The {MOST_RUNS} runs with the largest gap are drawn." if more > 0 else ""
    svg = inline_svg(partial(gap_in_time_figure, moments, unit), "gap-in-time-figure", title)
    return Drawing(svg, f"Gap with the baseline in windows over time.{rest}")


def _selection(reduction: GapReduction) -> Drawing:
    steps = ", ".join(f"{plain_name(step.added)} {step.rho:.3f}" for step in reduction.steps)
    svg = inline_svg(
        partial(selection_figure, reduction),
        "selection",
        f"Held-out ratios as effects are added: {steps}",
    )
    return Drawing(
        svg,
        "Each row adds one more effect. Bars are 95 % intervals from the bootstrap over conditions "
        "and segments.",
    )


def _gap_maps(grids: tuple[GapGrid, ...], diagnosis: Diagnosis) -> tuple[Drawing, ...]:
    reduction = diagnosis.reduction
    if not grids or reduction is None:
        return ()
    maps = [("Before", "the baseline", reduction.cells_before)]
    if added_effects(reduction):
        is_named = bool(diagnosis.attribution.effects)
        after = (
            "the named effects added"
            if is_named
            else f"{set_name(added_effects(reduction))} added, which is not named"
        )
        maps.append(("After", after, reduction.cells_after))
    limits = colour_limits(*grids[: len(maps)])
    shown = []
    for grid, (name, model, cells) in zip(grids, maps, strict=False):
        draw = partial(gap_map_figure, grid, limits, diagnosis.unit)
        title = f"Gap map with {model}; {_largest_cell(cells, diagnosis.unit)}"
        caption = f"{name}: gap with {model}." if len(maps) > 1 else f"Gap with {model}."
        if not grid.is_frequency and grid.edges[0] < -0.5 and np.isnan(grid.rms).any():
            caption += " White: only radial motion has orders that turn backwards."
        shown.append(Drawing(inline_svg(draw, f"map-{name.lower()}", title), caption))
    return tuple(shown)


def _remaining(grids: tuple[GapGrid, ...], diagnosis: Diagnosis) -> Drawing | None:
    reduction = diagnosis.reduction
    if reduction is None or not grids or not added_effects(reduction):
        return None
    if not grids[1].is_significant.any():
        return None
    draw = partial(gap_map_figure, grids[1], colour_limits(grids[1]), diagnosis.unit)
    largest = _largest_cell(reduction.cells_after, diagnosis.unit)
    title = f"Map of the remaining gap; {largest}"
    return Drawing(
        inline_svg(draw, "map-remaining", title), "The remaining gap on its own colour scale."
    )


def _largest_cell(cells: Sequence[GapCell], unit: str) -> str:
    """Largest cell of a map in words."""
    if not cells:
        return "no cells"
    first = cells[0]
    position = position_of(first.order, first.frequency_hz)
    size = sized(first.mean_square**0.5, unit)
    return f"largest in run {first.run}: {first.channel_pattern}, {position}, {size}"


def _panel(picture: Picture, number: int, picture_number: int) -> Drawing:
    panel = picture.panels[number]
    sizes = [
        f"{trace.role} {sized(float(np.sqrt(np.mean(trace.y**2))), picture.y_unit)}"
        for trace in panel.traces
    ]
    title = f"{picture.title}, {panel.title}; RMS: {', '.join(sizes)}"
    return Drawing(
        inline_svg(
            partial(panel_figure, picture, panel), f"motion-{picture_number}-{number}", title
        ),
        panel.title,
    )
