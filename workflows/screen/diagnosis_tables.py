"""Result of a diagnosis as a table on the screen."""

from typing import TYPE_CHECKING

import numpy as np
from rich.console import Group, RenderableType

from carrierflex.diagnosis.inference.results import GapReduction, NamedValue
from carrierflex.diagnosis.report.gap_change import GapChange
from carrierflex.diagnosis.report.gap_change_page import (
    causes_sentence,
    cells_sentence,
    first_sentence,
)
from carrierflex.diagnosis.report.gap_words import where_text
from carrierflex.diagnosis.report.words import ratio, sized
from carrierflex.diagnosis.results import Diagnosis
from carrierflex.workflows.screen.titled_table import titled_table

if TYPE_CHECKING:
    from carrierflex.workflows.diagnosis.check_campaign import CampaignCheck


def check_table(check: "CampaignCheck") -> RenderableType:
    """Findings about a campaign, one row each: what, where, what to do."""
    table = titled_table(f"check of {check.campaign}", "about", "finding", "remedy", "line")
    for column in table.columns[1:]:
        column.justify = "left"
        column.overflow = "fold"
    for warning in check.warnings:
        cells = (warning.about, warning.text, warning.remedy, warning.line)
        table.add_row(*(cell for cell in cells))
    if check.met:
        table.add_row("nothing", "stands out", "", "")
    return table


def _value_text(named: NamedValue) -> str:
    if not np.isfinite(named.std):
        return "not determined by these records"
    return f"{named.value:.5g} ± {named.std:.1g} {named.unit}"


def _reduction_rows(reduction: GapReduction, unit: str) -> list[tuple[str, str]]:
    """How far the gap shrinks, by quantity."""
    sizes = (reduction.rms_before, reduction.rms_after, reduction.noise_floor)
    return [
        ("RMS before, after, floor", ", ".join(f"{size:.4g}" for size in sizes) + f" {unit}"),
        ("rho, 95 %", _with_interval(reduction.rho, reduction.rho_ci95)),
        ("phi, 95 %", _with_interval(reduction.phi, reduction.phi_ci95)),
        ("rho of extrapolation", ratio(reduction.extrapolation_rho)),
    ]


def _with_interval(value: float, ci95: tuple[float, float]) -> str:
    return f"{value:.4f} [{ci95[0]:.4f}, {ci95[1]:.4f}]"


def diagnosis_table(diagnosis: Diagnosis) -> RenderableType:
    """Verdict, where, which and how far."""
    reduction = diagnosis.reduction
    which = diagnosis.attribution
    table = titled_table("diagnosis", "quantity", "value")
    table.columns[1].justify = "left"
    rows = [
        ("verdict", diagnosis.verdict),
        ("reason", diagnosis.reason),
        ("where", where_text(diagnosis)),
    ]
    rows += [("effects", ", ".join(which.effects) or "none")]
    rows += [("aliases", " = ".join(members)) for members in which.aliases]
    for effect, values in which.parameters.items():
        rows += [(f"{effect} {n}", _value_text(named)) for n, named in values.items()]
    rows += [("not determined", text) for text in which.undetermined]
    if reduction is not None:
        rows += _reduction_rows(reduction, diagnosis.unit)
    if which.discriminating_experiment:
        rows.append(("discriminating experiment", which.discriminating_experiment))
    rows += [("check " + warning.about, warning.text) for warning in diagnosis.warnings]
    for name, value in rows:
        table.add_row(name, value)
    return table


def comparison_table(change: GapChange) -> RenderableType:
    """What became of the gap as sentences, then the error of every run."""
    unit = change.before.unit
    text = " ".join((first_sentence(change), causes_sentence(change), cells_sentence(change)))
    table = titled_table("error by run", "run", "before", "after", "uncertainty")
    for row in change.runs:
        sizes = (row.error_before, row.error_after, row.u_val)
        table.add_row(row.run, *(sized(size, unit) for size in sizes))
    return Group(text, "", table)
