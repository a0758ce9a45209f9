"""All figures of a report as inline SVG with captions."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from carrierflex.diagnosis.comparison.pictures import Picture
from carrierflex.diagnosis.comparison.problem import Effects, GapCell
from carrierflex.diagnosis.gap.findings import GapMoment
from carrierflex.diagnosis.inference.screening import Screen
from carrierflex.diagnosis.report.figures import (
    MOST_EFFECTS,
    colour_limits,
    correlation_figure,
    gap_map_figure,
    selection_figure,
)
from carrierflex.diagnosis.report.gap_grid import GapGrid, gap_grids
from carrierflex.diagnosis.report.motion_figures import panel_figure
from carrierflex.diagnosis.report.svg import inline_svg
from carrierflex.diagnosis.report.time_figure import MOST_RUNS, gap_in_time_figure
from carrierflex.diagnosis.report.words import added_effects, place_of, set_name, sized
from carrierflex.diagnosis.results import Diagnosis, GapReduction


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
        What is left, on its own scale.
    search, signature_correlation : Drawing, optional
        Held-out ratios in turn; correlation of the signatures.
    in_time : Drawing, optional
        Gap over time.
    motion : tuple of (Picture, tuple of Drawing)
        Loops or polar plots.
    """

    gap_maps: tuple[Drawing, ...]
    remaining: Drawing | None
    search: Drawing | None
    signature_correlation: Drawing | None
    in_time: Drawing | None
    motion: tuple[tuple[Picture, tuple[Drawing, ...]], ...]


def drawings(diagnosis: Diagnosis) -> Drawings:
    """Draw everything a diagnosis holds.

    Parameters
    ----------
    diagnosis : Diagnosis
        What was found.

    Returns
    -------
    Drawings
        Inline SVG elements.
    """
    far, which = diagnosis.reduction, diagnosis.attribution
    grids = gap_grids(far.cells_before, far.cells_after)
    motion = tuple(
        (picture, tuple(_panel(picture, p, k) for p in range(len(picture.panels))))
        for k, picture in enumerate(diagnosis.pictures)
    )
    return Drawings(
        _gap_maps(grids, diagnosis),
        _remaining(grids, diagnosis),
        _ladder(far) if far.search else None,
        _likeness(which.screen, which.effects)
        if which.screen and len(which.screen.effects) > 1
        else None,
        _in_time(diagnosis.gap.findings.in_time, diagnosis.unit) if diagnosis.gap else None,
        motion,
    )


def _in_time(moments: Sequence[GapMoment], unit: str) -> Drawing | None:
    if not moments:
        return None
    largest = max(moments, key=lambda moment: moment.rms)
    title = f"Gap over time; largest in run {largest.run} at {largest.time:.4g} s, {sized(largest.rms, unit)}"
    more = len({moment.run for moment in moments}) - MOST_RUNS
    rest = f" The {MOST_RUNS} runs with the largest gap are drawn." if more > 0 else ""
    svg = inline_svg(partial(gap_in_time_figure, moments, unit), "gap-in-time-figure", title)
    return Drawing(svg, f"Gap with the baseline in windows over time.{rest}")


def _ladder(far: GapReduction) -> Drawing:
    steps = ", ".join(f"{step.added} {step.rho:.3f}" for step in far.search)
    svg = inline_svg(
        partial(selection_figure, far), "ladder", f"Ladder of held-out ratios: {steps}"
    )
    return Drawing(
        svg,
        "Each row adds one more effect. Bars are 95 % intervals from the bootstrap over conditions and blocks of record. A "
        "placebo is a signal without meaning: what it gains is chance. The flexible model shows how much could be learnt; "
        "where the plant is dynamic it is fitted in force space, so its line is a guide and no bound.",
    )


def _likeness(screened: Screen, accepted: Effects) -> Drawing:
    n = len(screened.effects)
    svg = inline_svg(
        partial(correlation_figure, screened, accepted),
        "likeness",
        "Likeness of the effects' signatures",
    )
    return Drawing(
        svg,
        "Correlation of the effects' signatures beside the baseline, under the conditions that were measured: 1 means that "
        "the screen cannot tell two effects apart."
        + (f" The {MOST_EFFECTS} best of {n} effects are shown." if n > MOST_EFFECTS else ""),
    )


def _gap_maps(grids: tuple[GapGrid, ...], diagnosis: Diagnosis) -> tuple[Drawing, ...]:
    if not grids:
        return ()
    far = diagnosis.reduction
    maps = [("Before", "the baseline", far.cells_before)]
    if added_effects(far):
        is_named = bool(diagnosis.attribution.effects)
        after = (
            "the named effects added"
            if is_named
            else f"{set_name(added_effects(far))} added, which is not named"
        )
        maps.append(("After", after, far.cells_after))
    limits = colour_limits(*grids[: len(maps)])
    shown = []
    for grid, (name, model, cells) in zip(grids, maps, strict=False):
        draw = partial(gap_map_figure, grid, limits, diagnosis.unit)
        title = f"Gap map with {model}; {_largest_cell(cells, diagnosis.unit)}"
        caption = f"{name}: gap with {model}." if len(maps) > 1 else f"Gap with {model}."
        shown.append(Drawing(inline_svg(draw, f"map-{name.lower()}", title), caption))
    return tuple(shown)


def _remaining(grids: tuple[GapGrid, ...], diagnosis: Diagnosis) -> Drawing | None:
    if not grids or not added_effects(diagnosis.reduction) or not grids[1].stands_out.any():
        return None
    draw = partial(gap_map_figure, grids[1], colour_limits(grids[1]), diagnosis.unit)
    title = f"Map of the remaining gap; {_largest_cell(diagnosis.reduction.cells_after, diagnosis.unit)}"
    return Drawing(
        inline_svg(draw, "map-remaining", title), "The remaining gap on its own colour scale."
    )


def _largest_cell(cells: Sequence[GapCell], unit: str) -> str:
    """Largest cell of a map in words."""
    if not cells:
        return "no cells"
    first = cells[0]
    return f"largest in run {first.run}: {first.channel_pattern}, {place_of(first)}, {sized(first.mean_square**0.5, unit)}"


def _panel(picture: Picture, number: int, place: int) -> Drawing:
    panel = picture.panels[number]
    sizes = [
        f"{trace.role} {sized(float(np.sqrt(np.mean(trace.y**2))), picture.y_unit)}"
        for trace in panel.traces
    ]
    title = f"{picture.title}, {panel.title}; RMS: {', '.join(sizes)}"
    return Drawing(
        inline_svg(partial(panel_figure, picture, panel), f"motion-{place}-{number}", title),
        panel.title,
    )
