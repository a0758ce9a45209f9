"""The report page: one HTML file for a screen, a phone and paper, which asks no network."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison import effect_names
from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.comparison.overlay import Picture
from carrierflex.diagnosis.comparison.problem import GapCell
from carrierflex.diagnosis.gap.findings import GapMoment
from carrierflex.diagnosis.gap.gap_map import map_of
from carrierflex.diagnosis.inference.results import GapReduction
from carrierflex.diagnosis.report import gap_words, verdict_words, words
from carrierflex.diagnosis.report.figures import (
    MOST_RUNS,
    gap_in_time_figure,
    inline_svg,
    panel_figure,
    remainder_factor,
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
from carrierflex.diagnosis.report.verdict_words import gists, next_step, worth
from carrierflex.diagnosis.report.words import added_effects, position_of, sized
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files.versions import software_name
from carrierflex.identification.campaign.campaign import Campaign
from carrierflex.identification.carrier.sensor_patterns import PATTERN_NAMES

#: Rows of the tables that could be long.
_MOST_CELLS = 10
_MOST_SETS = 10
_SMALLEST_SHARE = 0.01


@dataclass(frozen=True, eq=False)
class ReportSource:
    """What a report says about where it comes from."""

    campaign: Annotated[Campaign, "Measured records"]
    folder: Annotated[str, "Where they were read"]
    versions: Annotated[Mapping[str, str], "Versions of what can change a result"]
    written: Annotated[str, "Date and time"]
    view: Annotated[str, "3-D page in the report's folder; empty where none is written"] = ""
    view_command: Annotated[str, "Command that writes it; empty where there is no motion"] = ""


def report_page(diagnosis: Diagnosis, source: ReportSource) -> str:
    """HTML text of the report."""
    return rendered_page("report.html.j2", _content(diagnosis, source))


def rendered_page(template: str, content: Mapping[str, Any]) -> str:
    """HTML text of a template of this folder; a name that is not given is an error."""
    environment = Environment(
        loader=PackageLoader("carrierflex.diagnosis.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"plain_name": plain_name, "raised": words.raised}
    return environment.get_template(template).render(**content, words=words)


def _content(diagnosis: Diagnosis, source: ReportSource) -> dict[str, Any]:
    which = diagnosis.attribution
    reduction = diagnosis.reduction
    return {
        "diagnosis": diagnosis,
        "which": which,
        "reduction": reduction,
        "source": source,
        "campaign": source.campaign,
        "gap_words": gap_words,
        "verdict_words": verdict_words,
        "next_step": next_step(diagnosis),
        "worth": worth(diagnosis),
        "gist": gists(diagnosis),
        "names": effect_names,
        "software": software_name(),
        "drawn": _drawings(diagnosis, source.campaign),
        "cells_before": _largest_cells(reduction.cells_before if reduction else ()),
        "cells_after": _largest_cells(reduction.cells_after if reduction else ()),
        "sets": which.ranking[:_MOST_SETS],
        "n_more_sets": max(len(which.ranking) - _MOST_SETS, 0),
    }


def _largest_cells(cells: Sequence[GapCell]) -> list[GapCell]:
    """Cells beyond chance that hold a part of the gap worth a row."""
    gap_map = map_of(cells)
    return list(
        gap_map.chosen(gap_map.are_significant & (gap_map.shares >= _SMALLEST_SHARE))[:_MOST_CELLS]
    )


@dataclass(frozen=True, eq=False)
class _Drawing:
    """One figure: its SVG element, not to be escaped again, and what stands below it."""

    svg: Markup
    caption: str


def _drawings(diagnosis: Diagnosis, campaign: Campaign) -> dict[str, Any]:
    """Everything a diagnosis holds to be drawn; None or empty where there is nothing."""
    reduction = diagnosis.reduction
    grids = gap_grids(reduction.cells_before, reduction.cells_after) if reduction else ()
    return {
        "gap_maps": _gap_maps(grids, diagnosis),
        "remaining": _remaining(grids, diagnosis),
        "in_time": _in_time(diagnosis.gap.findings.in_time, diagnosis.unit)
        if diagnosis.gap
        else None,
        "selection": _selection(reduction) if reduction and reduction.steps else None,
        "motion": [
            {
                "picture": picture,
                "figures": [_panel(picture, number, k) for number in range(len(picture.panels))],
                "magnified": remainder_factor(picture),
            }
            for k, picture in enumerate(diagnosis.pictures)
        ],
        "shapes": _shapes(diagnosis.classes),
        "machine": _machine(diagnosis, campaign),
        "signals": _signals(diagnosis),
    }


def _machine(diagnosis: Diagnosis, campaign: Campaign) -> _Drawing | None:
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
    return _Drawing(
        inline_svg(draw, "machine", f"Machine with its sensors; RMS of the gap: {sizes}"),
        f"{view}{discs}{pattern}{'. ' if discs else ''}Numbers: its RMS over all runs.",
    )


def _waves(diagnosis: Diagnosis) -> int | None:
    """Circumferential waves of the largest part of the gap at the rim; None for other patterns."""
    findings = diagnosis.gap.findings.where if diagnosis.gap is not None else ()
    names = {name: abs(m) for m, name in PATTERN_NAMES.items()}
    patterns = [finding.patterns[0] for finding in findings if finding.patterns]
    return names.get(patterns[0]) if patterns else None


def _signals(diagnosis: Diagnosis) -> _Drawing | None:
    compared = diagnosis.signals
    if compared is None:
        return None
    before = compared.before[compared.largest]
    after = compared.after[compared.largest] if compared.after else None
    draw = partial(signal_figure, before, after, diagnosis.unit)
    size = sized(before.rms, diagnosis.unit)
    added = f", with the effects {sized(after.rms, diagnosis.unit)}" if after else ""
    is_turn = before.x_unit == "deg"
    span = "the mean of the revolutions" if is_turn else "the stretch of time where it is largest"
    title = f"Measured and simulated, {before.channel} in run {before.run}: gap {size}{added}"
    return _Drawing(
        inline_svg(draw, "signals", title),
        f"The largest gap: {before.channel} in run {before.run}, RMS {size}{added}. Drawn: {span}.",
    )


def _shapes(answer: ClassAnswer | None) -> tuple[_Drawing, ...]:
    drawn: list[_Drawing] = []
    for finding in answer.classes if answer is not None else ():
        if finding.shape is None:
            continue
        law = plain_name(finding.law)
        name = plain_name(finding.id)
        draw = partial(shape_figure, finding.shape, law)
        svg = inline_svg(draw, f"shape-{len(drawn)}", f"Measured {name}: {finding.shape.words}")
        over = f" Dashed: {law}, the nearest law." if finding.shape.law.size else ""
        drawn.append(_Drawing(svg, f"Measured {name} over the visited range.{over}"))
    return tuple(drawn)


def _in_time(moments: Sequence[GapMoment], unit: str) -> _Drawing | None:
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
    return _Drawing(svg, f"Gap with the baseline in windows over time.{rest}")


def _selection(reduction: GapReduction) -> _Drawing:
    steps = ", ".join(f"{plain_name(step.added)} {step.rho:.3f}" for step in reduction.steps)
    svg = inline_svg(
        partial(selection_figure, reduction),
        "selection",
        f"Held-out ratios as effects are added: {steps}",
    )
    return _Drawing(
        svg,
        "Each row adds one more effect. Bars are 95 % intervals from the bootstrap over conditions "
        "and segments.",
    )


def _gap_maps(grids: tuple[GapGrid, ...], diagnosis: Diagnosis) -> tuple[_Drawing, ...]:
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
        shown.append(_Drawing(inline_svg(draw, f"map-{name.lower()}", title), caption))
    return tuple(shown)


def _remaining(grids: tuple[GapGrid, ...], diagnosis: Diagnosis) -> _Drawing | None:
    reduction = diagnosis.reduction
    if reduction is None or not grids or not added_effects(reduction):
        return None
    if not grids[1].is_significant.any():
        return None
    draw = partial(gap_map_figure, grids[1], colour_limits(grids[1]), diagnosis.unit)
    largest = _largest_cell(reduction.cells_after, diagnosis.unit)
    title = f"Map of the remaining gap; {largest}"
    return _Drawing(
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


def _panel(picture: Picture, number: int, picture_number: int) -> _Drawing:
    panel = picture.panels[number]
    sizes = [
        f"{trace.role} {sized(float(np.sqrt(np.mean(trace.y**2))), picture.y_unit)}"
        for trace in panel.traces
    ]
    title = f"{picture.title}, {panel.title}; RMS: {', '.join(sizes)}"
    return _Drawing(
        inline_svg(
            partial(panel_figure, picture, panel), f"motion-{picture_number}-{number}", title
        ),
        panel.title,
    )
