"""The page of a fleet: turbines by their gap, those that differ, changes, what was not diagnosed.

One HTML file for a screen and paper, which asks no network.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from carrierflex.diagnosis.comparison.effect_names import plain_name, set_name
from carrierflex.diagnosis.report.figures import BLUE, GREY, ORANGE, WIDTH, inline_svg, shortened
from carrierflex.diagnosis.report.page import rendered_page
from carrierflex.diagnosis.report.words import counted, listed
from carrierflex.files.quantities import number
from carrierflex.files.versions import software_name
from carrierflex.identification.estimation.resampling import NORMAL_95
from carrierflex.workflows.diagnosis.fleet_sizes import (
    GAP,
    CampaignRow,
    factor_of,
    shown_size,
    shown_span,
    size_name,
)
from carrierflex.workflows.fleet.fleet import FleetDiagnosis, FleetPrior, SizeTrend

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MOST_DRAWN = 40
_MOST_TRENDS = 8
_MOST_LETTERS = 28
_MOST_NAMED = 5


def fleet_page(fleet: FleetDiagnosis, folder: Path, campaigns: str, report: str) -> str:
    """HTML text of a fleet.

    Parameters
    ----------
    fleet : FleetDiagnosis
        What is shown.
    folder : Path
        Where the campaigns were read.
    campaigns, report : str
        Folder of the results beside the page, and the report in each of them, for links.
    """
    changing = [one for one in fleet.trends if one.changes]
    content = {
        "fleet": fleet,
        "folder": folder,
        "campaigns": campaigns,
        "report": report,
        "software": software_name(),
        "sentences": fleet_sentences(fleet),
        "figures": _figures(fleet, changing),
        "differing": [
            (prior, one) for prior in fleet.priors for one in prior.turbines if one.differs
        ],
        "changing": sorted(changing, key=lambda one: one.p_value),
        "causes": causes_of,
        "size_name": size_name,
        "shown_size": shown_size,
        "shown_span": shown_span,
    }
    return rendered_page("fleet.html.j2", content)


def fleet_sentences(fleet: FleetDiagnosis) -> list[str]:
    """What the fleet says, most important first."""
    turbines = {row.turbine for row in fleet.rows}
    named = [row for row in fleet.latest if row.causes and not row.first_fault]
    faulty = [row.turbine for row in fleet.latest if row.first_fault]
    sentences = [
        f"{counted(len(fleet.rows), 'campaign')} of {counted(len(turbines), 'turbine')}: a cause "
        f"is named in the last campaign of {len({row.turbine for row in named})}."
    ]
    if faulty:
        sentences.append(
            f"Check the measurement first, a fault of it explains as much: {_first(faulty)}."
        )
    if named:
        first = named[0]
        sentences.append(
            f"The largest gap over its noise with a named cause is that of {first.turbine}: "
            f"{number(first.gap_floors)} noise floors, {causes_of(first)}."
        )
    differing = [
        f"{one.turbine} ({size_name(prior.cause, prior.parameter)})"
        for prior in fleet.priors
        for one in prior.turbines
        if one.differs
    ]
    if differing:
        sentences.append(f"Different from the other turbines: {_first(differing)}.")
    changing = [
        f"{one.turbine} ({size_name(one.cause, one.parameter)})"
        for one in sorted(fleet.trends, key=lambda one: one.p_value)
        if one.changes
    ]
    if changing:
        sentences.append(f"Changing with time: {_first(changing)}.")
    if fleet.failed:
        names = _first([row.campaign for row in fleet.failed])
        sentences.append(f"Not diagnosed: {names}.")
    return sentences


def _first(names: Sequence[str]) -> str:
    """First names of a list, each once, and how many more there are."""
    different = list(dict.fromkeys(names))
    more = len(different) - _MOST_NAMED
    return (
        f"{', '.join(different[:_MOST_NAMED])} and {more} more" if more > 0 else listed(different)
    )


def causes_of(row: CampaignRow) -> str:
    """Named causes in words; the measurement first where a fault of it explains as much."""
    if row.first_fault:
        return f"check the measurement first: {plain_name(row.first_fault)}"
    return set_name(row.causes) if row.causes else "nothing named"


def _figures(fleet: FleetDiagnosis, changing: Sequence[SizeTrend]) -> list[dict[str, Any]]:
    """Figures with captions; one that has nothing to show is left out."""
    drawn = []
    for prior in (prior for prior in fleet.priors if prior.cause == GAP):
        title = f"Gap above the noise of every turbine, kind {prior.kind}"
        svg = inline_svg(partial(_ranked_figure, prior), f"ranked-{prior.kind}", title)
        more = len(prior.turbines) - _MOST_DRAWN
        rest = f" The {_MOST_DRAWN} largest are drawn." if more > 0 else ""
        caption = (
            f"Gap of every turbine's last campaign, kind {prior.kind}. Open: as diagnosed; filled: "
            "with the fleet as prior, 95 % interval. Grey: mean of the prior and one standard "
            f"deviation of the turbines. Orange: different from the others.{rest}"
        )
        drawn.append({"svg": svg, "caption": caption})
    if changing:
        first = sorted(changing, key=lambda one: one.p_value)[:_MOST_TRENDS]
        svg = inline_svg(partial(_trend_figure, first), "trends", "Sizes that change with time")
        caption = "Sizes that change with time, 95 % intervals, and their straight lines."
        drawn.append({"svg": svg, "caption": caption})
    return drawn


def _ranked_figure(prior: FleetPrior) -> "Figure":
    """Value, shrunk value and interval of every turbine, the largest first."""
    from matplotlib.figure import Figure

    ranked = sorted(prior.turbines, key=lambda one: -one.shrunk)[:_MOST_DRAWN]
    factor, unit = factor_of(max(one.value for one in ranked), prior.parameter, prior.unit)
    rows = np.arange(len(ranked))
    figure = Figure(figsize=(WIDTH, 1.2 + 0.17 * len(ranked)), layout="constrained")
    panel = figure.subplots()
    spread = factor * prior.spread
    panel.axvspan(
        factor * prior.mean - spread, factor * prior.mean + spread, color=GREY, alpha=0.15
    )
    panel.axvline(factor * prior.mean, color=GREY, linewidth=0.8)
    for row, one in zip(rows, ranked, strict=True):
        colour = ORANGE if one.differs else BLUE
        low, high = one.shrunk_ci95
        panel.hlines(row, factor * low, factor * high, color=colour, linewidth=1.5)
        panel.plot(factor * one.shrunk, row, "o", color=colour, markersize=3.5)
        panel.plot(factor * one.value, row, "o", color=GREY, markersize=5, markerfacecolor="none")
    panel.set_yticks(rows, [shortened(one.turbine, _MOST_LETTERS) for one in ranked])
    panel.tick_params(axis="y", length=0, labelsize=7)
    panel.set_ylim(len(ranked) - 0.4, -0.6)
    panel.set_xlabel(f"{size_name(prior.cause, prior.parameter)} [{unit}]")
    panel.grid(axis="x", alpha=0.25)
    return figure


def _trend_figure(trends: Sequence[SizeTrend]) -> "Figure":
    """One panel a changing size, over the days of the records."""
    from datetime import date

    from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, 0.5 + 1.25 * len(trends)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(len(trends), 1))
    for panel, one in zip(panels, trends, strict=True):
        factor, unit = factor_of(max(map(abs, one.values)), one.parameter, one.unit)
        days = [date.fromisoformat(day) for day in one.dates]
        values, stds = factor * np.array(one.values), factor * np.array(one.stds)
        years = np.array([(day - days[0]).days for day in days]) / 365.25
        weights = 1.0 / stds**2
        centre = weights @ years / weights.sum()
        line = weights @ values / weights.sum() + factor * one.slope * (years - centre)
        panel.plot(days, line, color=GREY, linewidth=1.0)
        panel.errorbar(
            days, values, NORMAL_95 * stds, fmt="o", color=BLUE, markersize=3.5, linewidth=1
        )
        locator = AutoDateLocator(minticks=3, maxticks=6)
        panel.xaxis.set_major_locator(locator)
        panel.xaxis.set_major_formatter(ConciseDateFormatter(locator))
        name = shortened(f"{one.turbine}, {size_name(one.cause, one.parameter)}", 60)
        panel.set_title(name, loc="left", fontsize=8)
        panel.set_ylabel(f"[{unit}]", fontsize=8)
        panel.grid(alpha=0.25)
    return figure
