"""The report page: one HTML file for a screen, a phone and paper, which asks no network.

First what explains the gap and what to do next, on paper one page; then an annex that folds.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from carrierflex.diagnosis.classes.results import ClassAnswer
from carrierflex.diagnosis.comparison import effect_names
from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.comparison.overlay import Picture
from carrierflex.diagnosis.report import gap_words, verdict_words, words
from carrierflex.diagnosis.report.cause_rows import cause_rows
from carrierflex.diagnosis.report.figures import (
    colour_limits,
    gap_map_figure,
    inline_svg,
    panel_figure,
    remainder_factor,
    shape_figure,
    signal_figure,
)
from carrierflex.diagnosis.report.machine_drawing import (
    carrier_figure,
    machine_figure,
    shown_dimensions,
)
from carrierflex.diagnosis.report.report_data import ReportData
from carrierflex.diagnosis.report.words import added_effects
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.files import quantities
from carrierflex.files.quantities import sized
from carrierflex.identification.carrier.sensor_patterns import PATTERN_NAMES

#: Rows of a table that could be long.
_MOST_SETS = 10


def report_page(data: ReportData) -> str:
    """HTML text of the report."""
    diagnosis = data.diagnosis
    which = diagnosis.attribution
    steps = diagnosis.reduction.steps[1:] if diagnosis.reduction is not None else ()
    next_steps = verdict_words.next_steps(diagnosis, has_measured_law=data.has_measured_law)
    content = {
        "diagnosis": diagnosis,
        "which": which,
        "reduction": diagnosis.reduction,
        "source": data.source,
        "campaign": data.campaign,
        "gap_words": gap_words,
        "headlines": verdict_words.headlines(diagnosis),
        "steps": [*next_steps, verdict_words.worth(diagnosis)],
        "causes": cause_rows(data),
        "acting": [step for step in steps if step.by_run],
        "acting_runs": data.campaign.runs[: words.MOST_ROWS],
        "names": effect_names,
        "software": data.software,
        "drawn": _drawings(data),
        "sets": which.ranking[:_MOST_SETS],
        "n_more_sets": max(len(which.ranking) - _MOST_SETS, 0),
        "rivals": _rivals(diagnosis.classes),
    }
    return rendered_page("report.html.j2", content)


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
    return environment.get_template(template).render(**content, words=words, quantities=quantities)


def _rivals(answer: ClassAnswer | None) -> list[tuple[str, str]]:
    """Other classes alone with their shares, largest first."""
    rivals = answer.rivals.items() if answer is not None else ()
    shares = sorted(((share, name) for name, share in rivals), reverse=True)
    shown = [(share, name) for share, name in shares if share >= verdict_words.WORTH_A_LOOK]
    return [(plain_name(name), verdict_words.share_words(share)) for share, name in shown]


@dataclass(frozen=True, eq=False)
class _Drawing:
    """One figure: its SVG element, not to be escaped again, and what stands below it."""

    svg: Markup
    caption: str


def _drawings(data: ReportData) -> dict[str, Any]:
    """Everything a diagnosis holds to be drawn; None or empty where there is nothing."""
    diagnosis = data.diagnosis
    shapes = list(_shapes(diagnosis.classes))
    motion: list[dict[str, Any]] = [
        {
            "picture": picture,
            "figures": [_panel(picture, number, k) for number in range(len(picture.panels))],
            "magnified": remainder_factor(picture),
        }
        for k, picture in enumerate(diagnosis.pictures)
    ]
    signals = _signals(diagnosis)
    answer = signals
    if diagnosis.kind != "carrier":
        # Force over deflection: the curve of the class, or the gap along the motion. It is taken
        # out of its list: it stands on the page once.
        drawn = shapes or (motion[0]["figures"] if motion else [])
        answer = drawn.pop(0) if drawn else signals
        if answer is not None and not answer.caption.endswith("."):
            # A panel that stands without its picture's caption.
            picture = diagnosis.pictures[0]
            law = "; orange: what the causes explain" if added_effects(diagnosis.reduction) else ""
            over = f"{words.capitalised(picture.y_name)} over {picture.x_name}"
            answer = replace(answer, caption=f"{over}, {answer.caption}{law}.")
    return {
        "gap_maps": _gap_maps(data),
        "motion": motion,
        "shapes": shapes,
        "machine": _machine(data),
        "dimensions": _dimensions(diagnosis),
        "answer": answer,
        "signals": signals if signals is not answer else None,
    }


def _machine(data: ReportData) -> _Drawing | None:
    diagnosis = data.diagnosis
    if diagnosis.signals is None:
        return None
    waves = _waves(diagnosis)
    sizes = ", ".join(
        f"{name} {sized(before, diagnosis.unit)}" for name, (before, _) in data.sizes.items()
    )
    title = f"Machine with its sensors; RMS of the gap: {sizes}"
    svg = inline_svg(partial(machine_figure, data, waves), "machine", title)
    after = " → after" if diagnosis.signals.after else ""
    dashed = "; dashed: its largest pattern at the rim" if waves is not None else ""
    view = "" if diagnosis.kind == "element" else ", seen downwind"
    return _Drawing(svg, f"RMS of the gap at each sensor, before{after}{view}{dashed}.")


def _dimensions(diagnosis: Diagnosis) -> _Drawing | None:
    """Drawing of the carrier with the named dimensions, each of a tie among them."""
    which = diagnosis.attribution
    ties = [name for group in which.aliases if set(group) & set(which.effects) for name in group]
    effects = tuple(dict.fromkeys((*which.effects, *ties)))
    names = shown_dimensions(effects)
    if not names:
        return None
    texts = []
    for number, name in enumerate(names, start=1):
        rows = words.named_rows(diagnosis, f"geometry/{name}")
        value = f" {words.value_words(rows[0])}" if rows else ""
        texts.append(f"{number} {plain_name(f'geometry/{name}')}{value}")
    caption = f"On the drawing, not to scale: {'; '.join(texts)}."
    return _Drawing(inline_svg(partial(carrier_figure, names), "dimensions", caption), caption)


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
    before = compared.before[0]
    draw = partial(signal_figure, before, next(iter(compared.after), None), diagnosis.unit)
    what = "mean turn" if before.x_unit == "deg" else "stretch of time"
    text = f"{before.channel} in run {before.run}, the {what} with the largest gap."
    return _Drawing(inline_svg(draw, "signals", f"Measured and simulated, {text}"), text)


def _shapes(answer: ClassAnswer | None) -> Iterator[_Drawing]:
    findings = answer.classes if answer is not None else ()
    for number, finding in enumerate(sorted(findings, key=lambda one: -one.share)):
        if finding.shape is None:
            continue
        law, name = plain_name(finding.law), plain_name(finding.id)
        draw = partial(shape_figure, finding.shape, law)
        svg = inline_svg(draw, f"shape-{number}", f"Measured {name}: {finding.shape.words}")
        over = f"; dashed: {law}, the nearest law" if finding.shape.law.size else ""
        yield _Drawing(svg, f"Measured {name} over the visited range{over}.")


def _gap_maps(data: ReportData) -> tuple[_Drawing, ...]:
    reduction, unit = data.diagnosis.reduction, data.diagnosis.unit
    if not data.grids or reduction is None:
        return ()
    maps = [("Before", "the baseline")]
    if added_effects(reduction):
        is_named = bool(data.diagnosis.attribution.effects)
        unnamed = f"{set_name(added_effects(reduction))} added, which is not named"
        maps.append(("After", "the named effects added" if is_named else unnamed))
    limits = colour_limits(*data.grids[: len(maps)])
    shown = []
    for grid, (name, model) in zip(data.grids, maps, strict=False):
        draw = partial(gap_map_figure, grid, limits, unit)
        largest = sized(float(np.nanmax(grid.rms)), unit)
        title = f"Gap map with {model}; RMS in a cell up to {largest}"
        caption = f"{name}: gap with {model}." if len(maps) > 1 else f"Gap with {model}."
        if not grid.is_frequency and grid.edges[0] < -0.5 and np.isnan(grid.rms).any():
            caption += " White: only radial motion has orders that turn backwards."
        shown.append(_Drawing(inline_svg(draw, f"map-{name.lower()}", title), caption))
    return tuple(shown)


def _panel(picture: Picture, number: int, picture_number: int) -> _Drawing:
    panel = picture.panels[number]
    sizes = [
        f"{trace.role} {sized(float(np.sqrt(np.mean(trace.y**2))), picture.y_unit)}"
        for trace in panel.traces
    ]
    title = f"{picture.title}, {panel.title}; RMS: {', '.join(sizes)}"
    draw = partial(panel_figure, picture, panel)
    return _Drawing(inline_svg(draw, f"motion-{picture_number}-{number}", title), panel.title)
